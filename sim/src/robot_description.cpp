#include <cmath>

#include "palanquin/sim/robot_model.hpp"

namespace palanquin {

namespace {

std::string explain_body(const BodyDescription& body, int index) {
  const std::string name = "body '" + body.name + "': ";
  if (index == 0 && body.parent != -1) return name + "the first body floats; its parent must be -1";
  if (index > 0 && (body.parent < 0 || body.parent >= index))
    return name + "parent is " + std::to_string(body.parent) + "; it must be an earlier body";
  if (!(body.mass >= 0) || !body.inertia.allFinite() || !body.com.allFinite())
    return name + "mass is " + std::to_string(body.mass) +
           "; it must not be negative, and mass, com and inertia must be finite";
  if (!body.position.allFinite() || !(std::abs(body.orientation.norm() - 1) < 1e-6))
    return name + "position must be finite and orientation a unit quaternion";
  const bool is_hinge = !body.axis.isZero();
  if (is_hinge && !(std::abs(body.axis.norm() - 1) < 1e-6))
    return name + "axis must have length 1, or 0 for a fixed body";
  if (is_hinge && (!(body.effort > 0) || !(body.armature >= 0) || !(body.damping >= 0)))
    return name + "a hinge needs a positive effort, armature and damping not negative";
  return {};
}

}  // namespace

std::string RobotDescription::explain_invalid() const {
  if (bodies.empty()) return "bodies: at least one is needed";
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (auto text = explain_body(bodies[i], static_cast<int>(i)); !text.empty()) return text;
  if (!(bodies[0].mass > 0)) return "body '" + bodies[0].name + "': its mass must be positive";
  for (const PointDescription& point : points)
    if (point.body < 0 || point.body >= static_cast<int>(bodies.size()) ||
        !point.position.allFinite())
      return "point '" + point.name + "': body " + std::to_string(point.body) +
             " must exist and the position be finite";
  return {};
}

bool RobotState::is_finite() const {
  return base_position.allFinite() && base_orientation.allFinite() && base_velocity.allFinite() &&
         base_rate.allFinite() && joint_positions.allFinite() && joint_velocities.allFinite();
}

}  // namespace palanquin
