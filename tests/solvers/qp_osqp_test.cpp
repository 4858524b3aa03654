#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>

#include "palanquin/solvers/qp_factory.hpp"
#include "support/dense_qp.hpp"
#include "support/random_stage_qp.hpp"

extern "C" void osqp_start_interrupt_listener();

namespace palanquin {
namespace {

using testing::DenseQp;
using testing::random_stage_qp;
using testing::RandomStageQpOptions;

QpSettings tight() {
  QpSettings settings;
  settings.osqp.absolute_tolerance = 1e-8;
  settings.osqp.relative_tolerance = 1e-8;
  settings.osqp.max_iterations = 50000;
  return settings;
}

RandomStageQpOptions with_hard_rows() {
  RandomStageQpOptions options;
  options.equality_rows = {0, 1};
  options.link_rows = {0, 1};
  options.inequality_rows = {0, 4};
  return options;
}

struct Solved {
  QpStatus status;
  StageQpSolution solution;
  PenaltyModel model;
};

Solved solve(const StageQp& qp, QpSolver& solver) {
  Solved s;
  s.solution.resize(qp);
  s.model.expand(qp, s.solution.w);
  s.status = solver.solve(qp, s.model, s.solution);
  return s;
}

TEST(Osqp, RunningOutOfIterationsIsInaccurateAndFinite) {
  QpSettings settings;
  settings.osqp.max_iterations = 1;
  settings.osqp.check_interval = 1;
  const StageQp qp = random_stage_qp(with_hard_rows(), 3);
  const Solved s = solve(qp, *make_qp_solver("osqp", settings));
  EXPECT_EQ(s.status, QpStatus::Inaccurate);
  EXPECT_TRUE(DenseQp::stack(s.solution.w).allFinite());
}

TEST(Osqp, StartsFromTheGivenSolution) {
  const StageQp qp = random_stage_qp(with_hard_rows(), 4);
  const Solved exact = solve(qp, *make_qp_solver("osqp", tight()));
  QpSettings settings = tight();
  settings.osqp.max_iterations = 10;
  const auto warm = make_qp_solver("osqp", settings);
  StageQpSolution solution = exact.solution;
  EXPECT_EQ(warm->solve(qp, exact.model, solution), QpStatus::Solved);
  const auto cold = make_qp_solver("osqp", settings);
  EXPECT_EQ(solve(qp, *cold).status, QpStatus::Inaccurate);
}

TEST(Osqp, AnUnboundedCostIsNotSolved) {
  RandomStageQpOptions options;
  options.penalty_rows = {0, 0};
  StageQp qp = random_stage_qp(options, 5);
  for (QpStage& stage : qp.stages)
    std::fill(stage.hessian.values.begin(), stage.hessian.values.end(), 0.0);
  EXPECT_FALSE(is_usable(solve(qp, *make_qp_solver("osqp")).status));
}

TEST(Osqp, PolishingSharpensTheSolution) {
  QpSettings settings;
  settings.osqp.absolute_tolerance = settings.osqp.relative_tolerance = 1e-3;
  const StageQp qp = random_stage_qp(with_hard_rows(), 6);
  const Solved rough = solve(qp, *make_qp_solver("osqp", settings));
  settings.osqp.polish = true;
  const Solved polished = solve(qp, *make_qp_solver("osqp", settings));
  EXPECT_LT(kkt_residual(qp, polished.model, polished.solution).max(),
            1e-3 * kkt_residual(qp, rough.model, rough.solution).max());
}

volatile std::sig_atomic_t interrupts = 0;

TEST(Osqp, LeavesInterruptsToTheProgram) {
  auto* before = std::signal(SIGINT, [](int) { interrupts = interrupts + 1; });
  osqp_start_interrupt_listener();  // what each of its solves begins with
  std::raise(SIGINT);
  std::signal(SIGINT, before);
  EXPECT_EQ(interrupts, 1);
}

}  // namespace
}  // namespace palanquin
