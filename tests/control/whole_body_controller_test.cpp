#include "palanquin/control/whole_body/whole_body_controller.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "support/kkt_error.hpp"
#include "support/simple_quadruped.hpp"

namespace palanquin {
namespace {

constexpr double kGravity = 9.81;

struct Standing : ::testing::Test {
  RobotModel model{testing::simple_quadruped()};
  WholeBodyController controller{model, WholeBodySettings{}};
  RobotState state = testing::standing_state();

  /// A period with `feet` on the ground, each to carry its share of the weight.
  void begin(const std::vector<int>& feet, const PointTarget& com) {
    controller.begin(model);
    controller.track_com(com);
    controller.track_orientation({});
    const double share = model.mass() * kGravity / static_cast<double>(feet.size());
    for (const int foot : feet) controller.add_contact({foot, {0, 0, share}, 0.6});
  }
  PointTarget here() {
    PointTarget target;
    target.position = model.com().position;
    return target;
  }
  /// D v' + H - [0; tau] - sum J'f for the accelerations that the result stands for.
  Eigen::VectorXd acceleration(const std::vector<int>& feet) {
    Eigen::VectorXd force = -model.bias();
    force.tail(12) += controller.result().torques;
    for (std::size_t i = 0; i < feet.size(); ++i)
      force += model.point(feet[i]).jacobian.transpose() *
               controller.result().forces.col(static_cast<Eigen::Index>(i));
    return model.mass_matrix().ldlt().solve(force);
  }
};

TEST_F(Standing, CarriesItsWeightAndStaysWhereItIs) {
  model.update(state);
  begin({0, 1, 2, 3}, here());
  const WholeBodyResult& result = controller.solve();
  ASSERT_EQ(result.status, Status::Converged);
  // Torques cost a little, so that a slack of some cm/s^2 remains.
  EXPECT_NEAR(result.forces.row(2).sum(), model.mass() * kGravity, 0.02 * model.mass() * kGravity);
  EXPECT_LT(result.slack.norm(), 0.2);
  const Eigen::VectorXd v = acceleration({0, 1, 2, 3});
  for (const int foot : {0, 1, 2, 3})
    EXPECT_LT((model.point(foot).jacobian * v + model.point(foot).drift).norm(), 1e-7);
}

TEST_F(Standing, MeetsTheKktConditionsInAnyState) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> draw(-1, 1);
  for (int trial = 0; trial < 100; ++trial) {
    state = testing::standing_state();
    for (double& angle : state.joint_positions) angle += 0.2 * draw(random);
    for (double& rate : state.joint_velocities) rate = 5 * draw(random);
    state.base_velocity = {draw(random), draw(random), draw(random)};
    state.base_rate = {draw(random), draw(random), draw(random)};
    state.base_orientation = quaternion_exp({0.3 * draw(random), 0.3 * draw(random), 0});
    model.update(state);
    PointTarget target = here();
    target.acceleration = 5 * Vector3(draw(random), draw(random), draw(random));
    const std::vector<int> feet = trial % 2 ? std::vector{0, 3} : std::vector{0, 1, 2, 3};
    begin(feet, target);
    if (trial % 2)
      for (const int foot : {1, 2}) controller.track_point(foot, here());
    const WholeBodyResult& result = controller.solve();
    ASSERT_EQ(result.status, Status::Converged) << trial;
    Eigen::VectorXd x(12 + result.forces.size());
    x << result.torques, result.forces.reshaped();
    const double scale = 1 + controller.qp().g.norm() + controller.multipliers().norm();
    EXPECT_LT(testing::kkt_error(controller.qp(), x, controller.multipliers()), 1e-8 * scale);
    for (const auto& force : result.forces.colwise()) {
      EXPECT_GE(force.z(), -1e-6);
      EXPECT_LE(force.head<2>().norm(), 0.6 * force.z() + 1e-6);
    }
    EXPECT_TRUE((result.torques.array().abs() <= model.effort().array()).all());
  }
}

TEST_F(Standing, StaysWithinTorqueLimitsUnderImpossibleDemands) {
  model.update(state);
  PointTarget target = here();
  target.acceleration = {0, 0, 500};
  begin({0, 1, 2, 3}, target);
  const WholeBodyResult& result = controller.solve();
  ASSERT_EQ(result.status, Status::Converged);
  EXPECT_NEAR(result.torques.cwiseAbs().maxCoeff(), 30, 1e-9);
  EXPECT_GT(result.slack.norm(), 10);
}

TEST_F(Standing, CarriesAKnownLoad) {
  RobotDescription robot = testing::simple_quadruped();
  robot.points.push_back({"hand", 0, {0, 0, 0.1}});
  RobotModel loaded(robot);
  WholeBodyController carrier(loaded, WholeBodySettings{});
  loaded.update(state);
  carrier.begin(loaded);
  PointTarget target;
  target.position = loaded.com().position;
  carrier.track_com(target);
  carrier.track_orientation({});
  const double share = (loaded.mass() * kGravity + 50) / 4;
  for (const int foot : {0, 1, 2, 3}) carrier.add_contact({foot, {0, 0, share}, 0.6});
  carrier.add_force(4, {0, 0, -50});
  const WholeBodyResult& result = carrier.solve();
  ASSERT_EQ(result.status, Status::Converged);
  EXPECT_NEAR(result.forces.row(2).sum(), 4 * share, 0.02 * 4 * share);
  EXPECT_LT(result.slack.norm(), 0.2);
}

TEST_F(Standing, MovesAJointAsAskedInTheAir) {
  model.update(state);
  controller.begin(model);
  controller.track_joint(1, state.joint_positions[1], state.joint_positions[1] + 0.1, 0.0);
  ASSERT_EQ(controller.solve().status, Status::Converged);
  EXPECT_NEAR(acceleration({})[7], 100 * 0.1, 0.1);
}

TEST_F(Standing, HoldsItsTorquesThenDampsWhenTheStateIsOfNoUse) {
  model.update(state);
  begin({0, 1, 2, 3}, here());
  const Eigen::VectorXd good = controller.solve().torques;
  RobotState broken = state;
  broken.base_position.x() = std::numeric_limits<double>::quiet_NaN();
  for (int period = 0; period < 30; ++period) {
    model.update(broken);
    begin({0, 1, 2, 3}, here());
    const WholeBodyResult& result = controller.solve();
    EXPECT_TRUE(result.is_fallback);
    EXPECT_EQ(result.status, Status::NonFinite);
    EXPECT_TRUE(result.torques.allFinite());
    if (period < 20) {
      EXPECT_EQ(result.torques, good);
    }
  }
  model.update(state);
  begin({0, 1, 2, 3}, here());
  EXPECT_FALSE(controller.solve().is_fallback);
}

TEST_F(Standing, RefusesWhatDoesNotExist) {
  model.update(state);
  controller.begin(model);
  EXPECT_THROW(controller.add_contact({7, Vector3::Zero(), 0.6}), std::out_of_range);
  EXPECT_THROW(controller.track_joint(12, 0, 0, 0), std::invalid_argument);
  WholeBodySettings settings;
  settings.force_weight = -1;
  EXPECT_THROW(WholeBodyController(model, settings), std::invalid_argument);
}

}  // namespace
}  // namespace palanquin
