// Teams in MuJoCo: they stand and trot, fall when they must, and say what is wrong with them.
#include "palanquin/plant/team_simulation.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <thread>

#include "support/allocation_counter.hpp"
#include "support/quadruped_scene.hpp"

namespace palanquin {
namespace {

using testing::QuadrupedScene;

constexpr double kGravity = 9.81;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

RobotControlSettings trotting(double start) {
  RobotControlSettings control;
  control.gait.period = 0.4;
  control.gait.duty.assign(4, 0.5);
  control.gait.offset = {0, 0.5, 0.5, 0};
  control.gait_start = start;
  return control;
}

TeamSimulation simulate(QuadrupedScene& scene, const std::vector<TeamMember>& members,
                        std::vector<Disturbance> disturbances = {},
                        std::vector<BarSites> bars = {}) {
  return {scene.model.get(), scene.data.get(),       members, {},
          std::move(bars),   std::move(disturbances)};
}

/// A planner that looks no step ahead: where each robot stands now, upright, at its first height.
std::vector<RobotTarget> targets_for(TeamSimulation& team, const Vector3& velocity = {0, 0, 0}) {
  std::vector<RobotTarget> targets;
  for (int robot = 0; robot < team.robots(); ++robot) {
    RobotTarget& target = targets.emplace_back();
    target.time = team.time();
    target.position = team.observe(robot).position;
    target.position.z() = 0.27;
    target.velocity = target.commanded_velocity = velocity;
    const RobotController& controller = team.controller(robot);
    target.forces.setZero(3, controller.feet());
    for (int foot = 0; foot < controller.feet(); ++foot)
      target.forces(2, foot) = controller.will_bear(foot, team.time());
    target.forces *= controller.model().mass() * kGravity / target.forces.sum();
  }
  return targets;
}

/// Steps with new targets every 5 ms; returns the steps done.
int walk(TeamSimulation& team, int periods, const Vector3& velocity = {0, 0, 0}) {
  int done = 0;
  for (int last = 1; done < periods && last > 0; done += last)
    last = team.run(5, targets_for(team, velocity));
  return done;
}

TEST(TeamSimulation, StandsOnItsFeet) {
  QuadrupedScene scene(2);
  TeamSimulation team = simulate(scene, scene.members(trotting(100)));
  ASSERT_EQ(walk(team, 400), 400) << team.fall();
  EXPECT_FALSE(team.has_fallen());
  EXPECT_NEAR(team.time(), 0.4, 1e-9);
  for (int robot = 0; robot < 2; ++robot) {
    const double weight = team.controller(robot).model().mass() * kGravity;
    EXPECT_NEAR(team.foot_forces(robot).row(2).sum(), weight, 0.02 * weight);
    EXPECT_LT(team.measured(robot).base_velocity.norm(), 0.05);
    EXPECT_NEAR(team.measured(robot).base_position.y(), -QuadrupedScene::kLane * robot, 0.01);
  }
  const TeamExtremes& extremes = team.extremes();
  EXPECT_EQ(extremes.control_periods, 2 * 400);
  EXPECT_EQ(extremes.fallbacks, 0);
  EXPECT_GT(extremes.torque_fraction, 0.02);
  EXPECT_LE(extremes.torque_fraction, 1);
  EXPECT_GT(extremes.contact_force, 20);
}

TEST(TeamSimulation, TrotsAndIsTheSameInEveryRun) {
  const auto trot = [](unsigned seed) {
    QuadrupedScene scene(1);
    std::vector<TeamMember> members = scene.members(trotting(0.1));
    members[0].measurement.velocity = 0.01;
    members[0].measurement.delay = 1;
    members[0].measurement.seed = seed;
    TeamSimulation team = simulate(scene, members);
    EXPECT_EQ(walk(team, 1500, {0.2, 0, 0}), 1500) << team.fall();
    return team.measured(0).base_position;
  };
  const Vector3 end = trot(1);
  EXPECT_NEAR(end.x(), 0.2 * 1.4, 0.1);
  EXPECT_EQ(trot(1), end);
  EXPECT_NE(trot(2), end);
}

TEST(TeamSimulation, ChangesTheGaitOfOneRobotAtTheEndOfItsCycle) {
  QuadrupedScene scene(2);
  TeamSimulation team = simulate(scene, scene.members(trotting(0.2)));
  const planning::Gait stand{"stand", 0.4, {1, 1, 1, 1}, {0, 0, 0, 0}};
  EXPECT_DOUBLE_EQ(team.change_gait(1, stand, 0.3), 0.6);  // its cycle began at 0.2 s
  EXPECT_EQ(walk(team, 700), 700) << team.fall();
  const auto standing = [&](int robot, double time) {
    int count = 0;
    for (int foot = 0; foot < 4; ++foot) count += team.controller(robot).clock().stands(foot, time);
    return count;
  };
  EXPECT_EQ(standing(0, 0.65), 2);
  EXPECT_EQ(standing(1, 0.55), 2);
  EXPECT_EQ(standing(1, 0.65), 4);
  EXPECT_DOUBLE_EQ(team.change_gait(0, stand, 0.75, true), 0.75);
  EXPECT_EQ(standing(0, 0.76), 4);
  EXPECT_THROW(team.change_gait(2, stand, 0.8), std::out_of_range);
  EXPECT_THROW(team.change_gait(0, {"odd", 0.4, {1}, {0}}, 0.8), std::invalid_argument);
}

TEST(TeamSimulation, ARobotTrotsOnWithoutForcesOnItsFeetAndABlinkWithoutAState) {
  QuadrupedScene scene(1);
  TeamSimulation team = simulate(scene, scene.members(trotting(0.1)));
  ASSERT_EQ(walk(team, 500, {0.2, 0, 0}), 500) << team.fall();
  team.lose(0, Sense::FootForces, true);
  ASSERT_EQ(walk(team, 500, {0.2, 0, 0}), 500) << team.fall();
  EXPECT_EQ(team.extremes().fallbacks, 0);
  team.lose(0, Sense::State, true);
  EXPECT_FALSE(team.measured(0).is_finite());
  ASSERT_EQ(walk(team, 15, {0.2, 0, 0}), 15);
  EXPECT_EQ(team.extremes().fallbacks, 15);
  EXPECT_TRUE(team.controller(0).result().torques.allFinite());
  team.lose(0, Sense::State, false);
  ASSERT_EQ(walk(team, 1000, {0.2, 0, 0}), 1000) << team.fall();
  EXPECT_EQ(team.extremes().fallbacks, 15);
  EXPECT_THROW(team.lose(1, Sense::State, true), std::out_of_range);
}

TEST(TeamSimulation, ARobotWithoutAStateBearsItsWeightByThePlanAfterAWhile) {
  QuadrupedScene scene(1);
  TeamSimulation team = simulate(scene, scene.members(trotting(100)));
  ASSERT_EQ(walk(team, 300), 300) << team.fall();
  const std::vector<RobotTarget> targets = targets_for(team);
  team.lose(0, Sense::State, true);
  EXPECT_FALSE(team.observe(0).position.allFinite());
  ASSERT_EQ(team.run(60, targets), 60) << team.fall();
  EXPECT_TRUE(team.controller(0).result().torques.allFinite());
  EXPECT_GT(team.controller(0).result().torques.norm(), 5.0);
}

TEST(TeamSimulation, DoesNotAllocateWhileItRuns) {
  QuadrupedScene scene(2);
  Push push;
  push.body = scene.id(mjOBJ_BODY, "robot0/trunk");
  push.amplitude = {5, 0, 0};
  push.end = 100;
  Tether tether;
  tether.body = scene.id(mjOBJ_BODY, "robot1/trunk");
  tether.anchor = {0.5, -0.8, 0.3};
  tether.stiffness = 10;
  tether.end = 100;
  std::vector<TeamMember> members = scene.members(trotting(0.05));
  members[0].measurement.position = 1e-4;
  members[0].measurement.delay = 2;
  TeamSimulation team =
      simulate(scene, members, {push, tether},
               {{scene.id(mjOBJ_SITE, "robot0/back"), scene.id(mjOBJ_SITE, "robot1/back"), 0.8}});
  ASSERT_EQ(walk(team, 500), 500) << team.fall();
  const std::vector<RobotTarget> targets = targets_for(team);
  EXPECT_EQ(testing::allocations_during([&] { team.run(200, targets); }), 0);
  EXPECT_FALSE(team.has_fallen()) << team.fall();
  EXPECT_GT(team.extremes().bar_length_error, 0);
}

TEST(TeamSimulation, PushesWhileItIsToldTo) {
  Push push;
  push.amplitude = {0, 40, 0};
  push.period.setConstant(std::numeric_limits<double>::infinity());
  push.phase.setConstant(std::acos(0.0));
  push.start = 0.1;
  push.end = 0.2;
  QuadrupedScene scene(1);
  push.body = scene.id(mjOBJ_BODY, "robot0/trunk");
  TeamSimulation team = simulate(scene, scene.members(trotting(100)), {push});
  const auto sideways = [&] { return team.foot_forces(0).row(1).sum(); };
  walk(team, 100);
  EXPECT_NEAR(sideways(), 0, 1);
  walk(team, 95);
  EXPECT_NEAR(scene.data->qfrc_applied[1], 40, 1e-12);
  EXPECT_LT(sideways(), -10) << "the feet hold against it";
  walk(team, 105);
  EXPECT_EQ(scene.data->qfrc_applied[1], 0);
}

TEST(TeamSimulation, AFallEndsItAndSaysWhatFell) {
  QuadrupedScene scene(2);
  Push push;
  push.body = scene.id(mjOBJ_BODY, "robot1/trunk");
  push.amplitude = {0, 0, -400};
  push.period.setConstant(std::numeric_limits<double>::infinity());
  push.phase.setConstant(std::acos(0.0));
  push.start = 0.1;
  push.end = 5;
  TeamSimulation team = simulate(scene, scene.members(trotting(100)), {push});
  const int done = walk(team, 2000);
  ASSERT_TRUE(team.has_fallen());
  EXPECT_EQ(team.fall(), "robot1/trunk touched the ground");
  EXPECT_LT(done, 2000);
  EXPECT_NEAR(team.fall_time(), 1e-3 * done, 1e-9);
  EXPECT_EQ(team.run(10, targets_for(team)), 0);
  EXPECT_NEAR(team.time(), team.fall_time(), 1e-12);
}

TEST(TeamSimulation, SaysWhichRobotTippedOver) {
  QuadrupedScene scene(2);
  const double half = 0.6;  // turned by 1.2 rad about x, 69 degrees
  double* pose = scene.data->qpos + 19;
  pose[2] = 2;
  pose[3] = std::cos(half);
  pose[4] = std::sin(half);
  TeamSimulation team = simulate(scene, scene.members(trotting(100)));
  EXPECT_EQ(team.run(5, targets_for(team)), 1);
  EXPECT_EQ(team.fall(), "robot1 tipped over");
}

TEST(TeamSimulation, AStateThatIsNotFiniteEndsIt) {
  QuadrupedScene scene(1);
  TeamSimulation team = simulate(scene, scene.members(trotting(100)));
  std::filesystem::remove("MUJOCO_LOG.TXT");  // of other programs
  scene.data->qvel[2] = kNaN;
  EXPECT_LE(team.run(10, targets_for(team)), 1);
  EXPECT_EQ(team.fall(), "the simulation diverged");
  EXPECT_FALSE(std::filesystem::exists("MUJOCO_LOG.TXT"));
}

TEST(TeamSimulation, RefusesASecondThreadInWords) {
  QuadrupedScene scene(1);
  TeamSimulation team = simulate(scene, scene.members(trotting(100)));
  const std::vector<RobotTarget> targets = targets_for(team);
  const auto complaint = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const std::logic_error& error) {
      return error.what();
    }
    return "accepted";
  };
  std::atomic<bool> is_read{false}, may_go{false};
  std::thread reader([&] {
    const auto use = team.read("a viewer");
    is_read = true;
    may_go.wait(false);
  });
  while (!is_read) std::this_thread::yield();
  const std::string rule =
      ": another thread uses this team simulation; a team simulation serves one thread at a time";
  EXPECT_EQ(complaint([&] { team.run(1, targets); }), "run" + rule);
  EXPECT_EQ(complaint([&] { team.observe(0); }), "observe" + rule);
  EXPECT_EQ(complaint([&] { static_cast<void>(team.read("another viewer")); }), "accepted");
  may_go = true;
  may_go.notify_one();
  reader.join();
  EXPECT_EQ(team.run(1, targets), 1);
}

TEST(TeamSimulation, TargetsOfNoUseDoNotReachTheMotors) {
  QuadrupedScene scene(1);
  TeamSimulation team = simulate(scene, scene.members(trotting(100)));
  walk(team, 100);
  std::vector<RobotTarget> targets = targets_for(team);
  targets[0].forces.setConstant(kNaN);
  EXPECT_EQ(team.run(10, targets), 10);
  EXPECT_EQ(team.extremes().fallbacks, 10);
  for (int motor = 0; motor < scene.model->nu; ++motor)
    EXPECT_LE(std::abs(scene.data->ctrl[motor]), 30);
  EXPECT_EQ(walk(team, 100), 100) << team.fall();
  EXPECT_EQ(team.extremes().fallbacks, 10);
}

struct Refusal {
  std::string sentence;
  std::function<void(QuadrupedScene&, TeamMember&)> change;
};

TEST(TeamSimulation, NamesWhatDoesNotFitTheModel) {
  const Refusal refusals[] = {
      {"robot0: trunk is 0, but must be from 1 to 26", [](auto&, auto& m) { m.trunk = 0; }},
      {"robot0: trunk is 27, but must be from 1 to 26", [](auto&, auto& m) { m.trunk = 27; }},
      {"robot0: trunk is 2, but must be a body with a free joint",
       [](auto&, auto& m) { m.trunk = 2; }},
      {"robot0: joints[3] is 99, but must be from 0 to 25",
       [](auto&, auto& m) { m.joints[3] = 99; }},
      {"robot0: joints[0] is 0, but must be a hinge", [](auto&, auto& m) { m.joints[0] = 0; }},
      {"robot0: motors[11] is -1, but must be from 0 to 23",
       [](auto&, auto& m) { m.motors[11] = -1; }},
      {"robot0: number of motors is 11, but must be 12, one for each hinge of the robot",
       [](auto&, auto& m) { m.motors.pop_back(); }},
      {"robot0: number of joints is 13, but must be 12, one for each hinge of the robot",
       [](auto&, auto& m) { m.joints.push_back(1); }},
      {"robot0: number of foot_geoms is 3, but must be 4, one for each foot",
       [](auto&, auto& m) { m.foot_geoms.pop_back(); }},
      {"robot0: foot_geoms[2] is 1000, but must be from 0 to ",
       [](auto&, auto& m) { m.foot_geoms[2] = 1000; }},
      {"contact: touch_force is -1", [](auto&, auto& m) { m.control.contact.touch_force = -1; }},
      {"rate is -1, but must be", [](auto&, auto& m) { m.measurement.rate = -1; }},
  };
  for (const Refusal& refusal : refusals) {
    QuadrupedScene scene(2);
    std::vector<TeamMember> members = scene.members();
    refusal.change(scene, members[0]);
    try {
      simulate(scene, members);
      ADD_FAILURE() << "accepted, but " << refusal.sentence;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(refusal.sentence), std::string::npos)
          << error.what();
    }
  }
}

TEST(TeamSimulation, NamesWhatDoesNotFitTheTeam) {
  QuadrupedScene scene(1);
  const auto message_of = [](const auto& work) -> std::string {
    try {
      work();
    } catch (const std::logic_error& error) {
      return error.what();
    }
    return "";
  };
  Push push;
  push.body = 14;
  EXPECT_EQ(message_of([&] { simulate(scene, scene.members(), {push}); }),
            "team simulation: disturbance.body is 14, but must be from 1 to 13");
  push.body = 1;
  push.period[1] = 0;
  EXPECT_EQ(message_of([&] { simulate(scene, scene.members(), {push}); }),
            "team simulation: disturbance.period is 1 0 1, but must be positive on each axis");
  Tether tether;
  tether.body = 1;
  tether.slack = -2;
  EXPECT_EQ(message_of([&] { simulate(scene, scene.members(), {tether}); }),
            "team simulation: disturbance.slack is -2, but must be finite and not negative");
  EXPECT_EQ(message_of([&] { simulate(scene, scene.members(), {}, {{0, 7, 1.0}}); }),
            "team simulation: bar.second is 7, but must be from 0 to 0");
  TeamSimulation team = simulate(scene, scene.members());
  EXPECT_EQ(message_of([&] { team.run(1, {}); }),
            "team simulation: number of targets is 0, but must be 1, one for each robot");
  EXPECT_EQ(message_of([&] { team.run(-1, targets_for(team)); }),
            "team simulation: periods is -1, but must be at least 0");
  std::vector<RobotTarget> targets = targets_for(team);
  targets[0].forces.resize(3, 0);
  EXPECT_EQ(message_of([&] { team.run(1, targets); }),
            "team simulation: robot0's target: number of forces is 0, but must be 4, one a foot");
  EXPECT_EQ(message_of([&] { team.observe(1); }), "robot is 1; the team has 1");
  EXPECT_EQ(message_of([&] { team.foot_forces(-1); }), "robot is -1; the team has 1");
}

}  // namespace
}  // namespace palanquin
