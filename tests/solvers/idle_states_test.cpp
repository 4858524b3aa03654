// Remembered states that nothing depends on, behind the others: limits of rates that are not met.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "palanquin/solvers/qp_structured.hpp"
#include "support/kernel_levels.hpp"
#include "support/random_stage_qp.hpp"
#include "support/sparse_kkt.hpp"

namespace palanquin {
namespace {

using Eigen::MatrixXd;
using testing::RandomStageQpOptions;
using testing::relative_difference;

constexpr double kTolerance = 1e-8;

/// Columns of zeros after the first `at` ones.
SparseBlock with_columns(const SparseBlock& block, int at, int count) {
  const MatrixXd before = block.dense();
  MatrixXd after = MatrixXd::Zero(block.rows, before.cols() + count);
  after.leftCols(at) = before.leftCols(at);
  after.rightCols(before.cols() - at) = before.rightCols(before.cols() - at);
  return SparseBlock::from_dense(after);
}

/// `qp` whose states end with its first `count` inputs of the knot before, and rows
/// u - previous u as penalties behind the others.
StageQp with_memory(StageQp qp, int count) {
  for (int k = 0; k <= qp.horizon(); ++k) {
    QpStage& stage = qp.stages[k];
    const int nx = stage.nx, nw = stage.nw() + count;
    MatrixXd rows = MatrixXd::Zero(stage.penalty_jacobian.rows + count, nw);
    rows.topRows(stage.penalty_jacobian.rows) =
        with_columns(stage.penalty_jacobian, nx, count).dense();
    rows.block(stage.penalty_jacobian.rows, nx, count, count) = -MatrixXd::Identity(count, count);
    rows.block(stage.penalty_jacobian.rows, nx + count, count, count).setIdentity();
    stage.penalty_jacobian = SparseBlock::from_dense(rows);
    stage.penalty_value.conservativeResize(rows.rows());
    stage.penalty_value.tail(count).setConstant(0.3);
    stage.penalty_policy.resize(rows.rows());
    MatrixXd hessian = MatrixXd::Zero(nw, nw);
    const MatrixXd before = stage.hessian.dense();
    const int others = nw - nx - count;
    hessian.topLeftCorner(nx, nx) = before.topLeftCorner(nx, nx);
    hessian.bottomLeftCorner(others, nx) = before.bottomLeftCorner(others, nx);
    hessian.bottomRightCorner(others, others) = before.bottomRightCorner(others, others);
    SparseBlock lower;
    lower.begin(nw);
    for (int j = 0; j < nw; ++j) {
      for (int i = j; i < nw; ++i)
        if (i == j || hessian(i, j) != 0.0) lower.push(i, hessian(i, j));
      lower.end_column();
    }
    stage.hessian = lower;
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(nw);
    gradient.head(nx) = stage.gradient.head(nx);
    gradient.tail(others) = stage.gradient.tail(others);
    stage.gradient = gradient;
    stage.equality_jacobian = with_columns(stage.equality_jacobian, nx, count);
    stage.nx += count;
    if (k == qp.horizon()) break;
    const int next = qp.stages[k + 1].nx;
    MatrixXd dynamics = MatrixXd::Zero(next + count, nw);
    dynamics.topRows(next) = with_columns(stage.dynamics, nx, count).dense();
    dynamics.block(next, nx + count, count, count).setIdentity();
    stage.dynamics = SparseBlock::from_dense(dynamics);
    MatrixXd implicit = MatrixXd::Zero(next + count, next + count);
    implicit.topLeftCorner(next, next) = stage.implicit.dense();
    stage.implicit = SparseBlock::from_dense(implicit);
    stage.offset.conservativeResize(next + count);
    stage.offset.tail(count).setConstant(0.2);
  }
  qp.initial_state.conservativeResize(qp.stages[0].nx);
  qp.initial_state.tail(count).setConstant(-0.7);
  ++qp.structure_revision;
  return qp;
}

class IdleStates : public ::testing::TestWithParam<KernelLevel> {
 protected:
  static constexpr int kCount = 3;

  StageQp draw(unsigned seed, bool equality_rows = false) {
    RandomStageQpOptions options;
    options.horizon = 6;
    options.nx = {4, 9};
    options.nu = {kCount + 1, 10};
    if (equality_rows) options.equality_rows = {0, 2};
    return testing::random_stage_qp(options, seed);
  }

  /// Slopes and curvatures of the first rows; those over memory push where `lives` says so.
  PenaltyModel model_of(const StageQp& qp, const std::vector<int>& lives) {
    PenaltyModel model;
    model.resize(qp);
    for (int k = 0; k <= qp.horizon(); ++k) {
      model.slope[k].setConstant(0.1);
      model.curvature[k].setConstant(2.0);
      model.slope[k].tail(kCount).setZero();
      model.curvature[k].tail(kCount).setZero();
    }
    for (int k : lives) {
      model.slope[k].tail(kCount - 1)[0] = 0.5;
      model.curvature[k].tail(kCount - 1)[0] = 3.0;
    }
    return model;
  }

  void expect_right(StructuredQpSolver& solver, const StageQp& qp, const PenaltyModel& model,
                    const StageQpSolution& found) {
    StageQpSolution solution = found;
    solver.find_dynamics_multipliers(solution);
    const StageQpSolution expected = testing::solve_kkt_by_lu(qp, model);
    EXPECT_LE(relative_difference(solution.w, expected.w), kTolerance);
    EXPECT_LE(relative_difference(solution.dynamics_multiplier, expected.dynamics_multiplier),
              kTolerance);
    EXPECT_LE(relative_difference(solution.equality_multiplier, expected.equality_multiplier),
              kTolerance);
    if (has_equality_rows(qp)) return;  // which the factors hold by stiffness
    const Eigen::VectorXd slope =
        solver.value_hessian(0) * qp.initial_state + solver.value_gradient(0);
    EXPECT_LE((slope - expected.dynamics_multiplier[0]).norm(), 1e-7 * (1.0 + slope.norm()));
  }

  static bool has_equality_rows(const StageQp& qp) {
    return std::any_of(qp.stages.begin(), qp.stages.end(),
                       [](const QpStage& stage) { return stage.equality_jacobian.rows > 0; });
  }

  StructuredQpSolver solver_ = StructuredQpSolver({.kernels = GetParam()});
  StageQpSolution solution_;
};

TEST_P(IdleStates, ChangeNothing) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const StageQp qp = with_memory(draw(seed, seed % 2 == 1), kCount);
    solution_.resize(qp);
    for (const std::vector<int>& lives :
         {std::vector<int>{}, {0}, {6}, {2, 3}, {0, 1, 2, 3, 4, 5, 6}}) {
      const PenaltyModel model = model_of(qp, lives);
      ASSERT_EQ(solver_.solve(qp, model, solution_), QpStatus::Solved);
      expect_right(solver_, qp, model, solution_);
    }
  }
}

TEST_P(IdleStates, WakeAndSleepBetweenModels) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    const StageQp qp = with_memory(draw(seed), kCount);
    solution_.resize(qp);
    ASSERT_EQ(solver_.solve(qp, model_of(qp, {}), solution_), QpStatus::Solved);
    for (const std::vector<int>& lives : {std::vector<int>{3}, {3, 1}, {5, 1}, {}, {6}}) {
      const PenaltyModel model = model_of(qp, lives);
      ASSERT_EQ(solver_.resolve(qp, model, solution_), QpStatus::Solved);
      expect_right(solver_, qp, model, solution_);
    }
  }
}

TEST_P(IdleStates, HaveNoGain) {
  const StageQp qp = with_memory(draw(1), kCount);
  const int nx = qp.stages[0].nx;
  ASSERT_EQ(solver_.factorize(qp, model_of(qp, {4})), QpStatus::Solved);
  EXPECT_TRUE(solver_.input_gain(0).rightCols(kCount).isZero(0.0));
  EXPECT_TRUE(solver_.value_hessian(0).rightCols(kCount).isZero(0.0));
  EXPECT_FALSE(solver_.input_gain(4).col(qp.stages[4].nx - kCount + 1).isZero(0.0));
  EXPECT_EQ(solver_.input_gain(0).cols(), nx);
}

TEST_P(IdleStates, CostNextToNothing) {
  const StageQp without = draw(2);
  const StageQp qp = with_memory(without, kCount);
  PenaltyModel model;
  model.resize(without);
  for (int k = 0; k <= without.horizon(); ++k) {
    model.slope[k].setConstant(0.1);
    model.curvature[k].setConstant(2.0);
  }
  ASSERT_EQ(solver_.factorize(without, model), QpStatus::Solved);
  const double least = solver_.flops();
  ASSERT_EQ(solver_.factorize(qp, model_of(qp, {})), QpStatus::Solved);
  EXPECT_LE(solver_.flops(), 1.05 * least);
  ASSERT_EQ(solver_.factorize(qp, model_of(qp, {3})), QpStatus::Solved);
  const double one_knot = solver_.flops();
  EXPECT_GT(one_knot, 1.02 * least);
  ASSERT_EQ(solver_.factorize(qp, model_of(qp, {0, 1, 2, 3, 4, 5, 6})), QpStatus::Solved);
  EXPECT_GT(solver_.flops(), one_knot + 2.0 * (one_knot - least));
}

INSTANTIATE_TEST_SUITE_P(Levels, IdleStates,
                         ::testing::ValuesIn(testing::supported_kernel_levels()),
                         testing::kernel_level_name);

}  // namespace
}  // namespace palanquin
