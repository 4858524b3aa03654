// Robots in MuJoCo that know nothing but their sensors.
#include "palanquin/plant/robot_senses.hpp"

#include <gtest/gtest.h>

#include "palanquin/plant/team_simulation.hpp"
#include "support/allocation_counter.hpp"
#include "support/quadruped_scene.hpp"

namespace palanquin {
namespace {

constexpr double kPeriod = 1e-3, kGravity = 9.81;

RobotSensorSettings usual() {
  RobotSensorSettings s;
  s.gyro = 2e-4;
  s.gyro_bias = 5e-3;
  s.accelerometer = 2e-3;
  s.accelerometer_bias = 5e-2;
  s.joint_position = 1e-3;
  s.joint_velocity = 5e-2;
  s.place_rate = 50;
  s.place_position = 2e-3;
  s.place_heading = 5e-3;
  s.place_latency = 0.02;
  return s;
}

struct Trot {
  explicit Trot(const EstimationSettings& estimation) {
    RobotControlSettings control;
    control.gait.period = 0.4;
    control.gait.duty.assign(4, 0.5);
    control.gait.offset = {0, 0.5, 0.5, 0};
    control.gait_start = 0.3;
    std::vector<TeamMember> members = scene.members(control);
    members[0].estimation = estimation;
    team = std::make_unique<TeamSimulation>(scene.model.get(), scene.data.get(), members,
                                            std::vector<int>{}, std::vector<BarSites>{},
                                            std::vector<Disturbance>{});
  }
  /// On by 5 ms under a planner that looks no step ahead; `each` after every period.
  template <class Each>
  void run(int periods, Each each) {
    for (int i = 0; i < periods && !team->has_fallen(); ++i) {
      if (i % 5 == 0) aim();
      team->run(1, {target});
      each();
    }
  }
  void aim() {
    const RobotController& controller = team->controller(0);
    target.time = team->time();
    target.position = team->observe(0).position;
    target.position.z() = 0.27;
    target.velocity = target.commanded_velocity = {0.2, 0, 0};
    target.forces.setZero(3, 4);
    for (int foot = 0; foot < 4; ++foot)
      target.forces(2, foot) = controller.will_bear(foot, team->time());
    target.forces *= controller.model().mass() * kGravity / target.forces.sum();
  }

  testing::QuadrupedScene scene;
  std::unique_ptr<TeamSimulation> team;
  RobotTarget target;
};

TEST(RobotSenses, EstimatesItsStateWhileItTrots) {
  Trot trot({usual(), {}, false});
  trot.run(6000, [] {});
  EXPECT_FALSE(trot.team->has_fallen()) << trot.team->fall();
  const EstimationErrors errors = trot.team->estimation_errors(0);
  EXPECT_GT(trot.scene.data->qpos[0], 0.8);
  EXPECT_LT(errors.position, 5e-3);
  EXPECT_LT(errors.orientation, 1e-2);
  EXPECT_LT(errors.velocity, 5e-2);
  EXPECT_GT(errors.position, 1e-4);
}

/// Noise looks like touchdowns of feet in the air; those must not count as standing.
TEST(RobotSenses, IsNotMisledByForcesThatAreNone) {
  EstimationSettings settings{usual(), {}, false};
  settings.sensors.joint_velocity = 0.4;
  Trot trot(settings);
  trot.run(6000, [] {});
  EXPECT_FALSE(trot.team->has_fallen()) << trot.team->fall();
  EXPECT_LT(trot.team->estimation_errors(0).orientation, 1e-2);
  EXPECT_LT(trot.team->estimation_errors(0).position, 1e-2);
}

TEST(RobotSenses, DriftsWithoutFixes) {
  EstimationSettings settings{usual(), {}, false};
  settings.sensors.place_rate = 0;
  Trot trot(settings);
  trot.run(6000, [] {});
  EXPECT_FALSE(trot.team->has_fallen()) << trot.team->fall();
  EXPECT_LT(trot.team->estimation_errors(0).position, 0.1);  // after more than 0.8 m
}

TEST(RobotSenses, SeesForcesOnFeetInTorques) {
  Trot trot({RobotSensorSettings{}, {}, false});
  double sum = 0, error = 0;
  trot.run(3000, [&] {
    sum += trot.team->foot_forces(0).squaredNorm();
    error += (trot.team->known_forces(0) - trot.team->foot_forces(0)).squaredNorm();
  });
  EXPECT_LT(std::sqrt(error / sum), 0.3);
  EXPECT_GT(error, 0);
}

TEST(RobotSenses, FeelsItsFeetIfTheyHaveSensors) {
  Trot trot({usual(), {}, true});
  trot.run(100, [&] { EXPECT_EQ(trot.team->known_forces(0), trot.team->foot_forces(0)); });
}

TEST(RobotSenses, AllocatesNothingAtRate) {
  Trot trot({usual(), {}, false});
  trot.run(300, [] {});
  const std::vector<RobotTarget> targets{trot.target};
  EXPECT_EQ(testing::allocations_during([&] { trot.team->run(30, targets); }), 0);
}

RobotState moving(int period) {
  RobotState state;
  const double time = kPeriod * period;
  state.base_velocity = {0.5, 0, 0.2};
  state.base_position = time * state.base_velocity;
  state.base_orientation = quaternion_exp({0, 0, 0.6 * time});
  state.base_rate = {0, 0, 0.6};
  state.joint_positions.setConstant(12, 0.123456);
  state.joint_velocities.setConstant(12, 0.5);
  return state;
}

SensorReading read_after(const RobotSensorSettings& settings, int periods) {
  RobotSensors sensors(settings, kPeriod);
  sensors.start(moving(0));
  SensorReading reading;
  for (int i = 1; i <= periods; ++i)
    reading = sensors.update(moving(i), Eigen::VectorXd::Constant(12, 3.0));
  return reading;
}

TEST(RobotSensors, SayTheTruthWhenTheyArePerfect) {
  const SensorReading reading = read_after({}, 10);
  EXPECT_LT((reading.imu.rate - Vector3(0, 0, 0.6)).norm(), 1e-9);
  EXPECT_LT((reading.imu.specific_force - Vector3(0, 0, kGravity)).norm(), 1e-9);
  EXPECT_EQ(reading.joint_positions, moving(10).joint_positions);
  EXPECT_EQ(reading.torques[0], 3);
  EXPECT_FALSE(reading.place);
}

TEST(RobotSensors, HaveNoiseOfTheirDensity) {
  RobotSensorSettings settings;
  settings.gyro = 1e-3;
  settings.accelerometer = 1e-2;
  RobotSensors sensors(settings, kPeriod);
  sensors.start(moving(0));
  constexpr int kSamples = 20000;
  double gyro = 0, accelerometer = 0;
  for (int i = 1; i <= kSamples; ++i) {
    const SensorReading& reading = sensors.update(moving(i), Eigen::VectorXd::Zero(12));
    gyro += (reading.imu.rate - Vector3(0, 0, 0.6)).squaredNorm() / 3;
    accelerometer += (reading.imu.specific_force - Vector3(0, 0, kGravity)).squaredNorm() / 3;
  }
  EXPECT_NEAR(std::sqrt(kPeriod * gyro / kSamples), settings.gyro, 0.02 * settings.gyro);
  EXPECT_NEAR(std::sqrt(kPeriod * accelerometer / kSamples), settings.accelerometer,
              0.02 * settings.accelerometer);
}

TEST(RobotSensors, HaveBiasesThatWander) {
  RobotSensorSettings settings;
  settings.gyro_bias = 0.01;
  settings.accelerometer_walk = 0.1;
  const SensorReading first = read_after(settings, 1), later = read_after(settings, 1000);
  EXPECT_GT((first.imu.rate - Vector3(0, 0, 0.6)).norm(), 1e-3);
  EXPECT_LT((first.imu.rate - later.imu.rate).norm(), 1e-9);
  EXPECT_GT((first.imu.specific_force - later.imu.specific_force).norm(), 1e-2);
}

TEST(RobotSensors, RoundToTheEncodersSteps) {
  RobotSensorSettings settings;
  settings.joint_resolution = 0.01;
  EXPECT_NEAR(read_after(settings, 1).joint_positions[0], 0.12, 1e-12);
}

TEST(RobotSensors, AreAlikeForASeedAndDifferForAnother) {
  RobotSensorSettings settings = usual();
  const SensorReading first = read_after(settings, 7), again = read_after(settings, 7);
  settings.seed = 1;
  const SensorReading other = read_after(settings, 7);
  EXPECT_EQ(first.imu.rate, again.imu.rate);
  EXPECT_EQ(first.joint_positions, again.joint_positions);
  EXPECT_NE(first.imu.rate, other.imu.rate);
  EXPECT_NE(first.joint_positions, other.joint_positions);
}

TEST(RobotSensors, TellThePlaceLate) {
  RobotSensorSettings settings;
  settings.place_rate = 100;
  settings.place_latency = 0.025;
  RobotSensors sensors(settings, kPeriod);
  sensors.start(moving(0));
  std::vector<int> came;
  for (int i = 1; i <= 60; ++i) {
    const SensorReading& reading = sensors.update(moving(i), Eigen::VectorXd::Zero(12));
    if (!reading.place) continue;
    came.push_back(i);
    EXPECT_EQ(reading.place_age, 25);
    EXPECT_EQ(reading.place->position, moving(i - 25).base_position);
  }
  EXPECT_EQ(came, (std::vector<int>{35, 45, 55}));
}

TEST(RobotSensors, RefuseNonsense) {
  RobotSensorSettings settings;
  settings.place_latency = 2;
  EXPECT_THROW(RobotSensors(settings, kPeriod), std::invalid_argument);
  settings = {};
  settings.gyro = -1;
  EXPECT_THROW(RobotSensors(settings, kPeriod), std::invalid_argument);
  EXPECT_THROW(RobotSensors({}, 0), std::invalid_argument);
}

}  // namespace
}  // namespace palanquin
