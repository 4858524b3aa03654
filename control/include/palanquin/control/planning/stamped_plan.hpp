#pragma once

#include <array>

#include "palanquin/control/planning/team_planner.hpp"

namespace palanquin::planning {

/// A plan with the time that it is for: what a planner hands to a controller. A value of fixed size
/// that is filled again and again.
struct StampedPlan {
  static constexpr int kMostEvents = 8;

  long number = 0;          ///< 1 for a planner's first; 0: there is none yet
  double time = 0.0;        ///< of the first knot, s
  Eigen::VectorXd spacing;  ///< of knots, s, [N + 1], the last one unused
  RowMatrix knots;          ///< [N + 1, nz]
  Flags contacts;           ///< [N + 1, 4 R]
  Eigen::MatrixXd gain;     ///< dz_0/dx_0 [ndz, ndx], see Sqp::feedback_gain, or empty
  Status status = Status::NotSolved;
  bool is_usable = false;  ///< whether it is a new plan, not the last one shifted
  bool must_stop = false;  ///< plans have failed or come late for too long
  double solve_ms = 0.0;   ///< from measurement to plan
  double solver_ms = 0.0;  ///< of it, the solver's own
  std::array<Event, kMostEvents> events{};
  int event_count = 0;  ///< how many happened; the array has the first ones
  GainWork gain_work;   ///< memory

  /// As large as a planner's plans are.
  explicit StampedPlan(const TeamPlanner& planner);
  /// Takes a planner's last plan; with its gain if `with_gain`.
  void take(const TeamPlanner& planner, bool with_gain);
  void add(const Event& event);
};

/// Samples plans of one problem, for one thread.
class PlanSampler {
 public:
  explicit PlanSampler(const LoweredProblem& problem);

  /// The knot vector [nz] at a time (s): states interpolated on their manifolds, and extrapolated
  /// before the first knot and beyond the last one; other blocks are those of the interval.
  void sample(const StampedPlan& plan, double time, double* z) const;
  /// With first-order feedback: in the first interval the other blocks answer to what the measured
  /// states [nz] differ by, u = u_0 + K (x (-) x_plan(time)). Beyond, and without a gain, as above.
  void sample(const StampedPlan& plan, double time, const double* measured, double* z);
  /// The states of knot `z` [nz] carried on from `time` to `later` (s) as the plan moves between:
  /// x (+) (x_plan(later) (-) x_plan(time)).
  void carry(const StampedPlan& plan, double time, double later, double* z);

 private:
  void add_states(const double* difference, double* z);

  const LoweredProblem& problem_;
  Eigen::VectorXd at_, later_, dx_, dz_;
};

}  // namespace palanquin::planning
