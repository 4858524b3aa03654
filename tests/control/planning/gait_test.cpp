// Contact as a function of time, with changes under way.
#include "palanquin/control/planning/gait.hpp"

#include <gtest/gtest.h>

namespace palanquin::planning {
namespace {

const Gait kTrot{"trot", 0.5, {0.5, 0.5, 0.5, 0.5}, {0.0, 0.5, 0.5, 0.0}};
const Gait kStand{"stand", 0.5, {1.0, 1.0, 1.0, 1.0}, {0.0, 0.0, 0.0, 0.0}};
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
  for (double phase = 0.0; phase < 2.0; phase += 0.01)
    for (int f = 0; f < kFeet; ++f) {
      const Stance s = kTrot.stance(f, phase);
      EXPECT_NEAR(s.end - s.begin, 0.25, 1e-12);
      EXPECT_GT(s.end, -1e-6);
      EXPECT_EQ(s.begin < 1e-6, kTrot.stands(f, phase)) << phase;
    }
}

TEST(Gait, IsOfAnyNumberOfFeet) {
  const Gait gait{"three", 0.4, {0.6, 0.6, 0.6}, {0, 1.0 / 3, 2.0 / 3}};
  for (int i = 0; i < 40; ++i) {
    int standing = 0;
    for (int foot = 0; foot < 3; ++foot) standing += gait.stands(foot, 0.025 * i);
    EXPECT_GE(standing, 1);
    EXPECT_LE(standing, 2);
  }
  for (const int foot : {-1, 3}) EXPECT_THROW(gait.stands(foot, 0.0), std::out_of_range);
  EXPECT_TRUE(Gait().stands(7, 0.3)) << "without entries all feet stand";
}

TEST(Gait, ExplainsWhatIsWrong) {
  const auto with = [](auto change) {
    Gait gait = kTrot;
    change(gait);
    return gait.explain_invalid();
  };
  EXPECT_EQ(with([](Gait&) {}), "");
  EXPECT_EQ(Gait().explain_invalid(), "");
  EXPECT_EQ(with([](Gait& g) { g.period = 0; }), "period is 0, but must be finite and positive");
  EXPECT_EQ(with([](Gait& g) { g.duty[2] = 1.5; }), "duty[2] is 1.5, but must be from 0 to 1");
  EXPECT_EQ(with([](Gait& g) { g.offset.pop_back(); }),
            "number of offsets is 3, but must be 4, as that of duties");
  EXPECT_EQ(with([](Gait& g) { g.duty.assign(4, 0.0); }),
            "duty is 0, but must be over 0 for one foot at least");
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

TEST(GaitClock, TrotsInDiagonalPairsFromWhenItIsToldTo) {
  GaitClock clock(kStand);
  clock.change({"trot", 0.4, {0.5, 0.5, 0.5, 0.5}, {0.0, 0.5, 0.5, 0.0}}, 0.5);
  for (int foot = 0; foot < kFeet; ++foot) EXPECT_TRUE(clock.stands(foot, 0.49));
  for (int cycle = 0; cycle < 5000; ++cycle) {  // rounding must not move an event
    const double start = 0.5 + 0.4 * cycle;
    for (const double into : {0.0, 0.1, 0.199}) {
      EXPECT_EQ(clock.contacts(start + into), (Contacts{true, false, false, true}));
      EXPECT_NEAR(clock.swing(1, start + into).progress, into / 0.2, 1e-4);
      EXPECT_EQ(clock.contacts(start + 0.2 + into), (Contacts{false, true, true, false}));
    }
  }
}

TEST(GaitClock, StancesAndSwingsMeetTheContacts) {
  GaitClock clock(kTrot);
  clock.change({"own", 0.9, {0.6, 0.7, 0.8, 0.5}, {0.1, 0.9, 0.35, 0.6}}, 1.4);
  for (int foot = 0; foot < kFeet; ++foot)
    for (double time = 1.9; time < 4; time += 0.0137) {
      const Stance stance = clock.stance(foot, time);
      const Swing swing = clock.swing(foot, time);
      EXPECT_EQ(clock.stands(foot, time), stance.begin <= time + 1e-6);
      EXPECT_TRUE(clock.stands(foot, 0.5 * (stance.begin + stance.end)));
      EXPECT_FALSE(clock.stands(foot, stance.end + 1e-4));
      if (clock.stands(foot, time)) {
        EXPECT_EQ(swing.progress, 0);
        EXPECT_NEAR(swing.duration + stance.end - stance.begin, 0.9, 1e-9);
      } else {
        EXPECT_NEAR(time + swing.remaining(), stance.begin, 2e-6);
      }
    }
}

/// A foot that a new gait has in the midst of its swing still has all of its way before it.
TEST(GaitClock, ASwingThatAChangeBeginsTakesWhatIsLeft) {
  GaitClock clock(kStand);
  clock.change({"own", 1.0, {0.75, 0.75}, {0.1, 0.5}}, 2.0);  // foot 0 is to land at phase 0.1
  ASSERT_FALSE(clock.stands(0, 2.0));
  EXPECT_NEAR(clock.swing(0, 2.0).progress, 0, 1e-9);
  EXPECT_NEAR(clock.swing(0, 2.0).duration, 0.1, 1e-5);
  EXPECT_NEAR(clock.swing(0, 2.05).progress, 0.5, 1e-4);
  EXPECT_NEAR(clock.swing(0, 2.05).duration, 0.1, 1e-5);
  EXPECT_NEAR(clock.swing(0, 2.98).duration, 0.25, 1e-5) << "the next one is a whole one";
}

TEST(GaitClock, AFootThatLandsEarlyStandsToTheEndOfItsStance) {
  GaitClock clock(kTrot), other(kTrot);
  clock.sense(1, 0.2, true);  // due at 0.25
  EXPECT_FALSE(clock.stands(1, 0.19));
  for (const double time : {0.2, 0.24, 0.25, 0.49}) EXPECT_TRUE(clock.stands(1, time)) << time;
  EXPECT_FALSE(clock.stands(1, 0.5));
  EXPECT_FALSE(clock.is_due(1, 0.24));
  EXPECT_NEAR(clock.stance(1, 0.22).begin, 0.2, 1e-12);
  EXPECT_NEAR(clock.stance(1, 0.22).end, 0.5, 1e-5);
  EXPECT_EQ(clock.contacts(0.22), (Contacts{true, true, false, true}));
  // Told so again it is the same, and one that is told the same agrees.
  clock.sense(1, 0.21, true);
  other.sense(1, 0.2, true);
  for (double time = 0.2; time < 1.0; time += 0.01) {
    EXPECT_EQ(clock.contacts(time), other.contacts(time));
    EXPECT_EQ(clock.stance(1, time).begin, other.stance(1, time).begin);
  }
  clock.sense(1, 0.22, false);  // it bounced
  EXPECT_FALSE(clock.stands(1, 0.22));
  EXPECT_TRUE(clock.stands(1, 0.25));
}

TEST(GaitClock, AFootThatIsLateIsCountedOnSoon) {
  GaitClock clock(kTrot);
  clock.sense(1, 0.25, false, 0.03);
  EXPECT_FALSE(clock.stands(1, 0.27));
  EXPECT_TRUE(clock.is_due(1, 0.27));
  EXPECT_TRUE(clock.stands(1, 0.28));
  EXPECT_NEAR(clock.stance(1, 0.26).begin, 0.28, 1e-12);
  EXPECT_NEAR(clock.stance(1, 0.26).end, 0.5, 1e-5);
  clock.sense(1, 0.27, false, 0.03);  // still not
  EXPECT_FALSE(clock.stands(1, 0.29));
  EXPECT_TRUE(clock.stands(1, 0.3));
  clock.sense(1, 0.285, true);
  EXPECT_TRUE(clock.stands(1, 0.285));
  EXPECT_FALSE(clock.stands(1, 0.5)) << "it lifts off when it is due to";
}

TEST(GaitClock, AChangeOfGaitEndsWhatFeetDidOtherwise) {
  GaitClock clock(kTrot);
  clock.sense(0, 0.1, false, 1.0);
  clock.change(kStand, 0.15, true);
  EXPECT_FALSE(clock.stands(0, 0.14));
  EXPECT_TRUE(clock.stands(0, 0.15));
  GaitClock soon(kTrot);
  soon.change({"swing first", 0.5, {0.5, 0.5, 0.5, 0.5}, {0.4, 0.4, 0.4, 0.4}}, 0.01);  // at 0.5
  soon.sense(0, 0.4, true);  // the trot's touchdown at 0.5 is not to come
  EXPECT_TRUE(soon.stands(0, 0.49));
  EXPECT_FALSE(soon.stands(0, 0.51));
}

}  // namespace
}  // namespace palanquin::planning
