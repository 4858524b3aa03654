#pragma once

#include <string>

#include "palanquin/control/whole_body/robot_model.hpp"

namespace palanquin::testing {

/// A quadruped of 12 hinges with round numbers: trunk of 6 kg, legs of 1.5 kg with links of 0.2 m.
inline RobotDescription simple_quadruped() {
  RobotDescription robot;
  const auto add = [&](const std::string& name, int parent, const Vector3& at, const Vector3& axis,
                       double mass, const Vector3& inertia) {
    BodyDescription body;
    body.name = name;
    body.parent = parent;
    body.position = at;
    body.axis = axis;
    body.mass = mass;
    body.inertia = inertia.asDiagonal();
    body.armature = 0.01;
    body.damping = 0.1;
    body.effort = 30;
    robot.bodies.push_back(body);
    return static_cast<int>(robot.bodies.size()) - 1;
  };
  add("trunk", -1, Vector3::Zero(), Vector3::Zero(), 6, {0.02, 0.06, 0.07});
  for (const double x : {0.18, -0.18})
    for (const double y : {0.05, -0.05}) {
      const std::string leg = std::string(x > 0 ? "front" : "hind") + (y > 0 ? " left" : " right");
      int body = add(leg + " hip", 0, {x, y, 0}, Vector3::UnitX(), 0.6, {5e-4, 8e-4, 6e-4});
      body = add(leg + " thigh", body, {0, y > 0 ? 0.08 : -0.08, 0}, Vector3::UnitY(), 0.7,
                 {5e-3, 5e-3, 1e-3});
      body = add(leg + " calf", body, {0, 0, -0.2}, Vector3::UnitY(), 0.2, {3e-3, 3e-3, 1e-4});
      robot.points.push_back({leg, body, {0, 0, -0.2}});
    }
  return robot;
}

/// Standing with bent knees, at rest.
inline RobotState standing_state() {
  RobotState state;
  state.base_position = {0, 0, 0.27};
  state.joint_positions.resize(12);
  for (int leg = 0; leg < 4; ++leg) state.joint_positions.segment<3>(3 * leg) << 0, 0.8, -1.6;
  state.joint_velocities.setZero(12);
  return state;
}

}  // namespace palanquin::testing
