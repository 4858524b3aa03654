// Stamped plans: sampled on the manifold, with first-order feedback, on a thread of their own.
#include "palanquin/control/planning/stamped_plan.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "palanquin/control/planning/planner_thread.hpp"
#include "support/saved_planner.hpp"

namespace palanquin::planning {
namespace {

using StampedPlanTest = palanquin::testing::OnSavedPlanners;
constexpr Velocity kCommand{0.4, 0.0, 0.1};

StampedPlan settled(TeamPlanner& planner, double time = 0.0) {
  planner.settle(time, planner.nominal_state(planner.reference()), kCommand);
  StampedPlan plan(planner);
  plan.take(planner, true);
  return plan;
}

TEST_F(StampedPlanTest, SamplesAreKnotsAtKnotsAndUnitQuaternionsBetween) {
  const auto planner = load("planner");
  const StampedPlan plan = settled(*planner, 3.0);
  PlanSampler sampler(planner->problem());
  Eigen::VectorXd z(planner->problem().nz());
  for (Eigen::Index k = 0; k < planner->horizon(); ++k) {
    sampler.sample(plan, 3.0 + static_cast<double>(k) * planner->spacing(), z.data());
    EXPECT_LT((z - plan.knots.row(k).transpose()).cwiseAbs().maxCoeff(), 1e-9);
  }
  sampler.sample(plan, 3.0 + 1.5 * planner->spacing(), z.data());
  for (const BlockInfo& q : planner->problem().quaternions())
    EXPECT_NEAR(z.segment(q.offset, 4).norm(), 1.0, 1e-12);
  const Eigen::VectorXd middle = 0.5 * (plan.knots.row(1) + plan.knots.row(2));
  const int p = planner->slots().bodies[0][0];
  EXPECT_LT((z.segment(p, 3) - middle.segment(p, 3)).norm(), 1e-12);
}

TEST_F(StampedPlanTest, FeedbackPredictsHowAPlanAnswersTheMeasurement) {
  const auto planner = load("planner");
  const StampedPlan plan = settled(*planner);
  ASSERT_EQ(plan.gain.rows(), planner->problem().ndz());
  PlanSampler sampler(planner->problem());
  Eigen::VectorXd measured = plan.knots.row(0), answered(measured.size());
  const int velocity = planner->slots().bodies[0][2];
  measured[velocity + 1] += 1e-4;
  sampler.sample(plan, 0.0, measured.data(), answered.data());

  TeamState state = planner->nominal_state({});
  planner->slots().read_bodies(measured.data(), state.bodies.data());
  planner->solve(0.0, state, kCommand);
  const Eigen::VectorXd solved = planner->solver().trajectory().row(0);
  double change = 0.0, error = 0.0;
  for (int i : planner->slots().forces) {
    change = std::max(change, (solved - plan.knots.row(0).transpose()).segment(i, 3).norm());
    error = std::max(error, (solved - answered).segment(i, 3).norm());
  }
  EXPECT_GT(change, 1e-4);
  EXPECT_LT(error, 1e-2 * change);
}

TEST_F(StampedPlanTest, StatesAreCarriedAsThePlanMoves) {
  const auto planner = load("planner");
  const StampedPlan plan = settled(*planner);
  PlanSampler sampler(planner->problem());
  Eigen::VectorXd from(planner->problem().nz()), to = from;
  sampler.sample(plan, 0.01, from.data());
  sampler.sample(plan, 0.03, to.data());
  sampler.carry(plan, 0.01, 0.03, from.data());
  for (const BlockInfo& b : planner->problem().states())
    EXPECT_LT((from - to).segment(b.offset, b.size).norm(), 1e-9) << b.name;
}

/// Hands over measurements until `count` plans have come; returns the last one.
const StampedPlan& plans_of(PlannerThread& thread, const TeamState& state, long count) {
  const StampedPlan* plan = &thread.latest();
  for (int n = 0; plan->number < count && n < 2000 && *thread.failure() == '\0'; ++n) {
    thread.measure(1e-3 * n, state, kCommand);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    if (thread.has_news()) plan = &thread.latest();
  }
  return *plan;
}

TEST_F(StampedPlanTest, AThreadPlansForWhenThePlanIsInUse) {
  const auto planner = load("planner");
  const TeamState state = planner->nominal_state({});
  settled(*planner);
  PlannerThreadSettings settings;
  settings.latency = 0.005;
  settings.deadline = 60.0;
  PlannerThread thread(*planner, settings);
  EXPECT_EQ(thread.latest().number, 0);
  const StampedPlan& plan = plans_of(thread, state, 5);
  ASSERT_GE(plan.number, 5) << thread.failure();
  EXPECT_TRUE(plan.is_usable);
  EXPECT_FALSE(plan.must_stop);
  EXPECT_NEAR(std::remainder(plan.time - 0.005, 1e-3), 0.0, 1e-9);
}

TEST_F(StampedPlanTest, AThreadCountsOnFeetThatHaveTheGround) {
  const auto planner = load("planner");
  const TeamState state = planner->nominal_state({});
  settled(*planner);
  Flags grounded(1, planner->team().feet());
  for (int i = 0; i < grounded.size(); ++i)
    grounded(i) = planner->clock(i / kFeet).is_due(i % kFeet, 0.2);
  const int swings = grounded(1) ? 0 : 1;  // feet 0 and 1 take turns
  grounded(swings) = true;
  grounded(1 - swings) = false;
  PlannerThread thread(*planner, {.deadline = 60.0});
  thread.measure(0.2, state, kCommand, grounded);
  while (!thread.has_news() && *thread.failure() == '\0') std::this_thread::yield();
  const StampedPlan& plan = thread.latest();
  ASSERT_EQ(plan.number, 1) << thread.failure();
  EXPECT_TRUE(plan.contacts(0, swings));
  EXPECT_FALSE(plan.contacts(0, 1 - swings));
}

TEST_F(StampedPlanTest, MissedDeadlinesEndWithASafeStop) {
  const auto planner = load("planner");
  const TeamState state = planner->nominal_state({});
  settled(*planner);
  PlannerThreadSettings settings;
  settings.deadline = 1e-9;
  settings.stop_after = 3;
  PlannerThread thread(*planner, settings);
  const StampedPlan& plan = plans_of(thread, state, 3);
  ASSERT_GE(plan.number, 3) << thread.failure();
  EXPECT_TRUE(plan.must_stop);
  EXPECT_EQ(plan.events[0].kind, EventKind::MissedDeadline);
  EXPECT_EQ(plan.events[1].kind, EventKind::SafeStop);
  EXPECT_NE(plan.events[1].reason("").find("in a row"), std::string::npos);
}

TEST_F(StampedPlanTest, WhatEndsAThreadIsTold) {
  const auto planner = load("planner");
  TeamState state = planner->nominal_state({});
  settled(*planner);
  state.bodies(0, 0) = std::nan("");
  PlannerThread thread(*planner, {});
  plans_of(thread, state, 1);
  EXPECT_NE(std::string(thread.failure()).find("finite"), std::string::npos);
}

TEST_F(StampedPlanTest, SettingsSayWhatIsWrong) {
  const auto planner = load("planner");
  PlannerThreadSettings settings;
  settings.latency = -1.0;
  EXPECT_THROW(PlannerThread(*planner, settings), std::invalid_argument);
  settings = {};
  settings.stop_after = 0;
  EXPECT_NE(settings.explain_invalid().find("stop_after"), std::string::npos);
}

}  // namespace
}  // namespace palanquin::planning
