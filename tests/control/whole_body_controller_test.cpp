#include "palanquin/control/whole_body/whole_body_controller.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "support/allocation_counter.hpp"
#include "support/kkt_error.hpp"
#include "support/simple_quadruped.hpp"

namespace palanquin {
namespace {

constexpr double kGravity = 9.81;
constexpr int kHand = 4;

struct Draw {
  explicit Draw(unsigned seed) : random(seed) {}
  double operator()() { return uniform(random); }
  Vector3 vector() {
    const double x = (*this)(), y = (*this)(), z = (*this)();
    return {x, y, z};
  }
  /// Near standing, moving.
  RobotState state(bool arm) {
    RobotState s = testing::standing_state(arm);
    for (double& angle : s.joint_positions) angle += 0.2 * (*this)();
    for (double& rate : s.joint_velocities) rate = 3 * (*this)();
    s.base_velocity = vector();
    s.base_rate = vector();
    s.base_orientation = quaternion_exp({0.3 * (*this)(), 0.3 * (*this)(), 0});
    return s;
  }
  std::mt19937 random;
  std::uniform_real_distribution<double> uniform{-1, 1};
};

PointTarget at(const PointKinematics& point) {
  PointTarget target;
  target.position = point.position;
  return target;
}

/// A robot, its controller, and what follows from a result by the dynamics themselves.
struct Robot {
  explicit Robot(const RobotDescription& description, const WholeBodySettings& settings = {})
      : model(description), controller(model, settings) {}

  /// A period with `feet` on the ground, each to carry its share of the weight.
  void begin(const std::vector<int>& feet, const PointTarget& com, double friction = 0.6) {
    controller.begin(model);
    controller.track_com(com);
    controller.track_orientation({});
    const double share = model.mass() * kGravity / static_cast<double>(feet.size());
    for (const int foot : feet) controller.add_contact({foot, {0, 0, share}, friction});
  }
  /// v' under the result's torques, forces and moments, and a known wrench on the hand.
  Eigen::VectorXd acceleration(const Wrench& known = {}) {
    const WholeBodyResult& result = controller.result();
    Eigen::VectorXd force = -model.bias();
    force.tail(model.joints()) += result.torques;
    for (int limb = 0; limb < model.limbs(); ++limb) {
      const bool is_known = limb == kHand;
      const LimbKinematics& on = model.limb(limb);
      force += on.jacobian.transpose() * (result.forces.col(limb) + is_known * known.force);
      force +=
          on.angular_jacobian.transpose() * (result.moments.col(limb) + is_known * known.moment);
    }
    return model.mass_matrix().ldlt().solve(force);
  }
  Eigen::VectorXd solution(const std::vector<int>& contacts) const {
    const WholeBodyResult& result = controller.result();
    Eigen::VectorXd x(model.joints() + 3 * static_cast<Eigen::Index>(contacts.size()));
    x.head(model.joints()) = result.torques;
    for (std::size_t i = 0; i < contacts.size(); ++i)
      x.segment<3>(model.joints() + 3 * static_cast<Eigen::Index>(i)) =
          result.forces.col(contacts[i]);
    return x;
  }

  RobotModel model;
  WholeBodyController controller;
};

struct Standing : ::testing::Test, Robot {
  Standing() : Robot(testing::simple_quadruped()) {}
  RobotState state = testing::standing_state();
  std::vector<int> all{0, 1, 2, 3};
};

struct Armed : ::testing::Test, Robot {
  Armed() : Robot(testing::simple_armed_quadruped()) {}
  /// Stands still with a known load; the forces of the limbs, desired until they hardly change.
  Eigen::Matrix3Xd carry(const Wrench& load) {
    Eigen::Matrix3Xd forces = Eigen::Matrix3Xd::Zero(3, model.limbs());
    for (int round = 0; round < 6; ++round) {
      begin({}, at(model.com()));
      for (const int foot : all) controller.add_contact({foot, forces.col(foot)});
      controller.track_limb(kHand, at(model.limb(kHand)));
      controller.add_wrench(kHand, load);
      EXPECT_EQ(controller.solve().status, Status::Converged);
      forces = controller.result().forces;
    }
    return forces;
  }
  RobotState state = testing::standing_state(true);
  std::vector<int> all{0, 1, 2, 3};
};

TEST_F(Standing, CarriesItsWeightAndStaysWhereItIs) {
  model.update(state);
  begin(all, at(model.com()));
  const WholeBodyResult& result = controller.solve();
  ASSERT_EQ(result.status, Status::Converged);
  // Torques cost a little, so that a slack of some cm/s^2 remains.
  EXPECT_NEAR(result.forces.row(2).sum(), model.mass() * kGravity, 0.02 * model.mass() * kGravity);
  EXPECT_LT(controller.slack().norm(), 0.2);
  const Eigen::VectorXd v = acceleration();
  for (const int foot : all)
    EXPECT_LT((model.limb(foot).jacobian * v + model.limb(foot).drift).norm(), 1e-7);
}

TEST_F(Standing, MeetsTheKktConditionsInAnyState) {
  Draw draw(1);
  for (int trial = 0; trial < 100; ++trial) {
    model.update(draw.state(false));
    PointTarget target = at(model.com());
    target.acceleration = 5 * draw.vector();
    const std::vector<int> feet = trial % 2 ? std::vector{0, 3} : all;
    begin(feet, target);
    if (trial % 2)
      for (const int foot : {1, 2}) controller.track_limb(foot, at(model.com()));
    const WholeBodyResult& result = controller.solve();
    ASSERT_EQ(result.status, Status::Converged) << trial;
    const double scale = 1 + controller.qp().g.norm() + controller.multipliers().norm();
    EXPECT_LT(testing::kkt_error(controller.qp(), solution(feet), controller.multipliers()),
              1e-8 * scale);
    for (const auto& force : result.forces.colwise()) {
      EXPECT_GE(force.z(), -1e-6);
      EXPECT_LE(force.head<2>().norm(), 0.6 * force.z() + 1e-6);
    }
    EXPECT_TRUE((result.torques.array().abs() <= model.effort().array()).all());
  }
}

TEST_F(Standing, KeepsForcesInTheConesOfAnyGround) {
  Draw draw(2);
  int at_the_edge = 0;
  for (int trial = 0; trial < 60; ++trial) {
    model.update(draw.state(false));
    PointTarget target = at(model.com());
    target.acceleration = {8 * draw(), 8 * draw(), 0};
    begin({}, target);
    std::vector<Vector3> normals;
    for (const int foot : all) {
      normals.push_back((Vector3::UnitZ() + 0.4 * draw.vector()).normalized());
      Contact contact;
      contact.limb = foot;
      contact.force = model.mass() * kGravity / 4 * normals.back();
      contact.frame = contact_frame(normals.back());
      contact.least_force = 5;
      controller.add_contact(contact);
    }
    const WholeBodyResult& result = controller.solve();
    ASSERT_EQ(result.status, Status::Converged) << trial;
    for (const int foot : all) {
      const Vector3 force = result.forces.col(foot);
      const double normal = normals[static_cast<std::size_t>(foot)].dot(force);
      const double tangential = std::sqrt(std::max(0.0, force.squaredNorm() - normal * normal));
      EXPECT_GE(normal, 5 - 1e-6);
      EXPECT_LE(tangential, 0.6 * normal + 1e-5);
      at_the_edge += tangential > 0.9 * 0.6 * normal;
    }
  }
  EXPECT_GT(at_the_edge, 10) << "the pyramid is as wide as 92 % of the cone";
}

TEST_F(Standing, GivesAFootItsLeastForce) {
  model.update(state);
  for (const double least : {0.0, 15.0}) {
    begin({0, 1, 3}, at(model.com()));
    controller.add_contact({2, Vector3::Zero(), 0.6, Eigen::Matrix3d::Identity(), least});
    ASSERT_EQ(controller.solve().status, Status::Converged);
    EXPECT_GE(controller.result().forces(2, 2), least - 1e-6);
  }
}

TEST_F(Standing, StaysWithinTorqueLimitsUnderImpossibleDemands) {
  model.update(state);
  PointTarget target = at(model.com());
  target.acceleration = {0, 0, 500};
  begin(all, target);
  const WholeBodyResult& result = controller.solve();
  ASSERT_EQ(result.status, Status::Converged);
  EXPECT_NEAR(result.torques.cwiseAbs().maxCoeff(), 30, 1e-9);
  EXPECT_GT(controller.slack().norm(), 10);
}

TEST_F(Standing, MovesAJointAsAskedInTheAir) {
  model.update(state);
  controller.begin(model);
  controller.track_joint(1, {.position = state.joint_positions[1] + 0.1});
  ASSERT_EQ(controller.solve().status, Status::Converged);
  EXPECT_NEAR(acceleration()[7], 100 * 0.1, 0.5) << "a joint's weight is a light one";
}

TEST_F(Standing, HoldsItsTorquesThenDampsWhenTheStateIsOfNoUse) {
  model.update(state);
  begin(all, at(model.com()));
  const Eigen::VectorXd good = controller.solve().torques;
  RobotState broken = state;
  broken.base_position.x() = std::numeric_limits<double>::quiet_NaN();
  for (int period = 0; period < 30; ++period) {
    model.update(broken);
    begin(all, at(model.com()));
    const WholeBodyResult& result = controller.solve();
    EXPECT_TRUE(result.is_fallback);
    EXPECT_EQ(result.status, Status::NonFinite);
    EXPECT_TRUE(result.torques.allFinite());
    EXPECT_EQ(result.forces.norm(), 0);
    if (period < 20) {
      EXPECT_EQ(result.torques, good);
    }
  }
  model.update(state);
  begin(all, at(model.com()));
  EXPECT_FALSE(controller.solve().is_fallback);
}

/// Slack is what the accelerations of the dynamics lack of what the tasks demand.
TEST_F(Armed, SlackIsTheDifferenceToTheDemand) {
  Draw draw(3);
  for (int trial = 0; trial < 40; ++trial) {
    model.update(draw.state(true));
    const Wrench load{10 * draw.vector(), draw.vector()};
    begin(all, at(model.com()));
    PointTarget grip = at(model.limb(kHand));
    grip.acceleration = draw.vector();
    OrientationTarget turn;
    turn.acceleration = draw.vector();
    const Eigen::Quaterniond q(model.limb(kHand).rotation);
    turn.orientation = {q.w(), q.x(), q.y(), q.z()};
    controller.track_limb(kHand, grip);
    controller.track_limb_orientation(kHand, turn);
    controller.track_joint(13, {.position = model.joint_position(13), .acceleration = draw()});
    const bool is_known = trial % 2;
    if (is_known)
      controller.add_wrench(kHand, load);
    else
      controller.decide_wrench(kHand, load, trial % 4 == 0);
    ASSERT_EQ(controller.solve().status, Status::Converged);
    const Eigen::VectorXd v = acceleration(is_known ? load : Wrench{});
    const LimbKinematics& hand = model.limb(kHand);
    const Eigen::Ref<const Eigen::VectorXd> slack = controller.slack();
    ASSERT_EQ(slack.size(), 3 + 3 + 3 + 3 + 1);
    const Vector3 moving = grip.acceleration - 20 * hand.velocity + slack.segment<3>(6);
    EXPECT_LT((hand.jacobian * v + hand.drift - moving).norm(), 1e-6);
    const Vector3 turning =
        turn.acceleration - 20 * hand.rotation.transpose() * hand.rate + slack.segment<3>(9);
    EXPECT_LT(
        (hand.rotation.transpose() * (hand.angular_jacobian * v + hand.angular_drift) - turning)
            .norm(),
        1e-6);
    EXPECT_LT(
        (model.com().jacobian * v + model.com().drift + 20 * model.com().velocity - slack.head<3>())
            .norm(),
        1e-6);
    EXPECT_EQ(controller.result().moments.norm() > 0, trial % 4 == 0);
  }
}

TEST_F(Armed, CarriesAKnownLoad) {
  model.update(state);
  const Eigen::Matrix3Xd forces = carry({.force = {0, 0, -20}, .moment = {0.5, 0, 0}});
  const double weight = model.mass() * kGravity + 20;
  EXPECT_NEAR(forces.row(2).sum(), weight, 0.01 * weight);
  EXPECT_LT(controller.slack().norm(), 0.3);
}

TEST_F(Armed, DecidesALoadNearTheDesiredOne) {
  model.update(state);
  const Wrench load{.force = {0, 0, -20}, .moment = {0, 1, 0}};
  const Eigen::Matrix3Xd forces = carry(load);
  const auto deviation = [&](double weight) {
    WholeBodySettings settings;
    settings.force_weight = settings.moment_weight = weight;
    WholeBodyController other(model, settings);
    other.begin(model);
    other.track_com(at(model.com()));
    other.track_orientation({});
    for (const int foot : all) other.add_contact({foot, forces.col(foot)});
    other.track_limb(kHand, at(model.limb(kHand)));
    other.decide_wrench(kHand, load, true);
    EXPECT_EQ(other.solve().status, Status::Converged);
    const WholeBodyResult& result = other.result();
    return (result.forces.col(kHand) - load.force).norm() +
           (result.moments.col(kHand) - load.moment).norm();
  };
  EXPECT_LT(deviation(1e6), 0.05);
  EXPECT_GT(deviation(1e2), 10 * deviation(1e6)) << "what costs less gives way to the torques";
}

TEST_F(Armed, HeavierTasksPrevail) {
  model.update(state);
  for (const double weight : {1e2, 1e10}) {
    WholeBodySettings settings;
    settings.joint.weight = weight;
    WholeBodyController other(model, settings);
    other.begin(model);
    for (const int foot : all) other.add_contact({foot, {0, 0, model.mass() * kGravity / 4}});
    other.track_com(at(model.com()));
    other.track_orientation({});
    other.track_limb(kHand, at(model.limb(kHand)));
    for (const int joint : {13, 14})  // against the hand, which is to stay
      other.track_joint(joint, {.position = model.joint_position(joint) + 0.1});
    ASSERT_EQ(other.solve().status, Status::Converged);
    const double hand = other.slack().segment<3>(6).norm(), joints = other.slack().tail(2).norm();
    if (weight < 1e6)
      EXPECT_GT(joints, 20 * hand);
    else
      EXPECT_GT(hand, 20 * joints);
  }
}

/// Sizes change with the feet in contact, the tasks and what is decided; from the first period on.
TEST_F(Armed, AllocatesNothingWhicheverLimbsAreInContact) {
  model.update(state);
  const PointTarget com = at(model.com()), hand = at(model.limb(kHand));
  int converged = 0;
  const auto all_sets = [&] {
    for (unsigned set = 0; set < 32; ++set)
      for (int load = 0; load < 4; ++load) {
        controller.begin(model);
        controller.track_com(com);
        controller.track_orientation({});
        for (int foot = 0; foot < 4; ++foot)
          if (set >> foot & 1U)
            controller.add_contact({foot, {0, 0, 60}, 0.6, contact_frame({0.1, 0, 1})});
          else
            controller.track_limb(foot, at(model.limb(foot)));
        if (set >> kHand & 1U) controller.track_limb(kHand, hand);
        if (load == 1) controller.add_wrench(kHand, {.force = {0, 0, -10}});
        if (load > 1) controller.decide_wrench(kHand, {.force = {0, 0, -10}}, load == 3);
        converged += controller.solve().status == Status::Converged;
      }
  };
  EXPECT_EQ(testing::allocations_during(all_sets), 0);
  EXPECT_EQ(converged, 32 * 4);
}

TEST_F(Armed, RefusesWhatDoesNotExist) {
  model.update(state);
  controller.begin(model);
  EXPECT_THROW(controller.add_contact({7, Vector3::Zero()}), std::out_of_range);
  EXPECT_THROW(controller.track_joint(16, {}), std::out_of_range);
  EXPECT_THROW(controller.track_limb(-1, {}), std::out_of_range);
  controller.add_contact({0, Vector3::Zero()});
  EXPECT_THROW(controller.add_contact({0, Vector3::Zero()}), std::invalid_argument);
  EXPECT_THROW(controller.add_contact({1, Vector3::Zero(), -0.1}), std::invalid_argument);
  EXPECT_THROW(controller.add_contact({.limb = 1, .least_force = 1e3}), std::invalid_argument);
  EXPECT_THROW(controller.decide_wrench(1, {}, false), std::invalid_argument) << "a foot";
  controller.decide_wrench(kHand, {}, true);
  EXPECT_THROW(controller.decide_wrench(kHand, {}, true), std::invalid_argument);
  EXPECT_THROW(controller.add_contact({kHand, Vector3::Zero()}), std::invalid_argument);
  WholeBodySettings settings;
  settings.force_weight = -1;
  EXPECT_THROW(WholeBodyController(model, settings), std::invalid_argument);
}

}  // namespace
}  // namespace palanquin
