// The controller of one robot without a simulator: the feet's forces are what a test says they are.
#include "palanquin/control/whole_body/robot_controller.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "support/allocation_counter.hpp"
#include "support/simple_quadruped.hpp"

namespace palanquin {
namespace {

constexpr double kGravity = 9.81, kPeriod = 1e-3;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

constexpr int kFeet = 4;

RobotControlSettings trotting() {
  RobotControlSettings settings;
  settings.gait.period = 0.4;
  settings.gait.duty.assign(kFeet, 0.5);
  settings.gait.offset = {0, 0.5, 0.5, 0};
  settings.gait_start = 0.1;  // then RF and LH swing for 0.2 s
  return settings;
}

struct RobotControl : ::testing::Test {
  RobotControlSettings settings = trotting();
  RobotController controller{testing::simple_quadruped(), testing::simple_hips(), settings};
  RobotState state = testing::standing_state();
  RobotTarget target = here(Vector3::Zero());
  double weight = controller.model().mass() * kGravity;

  /// Going on with `velocity` from where it stands, each of the feet to carry its share.
  RobotTarget here(const Vector3& velocity) {
    RobotTarget t;
    t.position = controller.observe(state).position;
    t.velocity = velocity;
    t.commanded_velocity = velocity;
    t.forces.setZero(3, kFeet);
    t.forces.row(2).setConstant(controller.model().mass() * kGravity / 4);
    return t;
  }
  /// One period; a foot that stands by the schedule feels the ground, unless told otherwise.
  void update(double time) {
    Vector4 forces;
    for (int leg = 0; leg < kFeet; ++leg)
      forces[leg] = controller.clock().is_due(leg, time) ? weight / 4 : 0;
    update(time, forces);
  }
  void update(double time, const Vector4& forces) {
    target.time = time;
    measured.row(2) = forces;
    controller.update(time, kPeriod, state, measured, target);
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
    for (int other = 0; other < kFeet; ++other)
      force += model.limb(other).jacobian.transpose() * controller.result().forces.col(other);
    return model.limb(leg).jacobian * model.mass_matrix().ldlt().solve(force) +
           model.limb(leg).drift;
  }
  /// Which feet the ground pushes in the last result.
  std::vector<int> loaded() const {
    std::vector<int> feet;
    for (int leg = 0; leg < kFeet; ++leg)
      if (controller.result().forces.col(leg).norm() > 0) feet.push_back(leg);
    return feet;
  }

  Eigen::Matrix3Xd measured = Eigen::Matrix3Xd::Zero(3, kFeet);
  double clock = 0;
};

TEST_F(RobotControl, CarriesItsWeightWhileItStands) {
  run_until(0.1);
  const WholeBodyResult& result = controller.result();
  ASSERT_EQ(result.status, Status::Converged);
  EXPECT_FALSE(result.is_fallback);
  ASSERT_EQ(loaded(), (std::vector{0, 1, 2, 3}));
  EXPECT_NEAR(result.forces.row(2).sum(), weight, 0.03 * weight);
  EXPECT_LT(controller.output_errors().norm(), 1e-9);
  for (int leg = 0; leg < kFeet; ++leg) EXPECT_EQ(controller.phase(leg), LegPhase::Stance);
}

TEST_F(RobotControl, SwingsADiagonalPairBySchedule) {
  target = here({0.3, 0, 0});
  run_until(0.11);
  const Vector3 lift_off = controller.model().limb(1).position;
  run_until(0.15);
  ASSERT_EQ(controller.result().status, Status::Converged);
  EXPECT_EQ(loaded(), (std::vector{0, 3}));
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
  ASSERT_EQ(loaded(), (std::vector{0, 1, 3}));
  const double early = controller.result().forces(2, 1);
  EXPECT_LT(early, 0.3 * weight);
  // Due at last, it takes over from the diagonal that lifts.
  update(0.301, Vector4(weight / 2, weight / 2, weight / 2, weight / 2));
  ASSERT_EQ(loaded(), (std::vector{1, 2}));
  EXPECT_GT(controller.result().forces(2, 1), early + 0.1 * weight);
}

TEST_F(RobotControl, APlannersClockThatIsToldTheSameAgrees) {
  planning::GaitClock planners = controller.clock();
  const auto tell = [&](double time) {
    for (int i = 0; i < controller.feet(); ++i)
      planners.sense(i, time, controller.phase(i) == LegPhase::Stance);
  };
  run_until(0.28);
  update(0.28, Vector4(weight / 2, 50, 0, weight / 2));  // foot 1 lands early
  tell(0.28);
  update(0.3, Vector4(0, weight, 0, 0));  // foot 2 is late
  tell(0.3);
  EXPECT_TRUE(planners.stands(1, 0.29));
  EXPECT_FALSE(planners.stands(2, 0.31));
  for (double time = 0.28; time < 0.7; time += 0.001)
    EXPECT_EQ(planners.contacts(time), controller.clock().contacts(time)) << time;
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
  for (const int leg : {0, 3}) EXPECT_FALSE(controller.will_bear(leg, 0.35));
  EXPECT_TRUE(controller.will_bear(2, 0.315));
  EXPECT_FALSE(controller.will_bear(1, 0.315));
  EXPECT_TRUE(controller.will_bear(1, 0.35));
}

TEST_F(RobotControl, ReferencesMoveTowardsTheTimeTheyAreDue) {
  target = here({0.5, 0, 0});
  target.rate = {0, 0, 1};
  target.time = 0.01;
  measured.row(2).setConstant(weight / 4);
  controller.update(0.0, kPeriod, state, measured, target);
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
  for (int leg = 0; leg < kFeet; ++leg)
    EXPECT_NEAR(after.feet(2, leg), controller.model().limb(leg).position.z() - 0.02, 1e-12);
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
  EXPECT_EQ(testing::allocations_during([&] { run_until(1.0); }), 0) << "from the first one on";
  EXPECT_EQ(controller.result().status, Status::Converged);
  // Early and late touchdowns, and a state of no use.
  const RobotState good = state;
  const auto trouble = [&] {
    for (const double force : {0.0, 50.0, kNaN})
      for (int i = 0; i < 300; ++i) update(1 + i * kPeriod, Vector4::Constant(force));
    state.base_position.x() = kNaN;
    update(1.3);
    state = good;
  };
  EXPECT_EQ(testing::allocations_during(trouble), 0);
}

TEST_F(RobotControl, LandsWhereThePlannerWants) {
  target.footholds.setConstant(3, kFeet, kNaN);
  target.footholds.col(1) = Vector3(0.3, -0.2, 0.05);
  run_until(0.15);
  EXPECT_EQ(controller.footholds().col(1), target.footholds.col(1));
  EXPECT_TRUE(controller.footholds().col(2).allFinite()) << "left to the controller";
  EXPECT_NEAR(controller.footholds()(2, 2), controller.ground_height(), 1e-12);
  // Towards the end of the swing the foot is asked to be where its ball rests on the foothold.
  target.normals = Vector3(0.3, 0, 1).normalized().replicate(1, kFeet);
  run_until(0.3);
  EXPECT_EQ(controller.result().status, Status::Converged);
}

TEST_F(RobotControl, StandsOnTheNormalsOfTheGround) {
  const Vector3 normal = Vector3(0.5, 0, 1).normalized();
  target.normals = normal.replicate(1, kFeet);
  for (int i = 0; i < kFeet; ++i) measured.col(i) = weight / 4 * normal;
  controller.update(0.0, kPeriod, state, measured, target);
  ASSERT_EQ(controller.result().status, Status::Converged);
  for (int leg = 0; leg < kFeet; ++leg) {
    const Vector3 force = controller.result().forces.col(leg);
    EXPECT_LE((force - normal.dot(force) * normal).norm(), 0.6 * normal.dot(force) + 1e-6);
    EXPECT_LT((controller.footholds().col(leg) - controller.model().limb(leg).position +
               testing::kFootRadius * normal)
                  .norm(),
              1e-12);
  }
}

TEST_F(RobotControl, LoadsAFootAtLeastAsMuchAsItMust) {
  settings.least_force = 15;
  RobotController loading(testing::simple_quadruped(), testing::simple_hips(), settings);
  target.forces.col(2).setZero();
  target.forces.row(2) *= 4.0 / 3;
  measured.row(2).setConstant(weight / 4);
  for (const double time : {0.0, 0.02, 0.04}) {
    target.time = time;
    loading.update(time, kPeriod, state, measured, target);
    ASSERT_EQ(loading.result().status, Status::Converged);
    if (time < settings.loaded_after)
      EXPECT_GE(loading.result().forces(2, 2), -1e-6);
    else
      EXPECT_GE(loading.result().forces(2, 2), 15 - 1e-6);
  }
}

struct ArmedControl : ::testing::Test {
  ArmedControl() {
    settings.posture = {15};  // the forearm's roll
    target.forces.setZero(3, kFeet);
  }
  /// One period at rest under the target for what is measured now.
  RobotController& update() {
    controller.emplace(testing::simple_armed_quadruped(), testing::simple_hips(), settings);
    const RobotObservation seen = controller->observe(state);
    target.position = seen.position;
    if (target.forces.isZero())
      target.forces.row(2).setConstant(controller->model().mass() * kGravity / 4);
    for (HandTarget& hand : target.hands) hand.point.position += seen.hands[0].position;
    controller->update(0.0, kPeriod, state, Eigen::Matrix3Xd::Constant(3, kFeet, 40), target);
    return *controller;
  }
  /// Generalised acceleration under the result and a known wrench on the hand.
  Eigen::VectorXd acceleration(const Wrench& known = {}) {
    const RobotModel& model = controller->model();
    Eigen::VectorXd force = -model.bias();
    force.tail(16) += controller->result().torques;
    for (int limb = 0; limb < model.limbs(); ++limb) {
      const Vector3 f = controller->result().forces.col(limb) + (limb == 4) * known.force;
      const Vector3 m = controller->result().moments.col(limb) + (limb == 4) * known.moment;
      force += model.limb(limb).jacobian.transpose() * f;
      force += model.limb(limb).angular_jacobian.transpose() * m;
    }
    return model.mass_matrix().ldlt().solve(force);
  }

  RobotControlSettings settings;
  RobotState state = testing::standing_state(true);
  RobotTarget target;
  std::optional<RobotController> controller;
};

TEST_F(ArmedControl, KeepsItsArmWithoutTargets) {
  ASSERT_EQ(update().result().status, Status::Converged);
  EXPECT_LT(acceleration().tail<4>().norm(), 0.5);
  EXPECT_GT(controller->result().torques.tail<4>().norm(), 0.5) << "against gravity";
}

TEST_F(ArmedControl, MovesItsHandAsAskedUnderAnyLoad) {
  HandTarget hand;
  hand.point.position = {0.02, 0.01, -0.01};
  hand.wrench = {.force = {5, 2, -30}, .moment = {0.5, 1, 0}};
  for (int i = 0; i < 5; ++i) {  // forces that the feet can have, desired of all loads
    target.hands = {hand};
    update();
    target.forces = controller->result().forces.leftCols(kFeet);
  }
  for (const HandLoad load : {HandLoad::Known, HandLoad::Force, HandLoad::Wrench}) {
    hand.load = load;
    if (load == HandLoad::Force) hand.wrench.moment.setZero();
    target.hands = {hand};
    ASSERT_EQ(update().result().status, Status::Converged);
    const Eigen::VectorXd v = acceleration(load == HandLoad::Known ? hand.wrench : Wrench{});
    const LimbKinematics& at = controller->model().limb(4);
    // As demanded, but for what the torques cost.
    EXPECT_LT((at.jacobian * v + at.drift - 100 * hand.point.position).norm(), 0.2);
    EXPECT_LT(std::abs(v[21]), 0.5) << "the roll keeps its angle";
    const WholeBodyResult& result = controller->result();
    if (load != HandLoad::Known) {
      EXPECT_LT((result.forces.col(4) - hand.wrench.force).norm(), 3);
    } else {
      EXPECT_EQ(result.forces.col(4).norm(), 0);
    }
    if (load == HandLoad::Wrench) {
      EXPECT_LT((result.moments.col(4) - hand.wrench.moment).norm(), 1);
    } else {
      EXPECT_EQ(result.moments.norm(), 0);
    }
  }
}

TEST_F(ArmedControl, TurnsItsHandAsAsked) {
  settings.posture.clear();
  HandTarget hand;
  hand.orientation.emplace();
  target.hands = {hand};
  update();
  const LimbKinematics& before = controller->model().limb(4);
  const Eigen::Quaterniond q(before.rotation * Eigen::AngleAxisd(0.02, Vector3::UnitZ()));
  hand.orientation->orientation = {q.w(), q.x(), q.y(), q.z()};
  target.hands = {hand};
  ASSERT_EQ(update().result().status, Status::Converged);
  const LimbKinematics& at = controller->model().limb(4);
  const Vector3 turning =
      at.rotation.transpose() * (at.angular_jacobian * acceleration() + at.angular_drift);
  // About its own axis; the arm cannot turn about all of them while the hand stays in place.
  EXPECT_NEAR(turning.z(), 100 * 0.02, 0.1);
}

TEST_F(ArmedControl, RefusesTargetsOfAnotherRobot) {
  update();
  const auto misfit = [&](auto change) {
    RobotTarget other = target;
    change(other);
    EXPECT_THROW(controller->update(0, kPeriod, state, Eigen::Matrix3Xd::Zero(3, kFeet), other),
                 std::invalid_argument);
    return controller->explain_misfit(other);
  };
  EXPECT_EQ(misfit([](auto& t) { t.forces.setZero(3, 2); }),
            "number of forces is 2, but must be 4, one a foot");
  EXPECT_EQ(misfit([](auto& t) { t.normals.setZero(3, 1); }),
            "number of normals is 1, but must be 4, one a foot, or 0");
  EXPECT_EQ(misfit([](auto& t) { t.footholds.setZero(3, 5); }),
            "number of footholds is 5, but must be 4, one a foot, or 0");
  EXPECT_EQ(misfit([](auto& t) { t.hands.resize(2); }),
            "number of hands is 2, but must be 1, or 0");
  EXPECT_EQ(controller->explain_misfit(target), "");
  EXPECT_THROW(controller->update(0, kPeriod, state, Eigen::Matrix3Xd::Zero(3, 1), target),
               std::invalid_argument);
}

std::string refusal(const RobotControlSettings& settings,
                    const Eigen::Matrix3Xd& at = testing::simple_hips(),
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
    RobotControlSettings settings = trotting();
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
  EXPECT_EQ(after([](auto& s) { s.whole_body.foot.kd = -2; }),
            "robot controller: whole_body: foot.kd is -2, but must be finite and not negative");
  EXPECT_EQ(after([](auto& s) { s.whole_body.hand.weight = 0; }),
            "robot controller: whole_body: hand.weight is 0, but must be finite and positive");
  EXPECT_EQ(after([](auto& s) { s.least_force = 601; }),
            "robot controller: least_force is 601, but must be at most whole_body.largest_force");
  EXPECT_EQ(after([](auto& s) { s.posture = {3, 12}; }),
            "robot controller: posture[1] is 12, but must be from 0 to 11");
  EXPECT_EQ(after([](auto& s) { s.reach_depth = -0.1; }),
            "robot controller: reach_depth is -0.1, but must be finite and not negative");
  EXPECT_THROW(ContactMonitor({.touch_force = -8}), std::invalid_argument);
}

TEST(RobotControlSettings, FitTheFeetOfTheRobot) {
  RobotDescription robot = testing::simple_quadruped();
  robot.limbs.pop_back();
  EXPECT_EQ(refusal(trotting(), testing::simple_hips(), robot),
            "robot controller: gait: number of duties is 4, but must be 3, one a foot, or 0");
  EXPECT_EQ(refusal({}, testing::simple_hips(), robot),
            "robot controller: number of hips is 4, but must be 3, one a foot");
  EXPECT_EQ(refusal({}, testing::simple_hips().leftCols(3), robot), "");
  robot.limbs.clear();
  EXPECT_EQ(refusal({}, testing::simple_hips(), robot),
            "robot controller: number of feet is 0, but must be at least 1");
  Eigen::Matrix3Xd at = testing::simple_hips();
  at(1, 2) = kNaN;
  EXPECT_NE(refusal({}, at).find("hips[2]"), std::string::npos);
}

}  // namespace
}  // namespace palanquin
