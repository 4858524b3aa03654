// The controller of one robot without a simulator: the feet's forces are what a test says they are.
#include "palanquin/control/whole_body/robot_controller.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "support/allocation_counter.hpp"
#include "support/simple_quadruped.hpp"

namespace palanquin {
namespace {

constexpr double kGravity = 9.81, kPeriod = 1e-3;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

FootPositions hips() {
  FootPositions positions;
  positions << 0.18, 0.18, -0.18, -0.18, 0.13, -0.13, 0.13, -0.13, 0, 0, 0, 0;
  return positions;
}

RobotControlSettings trotting() {
  RobotControlSettings settings;
  settings.gait.start = 0.1;  // then RF and LH swing for 0.2 s
  return settings;
}

struct RobotControl : ::testing::Test {
  RobotController controller{testing::simple_quadruped(), hips(), trotting()};
  RobotState state = testing::standing_state();
  RobotTarget target = here(Vector3::Zero());
  double weight = controller.model().mass() * kGravity;

  /// Going on with `velocity` from where it stands, each of the feet to carry its share.
  RobotTarget here(const Vector3& velocity) {
    RobotTarget t;
    t.position = controller.observe(state).position;
    t.velocity = velocity;
    t.commanded_velocity = velocity;
    t.forces.row(2).setConstant(controller.model().mass() * kGravity / 4);
    return t;
  }
  /// One period; a foot that stands by the schedule feels the ground, unless told otherwise.
  void update(double time) {
    Vector4 forces;
    for (int leg = 0; leg < kLegs; ++leg)
      forces[leg] = trotting().gait.stands(leg, time) ? weight / 4 : 0;
    update(time, forces);
  }
  void update(double time, const Vector4& forces) {
    target.time = time;
    controller.update(time, kPeriod, state, forces, target);
  }
  /// Up to but without `time`, in steps of a period.
  void run_until(double time) {
    for (; clock < time - kPeriod / 2; clock += kPeriod) update(clock);
  }
  /// Acceleration of the centre of a foot under the controller's torques and forces, m/s^2.
  Vector3 foot_acceleration(int leg) {
    const RobotModel& model = controller.model();
    Eigen::VectorXd force = -model.bias();
    force.tail(12) += controller.result().torques;
    Eigen::Index column = 0;
    for (int other = 0; other < kLegs; ++other)
      if (controller.phase(other) == LegPhase::Stance)
        force += model.point(other).jacobian.transpose() * controller.result().forces.col(column++);
    return model.point(leg).jacobian * model.mass_matrix().ldlt().solve(force) +
           model.point(leg).drift;
  }

  double clock = 0;
};

TEST_F(RobotControl, CarriesItsWeightWhileItStands) {
  run_until(0.1);
  const WholeBodyResult& result = controller.result();
  ASSERT_EQ(result.status, Status::Converged);
  EXPECT_FALSE(result.is_fallback);
  ASSERT_EQ(result.forces.cols(), kLegs);
  EXPECT_NEAR(result.forces.row(2).sum(), weight, 0.03 * weight);
  EXPECT_LT(controller.output_errors().norm(), 1e-9);
  for (int leg = 0; leg < kLegs; ++leg) EXPECT_EQ(controller.phase(leg), LegPhase::Stance);
}

TEST_F(RobotControl, SwingsADiagonalPairBySchedule) {
  target = here({0.3, 0, 0});
  run_until(0.11);
  const Vector3 lift_off = controller.model().point(1).position;
  run_until(0.15);
  ASSERT_EQ(controller.result().status, Status::Converged);
  EXPECT_EQ(controller.result().forces.cols(), 2);
  for (const int leg : {0, 3}) EXPECT_EQ(controller.phase(leg), LegPhase::Stance);
  for (const int leg : {1, 2}) {
    EXPECT_EQ(controller.phase(leg), LegPhase::Swing);
    EXPECT_GT(foot_acceleration(leg).z(), 1) << "a foot that is late in its swing goes up";
  }
  // It lands ahead of where it stood: by the command, though the robot itself doesn't move yet.
  const double lead = controller.footholds()(0, 1) - lift_off.x();
  target = here(Vector3::Zero());
  update(0.15);
  EXPECT_NEAR(lead - (controller.footholds()(0, 1) - lift_off.x()), -0.1 * 0.3, 1e-9)
      << "k (v - v_cmd) with the default gain";
}

TEST_F(RobotControl, FootholdsGoAheadOfARobotThatMoves) {
  run_until(0.15);  // 0.15 s before the touchdown
  const double still = controller.footholds()(0, 1);
  state.base_velocity.x() = 0.2;
  target = here({0.2, 0, 0});
  update(0.15);
  // Where the hip will be, and half a stance of 0.2 s ahead, a little less for a pendulum that is
  // at its fastest when it lands.
  const double ahead = controller.footholds()(0, 1) - still;
  EXPECT_LT(ahead, 0.2 * (0.15 + 0.1));
  EXPECT_GT(ahead, 0.85 * 0.2 * (0.15 + 0.1));
  EXPECT_NEAR(controller.footholds()(2, 1), controller.ground_height(), 1e-12);
}

TEST_F(RobotControl, AnEarlyFootBearsLittleUntilItIsDue) {
  run_until(0.25);
  Vector4 forces(weight / 2, 20, 0, weight / 2);
  update(0.25, forces);
  ASSERT_EQ(controller.phase(1), LegPhase::Stance);
  ASSERT_EQ(controller.result().forces.cols(), 3);
  const double early = controller.result().forces(2, 1);
  EXPECT_LT(early, 0.3 * weight);
  // Due at last, it takes over from the diagonal that lifts.
  update(0.301, Vector4(weight / 2, weight / 2, weight / 2, weight / 2));
  ASSERT_EQ(controller.result().forces.cols(), 2);
  EXPECT_GT(controller.result().forces(2, 0), early + 0.1 * weight);
}

TEST_F(RobotControl, AFootThatFindsNoGroundReachesForIt) {
  run_until(0.3);
  const Vector4 forces(0, 0, weight, 0);
  update(0.3, forces);
  EXPECT_EQ(controller.phase(1), LegPhase::Reaching);
  EXPECT_EQ(controller.phase(2), LegPhase::Stance);
  update(0.31, forces);
  EXPECT_LT(foot_acceleration(1).z(), -1);
  // A planner is to count on it only after a while, and not at all on legs that are to swing.
  EXPECT_EQ(controller.contacts(0.31, 0.315), (std::array{false, false, true, false}));
  EXPECT_EQ(controller.contacts(0.31, 0.35), (std::array{false, true, true, false}));
}

TEST_F(RobotControl, ReferencesMoveTowardsTheTimeTheyAreDue) {
  target = here({0.5, 0, 0});
  target.rate = {0, 0, 1};
  target.time = 0.01;
  controller.update(0.0, kPeriod, state, Vector4::Constant(weight / 4), target);
  const Eigen::Matrix<double, 6, 1> errors = controller.output_errors();
  EXPECT_NEAR(errors[0], 0.5 * 0.01, 1e-12);
  EXPECT_NEAR(errors[5], 1 * 0.01, 1e-12);
  EXPECT_LT((errors - errors[0] * errors.Unit(0) - errors[5] * errors.Unit(5)).norm(), 1e-12);
}

TEST_F(RobotControl, ObservesTheContactPointsBelowItsFeet) {
  const RobotObservation before = controller.observe(state);
  EXPECT_EQ(before.feet, before.footholds);
  EXPECT_NEAR(before.ground, before.feet.row(2).mean(), 1e-15);
  run_until(0.15);
  const RobotObservation after = controller.observe(state);
  for (int leg = 0; leg < kLegs; ++leg)
    EXPECT_NEAR(after.feet(2, leg), controller.model().point(leg).position.z() - 0.02, 1e-12);
  EXPECT_EQ(after.footholds.col(1), controller.footholds().col(1));
  EXPECT_EQ(after.ground, controller.ground_height());
}

TEST_F(RobotControl, SurvivesMeasurementsOfNoUse) {
  run_until(0.05);
  const RobotState good = state;
  state.joint_velocities[3] = kNaN;
  for (int period = 0; period < 30; ++period) {
    update(0.05 + period * kPeriod);
    EXPECT_TRUE(controller.result().is_fallback);
    EXPECT_TRUE(controller.result().torques.allFinite());
  }
  state = good;
  update(0.08);
  EXPECT_FALSE(controller.result().is_fallback);
  EXPECT_EQ(controller.result().status, Status::Converged);
  target.position.x() = kNaN;  // what a planner may say that failed
  update(0.081);
  EXPECT_TRUE(controller.result().is_fallback);
  EXPECT_TRUE(controller.result().torques.allFinite());
}

TEST_F(RobotControl, DoesNotAllocateInAPeriod) {
  target = here({0.3, 0, 0});
  run_until(0.5);  // each leg has stood and swung
  EXPECT_EQ(testing::allocations_during([&] { run_until(1.0); }), 0);
  EXPECT_EQ(controller.result().status, Status::Converged);
  // Early and late touchdowns, and a state of no use, where these numbers of contacts came before.
  const RobotState good = state;
  const auto trouble = [&] {
    for (const double force : {0.0, 50.0, kNaN})
      for (int i = 0; i < 300; ++i) update(1 + i * kPeriod, Vector4::Constant(force));
    state.base_position.x() = kNaN;
    update(1.3);
    state = good;
  };
  trouble();
  EXPECT_EQ(testing::allocations_during(trouble), 0);
}

std::string refusal(const RobotControlSettings& settings, const FootPositions& at = hips(),
                    const RobotDescription& robot = testing::simple_quadruped()) {
  try {
    RobotController controller(robot, at, settings);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(RobotControlSettings, NameFieldValueAndRule) {
  const auto after = [](auto change) {
    RobotControlSettings settings;
    change(settings);
    return refusal(settings);
  };
  EXPECT_EQ(refusal({}), "");
  EXPECT_EQ(after([](auto& s) { s.contact.touch_force = 0; }),
            "robot controller: contact: touch_force is 0, but must be finite and positive");
  EXPECT_EQ(after([](auto& s) { s.contact.release_force = 9; }),
            "robot controller: contact: release_force is 9, but must be at most touch_force");
  EXPECT_EQ(after([](auto& s) { s.contact.lost_time = -1; }),
            "robot controller: contact: lost_time is -1, but must be finite and not negative");
  EXPECT_EQ(after([](auto& s) { s.contact.earliest = 1.5; }),
            "robot controller: contact: earliest is 1.5, but must be at most 1, the whole swing");
  EXPECT_EQ(after([](auto& s) { s.contact.early_force = kNaN; }),
            "robot controller: contact: early_force is nan, but must be finite and not negative");
  EXPECT_EQ(after([](auto& s) { s.gait.offset[2] = kNaN; }),
            "robot controller: gait: offset[2] is nan, but must be finite");
  EXPECT_EQ(after([](auto& s) { s.whole_body.point.kd = -2; }),
            "robot controller: whole_body: point.kd is -2, but must be finite and not negative");
  EXPECT_EQ(after([](auto& s) { s.reach_depth = -0.1; }),
            "robot controller: reach_depth is -0.1, but must be finite and not negative");
  EXPECT_THROW(ContactMonitor({.touch_force = -8}), std::invalid_argument);
}

TEST(RobotControlSettings, NeedFourFeetAndFiniteHips) {
  RobotDescription robot = testing::simple_quadruped();
  robot.points.pop_back();
  EXPECT_NE(refusal({}, hips(), robot).find("3 points"), std::string::npos);
  FootPositions at = hips();
  at(1, 2) = kNaN;
  EXPECT_NE(refusal({}, at).find("hips"), std::string::npos);
}

}  // namespace
}  // namespace palanquin
