// The SQP from C++: no allocation in a solve, and misuse.
#include "palanquin/solvers/sqp.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace palanquin
