// Solvers in several threads: side by side, met by a second one, and their plans read elsewhere.
#include <gtest/gtest.h>

#include <functional>
#include <stdexcept>
#include <thread>
#include <vector>

#include "palanquin/solvers/sqp.hpp"
#include "support/lowered_problem.hpp"

namespace palanquin {
namespace {

using testing::LoweredCase;
using SqpThreadsTest = testing::OnLoweredProblems;

constexpr int kRounds = 20;

SqpSettings two_threads() {
  SqpSettings settings;
  settings.threads = 2;
  return settings;
}

void together(const std::vector<std::function<void()>>& works) {
  std::vector<std::thread> threads;
  threads.reserve(works.size());
  for (const auto& work : works) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
}

/// The case with a measurement a little to the side.
LoweredCase moved(LoweredCase given, double by) {
  given.measured[0] += by;
  return given;
}

RowMatrix in_one_phase(Sqp& sqp, const LoweredCase& given) {
  sqp.solve(given.parameters, given.measured, given.guess);
  return sqp.trajectory();
}

RowMatrix in_two_phases(Sqp& sqp, const LoweredCase& given) {
  if (!sqp.prepare(given.parameters, given.measured, given.guess)) return {};
  return sqp.feedback_plan(given.measured).trajectory;
}

TEST_F(SqpThreadsTest, SolversOfOneProblemWorkSideBySide) {
  const LoweredCase given = load("RigidBody");
  for (const auto& solve : {in_one_phase, in_two_phases}) {
    const auto work = [&](double by, std::vector<RowMatrix>& found) {
      const LoweredCase mine = moved(given, by);
      Sqp sqp(given.problem, given.horizon(), two_threads());
      for (int round = 0; round < kRounds; ++round) found.push_back(solve(sqp, mine));
    };
    std::vector<RowMatrix> expected[2], found[2];
    for (const std::size_t i : {0, 1}) work(0.01 * static_cast<double>(i), expected[i]);
    together({[&] { work(0.0, found[0]); }, [&] { work(0.01, found[1]); }});
    for (const std::size_t i : {0, 1}) EXPECT_EQ(found[i], expected[i]);
    EXPECT_NE(expected[0], expected[1]);
    EXPECT_GT(expected[0].front().size(), 0);
  }
}

TEST_F(SqpThreadsTest, ASolverThatIsSharedAnswersRightOrRefuses) {
  const LoweredCase given = load("Hopper");
  Sqp shared(given.problem, given.horizon(), two_threads());
  const auto work = [&](double by) {
    const LoweredCase mine = moved(given, by);
    Sqp own(given.problem, given.horizon(), two_threads());
    const RowMatrix expected = in_one_phase(own, mine);
    for (int round = 0; round < kRounds; ++round) try {
        const Plan plan = shared.solve_plan(mine.parameters, mine.measured, mine.guess);
        EXPECT_EQ(plan.trajectory, expected);
      } catch (const std::logic_error& error) {
        EXPECT_NE(std::string(error.what()).find("another thread uses this solver"),
                  std::string::npos);
      }
  };
  together({[&] { work(0.0); }, [&] { work(0.01); }});
}

TEST_F(SqpThreadsTest, PlansAreReadWhileTheSolverGoesOn) {
  const LoweredCase given = load("Hopper");
  Sqp sqp(given.problem, given.horizon(), two_threads());
  const Plan plan = sqp.solve_plan(given.parameters, given.measured, given.guess);
  const auto expected = plan.violations();
  const auto read = [&] {
    for (int round = 0; round < kRounds; ++round) EXPECT_EQ(plan.violations(), expected);
  };
  const auto go_on = [&] {
    for (int round = 0; round < kRounds; ++round) in_two_phases(sqp, moved(given, 0.001 * round));
  };
  together({read, read, go_on});
}

}  // namespace
}  // namespace palanquin
