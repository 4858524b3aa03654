// A team's planner in closed loop with its nominal model: no allocation, restarts, ditches.
#include "palanquin/control/planning/team_planner.hpp"

#include <gtest/gtest.h>

#include "nominal_loop.hpp"
#include "support/allocation_counter.hpp"
#include "support/saved_planner.hpp"

namespace palanquin::planning {
namespace {

using TeamPlannerTest = palanquin::testing::OnSavedPlanners;
constexpr Velocity kCommand{0.4, 0.0, 0.0};

/// Runs for so many periods of 1/90 s; returns the allocations of all plans, whose knots' contacts,
/// and so dimensions, change many times.
long allocations_of(TeamPlanner& planner, NominalLoop& loop, int ticks) {
  long count = 0;
  int changes = 0;
  for (int n = 0; n < ticks; ++n) {
    const Flags contacts = planner.instant().contacts;
    count += palanquin::testing::allocations_during(
        [&] { planner.solve(loop.time(), loop.state(), kCommand); });
    EXPECT_TRUE(planner.has_usable_plan()) << loop.time() << ": " << planner.solver().message();
    changes += contacts == planner.instant().contacts ? 0 : 1;
    loop.advance(1.0 / 90.0);
  }
  EXPECT_GT(changes, ticks / 5);
  return count;
}

TEST_F(TeamPlannerTest, PlansWithoutAllocation) {
  for (const char* name : {"planner", "planner-observing", "planner-candidates"}) {
    const auto planner = load(name);
    NominalLoop loop(*planner);
    planner->settle(0.0, loop.state(), kCommand);
    allocations_of(*planner, loop, 90);  // more than a cycle of the gait: all knots were seen
    EXPECT_EQ(allocations_of(*planner, loop, 90), 0) << name;
    EXPECT_GT(loop.state().bodies(0, 0), 0.7);
  }
}

TEST_F(TeamPlannerTest, NoFootStepsIntoADitch) {
  const auto planner = load("planner-candidates");
  NominalLoop loop(*planner);
  planner->settle(0.0, loop.state(), kCommand);
  double deepest = 0.0;
  for (int n = 0; n < 4 * 90; ++n) {
    planner->solve(loop.time(), loop.state(), kCommand);
    loop.advance(1.0 / 90.0);
    for (int i = 0; i < planner->team().feet(); ++i)
      if (planner->instant().contacts(0, i))
        deepest = std::max(deepest,
                           planner->ground().ditches().deepest(loop.state().feet.row(i).head<2>()));
  }
  EXPECT_LT(deepest, 0.005);
  EXPECT_GT(loop.state().bodies(0, 0), 1.4);
}

TEST_F(TeamPlannerTest, FeetStartWhereTheLastPlanLandsThem) {
  const auto planner = load("planner");
  NominalLoop loop(*planner);
  planner->settle(0.0, loop.state(), kCommand);
  const Eigen::Index last_with_feet = planner->horizon() - 1;
  int landings = 0;
  for (int n = 0; n < 90; ++n) {
    loop.advance(1.0 / 90.0);  // a third of a knot's distance
    const RowMatrix plan = planner->solver().trajectory();
    const Instant then = planner->instant();
    planner->solve(loop.time(), loop.state(), kCommand);
    for (Eigen::Index k = 0; k <= last_with_feet; ++k) {
      const double at = (loop.time() - then.time) / planner->spacing() + static_cast<double>(k);
      const auto before = static_cast<Eigen::Index>(at + 1e-6);
      if (before + 1 > last_with_feet) break;
      for (int i = 0; i < planner->team().feet(); ++i) {
        if (!planner->instant().contacts(k, i) || then.contacts(before, i) ||
            !then.contacts(before + 1, i))
          continue;
        const int slot = planner->slots().feet[static_cast<std::size_t>(i)];
        EXPECT_EQ(planner->guess().row(k).segment<3>(slot), plan.row(before + 1).segment<3>(slot));
        ++landings;
      }
    }
  }
  EXPECT_GT(landings, 20);
}

TEST_F(TeamPlannerTest, FailuresKeepThePlanAndEndWithARestart) {
  const auto planner = load("planner");
  const TeamState state = planner->nominal_state({});
  planner->settle(0.0, state, kCommand);
  TeamState lost = state;
  lost.bodies(1, 0) = 1e200;
  planner->solve(0.01, lost, kCommand);
  EXPECT_FALSE(planner->has_usable_plan());
  ASSERT_EQ(planner->events().size(), 1u);
  EXPECT_EQ(planner->events()[0].kind, EventKind::KeptPlan);
  planner->solve(0.02, state, kCommand);
  EXPECT_TRUE(planner->has_usable_plan());
  ASSERT_FALSE(planner->events().empty());
  EXPECT_EQ(planner->events()[0].kind, EventKind::Restart);
  EXPECT_EQ(planner->events()[0].time, 0.02);
}

TEST_F(TeamPlannerTest, TwoPhasesAnswerTheMeasurement) {
  const auto planner = load("planner");
  TeamState state = planner->nominal_state({});
  planner->settle(0.0, state, kCommand);
  EXPECT_THROW(planner->feedback(state), std::logic_error);
  ASSERT_TRUE(planner->prepare(0.01, state, kCommand));
  state.bodies(1, 7) += 0.01;
  planner->feedback(state);
  EXPECT_TRUE(planner->has_usable_plan());
  TeamState planned = state;
  planner->slots().read_bodies(planner->solver().trajectory().data(), planned.bodies.data());
  EXPECT_EQ(planned.bodies, state.bodies);
  EXPECT_THROW(load("planner-candidates")->prepare(0.0, state, kCommand), std::logic_error);
}

TEST_F(TeamPlannerTest, CountsOnFeetThatLandedAndNotOnFeetThatAreLate) {
  const auto planner = load("planner");
  const TeamState state = planner->nominal_state({});
  planner->settle(0.0, state, kCommand);
  Flags grounded = Flags::Constant(1, planner->team().feet(), false);
  for (int i = 0; i < grounded.size(); ++i)
    grounded(i) = planner->clock(i / kFeet).is_due(i % kFeet, 0.22);
  const auto swings = planner->clock(0).is_due(1, 0.22) ? 0 : 1, stands = 1 - swings;
  grounded(swings) = true;
  grounded(stands) = false;
  planner->sense(0.22, grounded);
  planner->solve(0.221, state, kCommand);
  ASSERT_TRUE(planner->has_usable_plan());
  EXPECT_TRUE(planner->instant().contacts(0, swings));
  EXPECT_FALSE(planner->instant().contacts(0, stands));
  const RowMatrix& plan = planner->solver().trajectory();
  const TeamSlots& slots = planner->slots();
  EXPECT_TRUE(plan.row(0).segment<3>(slots.forces[static_cast<std::size_t>(stands)]).isZero());
  EXPECT_FALSE(plan.row(0).segment<3>(slots.forces[static_cast<std::size_t>(swings)]).isZero());
  EXPECT_THROW(planner->sense(0.23, Flags::Constant(1, 3, true)), std::invalid_argument);
}

TEST_F(TeamPlannerTest, RefusesWhatMakesNoSense) {
  const auto planner = load("planner");
  const TeamState state = planner->nominal_state({});
  planner->solve(1.0, state, kCommand);
  EXPECT_THROW(planner->solve(0.5, state, kCommand), std::invalid_argument);
  EXPECT_THROW(planner->solve(std::nan(""), state, kCommand), std::invalid_argument);
  EXPECT_THROW(planner->solve(2.0, {state.bodies.topRows(2), state.feet}, kCommand),
               std::invalid_argument);
  EXPECT_THROW(planner->set_ditches(RowMatrix::Ones(3, 4)), std::invalid_argument);
  EXPECT_THROW(planner->expect_wrenches(RowMatrix::Zero(2, 18)), std::invalid_argument);
}

TEST_F(TeamPlannerTest, ARestartForgetsGaitsAndWrenches) {
  const auto planner = load("planner"), fresh = load("planner");
  const TeamState state = planner->nominal_state({});
  planner->solve(0.0, state, kCommand);
  for (int r = 0; r < planner->team().robots(); ++r)
    planner->clock(r).change(Gait{"stand", 0.5, {1, 1, 1, 1}, {}}, 0.0, true);
  planner->expect_wrenches(RowMatrix::Constant(planner->horizon() + 1, 18, 5.0));
  planner->solve(0.1, state, kCommand);
  EXPECT_TRUE(planner->instant().contacts.all());
  planner->restart();
  planner->solve(0.0, state, kCommand);
  fresh->solve(0.0, state, kCommand);
  EXPECT_EQ(planner->solver().trajectory(), fresh->solver().trajectory());
}

}  // namespace
}  // namespace palanquin::planning
