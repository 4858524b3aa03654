#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <tuple>

#include "palanquin/solvers/qp_factory.hpp"
#include "support/allocation_counter.hpp"
#include "support/dense_qp.hpp"
#include "support/random_stage_qp.hpp"

namespace palanquin {
namespace {

using testing::DenseQp;
using testing::random_stage_qp;
using testing::RandomStageQpOptions;

/// What every back end must do with hard inequality rows.
class HardRowsBackEnd : public ::testing::TestWithParam<std::string> {
 protected:
  HardRowsBackEnd() {
    QpSettings settings;
    settings.osqp.absolute_tolerance = settings.osqp.relative_tolerance = 1e-8;
    settings.osqp.max_iterations = 50000;
    solver_ = make_qp_solver(GetParam(), settings);
  }

  RandomStageQpOptions options() const {
    RandomStageQpOptions options;
    options.equality_rows = {0, 1};
    options.inequality_rows = {0, 4};
    if (solver_->capabilities().link_rows) options.link_rows = {0, 1};
    return options;
  }

  QpStatus solve(const StageQp& qp) {
    solution_ = {};
    solution_.resize(qp);
    model_.expand(qp, solution_.w);
    return solver_->solve(qp, model_, solution_);
  }

  /// Feasible, multipliers of the right sign, complementary; counts the rows that bind.
  void expect_kkt(const StageQp& qp, double tolerance, int& active) {
    solver_->find_dynamics_multipliers(solution_);
    EXPECT_LE(kkt_residual(qp, model_, solution_).max(), 10 * tolerance);
    for (std::size_t k = 0; k < qp.stages.size(); ++k) {
      Eigen::VectorXd row = qp.stages[k].inequality_value;
      qp.stages[k].inequality_jacobian.multiply_add(solution_.w[k].data(), row.data());
      const Eigen::VectorXd& multiplier = solution_.inequality_multiplier[k];
      for (Eigen::Index i = 0; i < row.size(); ++i) {
        EXPECT_LE(row[i], tolerance);
        EXPECT_GE(multiplier[i], -tolerance);
        EXPECT_LE(std::abs(row[i] * multiplier[i]), 10 * tolerance * (1.0 + multiplier[i]));
        active += multiplier[i] > 1e-3;
      }
    }
  }

  double tolerance() const { return GetParam() == "osqp" ? 1e-6 : 1e-8; }

  std::unique_ptr<QpSolver> solver_;
  StageQpSolution solution_;
  PenaltyModel model_;
};

TEST_P(HardRowsBackEnd, MeetsTheKktConditions) {
  int active = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const StageQp qp = random_stage_qp(options(), seed);
    ASSERT_EQ(solve(qp), QpStatus::Solved);
    expect_kkt(qp, tolerance(), active);
  }
  EXPECT_GT(active, 60);  // or the conditions above would say little
}

TEST_P(HardRowsBackEnd, ContradictingRowsAreInfeasible) {
  StageQp qp = random_stage_qp(options(), 2);
  QpStage& stage = qp.stages[1];
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2, stage.nw());
  rows(0, stage.nx) = 1.0;
  rows(1, stage.nx) = -1.0;
  stage.inequality_jacobian = SparseBlock::from_dense(rows);
  stage.inequality_value = Eigen::Vector2d(1.0, 1.0);  // u <= -1 and u >= 1
  EXPECT_EQ(solve(qp), QpStatus::PrimalInfeasible);
  EXPECT_TRUE(DenseQp::stack(solution_.w).isZero());
}

TEST_P(HardRowsBackEnd, ANaNInAHardRowIsNotASolution) {
  RandomStageQpOptions o = options();
  o.inequality_rows = {2, 2};
  StageQp qp = random_stage_qp(o, 3);
  qp.stages[2].inequality_value[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(solve(qp), QpStatus::NonFinite);
}

std::vector<std::string> takers() {
  std::vector<std::string> names;
  for (std::string_view name : qp_solver_names())
    if (make_qp_solver(name)->capabilities().inequality_rows) names.emplace_back(name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Names, HardRowsBackEnd, ::testing::ValuesIn(takers()),
                         [](const auto& name) { return name.param; });

RandomStageQpOptions many_rows() {
  RandomStageQpOptions options;
  options.equality_rows = {0, 1};
  options.inequality_rows = {3, 6};
  return options;
}

/// Whatever the method was at when its recursions ran out.
TEST(Multipliers, TooFewRecursionsAreNoSolution) {
  int usable = 0;
  for (unsigned seed = 0; seed < 30; ++seed) {
    const StageQp qp = random_stage_qp(many_rows(), seed);
    StageQpSolution expected, solution;
    expected.resize(qp);
    PenaltyModel model;
    model.expand(qp, expected.w);
    ASSERT_EQ(make_qp_solver("structured")->solve(qp, model, expected), QpStatus::Solved);
    for (int recursions = 1; recursions <= 12; ++recursions)
      for (int fast : {1, 2, 30}) {
        SCOPED_TRACE(::testing::PrintToString(std::tuple(seed, recursions, fast)));
        QpSettings settings;
        settings.multipliers.max_iterations = recursions;
        settings.multipliers.fast_iterations = fast;
        solution = {};
        solution.resize(qp);
        if (!is_usable(make_qp_solver("structured", settings)->solve(qp, model, solution)))
          continue;
        ++usable;
        const Eigen::VectorXd right = DenseQp::stack(expected.w);
        EXPECT_LE((DenseQp::stack(solution.w) - right).norm(), 1e-2 * (1.0 + right.norm()));
      }
  }
  EXPECT_GT(usable, 100);
}

TEST(Multipliers, AWarmStartNeedsOneRecursion) {
  const StageQp qp = random_stage_qp(many_rows(), 4);
  StageQpSolution solution;
  solution.resize(qp);
  PenaltyModel model;
  model.expand(qp, solution.w);
  ASSERT_EQ(make_qp_solver("multipliers")->solve(qp, model, solution), QpStatus::Solved);
  QpSettings once;
  once.multipliers.max_iterations = 1;
  EXPECT_EQ(make_qp_solver("multipliers", once)->solve(qp, model, solution), QpStatus::Solved);
}

TEST(Multipliers, StoppingEarlyIsNotCalledSolved) {
  const StageQp qp = random_stage_qp(many_rows(), 4);
  StageQpSolution solution;
  solution.resize(qp);
  PenaltyModel model;
  model.expand(qp, solution.w);
  QpSettings once;
  once.multipliers.max_iterations = 1;
  EXPECT_EQ(make_qp_solver("multipliers", once)->solve(qp, model, solution), QpStatus::NotSolved);
  EXPECT_TRUE(DenseQp::stack(solution.w).isZero());
}

TEST(Multipliers, DoesNotAllocateWhileTheStructureStays) {
  const auto solver = make_qp_solver("multipliers");
  StageQpSolution solution;
  PenaltyModel model;
  for (unsigned value_seed = 0; value_seed < 8; ++value_seed) {
    const StageQp qp = random_stage_qp(many_rows(), 5, value_seed);
    solution.resize(qp);
    model.resize(qp);
    model.expand(qp, solution.w);
    QpStatus status = QpStatus::NotSolved;
    const long allocations =
        testing::allocations_during([&] { status = solver->solve(qp, model, solution); });
    ASSERT_EQ(status, QpStatus::Solved);
    if (value_seed <= 1) continue;
    EXPECT_EQ(allocations, 0) << value_seed;
  }
}

TEST(Multipliers, KnowsThePointNearestToContradictingRows) {
  StageQp qp = random_stage_qp(many_rows(), 6);
  QpStage& stage = qp.stages[1];
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2, stage.nw());
  rows(0, stage.nx) = 1.0;
  rows(1, stage.nx) = -1.0;
  stage.inequality_jacobian = SparseBlock::from_dense(rows);
  stage.inequality_value = Eigen::Vector2d(1.0, 3.0);  // u <= -1 and u >= 3
  StageQpSolution solution;
  solution.resize(qp);
  PenaltyModel model;
  model.expand(qp, solution.w);
  const auto solver = make_qp_solver("multipliers");
  ASSERT_EQ(solver->solve(qp, model, solution), QpStatus::PrimalInfeasible);
  ASSERT_NE(solver->least_violation(), nullptr);
  EXPECT_NEAR(solver->least_violation()->w[1][stage.nx], 1.0, 1e-3);
}

}  // namespace
}  // namespace palanquin
