// Links between planners: delays, losses, and messages that age along their own plan.
#include "palanquin/control/planning/link.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "palanquin/control/planning/rotations.hpp"

namespace palanquin::planning {
namespace {

/// Of a robot whose foot forces are 1 + step N, over three intervals.
Message message(int step, bool is_held = false) {
  Message m;
  m.step = step;
  m.operating.setIdentity();
  m.states = RowMatrix::Zero(4, 12);
  m.inputs = RowMatrix::Constant(3, 12, 1.0 + step);
  m.bars.push_back(RowMatrix(Eigen::Vector3d(0.0, 1.0, 2.0)));
  m.dual = RowMatrix::Zero(3, 12);
  m.feet = RowMatrix::Zero(4, 3);
  m.is_held = is_held;
  return m;
}

/// Which sample's message is heard at each, after a greeting.
std::vector<int> heard(const LinkSettings& settings) {
  Link link(settings);
  link.send(message(0, true));
  std::vector<int> steps;
  for (int step = 0; step < 200; ++step) {
    steps.push_back(link.receive(step).step);
    link.send(message(step));
  }
  return steps;
}

TEST(Link, DeliversAsLateAsItIsTold) {
  for (const int delay : {1, 3}) {
    const std::vector<int> steps = heard({.delay = delay});
    for (int step = 0; step < 200; ++step) EXPECT_EQ(steps[step], std::max(step - delay, 0));
  }
}

TEST(Link, KeepsTheNewestThatItHeard) {
  const std::vector<int> steps = heard({.loss = 0.5, .seed = 4});
  int fresh = 0;
  for (int step = 0; step < 200; ++step) fresh += steps[step] == std::max(step - 1, 0);
  EXPECT_GT(fresh, 70);
  EXPECT_LT(fresh, 130);
  EXPECT_TRUE(std::is_sorted(steps.begin(), steps.end()));
  EXPECT_EQ(steps, heard({.loss = 0.5, .seed = 4}));
  EXPECT_NE(steps, heard({.loss = 0.5, .seed = 5}));
}

TEST(Link, AlwaysDeliversItsGreeting) {
  EXPECT_EQ(heard({.loss = 1.0}), std::vector<int>(200, 0));
  EXPECT_THROW(Link({}).receive(0), std::logic_error);
}

TEST(Link, AddsItsBiasFromASampleOn) {
  const Link link({.bias = 20.0, .bias_from = 2});
  EXPECT_EQ(link.bias(1), 0.0);
  EXPECT_EQ(link.bias(2), 20.0);
}

TEST(Message, AgesAlongItsOwnPlan) {
  Message sent = message(0);
  for (int k = 0; k < 4; ++k) {
    sent.states(k, 0) = k;
    sent.states(k, 8) = 0.1 * k;
  }
  Link link({.delay = 2});
  link.send(sent);
  const Message aged = link.receive(2);
  EXPECT_EQ(aged.states.col(0), Eigen::Vector4d(2, 3, 3, 3));
  EXPECT_TRUE(aged.states.col(8).isApprox(Eigen::Vector4d(0, 0.1, 0.1, 0.1), 1e-12));
  EXPECT_TRUE(aged.operating.isApprox(rotation_exp({0, 0, 0.2}), 1e-12));
  EXPECT_EQ(aged.bars[0].col(0), Eigen::Vector3d(2, 2, 2));
  EXPECT_EQ(aged.inputs.col(0), Eigen::Vector3d(1, 0, 0));  // nothing beyond the plan
  EXPECT_EQ(message(0, true).aged(2).inputs.col(0), Eigen::Vector3d(1, 1, 1));  // but held
}

TEST(Rotations, LogOfExpIsTheVector) {
  for (const Vector3& v :
       {Vector3(0, 0, 0), Vector3(1e-8, -2e-8, 0), Vector3(0.3, -0.2, 0.9), Vector3(2, 1, -2)}) {
    const Matrix3 R = rotation_exp(v);
    EXPECT_TRUE((R.transpose() * R).isIdentity(1e-12));
    EXPECT_NEAR(R.determinant(), 1.0, 1e-12);
    EXPECT_TRUE(rotation_log(R).isApprox(v, 1e-9) || (rotation_log(R) - v).norm() < 1e-15);
  }
}

}  // namespace
}  // namespace palanquin::planning
