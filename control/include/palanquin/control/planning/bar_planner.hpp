#pragma once

#include "palanquin/control/planning/bar_reference.hpp"
#include "palanquin/control/planning/layered_planner.hpp"

namespace palanquin::planning {

/// What is known of M robots on bars at an instant.
struct BarMeasurement {
  double time = 0.0;       ///< s
  RowMatrix bodies;        ///< states [M, 13], see BodyState
  RowMatrix feet;          ///< world, m, [4 M, 3]
  RowMatrix footholds;     ///< where feet in the air will be put, world, m, [4 M, 3]
  Eigen::VectorXd ground;  ///< heights below the robots, as they know them, m, [M]
};

/// A plan of one sample, with what it was planned for.
struct BarPlan {
  LayeredPlan mpc;   ///< what the linear MPC came to
  RowMatrix bodies;  ///< states at the knots [N + 1, 13 M]; the first as measured
  Flags contacts;    ///< at the knots [N + 1, 4 M]
  RowMatrix feet;    ///< where they are, or will stand, world, m, [4 M, 3]
  std::vector<BarReference> references;  ///< of the robots
  std::vector<Event> events;             ///< what the planner could not do at this sample

  /// The references as states [M, 13].
  RowMatrix reference_states() const;
  /// By how much forces until the next knot leave the friction pyramid (9) of a coefficient, N.
  double friction_violation(double friction) const;
};

/// Plans for robots on bars, each led at its own velocity: references, contacts, the QP.
class BarPlanner {
 public:
  BarPlanner(std::shared_ptr<LayeredPlanner> planner, const Leash& leash);

  /// Moves the references on, and plans from what is measured under commands that stay, one a
  /// robot, with the contacts [N + 1, 4 M] that the clocks of those who move the feet have. Throws
  /// std::invalid_argument for arrays of other shapes, and as LayeredPlanner::plan.
  const BarPlan& plan(const BarMeasurement& seen, const Flags& contacts,
                      const std::vector<Velocity>& commands);

  const BarPlan& last() const { return plan_; }
  const Leash& leash() const { return leash_; }
  LayeredPlanner& planner() { return *planner_; }
  const LayeredPlanner& planner() const { return *planner_; }
  const std::vector<BarReference>& references() const { return references_; }

 private:
  void check(const BarMeasurement& seen, const Flags& contacts,
             const std::vector<Velocity>& commands) const;
  void lead(const BarMeasurement& seen, const std::vector<Velocity>& commands);
  void take(const BarMeasurement& seen, const Flags& contacts);
  void answer(const BarMeasurement& seen, const LayeredPlan& layered);

  std::shared_ptr<LayeredPlanner> planner_;
  Leash leash_;
  std::vector<BarReference> references_;
  double time_ = 0.0;  ///< of the last plan
  BarSample sample_;
  BarPlan plan_;
};

}  // namespace palanquin::planning
