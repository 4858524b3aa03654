#include "palanquin/core/penalty.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace palanquin {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::string kind_name(PolicyKind kind) {
  switch (kind) {
    case PolicyKind::Hard:
      return "Hard";
    case PolicyKind::C2Penalty:
      return "C2Penalty";
    case PolicyKind::SquaredHinge:
      return "SquaredHinge";
    case PolicyKind::RelaxedBarrier:
      return "RelaxedBarrier";
  }
  return "Unknown";
}

class EveryPenalty : public ::testing::TestWithParam<PolicyKind> {
 protected:
  Policy policy_{GetParam(), 420.0, 0.1};
};

TEST_P(EveryPenalty, SlopeAndCurvatureAreDerivatives) {
  const double step = 1e-5;
  // Points off the kinks, where a central difference means something for every kind.
  for (double h = -0.255; h < 0.3; h += 0.02) {
    const PenaltyValue s = evaluate_penalty(policy_, h);
    const PenaltyValue left = evaluate_penalty(policy_, h - step);
    const PenaltyValue right = evaluate_penalty(policy_, h + step);
    EXPECT_NEAR(s.slope, (right.value - left.value) / (2 * step), 1e-5 * (1 + s.slope)) << h;
    EXPECT_NEAR(s.curvature, (right.slope - left.slope) / (2 * step), 1e-5 * (1 + s.curvature))
        << h;
  }
}

TEST_P(EveryPenalty, IsConvexAndNonDecreasing) {
  double last_slope = 0.0;
  for (double h = -1.0; h < 1.0; h += 0.01) {
    const PenaltyValue s = evaluate_penalty(policy_, h);
    EXPECT_GE(s.slope, last_slope) << h;
    EXPECT_GE(s.curvature, 0.0) << h;
    last_slope = s.slope;
  }
}

TEST_P(EveryPenalty, VanishesAsFarAsItSaysAndNoFurther) {
  const double end = vanishes_until(policy_);
  for (double below : {end, end - 1e-12, end - 1.0}) {
    if (!std::isfinite(below)) continue;
    const PenaltyValue s = evaluate_penalty(policy_, below);
    EXPECT_EQ(std::max({std::abs(s.value), std::abs(s.slope), std::abs(s.curvature)}), 0.0);
  }
  const double above = std::isfinite(end) ? end + 1e-3 : -1e3;
  EXPECT_NE(evaluate_penalty(policy_, above).value, 0.0);
}

TEST_P(EveryPenalty, NaNIsNotTakenForAnInactiveRow) {
  const PenaltyValue s = evaluate_penalty(policy_, kNaN);
  EXPECT_TRUE(std::isnan(s.value));
  EXPECT_TRUE(std::isnan(s.slope));
}

INSTANTIATE_TEST_SUITE_P(Kinds, EveryPenalty,
                         ::testing::Values(PolicyKind::C2Penalty, PolicyKind::SquaredHinge,
                                           PolicyKind::RelaxedBarrier),
                         [](const auto& kind) { return kind_name(kind.param); });

class SmoothPenalty : public EveryPenalty {};

TEST_P(SmoothPenalty, IsTwiceContinuouslyDifferentiableAtItsSeams) {
  const double nudge = 1e-12;
  for (double seam : {-policy_.smoothing, policy_.smoothing}) {
    const PenaltyValue left = evaluate_penalty(policy_, seam - nudge);
    const PenaltyValue right = evaluate_penalty(policy_, seam + nudge);
    EXPECT_NEAR(left.value, right.value, 1e-7);
    EXPECT_NEAR(left.slope, right.slope, 1e-6);
    EXPECT_NEAR(left.curvature, right.curvature, 1e-4);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, SmoothPenalty,
                         ::testing::Values(PolicyKind::C2Penalty, PolicyKind::RelaxedBarrier),
                         [](const auto& kind) { return kind_name(kind.param); });

TEST(C2Penalty, VanishesBelowTheSmoothingAndIsQuadraticAbove) {
  const Policy policy{PolicyKind::C2Penalty, 42.0, 1e-2};
  EXPECT_EQ(evaluate_penalty(policy, -1e-2).value, 0.0);
  EXPECT_NEAR(evaluate_penalty(policy, 0.3).value, 42.0 * (0.09 + 1e-4 / 3.0), 1e-12);
  EXPECT_NEAR(evaluate_penalty(policy, 0.0).value, 42.0 * 1e-4 / 6.0, 1e-15);
}

// Why the odd terms of the printed eq. 15 are mended: with their signs it jumps at +-eps.
TEST(C2Penalty, ThePrintedFormJumpsAtBothSeams) {
  const double k = 42.0, eps = 1e-2;
  const auto printed = [&](double h) {
    return k * (-h * h * h / (6 * eps) + h * h / 2 - eps * h / 2 + eps * eps / 6);
  };
  const Policy policy{PolicyKind::C2Penalty, k, eps};
  const double jump = 4.0 / 3.0 * k * eps * eps;
  EXPECT_NEAR(evaluate_penalty(policy, eps).value - printed(eps), jump, 1e-12);
  EXPECT_NEAR(printed(-eps) - evaluate_penalty(policy, -eps).value, jump, 1e-12);
}

TEST(HardPolicy, CostsNothing) {
  const Policy policy{PolicyKind::Hard, 420.0, 1e-3};
  EXPECT_EQ(evaluate_penalty(policy, 5.0).value, 0.0);
  EXPECT_EQ(evaluate_penalty(policy, 5.0).slope, 0.0);
}

TEST(Policy, ExplainsWhatIsWrong) {
  EXPECT_EQ(Policy{}.explain_invalid(), "");
  EXPECT_EQ((Policy{PolicyKind::C2Penalty, -1.0, 1e-3}).explain_invalid(),
            "stiffness is -1, but must be finite and not negative");
  EXPECT_NE((Policy{PolicyKind::C2Penalty, kNaN, 1e-3}).explain_invalid(), "");
  EXPECT_EQ((Policy{PolicyKind::RelaxedBarrier, 1.0, 0.0}).explain_invalid(),
            "smoothing is 0, but must be finite and positive");
  EXPECT_NE((Policy{static_cast<PolicyKind>(9), 1.0, 1.0}).explain_invalid().find("kind is 9"),
            std::string::npos);
}

TEST(Policy, ParametersThatAKindDoesNotUseAreNotChecked) {
  EXPECT_EQ((Policy{PolicyKind::SquaredHinge, 1.0, kNaN}).explain_invalid(), "");
  EXPECT_EQ((Policy{PolicyKind::Hard, kNaN, kNaN}).explain_invalid(), "");
}

}  // namespace
}  // namespace palanquin
