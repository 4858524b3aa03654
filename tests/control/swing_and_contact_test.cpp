#include <gtest/gtest.h>

#include <cmath>

#include "palanquin/control/whole_body/contact_monitor.hpp"
#include "palanquin/control/whole_body/swing.hpp"

namespace palanquin {
namespace {

TEST(Swing, StartsAndEndsAtRestOnItsFootholds) {
  const Vector3 from(0.1, -0.2, 0.02), to(0.3, -0.15, 0.07);
  for (const auto& [progress, end] : {std::pair{0.0, from}, {1.0, to}}) {
    const PointTarget target = swing_target(from, to, 0.06, progress, 0.2);
    EXPECT_LT((target.position - end).norm(), 1e-12);
    EXPECT_LT(target.velocity.norm(), 1e-12);
    EXPECT_LT(target.acceleration.norm(), 1e-9);
  }
  EXPECT_NEAR(swing_target(from, to, 0.06, 0.5, 0.2).position.z(), 0.07 + 0.06, 1e-12);
}

TEST(Swing, VelocityAndAccelerationAreDerivatives) {
  const Vector3 from(0.1, -0.2, 0.02), to(0.3, -0.15, 0.07);
  const double duration = 0.25, h = 1e-5;
  for (const double s : {0.1, 0.37, 0.5, 0.81}) {
    const auto at = [&](double shift) {
      return swing_target(from, to, 0.06, s + shift / duration, duration);
    };
    const PointTarget now = at(0);
    EXPECT_LT(((at(h).position - at(-h).position) / (2 * h) - now.velocity).norm(), 1e-6);
    EXPECT_LT(((at(h).velocity - at(-h).velocity) / (2 * h) - now.acceleration).norm(), 1e-4);
  }
}

TEST(Foothold, IsSymmetricInMarchAndAheadInARun) {
  FootholdInput input;
  input.hip = {1, 2, 0.3};
  input.velocity = input.commanded_velocity = Vector3::Zero();
  input.ground = 0.05;
  EXPECT_EQ(raibert_foothold(input), Vector3(1, 2, 0.05));
  // A pendulum whose mean velocity is the commanded one stands half a stance ahead.
  const double a = 0.1 * std::sqrt(9.81 / input.height);
  input.commanded_velocity = {0.5, 0, 0};
  input.velocity = a / std::tanh(a) * input.commanded_velocity;
  input.remaining = 0.1;
  EXPECT_NEAR(raibert_foothold(input).x(), 1 + 0.1 * input.velocity.x() + 0.05, 1e-12);
  input.velocity.x() = 20;  // thrown: no further than a leg reaches
  EXPECT_NEAR(raibert_foothold(input).x() - (1 + 2.0), input.farthest, 1e-12);
}

TEST(ContactMonitor, FollowsTheScheduleOnFlatGround) {
  ContactMonitor monitor;
  monitor.update(true, 0, 60, 1e-3);
  EXPECT_EQ(monitor.phase(), LegPhase::Stance);
  monitor.update(false, 0, 60, 1e-3);  // due to swing, still touching
  EXPECT_EQ(monitor.phase(), LegPhase::Swing);
  monitor.update(false, 0.1, 60, 1e-3);
  EXPECT_EQ(monitor.phase(), LegPhase::Swing);
  monitor.update(true, 0, 60, 1e-3);
  EXPECT_EQ(monitor.phase(), LegPhase::Stance);
  EXPECT_FALSE(monitor.is_early() || monitor.is_late());
}

TEST(ContactMonitor, EndsTheSwingEarlyWhenTheFootHitsTheGround) {
  ContactMonitor monitor;
  monitor.update(false, 0, 0, 1e-3);
  monitor.update(false, 0.7, 20, 1e-3);
  EXPECT_EQ(monitor.phase(), LegPhase::Stance);
  EXPECT_TRUE(monitor.is_early());
  monitor.update(true, 0, 60, 1e-3);
  EXPECT_FALSE(monitor.is_early());
}

TEST(ContactMonitor, ReachesWhenTheGroundIsLate) {
  ContactMonitor monitor;
  monitor.update(false, 0, 0, 1e-3);
  monitor.update(true, 0, 0, 1e-3);
  EXPECT_EQ(monitor.phase(), LegPhase::Reaching);
  EXPECT_TRUE(monitor.is_late());
  monitor.update(true, 0, 20, 1e-3);
  EXPECT_EQ(monitor.phase(), LegPhase::Stance);
  EXPECT_TRUE(monitor.has_changed());
}

TEST(ContactMonitor, LosesTheGroundOnlyAfterAWhile) {
  ContactMonitor monitor;
  monitor.update(true, 0, 60, 1e-3);
  for (int i = 0; i < 14; ++i) monitor.update(true, 0, 0, 1e-3);
  EXPECT_EQ(monitor.phase(), LegPhase::Stance);
  for (int i = 0; i < 3; ++i) monitor.update(true, 0, 0, 1e-3);
  EXPECT_EQ(monitor.phase(), LegPhase::Reaching);
}

}  // namespace
}  // namespace palanquin
