#include "palanquin/control/planning/bar_reference.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

namespace palanquin::planning {

Vector2 Leash::hold(const Vector2& ahead) const {
  if (shape == Shape::Square) return ahead.cwiseMax(-length).cwiseMin(length);
  return std::min(1.0, length / std::max(std::hypot(ahead.x(), ahead.y()), 1e-9)) * ahead;
}

void BarReference::advance(const Velocity& command, const ConstBodyState& body, double ground,
                           const Leash& leash, double dt) {
  const double cosine = std::cos(yaw), sine = std::sin(yaw);
  velocity = {cosine * command.vx - sine * command.vy, sine * command.vx + cosine * command.vy,
              0.0};
  const Vector2 robot = body.position.head<2>();
  const Vector2 ahead = position.head<2>() + dt * velocity.head<2>() - robot;
  position.head<2>() = robot + leash.hold(ahead);
  position.z() = ground + kBarStandingHeight;
  yaw_rate = command.wz;
  const double now = heading(body.orientation);
  const double turn = std::remainder(yaw + dt * command.wz - now, 2 * std::numbers::pi);
  yaw = now + std::clamp(turn, -kYawLeash, kYawLeash);
}

BodyMotion BarReference::motion() const {
  const double cosine = std::cos(yaw), sine = std::sin(yaw);
  BodyMotion motion{position, velocity, Matrix3::Identity(), {0.0, 0.0, yaw_rate}};
  motion.rotation.topLeftCorner<2, 2>() << cosine, -sine, sine, cosine;
  return motion;
}

BarReference reference_at(const ConstBodyState& body) {
  return {body.position, Vector3::Zero(), heading(body.orientation), 0.0};
}

double heading(const Vector4& orientation) {
  const auto [w, x, y, z] =
      std::tie(orientation[0], orientation[1], orientation[2], orientation[3]);
  return std::atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z));
}

}  // namespace palanquin::planning
