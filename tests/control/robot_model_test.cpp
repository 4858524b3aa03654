// Limbs as bodies: what their angular Jacobians and drifts say against differences of rotations.
#include "palanquin/control/whole_body/robot_model.hpp"

#include <gtest/gtest.h>

#include <random>

#include "support/simple_quadruped.hpp"

namespace palanquin {
namespace {

RobotState moving_state(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> draw(-1, 1);
  RobotState state = testing::standing_state(true);
  for (double& angle : state.joint_positions) angle += 0.3 * draw(random);
  for (double& rate : state.joint_velocities) rate = 2 * draw(random);
  state.base_orientation = quaternion_exp({0.4 * draw(random), 0.4 * draw(random), draw(random)});
  state.base_velocity = {draw(random), draw(random), draw(random)};
  state.base_rate = {draw(random), draw(random), draw(random)};
  return state;
}

/// The state after `dt` with the generalised velocity unchanged.
RobotState after(const RobotState& state, double dt) {
  RobotState next = state;
  const Eigen::Quaterniond before(state.base_orientation[0], state.base_orientation[1],
                                  state.base_orientation[2], state.base_orientation[3]);
  next.base_orientation = quaternion_plus(state.base_orientation, dt * state.base_rate);
  const Eigen::Quaterniond turned(next.base_orientation[0], next.base_orientation[1],
                                  next.base_orientation[2], next.base_orientation[3]);
  next.base_position += dt * state.base_velocity;
  next.base_velocity = turned * (before.conjugate() * state.base_velocity);
  next.joint_positions += dt * state.joint_velocities;
  return next;
}

Vector3 vee(const Eigen::Matrix3d& m) { return {m(2, 1), m(0, 2), m(1, 0)}; }

TEST(RobotModel, LimbsTurnAsTheirAngularJacobiansSay) {
  RobotModel model(testing::simple_armed_quadruped());
  const double h = 1e-5;
  for (unsigned seed = 0; seed < 5; ++seed) {
    const RobotState state = moving_state(seed);
    for (int limb = 0; limb < model.limbs(); ++limb) {
      model.update(after(state, -h));
      const LimbKinematics before = model.limb(limb);
      model.update(after(state, h));
      const LimbKinematics later = model.limb(limb);
      model.update(state);
      const LimbKinematics& now = model.limb(limb);
      const Eigen::Matrix3d turning = (later.rotation - before.rotation) / (2 * h);
      EXPECT_LT((vee(turning * now.rotation.transpose()) - now.rate).norm(), 1e-7);
      EXPECT_LT((now.angular_jacobian * model.velocity() - now.rate).norm(), 1e-12);
      EXPECT_LT(((later.rate - before.rate) / (2 * h) - now.angular_drift).norm(), 1e-6);
      EXPECT_LT(((later.velocity - before.velocity) / (2 * h) - now.drift).norm(), 1e-6);
    }
  }
}

TEST(RobotModel, KnowsItsLimbsAndArms) {
  const RobotModel model(testing::simple_armed_quadruped());
  EXPECT_EQ(model.feet(), (std::vector{0, 1, 2, 3}));
  EXPECT_EQ(model.hands(), (std::vector{4}));
  const RobotDescription& robot = model.description();
  EXPECT_EQ(robot.hinges_to(robot.limbs[4].body), (std::vector{12, 13, 14, 15}));
  EXPECT_EQ(robot.hinges_to(robot.limbs[1].body), (std::vector{3, 4, 5}));
  EXPECT_EQ(robot.hinges_to(0), std::vector<int>{});
  EXPECT_THROW(model.limb(5), std::out_of_range);
  EXPECT_THROW(model.joint_position(16), std::out_of_range);
  RobotDescription bad = robot;
  bad.limbs[4].body = 17;
  EXPECT_EQ(bad.explain_invalid(), "limb 'hand': body is 17, but must be from 0 to 16");
  bad.limbs[4] = robot.limbs[4];
  bad.limbs[0].radius = -1;
  EXPECT_NE(bad.explain_invalid().find("radius is -1"), std::string::npos);
}

}  // namespace
}  // namespace palanquin
