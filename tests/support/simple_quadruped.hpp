#pragma once

#include <string>

#include "palanquin/control/whole_body/robot_description.hpp"
#include "palanquin/control/whole_body/robot_state.hpp"

namespace palanquin::testing {

constexpr double kFootRadius = 0.02;  ///< m

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
      robot.limbs.push_back({leg, LimbKind::Foot, body, {0, 0, -0.2}, kFootRadius});
    }
  return robot;
}

/// The same with an arm of four hinges on its back, yaw, shoulder, elbow and roll, and its hand.
inline RobotDescription simple_armed_quadruped() {
  RobotDescription robot = simple_quadruped();
  const auto add = [&](const std::string& name, int parent, const Vector3& at, const Vector3& axis,
                       double mass) {
    BodyDescription body;
    body.name = name;
    body.parent = parent;
    body.position = at;
    body.axis = axis;
    body.mass = mass;
    body.com = {0, 0, 0.05};
    body.inertia.diagonal() << 2e-3, 2e-3, 1e-3;
    body.armature = 0.01;
    body.damping = 0.1;
    body.effort = 30;
    robot.bodies.push_back(body);
    return static_cast<int>(robot.bodies.size()) - 1;
  };
  int body = add("arm yaw", 0, {0.1, 0, 0.06}, Vector3::UnitZ(), 0.5);
  body = add("arm shoulder", body, {0, 0, 0.05}, Vector3::UnitY(), 0.5);
  body = add("arm elbow", body, {0, 0, 0.2}, Vector3::UnitY(), 0.4);
  body = add("arm roll", body, {0, 0, 0.1}, Vector3::UnitZ(), 0.2);
  robot.limbs.push_back({"hand", LimbKind::Hand, body, {0, 0, 0.15}});
  return robot;
}

/// Below which the feet of both stand: under the hips, from the centre of the trunk, [3, 4], m.
inline Eigen::Matrix3Xd simple_hips() {
  Eigen::Matrix3Xd hips(3, 4);
  hips << 0.18, 0.18, -0.18, -0.18, 0.13, -0.13, 0.13, -0.13, 0, 0, 0, 0;
  return hips;
}

/// Standing with bent knees, at rest; `arm`: with bent arm, too.
inline RobotState standing_state(bool arm = false) {
  RobotState state;
  state.base_position = {0, 0, 0.27};
  state.joint_positions.resize(arm ? 16 : 12);
  for (int leg = 0; leg < 4; ++leg) state.joint_positions.segment<3>(3 * leg) << 0, 0.8, -1.6;
  if (arm) state.joint_positions.tail<4>() << 0.2, 0.5, 1.2, 0.1;
  state.joint_velocities.setZero(state.joint_positions.size());
  return state;
}

}  // namespace palanquin::testing
