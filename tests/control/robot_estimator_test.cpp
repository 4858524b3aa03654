// A robot's estimator without a simulator: robots that stand still, and what their sensors say.
#include "palanquin/control/estimation/robot_estimator.hpp"

#include <gtest/gtest.h>

#include "support/allocation_counter.hpp"
#include "support/simple_quadruped.hpp"

namespace palanquin {
namespace {

constexpr double kPeriod = 1e-3, kGravity = 9.81;
constexpr int kFeet = 4;

/// Torques with which a robot at rest bears these forces [3, feet].
Eigen::VectorXd torques_at_rest(const RobotModel& model, const Eigen::Matrix3Xd& forces) {
  Eigen::VectorXd load = model.bias();
  for (int foot = 0; foot < kFeet; ++foot)
    load -= model.limb(model.feet()[foot]).jacobian.transpose() * forces.col(foot);
  return load.tail(model.joints());
}

Eigen::Matrix3Xd some_forces() {
  Eigen::Matrix3Xd forces(3, kFeet);
  forces << 3, -2, 0, 0, 1, 4, 0, 0, 30, 40, 0, 25;
  return forces;
}

TEST(FootForceObserver, SeesForcesAtRest) {
  for (const bool arm : {false, true}) {
    RobotModel model(arm ? testing::simple_armed_quadruped() : testing::simple_quadruped());
    model.update(testing::standing_state(arm));
    FootForceObserver observer(model);
    const Eigen::VectorXd torques = torques_at_rest(model, some_forces());
    for (int i = 0; i < 3; ++i) observer.update(model, torques, kPeriod);
    // A leg's damped inverse gives a little less.
    EXPECT_LT((observer.forces() - some_forces()).norm(), 0.1 * some_forces().norm());
    EXPECT_LT(observer.forces().col(2).norm(), 1);
  }
}

TEST(FootForceObserver, SeesATouchdownInItsTime) {
  RobotModel model(testing::simple_quadruped());
  model.update(testing::standing_state());
  FootForceObserver observer(model, 100);
  const Eigen::Matrix3Xd none = Eigen::Matrix3Xd::Zero(3, kFeet);
  observer.update(model, torques_at_rest(model, none), kPeriod);
  EXPECT_LT(observer.forces().norm(), 1e-9);
  const Eigen::VectorXd torques = torques_at_rest(model, some_forces());
  for (int i = 0; i < 10; ++i) observer.update(model, torques, kPeriod);
  EXPECT_NEAR(observer.forces().norm() / some_forces().norm(), 1 - std::exp(-1.0), 0.06);
}

TEST(FootForceObserver, RefusesNonsense) {
  const RobotModel model(testing::simple_quadruped());
  EXPECT_THROW(FootForceObserver(model, 0), std::invalid_argument);
  RobotDescription stiff;
  stiff.bodies.resize(1);
  stiff.bodies[0].mass = 1;
  stiff.limbs.resize(1);
  const RobotModel without_hinges(stiff);
  EXPECT_THROW(FootForceObserver{without_hinges}, std::invalid_argument);
}

struct RobotEstimatorStands : ::testing::Test {
  RobotState state = testing::standing_state();
  SensorReading reading = [&] {
    SensorReading r;
    r.imu.specific_force = {0, 0, kGravity};
    r.joint_positions = state.joint_positions;
    r.joint_velocities = state.joint_velocities;
    r.torques.setZero(12);
    return r;
  }();
  const std::vector<bool> all = std::vector<bool>(kFeet, true);
  const Eigen::Matrix3Xd level;
};

TEST_F(RobotEstimatorStands, StaysWhereItStands) {
  RobotEstimator estimator(testing::simple_quadruped());
  estimator.start(state);
  for (int i = 0; i < 2000; ++i) estimator.update(reading, kPeriod, all, level);
  EXPECT_LT((estimator.state().base_position - state.base_position).norm(), 1e-6);
  EXPECT_LT(quaternion_minus(estimator.state().base_orientation, state.base_orientation).norm(),
            1e-6);
  EXPECT_LT(estimator.state().base_velocity.norm(), 1e-6);
}

TEST_F(RobotEstimatorStands, TellsABiasFromATurn) {
  RobotEstimator estimator(testing::simple_quadruped());
  estimator.start(state);
  reading.imu.rate = {0.02, -0.01, 0};
  reading.imu.specific_force += Vector3(0, 0, 0.1);
  for (int i = 0; i < 10000; ++i) estimator.update(reading, kPeriod, all, level);
  EXPECT_LT((estimator.base().gyro_bias() - reading.imu.rate).norm(), 1e-3);
  EXPECT_NEAR(estimator.base().accelerometer_bias().z(), 0.1, 5e-3);
  EXPECT_LT(estimator.state().base_rate.norm(), 1e-3);
  EXPECT_LT(estimator.state().base_velocity.norm(), 1e-3);
}

/// Feet are balls: as a shank turns by an angle, the centre moves on by the radius times that.
TEST_F(RobotEstimatorStands, RollsOnItsFeet) {
  RobotEstimator estimator(testing::simple_quadruped());
  estimator.start(state);
  constexpr double kRate = 0.2;  // of all thighs, so that the shanks turn with them, rad/s
  RobotModel model(testing::simple_quadruped());
  model.update(state);
  const double leg = model.limb(0).position.x() - 0.18;
  for (int i = 1; i <= 500; ++i) {
    for (int joint = 1; joint < 12; joint += 3) {
      reading.joint_positions[joint] += kRate * kPeriod;
      reading.joint_velocities[joint] = kRate;
    }
    estimator.update(reading, kPeriod, all, level);
  }
  RobotState turned = state;
  turned.joint_positions = reading.joint_positions;
  model.update(turned);
  const double moved = model.limb(0).position.x() - 0.18 - leg;  // of the foot in the base
  const double rolled = testing::kFootRadius * kRate * 0.5;
  EXPECT_NEAR(estimator.state().base_position.x(), rolled - moved, 0.4 * rolled);
}

TEST_F(RobotEstimatorStands, AllocatesNothingAtRate) {
  RobotEstimator estimator(testing::simple_quadruped(), {}, 5);
  estimator.start(state);
  reading.place = PlaceFix{state.base_position, state.base_orientation};
  reading.place_age = 3;
  estimator.update(reading, kPeriod, all, level);
  EXPECT_EQ(testing::allocations_during([&] { estimator.update(reading, kPeriod, all, level); }),
            0);
}

TEST(RobotEstimator, RefusesNonsense) {
  RobotEstimatorSettings settings;
  settings.leg = 0;
  EXPECT_THROW(RobotEstimator(testing::simple_quadruped(), settings), std::invalid_argument);
}

}  // namespace
}  // namespace palanquin
