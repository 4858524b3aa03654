#include <gtest/gtest.h>

#include "palanquin/solvers/qp_factory.hpp"
#include "support/dense_qp.hpp"
#include "support/random_stage_qp.hpp"

namespace palanquin {
namespace {

using testing::DenseQp;
using testing::random_stage_qp;
using testing::RandomStageQpOptions;

QpStatus solve(const StageQp& qp, StageQpSolution& solution, PenaltyModel& model) {
  solution.resize(qp);
  model.resize(qp);
  model.expand(qp, solution.w);
  return make_qp_solver("ldl")->solve(qp, model, solution);
}

TEST(Ldl, DoesNotTakeHardRows) {
  RandomStageQpOptions options;
  options.inequality_rows = {1, 1};
  StageQpSolution solution;
  PenaltyModel model;
  EXPECT_EQ(solve(random_stage_qp(options, 1), solution, model), QpStatus::Unsupported);
  EXPECT_FALSE(make_qp_solver("ldl")->capabilities().inequality_rows);
}

TEST(Ldl, AnIndefiniteHessianIsAStatus) {
  StageQp qp = random_stage_qp({}, 2);
  for (double& value : qp.stages[2].hessian.values) value *= -1.0;
  StageQpSolution solution;
  PenaltyModel model;
  EXPECT_EQ(solve(qp, solution, model), QpStatus::FactorizationFailed);
}

TEST(Ldl, RowsGivenTwiceDoNoHarm) {
  RandomStageQpOptions options;
  options.equality_rows = {2, 2};
  StageQp qp = random_stage_qp(options, 3);
  QpStage& stage = qp.stages[2];
  Eigen::MatrixXd rows = stage.equality_jacobian.dense();
  rows.row(1) = 2.0 * rows.row(0);
  stage.equality_jacobian = SparseBlock::from_dense(rows);
  stage.equality_value[1] = 2.0 * stage.equality_value[0];
  StageQpSolution solution;
  PenaltyModel model;
  ASSERT_EQ(solve(qp, solution, model), QpStatus::Solved);
  EXPECT_LE(kkt_residual(qp, model, solution).max(), 1e-8);
}

TEST(Ldl, StatesWithoutCostAndStiffPenaltiesKeepItsAccuracy) {
  RandomStageQpOptions options;
  options.equality_rows = {0, 1};
  options.link_rows = {0, 1};
  for (unsigned seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    StageQp qp = random_stage_qp(options, seed);
    for (QpStage& stage : qp.stages) {
      Eigen::VectorXd weights = Eigen::VectorXd::Zero(stage.nw());
      weights.tail(stage.nu + stage.nl).setConstant(1e-4);
      stage.hessian.begin(stage.nw());
      for (int i = 0; i < stage.nw(); ++i) {
        stage.hessian.push(i, weights[i]);
        stage.hessian.end_column();
      }
      for (Policy& policy : stage.penalty_policy) policy = {PolicyKind::C2Penalty, 42000.0, 1e-3};
    }
    qp.structure_revision += 1;
    StageQpSolution solution;
    PenaltyModel model;
    ASSERT_EQ(solve(qp, solution, model), QpStatus::Solved);
    const Eigen::VectorXd expected = DenseQp(qp, model).solve();
    EXPECT_LE((DenseQp::stack(solution.w) - expected).norm(), 1e-6 * expected.norm());
  }
}

}  // namespace
}  // namespace palanquin
