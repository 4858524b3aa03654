// A body from the hands that hold it.
#include "palanquin/control/estimation/held_body.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "support/allocation_counter.hpp"

namespace palanquin {
namespace {

Eigen::Quaterniond quaternion(const Vector4& q) { return {q[0], q[1], q[2], q[3]}; }

const std::vector<Grip> kGrips{{{0.1, 2, 0.05}, quaternion_exp({0.3, 0, 1})},
                               {{-0.2, -2, 0}, quaternion_exp({0, -0.5, 2})},
                               {{0.5, 0.3, -0.1}, quaternion_exp({0, 0, -1})}};

BodyMotion some_motion() {
  return {{1, -3, 0.6}, quaternion_exp({0.2, -0.1, 0.8}), {0.4, 0.1, -0.05}, {0.1, -0.2, 0.3}};
}

HandObservation hand_of(const BodyMotion& body, const Grip& grip) {
  const Eigen::Quaterniond turn = quaternion(body.orientation);
  const Vector3 arm = turn * grip.position, rate = turn * body.rate;
  return {body.position + arm, quaternion_multiply(body.orientation, grip.orientation),
          body.velocity + rate.cross(arm), rate};
}

std::vector<HandObservation> hands_of(const BodyMotion& body, std::size_t count) {
  std::vector<HandObservation> hands;
  for (std::size_t i = 0; i < count; ++i) hands.push_back(hand_of(body, kGrips[i]));
  return hands;
}

TEST(HeldBody, IsWhereItsHandsAre) {
  for (std::size_t count = 1; count <= kGrips.size(); ++count) {
    HeldBody held({kGrips.begin(), kGrips.begin() + static_cast<std::ptrdiff_t>(count)});
    const BodyMotion truth = some_motion();
    const BodyMotion& found = held.update(hands_of(truth, count));
    EXPECT_LT((found.position - truth.position).norm(), 1e-9);
    EXPECT_LT(quaternion_minus(found.orientation, truth.orientation).norm(), 1e-9);
    EXPECT_LT((found.velocity - truth.velocity).norm(), 1e-9);
    EXPECT_LT((found.rate - truth.rate).norm(), 1e-9);
  }
}

/// Two hands 4 m apart tell a turn better than each of them.
TEST(HeldBody, IsSurerThanEachOfItsHands) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const auto noise = [&](double deviation) -> Vector3 {
    const double x = normal(random), y = normal(random), z = normal(random);
    return deviation * Vector3(x, y, z);
  };
  HeldBody held({kGrips[0], kGrips[1]});
  const BodyMotion truth = some_motion();
  double place = 0, turn = 0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<HandObservation> hands = hands_of(truth, 2);
    for (HandObservation& hand : hands) {
      hand.position += noise(3e-3);
      hand.orientation = quaternion_plus(hand.orientation, noise(1e-2));
    }
    const BodyMotion& found = held.update(hands);
    place += (found.position - truth.position).squaredNorm() / kRuns;
    // About the vertical, across the line between the hands.
    const double yaw = quaternion_minus(found.orientation, truth.orientation).z();
    turn += yaw * yaw / kRuns;
  }
  EXPECT_LT(std::sqrt(place), 4.5e-3);  // 3 mm / sqrt(2) an axis
  EXPECT_LT(std::sqrt(turn), 2e-3);
}

TEST(HeldBody, AllocatesNothingAtRate) {
  HeldBody held(kGrips);
  const std::vector<HandObservation> hands = hands_of(some_motion(), kGrips.size());
  EXPECT_EQ(testing::allocations_during([&] { held.update(hands); }), 0);
}

TEST(HeldBody, RefusesNonsense) {
  EXPECT_THROW(HeldBody({}), std::invalid_argument);
  EXPECT_THROW(HeldBody(kGrips, 0), std::invalid_argument);
  EXPECT_THROW(HeldBody(kGrips).update({}), std::invalid_argument);
}

}  // namespace
}  // namespace palanquin
