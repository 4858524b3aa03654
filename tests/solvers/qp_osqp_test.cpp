#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "palanquin/solvers/qp_factory.hpp"
#include "support/dense_qp.hpp"
#include "support/random_stage_qp.hpp"

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

TEST(Osqp, HardRowsMeetTheKktConditions) {
  const auto solver = make_qp_solver("osqp", tight());
  int active = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const StageQp qp = random_stage_qp(with_hard_rows(), seed);
    const Solved s = solve(qp, *solver);
    ASSERT_EQ(s.status, QpStatus::Solved);
    EXPECT_LE(kkt_residual(qp, s.model, s.solution).max(), 1e-5);
    for (std::size_t k = 0; k < qp.stages.size(); ++k) {
      Eigen::VectorXd row = qp.stages[k].inequality_value;
      qp.stages[k].inequality_jacobian.multiply_add(s.solution.w[k].data(), row.data());
      const Eigen::VectorXd& multiplier = s.solution.inequality_multiplier[k];
      for (Eigen::Index i = 0; i < row.size(); ++i) {
        EXPECT_LE(row[i], 1e-6);
        EXPECT_GE(multiplier[i], -1e-6);
        EXPECT_LE(std::abs(row[i] * multiplier[i]), 1e-5);
        active += multiplier[i] > 1e-3;
      }
    }
  }
  EXPECT_GT(active, 20);  // or the conditions above would say little
}

TEST(Osqp, HardRowsThatContradictEachOtherAreInfeasible) {
  StageQp qp = random_stage_qp(with_hard_rows(), 2);
  QpStage& stage = qp.stages[1];
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2, stage.nw());
  rows(0, stage.nx) = 1.0;
  rows(1, stage.nx) = -1.0;
  stage.inequality_jacobian = SparseBlock::from_dense(rows);
  stage.inequality_value = Eigen::Vector2d(1.0, 1.0);  // u <= -1 and u >= 1
  EXPECT_EQ(solve(qp, *make_qp_solver("osqp")).status, QpStatus::PrimalInfeasible);
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

}  // namespace
}  // namespace palanquin
