#pragma once

#include <string>

#include "palanquin/control/planning/arrays.hpp"

namespace palanquin::planning {

/// How fast unknown wrenches on a body are observed, and how much of them is believed.
struct ObserverGains {
  double force = 0.0;        ///< 1/s, [>= 0]; 0: none
  double most_force = 0.0;   ///< N, [>= 0]
  double torque = 0.0;       ///< 1/s, [>= 0]; 0: none
  double most_torque = 0.0;  ///< N m, [>= 0]

  bool is_on() const { return force > 0.0 || torque > 0.0; }
};

/// Of a team's bodies.
struct ObserverSettings {
  ObserverGains robots, payload;

  bool is_on() const { return robots.is_on() || payload.is_on(); }
  /// An empty string, or a sentence that names field, value and rule.
  std::string explain_invalid() const;
};

/// Mass and inertia of a body as the planner has them.
struct Inertial {
  double mass;      ///< kg
  Vector3 moments;  ///< about the body's axes, kg m^2
};

/// Observes wrenches that a plan does not know of: pushes, and weights other than it was told.
///
/// A body that moves otherwise than planned is told to be pushed. With velocity v measured where
/// the plan had v_p, the force is corrected by gain * m (v - v_p), so that the estimate follows the
/// true one with the time constant 1/gain as long as plans count on it; likewise the torque with
/// the moments of inertia and the angular velocities. Clamped in length: what contact forces and
/// motors at their limits leave unbalanced is not to be answered by more of the same.
class WrenchObserver {
 public:
  WrenchObserver(int robots, const ObserverSettings& settings);

  /// Corrects the estimates by what a body does: states [13] as measured and as planned for now.
  void observe(int body, const double* measured, const double* planned, const Inertial& inertial);
  void reset() { wrenches_.setZero(); }

  /// Force and torque on each body, payload first, world, N and N m, [R + 1, 6].
  const RowMatrix& wrenches() const { return wrenches_; }
  bool is_on() const { return settings_.is_on(); }
  const ObserverSettings& settings() const { return settings_; }

 private:
  ObserverSettings settings_;
  RowMatrix wrenches_;
};

/// The mass of a body planned with `mass` (kg) that the force (world, N) on it makes: what it would
/// weigh if its weight alone were wrong.
double apparent_mass(double mass, const Vector3& force);

}  // namespace palanquin::planning
