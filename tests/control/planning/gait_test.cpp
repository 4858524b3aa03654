// Contact as a function of time, with changes under way.
#include "palanquin/control/planning/gait.hpp"

#include <gtest/gtest.h>

namespace palanquin::planning {
namespace {

const Gait kTrot{"trot", 0.5, {0.5, 0.5, 0.5, 0.5}, {0.0, 0.5, 0.5, 0.0}};
const Gait kStand{"stand", 0.5, {1.0, 1.0, 1.0, 1.0}, {}};
using Contacts = std::array<bool, kFeet>;

TEST(Gait, DiagonalPairsTakeTurns) {
  EXPECT_EQ(kTrot.stands(0.1), (Contacts{true, false, false, true}));
  EXPECT_EQ(kTrot.stands(0.6), (Contacts{false, true, true, false}));
  EXPECT_EQ(kTrot.stands(-0.9), kTrot.stands(0.1));
}

TEST(Gait, AnInstantJustBeforeATouchdownCountsAsAfterIt) {
  EXPECT_EQ(kTrot.stands(1.0 - 1e-9), kTrot.stands(0.0));
  EXPECT_EQ(kTrot.stands(0.5 - 1e-9), kTrot.stands(0.5));
}

TEST(Gait, StancesHoldTheirPhase) {
  for (double phase = 0.0; phase < 2.0; phase += 0.01) {
    const Stances s = kTrot.stances(phase);
    const Contacts stands = kTrot.stands(phase);
    for (std::size_t f = 0; f < kFeet; ++f) {
      EXPECT_NEAR(s.end[f] - s.begin[f], 0.25, 1e-12);
      EXPECT_GT(s.end[f], -1e-6);
      EXPECT_EQ(s.begin[f] < 1e-6, stands[f]) << phase;
    }
  }
}

TEST(GaitClock, AChangeWaitsForTheEndOfTheCycleAndBeginsAtPhaseZero) {
  GaitClock clock(kTrot);
  EXPECT_DOUBLE_EQ(clock.change(kStand, 1.2), 1.5);
  EXPECT_EQ(clock.gait(1.49).name, "trot");
  EXPECT_EQ(clock.contacts(1.6), (Contacts{true, true, true, true}));
  EXPECT_DOUBLE_EQ(clock.change(kTrot, 2.1), 2.1);  // a standing robot has no cycle to end
  EXPECT_NEAR(clock.phase(2.2), 0.2, 1e-12);
}

TEST(GaitClock, LaterChangesAreDropped) {
  GaitClock clock(kStand);
  clock.change(kTrot, 5.0);
  clock.change(kTrot, 1.0, true);
  EXPECT_EQ(clock.contacts(1.1), (Contacts{true, false, false, true}));
  EXPECT_NEAR(clock.phase(5.1), 0.2, 1e-12);
}

}  // namespace
}  // namespace palanquin::planning
