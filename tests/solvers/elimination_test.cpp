#include <gtest/gtest.h>

#include <memory>

#include "elimination/eliminated_qp.hpp"
#include "palanquin/solvers/qp_factory.hpp"
#include "support/allocation_counter.hpp"
#include "support/dense_qp.hpp"
#include "support/random_stage_qp.hpp"

namespace palanquin {
namespace {

using testing::DenseQp;
using testing::random_stage_qp;
using testing::RandomStageQpOptions;

constexpr double kTolerance = 1e-9;

/// A random QP whose state begins with the inputs of the knot before, and whose knots each have
/// rates as further inputs, du = `scale` (u - previous u) + drift, that cost something.
StageQp with_rates(unsigned seed, double scale, int rates = 2, RandomStageQpOptions options = {}) {
  options.nx = {rates + 3, rates + 3};
  options.nu = {2 * rates, 2 * rates};  // u, then du
  StageQp qp = random_stage_qp(options, seed);
  for (int k = 0; k <= qp.horizon(); ++k) {
    QpStage& stage = qp.stages[k];
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(rates, stage.nw());
    for (int i = 0; i < rates; ++i) {
      rows(i, stage.nx + rates + i) = 1.0;
      rows(i, stage.nx + i) = -scale;
      rows(i, i) = scale;
    }
    stage.equality_jacobian = SparseBlock::from_dense(rows);
    stage.equality_value = 0.1 * Eigen::VectorXd::LinSpaced(rates, 1.0, 2.0);
    if (k == qp.horizon()) continue;
    Eigen::MatrixXd dynamics = stage.dynamics.dense();
    dynamics.middleCols(stage.nx + rates, rates).setZero();
    for (int i = 0; i < rates; ++i) {
      dynamics.row(i).setZero();
      dynamics(i, stage.nx + i) = 1.0;
      stage.offset[i] = 0.0;
    }
    stage.dynamics = SparseBlock::from_dense(dynamics);
    Eigen::MatrixXd implicit = stage.implicit.dense();
    implicit.topRows(rates).setZero();
    stage.implicit = SparseBlock::from_dense(implicit);
  }
  return qp;
}

class Elimination : public ::testing::Test {
 protected:
  void expect_solved(const StageQp& qp) {
    solution_.resize(qp);
    for (Eigen::VectorXd& w : solution_.w) w.setZero();  // where penalties are expanded
    model_.resize(qp);
    model_.expand(qp, solution_.w);
    ASSERT_EQ(solver_->solve(qp, model_, solution_), QpStatus::Solved);
    expect_right(qp);
  }
  void expect_right(const StageQp& qp) {
    solver_->find_dynamics_multipliers(solution_);
    const Eigen::VectorXd expected = DenseQp(qp, model_).solve();
    EXPECT_LE((DenseQp::stack(solution_.w) - expected).norm(),
              kTolerance * (1.0 + expected.norm()));
    EXPECT_LE(kkt_residual(qp, model_, solution_).max(), 1e3 * kTolerance);
  }

  std::unique_ptr<QpSolver> solver_ = make_qp_solver("structured", {});
  StageQpSolution solution_;
  PenaltyModel model_;
};

TEST_F(Elimination, RatesLeaveTheQp) {
  const StageQp qp = with_rates(0, 1.0);
  EliminatedQp eliminated;
  ASSERT_TRUE(eliminated.take(qp));
  for (const QpStage& stage : eliminated.qp().stages) {
    EXPECT_EQ(stage.equality_jacobian.rows, 0);
    EXPECT_EQ(stage.nu, 2);
  }
}

TEST_F(Elimination, GivesTheSolutionOfTheWhole) {
  for (unsigned seed = 0; seed < 20; ++seed)
    for (double scale : {1.0, 20.0}) {
      SCOPED_TRACE(seed);
      expect_solved(with_rates(seed, scale));
    }
}

TEST_F(Elimination, TakesDataForVariablesOfTheDynamics) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    StageQp qp = random_stage_qp({}, seed);
    for (QpStage& stage : qp.stages) {
      Eigen::MatrixXd row = Eigen::MatrixXd::Zero(1, stage.nw());
      row(0, stage.nx) = -2.0;
      stage.equality_jacobian = SparseBlock::from_dense(row);
      stage.equality_value = Eigen::VectorXd::Constant(1, 0.7);
    }
    EliminatedQp eliminated;
    ASSERT_TRUE(eliminated.take(qp));
    EXPECT_EQ(eliminated.qp().stages[0].nu, qp.stages[0].nu - 1);
    expect_solved(qp);
  }
}

TEST_F(Elimination, KeepsRowsOverSharedVariables) {
  StageQp qp = random_stage_qp({}, 1);
  for (QpStage& stage : qp.stages) {
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2, stage.nw());
    rows.col(stage.nx) << 1.0, 1.0;  // both over the first input, one over states besides
    rows(1, 0) = 1.0;
    stage.equality_jacobian = SparseBlock::from_dense(rows);
    stage.equality_value = Eigen::VectorXd::Zero(2);
  }
  EXPECT_FALSE(EliminatedQp().take(qp));
}

TEST_F(Elimination, FollowsPivotsThatVanish) {
  StageQp qp = with_rates(3, 1.0);
  expect_solved(qp);
  SparseBlock& rows = qp.stages[2].equality_jacobian;
  for (int j = 0; j < rows.cols; ++j)
    for (int e = rows.column_start[j]; e < rows.column_start[j + 1]; ++e)
      if (j == qp.stages[2].nx + 2) rows.values[e] = 0.0;
  expect_solved(qp);
  expect_solved(with_rates(3, 1.0));
}

TEST_F(Elimination, HoldsInTwoPhasesAndAfterAnotherModel) {
  StageQp qp = with_rates(4, 2.0);
  expect_solved(qp);
  for (Eigen::VectorXd& curvature : model_.curvature) curvature *= 3.0;
  qp.initial_state *= -0.5;
  ASSERT_EQ(solver_->resolve(qp, model_, solution_), QpStatus::Solved);
  expect_right(qp);
  ASSERT_EQ(solver_->prepare(qp, model_), QpStatus::Solved);
  qp.initial_state *= -3.0;
  ASSERT_EQ(solver_->finish(qp, model_, solution_), QpStatus::Solved);
  expect_right(qp);
}

TEST_F(Elimination, KnowsTheGainOfWhatWasGiven) {
  StageQp qp = with_rates(5, 2.0);
  expect_solved(qp);
  Eigen::MatrixXd gain(qp.stages[0].nu, qp.stages[0].nx);
  std::vector<double> work;
  ASSERT_TRUE(solver_->feedback_gain(gain, work));
  const Eigen::VectorXd before = solution_.w[0];
  for (int j = 0; j < qp.stages[0].nx; ++j) {
    StageQp moved = qp;
    moved.initial_state[j] += 1.0;
    expect_solved(moved);
    const Eigen::VectorXd change =
        (solution_.w[0] - before).segment(qp.stages[0].nx, qp.stages[0].nu);
    EXPECT_LE((gain.col(j) - change).norm(), 1e-8 * (1.0 + change.norm()));
  }
}

TEST_F(Elimination, FindsMultipliersOfItsOwnSolution) {
  const StageQp qp = with_rates(8, 2.0);
  expect_solved(qp);
  const std::vector<Eigen::VectorXd> w = solution_.w;
  for (Eigen::VectorXd& moved : solution_.w) moved.setConstant(3.0);
  for (Eigen::VectorXd& mu : solution_.equality_multiplier) mu.setZero();
  solver_->find_dynamics_multipliers(solution_);
  solution_.w = w;
  EXPECT_LE(kkt_residual(qp, model_, solution_).max(), 1e3 * kTolerance);
}

TEST_F(Elimination, AllocatesNothingOnceThePatternIsKnown) {
  const StageQp qp = with_rates(6, 1.0);
  expect_solved(qp);
  EXPECT_EQ(testing::allocations_during([&] { solver_->solve(qp, model_, solution_); }), 0);
}

TEST_F(Elimination, LeavesHardRowsTheirLimits) {
  RandomStageQpOptions options;
  options.penalty_rows = {0, 0};
  StageQp qp = with_rates(7, 1.0, 2, options);
  for (QpStage& stage : qp.stages) {  // |du_0| <= 0.2
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2, stage.nw());
    rows.col(stage.nx + 2) << 1.0, -1.0;
    stage.inequality_jacobian = SparseBlock::from_dense(rows);
    stage.inequality_value = Eigen::VectorXd::Constant(2, -0.2);
  }
  solution_.resize(qp);
  model_.resize(qp);
  model_.expand(qp, solution_.w);
  ASSERT_EQ(solver_->solve(qp, model_, solution_), QpStatus::Solved);
  solver_->find_dynamics_multipliers(solution_);
  double largest = 0.0;
  for (int k = 0; k <= qp.horizon(); ++k) {
    const QpStage& stage = qp.stages[k];
    const double rate = solution_.w[k][stage.nx + 2];
    EXPECT_LE(std::abs(rate), 0.2 + 1e-6);
    largest = std::max(largest, std::abs(rate));
    Eigen::VectorXd row = stage.equality_value;
    stage.equality_jacobian.multiply_add(solution_.w[k].data(), row.data());
    EXPECT_LE(row.norm(), kTolerance);
  }
  EXPECT_GE(largest, 0.2 - 1e-6);
}

}  // namespace
}  // namespace palanquin
