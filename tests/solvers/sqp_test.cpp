// The SQP from C++: no allocation in a solve, and misuse.
#include "palanquin/solvers/sqp.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "support/allocation_counter.hpp"
#include "support/lowered_problem.hpp"

namespace palanquin {
namespace {

using testing::LoweredCase;
using SqpTest = testing::OnLoweredProblems;

SqpSettings settings_for(const std::string& qp) {
  SqpSettings settings;
  settings.qp = qp;
  return settings;
}

TEST_F(SqpTest, DoesNotAllocateInASolve) {
  for (const char* name : {"Hopper", "RigidBody"})
    for (const char* qp : {"structured", "ldl"})
      for (int max_iterations : {1, 50}) {
        const LoweredCase given = load(name);
        SqpSettings settings = settings_for(qp);
        settings.max_iterations = max_iterations;
        Sqp sqp(given.problem, given.horizon(), settings);
        const auto solve = [&] { sqp.solve(given.parameters, given.measured, given.guess); };
        solve();
        EXPECT_TRUE(is_usable(sqp.status())) << sqp.message();
        EXPECT_EQ(testing::allocations_during(solve), 0)
            << name << ", " << qp << ", " << max_iterations << " iterations";
      }
}

TEST_F(SqpTest, AnyNumberOfThreadsGivesTheSameBits) {
  for (const char* name : {"Hopper", "RigidBody"}) {
    const LoweredCase given = load(name);
    RowMatrix expected;
    for (int threads : {1, 2, 3}) {
      SqpSettings settings = settings_for("structured");
      settings.threads = threads;
      Sqp sqp(given.problem, given.horizon(), settings);
      for (int solve = 0; solve < 3; ++solve)
        EXPECT_TRUE(is_usable(sqp.solve(given.parameters, given.measured, given.guess)));
      if (threads == 1) expected = sqp.trajectory();
      EXPECT_EQ(sqp.trajectory(), expected) << name << ", " << threads << " threads";
    }
  }
}

TEST_F(SqpTest, CountsAllocationsAtAll) {
  const LoweredCase given = load("RigidBody");
  Sqp sqp(given.problem, given.horizon(), settings_for("ldl"));
  const long first = testing::allocations_during(
      [&] { sqp.solve(given.parameters, given.measured, given.guess); });
#if defined(__SANITIZE_ADDRESS__)
  EXPECT_EQ(first, 0);
#else
  EXPECT_GT(first, 0);
#endif
}

TEST_F(SqpTest, TheKernelLevelOfTheSettingsIsTheOnlyOne) {
  const LoweredCase given = load("RigidBody");
  SqpSettings settings = settings_for("structured");
  ASSERT_EQ(setenv("PALANQUIN_KERNELS", "z80", 1), 0);  // whoever takes the automatic level throws
  EXPECT_THROW(Sqp(given.problem, given.horizon(), settings), std::invalid_argument);
  settings.qp_settings.structured.kernels = KernelLevel::X86_64;
  Sqp sqp(given.problem, given.horizon(), settings);
  EXPECT_EQ(sqp.solve(given.parameters, given.measured, given.guess), Status::Converged);
  ASSERT_EQ(unsetenv("PALANQUIN_KERNELS"), 0);
}

TEST_F(SqpTest, ExactHessiansNeedTheirFunctions) {
  const LoweredCase given = load("RigidBody");
  SqpSettings settings = settings_for("ldl");
  settings.hessian = HessianKind::Exact;
  EXPECT_THROW(Sqp(given.problem, given.horizon(), settings), std::invalid_argument);
}

TEST_F(SqpTest, MisuseThrowsAndTheSolverRemainsUsable) {
  const LoweredCase given = load("RigidBody");
  Sqp sqp(given.problem, given.horizon(), settings_for("ldl"));
  EXPECT_THROW(sqp.solve(given.parameters.topRows(3), given.measured, given.guess),
               std::invalid_argument);
  EXPECT_THROW(sqp.solve(given.parameters, given.measured.head(4), given.guess),
               std::invalid_argument);
  EXPECT_THROW(sqp.solve(given.parameters, given.measured, given.guess.leftCols(2)),
               std::invalid_argument);
  EXPECT_EQ(sqp.solve(given.parameters, given.measured, given.guess), Status::Converged);
}

TEST_F(SqpTest, RefusesWorkAndAnswersWhileAnotherThreadHasIt) {
  const LoweredCase given = load("Hopper");
  Sqp sqp(given.problem, given.horizon(), settings_for("ldl"));
  sqp.solve(given.parameters, given.measured, given.guess);
  {
    const auto reading = sqp.read("test");
    EXPECT_THROW(sqp.solve(given.parameters, given.measured, given.guess), std::logic_error);
    EXPECT_THROW(sqp.solve_plan(given.parameters, given.measured, given.guess), std::logic_error);
    EXPECT_THROW(sqp.prepare(given.parameters, given.measured, given.guess), std::logic_error);
    EXPECT_THROW(sqp.feedback(given.measured), std::logic_error);
    EXPECT_THROW(sqp.feedback_plan(given.measured), std::logic_error);
    EXPECT_THROW(sqp.set_policy("friction", Policy{}), std::logic_error);
    EXPECT_EQ(sqp.status(), sqp.plan().status);  // readers do not exclude each other
  }
  EXPECT_NO_THROW(sqp.solve(given.parameters, given.measured, given.guess));
}

TEST(SingleUser, NamesTheCallThatItRefuses) {
  const SingleUser user("solver");
  const auto use = user.change("solve");
  for (bool reads : {false, true}) try {
      (void)(reads ? user.read("history") : user.change("prepare"));
      ADD_FAILURE();
    } catch (const std::logic_error& error) {
      EXPECT_NE(std::string(error.what()).find(reads ? "history: " : "prepare: "),
                std::string::npos);
    }
}

TEST_F(SqpTest, PlansOutliveTheirSolver) {
  const LoweredCase given = load("Hopper");
  auto sqp = std::make_unique<Sqp>(given.problem, given.horizon(), settings_for("ldl"));
  const Plan plan = sqp->solve_plan(given.parameters, given.measured, given.guess);
  EXPECT_TRUE(plan.is_usable());
  EXPECT_EQ(plan.trajectory, sqp->trajectory());
  const auto violations = plan.violations();
  RowMatrix later = given.parameters;
  later.topRows(given.horizon()) = given.parameters.bottomRows(given.horizon());
  sqp->solve(later, given.measured, given.guess);
  EXPECT_EQ(plan.violations(), violations);
  sqp.reset();
  EXPECT_EQ(plan.violations(), violations);
  EXPECT_EQ(plan.evaluate().total(), plan.evaluation.total());
}

TEST_F(SqpTest, FailedPlansHaveNoNumbers) {
  LoweredCase given = load("RigidBody");
  given.guess(2, 0) = std::numeric_limits<double>::infinity();
  Sqp sqp(given.problem, given.horizon(), settings_for("ldl"));
  EXPECT_TRUE(std::isnan(sqp.evaluation().total()));  // not solved yet
  const Plan plan = sqp.solve_plan(given.parameters, given.measured, given.guess);
  EXPECT_EQ(plan.status, Status::NonFinite);
  EXPECT_FALSE(plan.is_usable());
  EXPECT_TRUE(std::isnan(plan.evaluation.cost));
  EXPECT_TRUE(std::isnan(plan.evaluation.equality_max));
  EXPECT_TRUE(std::isnan(sqp.model_cost()));
}

}  // namespace
}  // namespace palanquin
