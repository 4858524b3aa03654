#include "palanquin/control/planning/wrench_observer.hpp"

#include <stdexcept>

#include "palanquin/control/planning/references.hpp"
#include "palanquin/core/setting_rules.hpp"

namespace palanquin::planning {

namespace {
constexpr int kOrientation = 3, kVelocity = 7, kRate = 10;  // in a body's state

using Three = Eigen::Map<const Vector3>;

std::string broken_rule(const std::string& name, const ObserverGains& gains) {
  return SettingRules("observers." + name + '.')
      .not_negative("force", gains.force)
      .not_negative("most_force", gains.most_force)
      .not_negative("torque", gains.torque)
      .not_negative("most_torque", gains.most_torque)
      .sentence();
}

const ObserverSettings& checked(const ObserverSettings& settings) {
  if (const std::string reason = settings.explain_invalid(); !reason.empty())
    throw std::invalid_argument(reason);
  return settings;
}

Vector3 clamped(const Vector3& v, double most) {
  const double length = v.norm();
  return length > most ? Vector3(most / length * v) : v;
}
}  // namespace

std::string ObserverSettings::explain_invalid() const {
  return SettingRules()
      .nested(broken_rule("robots", robots))
      .nested(broken_rule("payload", payload))
      .sentence();
}

WrenchObserver::WrenchObserver(int robots, const ObserverSettings& settings)
    : settings_(checked(settings)), wrenches_(RowMatrix::Zero(robots + 1, 6)) {}

void WrenchObserver::observe(int body, const double* measured, const double* planned,
                             const Inertial& inertial) {
  const ObserverGains& gains = body == 0 ? settings_.payload : settings_.robots;
  const Vector3 faster = Three(measured + kVelocity) - Three(planned + kVelocity);
  const Vector3 spins = Three(measured + kRate) - Three(planned + kRate);  // body axes
  const Matrix3 turn = rotation_matrix(Eigen::Map<const Vector4>(measured + kOrientation));
  const Vector3 push = gains.force * inertial.mass * faster;
  const Vector3 twist = gains.torque * (turn * inertial.moments.cwiseProduct(spins));
  auto force = wrenches_.row(body).head<3>(), torque = wrenches_.row(body).tail<3>();
  if (!(push.allFinite() && twist.allFinite())) return;  // a measurement that the planner refuses
  force = clamped(force.transpose() + push, gains.most_force).transpose();
  torque = clamped(torque.transpose() + twist, gains.most_torque).transpose();
}

double apparent_mass(double mass, const Vector3& force) {
  return mass + force.dot(kGravity) / kGravity.squaredNorm();
}

}  // namespace palanquin::planning
