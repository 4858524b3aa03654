#include "palanquin/plant/measurement.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/simple_quadruped.hpp"

namespace palanquin {
namespace {

TEST(Measurement, IsDelayedAndRepeatsItsSeed) {
  MeasurementSettings settings;
  settings.delay = 3;
  Measurement exact(settings);
  RobotState state = testing::standing_state();
  for (int period = 0; period < 10; ++period) {
    state.base_position.x() = period;
    EXPECT_EQ(exact.update(state).base_position.x(), std::max(0, period - 3));
  }
  settings.position = 0.01;
  settings.joint_velocity = 0.1;
  Measurement first(settings), second(settings);
  settings.seed = 1;
  Measurement third(settings);
  EXPECT_EQ(first.update(state).base_position, second.update(state).base_position);
  EXPECT_NE(first.current().base_position, third.update(state).base_position);
}

}  // namespace
}  // namespace palanquin
