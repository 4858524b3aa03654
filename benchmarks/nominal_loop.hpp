#pragma once

#include <cmath>

#include "palanquin/control/planning/team_planner.hpp"
#include "palanquin/core/simulation.hpp"

namespace palanquin::planning {

/// A team's nominal model in closed loop with its planner: the reduced-order plant of programs and
/// tests without a simulator. Allocates in `advance`.
class NominalLoop {
 public:
  explicit NominalLoop(TeamPlanner& planner)
      : planner_(planner), state_(planner.nominal_state(planner.reference())) {}

  double time() const { return time_; }
  const TeamState& state() const { return state_; }

  /// Moves the bodies for `period` (s, at most the knots' spacing) by an Euler step (4) under the
  /// plan's first inputs. A foot that lands stays where the plan has it land until it lifts off.
  /// `unknown` [R + 1, 6] are forces and torques (world) on bodies beside those that it plans with.
  void advance(double period, const RowMatrix& unknown = {}) {
    const RowMatrix& plan = planner_.solver().trajectory();
    const TeamSlots& slots = planner_.slots();
    place_feet(plan, 0, time_);
    Eigen::VectorXd z = plan.row(0), p = planner_.parameters().row(0);
    slots.write_measured(state_, z.data());
    p[slots.spacing()] = period;
    for (int body = 0; body < unknown.rows(); ++body) slots.add_wrench(unknown.row(body), body, p);
    z = step_dynamics(planner_.problem(), z, p);
    slots.read_bodies(z.data(), state_.bodies.data());
    place_feet(plan, 1, time_ + period);
    time_ += period;
  }

 private:
  /// Feet that swung before and stand now, from knot `k` of the plan on.
  void place_feet(const RowMatrix& plan, Eigen::Index k, double time) {
    for (int i = 0; i < planner_.team().feet(); ++i) {
      const GaitClock& clock = planner_.clock(i / kFeet);
      const auto foot = static_cast<std::size_t>(i % kFeet);
      const bool stood = k == 0 ? planner_.instant().before(0, i) : clock.contacts(time_)[foot];
      if (clock.contacts(time)[foot] && !stood)
        state_.feet.row(i) =
            Eigen::Map<const Vector3>(&plan(k, planner_.slots().feet[static_cast<std::size_t>(i)]));
    }
  }

  TeamPlanner& planner_;
  TeamState state_;
  double time_ = 0.0;
};

}  // namespace palanquin::planning
