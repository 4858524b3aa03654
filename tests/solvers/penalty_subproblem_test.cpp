#include "palanquin/solvers/penalty_subproblem.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>

#include "palanquin/solvers/qp_factory.hpp"
#include "support/allocation_counter.hpp"
#include "support/dense_qp.hpp"
#include "support/random_stage_qp.hpp"

namespace palanquin {
namespace {

using testing::DenseQp;
using testing::random_stage_qp;
using testing::RandomStageQpOptions;

RandomStageQpOptions options() {
  RandomStageQpOptions options;
  options.equality_rows = {0, 1};
  options.link_rows = {0, 1};
  options.penalty_rows = {2, 8};
  return options;
}

StageQpSolution zero(const StageQp& qp) {
  StageQpSolution solution;
  solution.resize(qp);
  return solution;
}

/// The lowest cost, by Newton's method with step halving in the null space of the rows.
double reference_cost(const StageQp& qp) {
  StageQpSolution s = zero(qp);
  PenaltyModel model;
  model.expand(qp, s.w);
  const DenseQp linear(qp, model);
  const Eigen::MatrixXd basis = linear.A.fullPivLu().kernel();
  Eigen::VectorXd z = linear.A.fullPivLu().solve(linear.r);
  double cost = evaluate_cost(qp, linear.split(z));
  for (int i = 0; i < 200; ++i) {
    model.expand(qp, linear.split(z));
    const DenseQp local(qp, model);
    const Eigen::VectorXd slope = basis.transpose() * (local.P * z + local.q);
    if (slope.norm() < 1e-11) break;
    const Eigen::MatrixXd curvature = basis.transpose() * local.P * basis;
    const Eigen::VectorXd step = -basis * curvature.ldlt().solve(slope);
    double alpha = 1.0;
    while (alpha > 1e-12 && evaluate_cost(qp, linear.split(z + alpha * step)) > cost) alpha *= 0.5;
    z += alpha * step;
    cost = evaluate_cost(qp, linear.split(z));
  }
  return cost;
}

/// min 1/2 weight u^2 + g u + S(h + u) over one input and no dynamics.
StageQp scalar_qp(double weight, double gradient, double h, const Policy& policy) {
  StageQp qp;
  qp.structure_revision = 1;
  qp.stages.resize(1);
  QpStage& stage = qp.stages[0];
  stage.nu = 1;
  stage.hessian = SparseBlock::from_dense(Eigen::MatrixXd::Constant(1, 1, weight));
  stage.gradient = Eigen::VectorXd::Constant(1, gradient);
  stage.penalty_jacobian = SparseBlock::from_dense(Eigen::MatrixXd::Ones(1, 1));
  stage.penalty_value = Eigen::VectorXd::Constant(1, h);
  stage.penalty_policy = {policy};
  return qp;
}

constexpr PenaltySubproblemSettings kExact{
    .max_inner_iterations = 50, .tolerance = 1e-10, .decrease_tolerance = 0.0};

TEST(PenaltySubproblem, FindsTheMinimumOfRandomProblems) {
  const auto solver = make_qp_solver("ldl");
  PenaltySubproblem subproblem(kExact);
  for (unsigned seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE(seed);
    const StageQp qp = random_stage_qp(options(), seed);
    StageQpSolution solution = zero(qp);
    const PenaltySubproblemResult result = subproblem.solve(qp, *solver, solution);
    ASSERT_EQ(result.status, QpStatus::Solved);
    EXPECT_TRUE(result.converged);
    EXPECT_LE(result.iterations, 15);
    const double expected = reference_cost(qp);
    EXPECT_NEAR(evaluate_cost(qp, solution.w), expected, 1e-9 * (1.0 + std::abs(expected)));
    EXPECT_LE(kkt_residual(qp, subproblem.model(), solution).max(), 1e-6);
  }
}

TEST(PenaltySubproblem, EndsWhereAnotherQpWouldGainNextToNothing) {
  const auto solver = make_qp_solver("ldl");
  constexpr double kShare = 1e-2;
  PenaltySubproblem exact(kExact);
  PenaltySubproblem early({.max_inner_iterations = 50, .decrease_tolerance = kShare});
  int exact_iterations = 0, early_iterations = 0;
  for (unsigned seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE(seed);
    const StageQp qp = random_stage_qp(options(), seed);
    StageQpSolution best = zero(qp), good = zero(qp);
    exact_iterations += exact.solve(qp, *solver, best).iterations;
    const PenaltySubproblemResult result = early.solve(qp, *solver, good);
    early_iterations += result.iterations;
    EXPECT_TRUE(result.converged);
    const double left = evaluate_cost(qp, good.w) - evaluate_cost(qp, best.w);
    EXPECT_LE(left, 2.0 * kShare * std::abs(result.predicted_change));
  }
  EXPECT_LT(early_iterations, exact_iterations);
}

TEST(PenaltySubproblem, NeverEndsAboveAFeasibleStart) {
  const auto solver = make_qp_solver("ldl");
  for (unsigned seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE(seed);
    // A feasible point far from the minimum: the minimum of a problem with other penalties.
    const StageQp qp = random_stage_qp(options(), seed);
    StageQp other = qp;
    for (QpStage& stage : other.stages) stage.penalty_value *= -3.0;
    StageQpSolution solution = zero(qp);
    PenaltySubproblem({.max_inner_iterations = 1}).solve(other, *solver, solution);
    double cost = evaluate_cost(qp, solution.w);
    for (int i = 0; i < 12; ++i) {
      PenaltySubproblem one_step({.max_inner_iterations = 1, .tolerance = 0.0});
      ASSERT_TRUE(is_usable(one_step.solve(qp, *solver, solution).status));
      const double next = evaluate_cost(qp, solution.w);
      EXPECT_LE(next, cost + 1e-9 * std::abs(cost));
      EXPECT_LE(kkt_residual(qp, one_step.model(), solution).dynamics, 1e-9);
      EXPECT_LE(kkt_residual(qp, one_step.model(), solution).equality, 1e-9);
      cost = next;
    }
    EXPECT_NEAR(cost, reference_cost(qp), 1e-6 * (1.0 + std::abs(cost)));
  }
}

// The inactive penalty has no curvature, so the quadratic's minimum u = 1 overshoots into it; the
// expansion there throws u back, and so on. With the search each step is lower than the last.
TEST(PenaltySubproblem, DoesNotCycleBetweenTwoActiveSets) {
  const StageQp qp = scalar_qp(1.0, -1.0, -0.1, {PolicyKind::C2Penalty, 420.0, 1e-3});
  const auto solver = make_qp_solver("ldl");
  StageQpSolution solution = zero(qp);
  const auto result = PenaltySubproblem({.max_inner_iterations = 1}).solve(qp, *solver, solution);
  EXPECT_FALSE(result.converged);
  EXPECT_LT(evaluate_cost(qp, solution.w), evaluate_cost(qp, zero(qp).w));
  EXPECT_LT(solution.w[0][0], 0.11);

  const auto rest = PenaltySubproblem({.max_inner_iterations = 5}).solve(qp, *solver, solution);
  EXPECT_TRUE(rest.converged);
  // Above the smoothing: u - 1 + 840 (u - 0.1) = 0.
  EXPECT_NEAR(solution.w[0][0], 85.0 / 841.0, 1e-9);
}

TEST(PenaltySubproblem, StiffPenaltiesTakeAFewQps) {
  // From deep inside both penalties, the second with a force a hundred times the first one's.
  // About the points alone each would come closer by half its distance in every QP.
  const Policy stiff{PolicyKind::C2Penalty, 42000.0, 1e-3};
  StageQp qp = scalar_qp(1.0, -2.0, -1.0, stiff);
  QpStage& stage = qp.stages[0];
  stage.nu = 2;
  stage.hessian = SparseBlock::from_dense(Eigen::Matrix2d::Identity());
  stage.gradient = Eigen::Vector2d(-1.1, -11.0);
  stage.penalty_jacobian = SparseBlock::from_dense(Eigen::Matrix2d::Identity());
  stage.penalty_value = Eigen::Vector2d(-1.0, -1.0);
  stage.penalty_policy = {stiff, stiff};
  StageQpSolution solution = zero(qp);
  solution.w[0].setConstant(2.0);
  const auto result = PenaltySubproblem(kExact).solve(qp, *make_qp_solver("ldl"), solution);
  EXPECT_TRUE(result.converged);
  EXPECT_LE(result.iterations, 4);
  for (int i = 0; i < 2; ++i) {
    const double u = solution.w[0][i];
    EXPECT_NEAR(u + stage.gradient[i] + evaluate_penalty(stiff, u - 1.0).slope, 0.0, 1e-7);
  }
}

TEST(PenaltySubproblem, OneIterationSufficesWhenNoPenaltyChanges) {
  const StageQp qp = scalar_qp(1.0, -1.0, -5.0, {PolicyKind::C2Penalty, 420.0, 1e-3});
  StageQpSolution solution = zero(qp);
  const auto result = PenaltySubproblem().solve(qp, *make_qp_solver("ldl"), solution);
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.iterations, 1);
  EXPECT_NEAR(solution.w[0][0], 1.0, 1e-12);
}

TEST(PenaltySubproblem, TheSolutionIsAFixedPoint) {
  const StageQp qp = random_stage_qp(options(), 5);
  const auto solver = make_qp_solver("ldl");
  PenaltySubproblem subproblem(kExact);
  StageQpSolution solution = zero(qp);
  ASSERT_TRUE(subproblem.solve(qp, *solver, solution).converged);
  const Eigen::VectorXd first = DenseQp::stack(solution.w);
  const auto again = subproblem.solve(qp, *solver, solution);
  EXPECT_TRUE(again.converged);
  EXPECT_EQ(again.iterations, 1);
  EXPECT_LE((DenseQp::stack(solution.w) - first).norm(), 1e-7 * first.norm());
}

TEST(PenaltySubproblem, TheLastActiveSetIsAWarmStart) {
  const StageQp qp = random_stage_qp(options(), 6);
  const auto solver = make_qp_solver("ldl");
  PenaltySubproblem subproblem(kExact);
  StageQpSolution cold = zero(qp);
  const auto first = subproblem.solve(qp, *solver, cold);
  ASSERT_GT(first.iterations, 2);
  const PenaltyModel active = subproblem.model();
  StageQpSolution warm = zero(qp);
  const auto second = subproblem.solve(qp, *solver, active, warm);
  EXPECT_TRUE(second.converged);
  EXPECT_EQ(second.iterations, 1);
  EXPECT_LE((DenseQp::stack(warm.w) - DenseQp::stack(cold.w)).norm(), 1e-7);
}

TEST(PenaltySubproblem, AMisleadingFirstModelIsOvercome) {
  const auto solver = make_qp_solver("ldl");
  PenaltySubproblem subproblem(kExact);
  for (unsigned seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    const StageQp qp = random_stage_qp(options(), seed);
    StageQpSolution solution = zero(qp);
    subproblem.solve(qp, *solver, solution);  // a feasible start
    PenaltyModel misleading = subproblem.model();
    for (auto& slope : misleading.slope) slope.setConstant(-100.0);
    const double cost = evaluate_cost(qp, solution.w);
    EXPECT_TRUE(subproblem.solve(qp, *solver, misleading, solution).converged);
    EXPECT_NEAR(evaluate_cost(qp, solution.w), cost, 1e-8 * (1.0 + std::abs(cost)));
  }
}

TEST(PenaltySubproblem, WorksWithOsqpAndHardRows) {
  RandomStageQpOptions hard = options();
  hard.inequality_rows = {1, 2};
  QpSettings settings;
  settings.osqp.absolute_tolerance = settings.osqp.relative_tolerance = 1e-9;
  settings.osqp.max_iterations = 50000;
  const auto solver = make_qp_solver("osqp", settings);
  PenaltySubproblem subproblem(kExact);
  for (unsigned seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    const StageQp qp = random_stage_qp(hard, seed);
    StageQpSolution solution = zero(qp);
    const auto result = subproblem.solve(qp, *solver, solution);
    EXPECT_TRUE(result.converged);
    EXPECT_LE(kkt_residual(qp, subproblem.model(), solution).max(), 1e-5);
  }
}

TEST(PenaltySubproblem, WithoutPenaltiesItIsOneQp) {
  RandomStageQpOptions none = options();
  none.penalty_rows = {0, 0};
  const StageQp qp = random_stage_qp(none, 7);
  StageQpSolution solution = zero(qp);
  const auto result = PenaltySubproblem().solve(qp, *make_qp_solver("ldl"), solution);
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.iterations, 1);
}

TEST(PenaltySubproblem, LeavesTheStartWhenTheQpCannotBeSolved) {
  StageQp qp = random_stage_qp(options(), 8);
  qp.stages[1].offset[0] = std::numeric_limits<double>::quiet_NaN();
  StageQpSolution solution = zero(qp);
  solution.w[1].setConstant(0.25);
  const auto result = PenaltySubproblem().solve(qp, *make_qp_solver("ldl"), solution);
  EXPECT_EQ(result.status, QpStatus::NonFinite);
  EXPECT_FALSE(result.converged);
  EXPECT_TRUE((solution.w[1].array() == 0.25).all());
}

/// Solves once, then gives up.
class FailsLater final : public QpSolver {
 public:
  std::string_view name() const override { return "fails later"; }
  QpCapabilities capabilities() const override { return solver_->capabilities(); }
  QpStatus solve(const StageQp& qp, const PenaltyModel& model, StageQpSolution& s) override {
    return solver_->solve(qp, model, s);
  }
  QpStatus resolve(const StageQp&, const PenaltyModel&, StageQpSolution&) override {
    return QpStatus::FactorizationFailed;
  }

 private:
  std::unique_ptr<QpSolver> solver_ = make_qp_solver("ldl");
};

TEST(PenaltySubproblem, KeepsTheBestPointWhenALaterQpFails) {
  const StageQp qp = random_stage_qp(options(), 6);
  FailsLater solver;
  StageQpSolution solution = zero(qp), expected = zero(qp);
  const auto result = PenaltySubproblem().solve(qp, solver, solution);
  EXPECT_EQ(result.status, QpStatus::Inaccurate);
  EXPECT_EQ(result.iterations, 2);
  PenaltySubproblem({.max_inner_iterations = 1}).solve(qp, *make_qp_solver("ldl"), expected);
  EXPECT_EQ(DenseQp::stack(solution.w), DenseQp::stack(expected.w));
}

TEST(PenaltySubproblem, AllocatesOnlyForANewStructure) {
  const auto solver = make_qp_solver("ldl");
  PenaltySubproblem subproblem;
  StageQpSolution solution = zero(random_stage_qp(options(), 9));
  subproblem.solve(random_stage_qp(options(), 9), *solver, solution);
  for (unsigned value_seed : {1u, 2u, 3u}) {
    const StageQp qp = random_stage_qp(options(), 9, value_seed);
    PenaltySubproblemResult result;
    const long allocations =
        testing::allocations_during([&] { result = subproblem.solve(qp, *solver, solution); });
    EXPECT_TRUE(is_usable(result.status));
    EXPECT_EQ(allocations, 0);
  }
}

TEST(PenaltySubproblem, SeesNaNInARowThatTheQpDoesNotUse) {
  StageQp qp = random_stage_qp(options(), 8);
  QpStage& stage = qp.stages[1];
  stage.penalty_value.setConstant(-100.0);  // inactive at the start
  stage.penalty_policy.assign(stage.penalty_policy.size(), Policy{});
  stage.penalty_jacobian.values[0] = std::numeric_limits<double>::quiet_NaN();
  StageQpSolution solution = zero(qp);
  const auto result = PenaltySubproblem().solve(qp, *make_qp_solver("ldl"), solution);
  EXPECT_EQ(result.status, QpStatus::NonFinite);
  EXPECT_TRUE(solution.w[1].isZero(0.0));
}

TEST(PenaltySubproblem, RefusesBadSettings) {
  EXPECT_EQ(PenaltySubproblemSettings{}.explain_invalid(), "");
  EXPECT_EQ(PenaltySubproblemSettings{.max_inner_iterations = 0}.explain_invalid(),
            "subproblem.max_inner_iterations is 0, but must be at least 1");
  EXPECT_THROW(PenaltySubproblem({.tolerance = -1.0}), std::invalid_argument);
}

}  // namespace
}  // namespace palanquin
