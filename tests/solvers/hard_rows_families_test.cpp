#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "palanquin/solvers/qp_factory.hpp"
#include "support/dense_qp.hpp"
#include "support/random_stage_qp.hpp"

namespace palanquin {
namespace {

using testing::DenseQp;
using testing::random_stage_qp;
using testing::RandomStageQpOptions;

constexpr int kBounded = 150;  ///< recursions; the interior point needs some 30

/// One solve with its KKT check, rows in their own unit and forces relative to the cost's scale.
class Solve {
 public:
  explicit Solve(const StageQp& qp, const QpSettings& settings = {})
      : qp_(qp), solver_(make_qp_solver("structured", settings)) {
    solution_.resize(qp);
    model_.expand(qp, solution_.w);
    status_ = solver_->solve(qp, model_, solution_);
    if (is_usable(status_)) solver_->find_dynamics_multipliers(solution_);
  }

  QpStatus status() const { return status_; }
  const StageQpSolution& solution() const { return solution_; }
  Eigen::VectorXd w() const { return DenseQp::stack(solution_.w); }
  const QpSolver& solver() const { return *solver_; }

  void expect_solved(double cost_scale = 1.0) const {
    ASSERT_EQ(status_, QpStatus::Solved);
    EXPECT_LE(solver_->recursions(), kBounded);
    const KktResidual kkt = kkt_residual(qp_, model_, solution_);
    EXPECT_LE(kkt.stationarity, 1e-7 * cost_scale * (1.0 + largest_multiplier() / cost_scale));
    EXPECT_LE(std::max(kkt.dynamics, kkt.equality), 1e-7);
    for (std::size_t k = 0; k < qp_.stages.size(); ++k) {
      Eigen::VectorXd h = qp_.stages[k].inequality_value;
      qp_.stages[k].inequality_jacobian.multiply_add(solution_.w[k].data(), h.data());
      const Eigen::VectorXd& nu = solution_.inequality_multiplier[k];
      for (Eigen::Index j = 0; j < h.size(); ++j) {
        EXPECT_LE(h[j], 1e-7);
        EXPECT_GE(nu[j], 0.0);
        EXPECT_TRUE(std::abs(h[j]) <= 1e-7 || nu[j] <= 1e-7 * cost_scale) << h[j] << " " << nu[j];
      }
    }
  }

 private:
  double largest_multiplier() const {
    double largest = 0.0;
    for (const Eigen::VectorXd& nu : solution_.inequality_multiplier)
      for (const double v : nu) largest = std::max(largest, v);
    return largest;
  }

  const StageQp& qp_;
  std::unique_ptr<QpSolver> solver_;
  PenaltyModel model_;
  StageQpSolution solution_;
  QpStatus status_ = QpStatus::NotSolved;
};

RandomStageQpOptions options(int horizon = 8) {
  RandomStageQpOptions options;
  options.horizon = horizon;
  options.equality_rows = {0, 1};
  options.inequality_rows = {0, 5};
  return options;
}

QpSettings interior_point_at_once() {
  QpSettings settings;
  settings.multipliers.fast_iterations = 1;
  return settings;
}

void scale_cost(StageQp& qp, double scale) {
  for (QpStage& stage : qp.stages) {
    for (double& v : stage.hessian.values) v *= scale;
    stage.gradient *= scale;
    for (Policy& policy : stage.penalty_policy) policy.stiffness *= scale;
  }
}

SparseBlock diagonal(const std::vector<double>& entries) {
  SparseBlock block;
  block.begin(static_cast<int>(entries.size()));
  for (std::size_t i = 0; i < entries.size(); ++i) {
    block.push(static_cast<int>(i), entries[i]);
    block.end_column();
  }
  return block;
}

void add_inequality(QpStage& stage, const Eigen::RowVectorXd& row, double value) {
  const auto rows = stage.inequality_value.size();
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(rows + 1, stage.nw());
  if (rows > 0) all.topRows(rows) = stage.inequality_jacobian.dense();
  all.row(rows) = row;
  stage.inequality_jacobian = SparseBlock::from_dense(all);
  stage.inequality_value.conservativeResize(rows + 1);
  stage.inequality_value[rows] = value;
}

/// x+ = x + u from x = 0 with |u| <= 1, cost u^2 / 2 and, of the last state, x_N >= target.
StageQp reach(int horizon, double target) {
  StageQp qp;
  qp.initial_state = Eigen::VectorXd::Zero(1);
  qp.stages.resize(static_cast<std::size_t>(horizon) + 1);
  for (int k = 0; k <= horizon; ++k) {
    QpStage& stage = qp.stages[static_cast<std::size_t>(k)];
    stage.nx = 1;
    stage.nu = k < horizon;
    stage.hessian =
        diagonal(k < horizon ? std::vector<double>{0.0, 1.0} : std::vector<double>{0.0});
    stage.gradient = Eigen::VectorXd::Zero(stage.nw());
    stage.inequality_jacobian.begin(0);
    if (k < horizon) {
      stage.dynamics = SparseBlock::from_dense(Eigen::RowVector2d(1, 1));
      stage.implicit = SparseBlock::from_dense(Eigen::MatrixXd::Zero(1, 1));
      stage.offset = Eigen::VectorXd::Zero(1);
      add_inequality(stage, Eigen::RowVector2d(0, 1), -1.0);
      add_inequality(stage, Eigen::RowVector2d(0, -1), -1.0);
    } else {
      add_inequality(stage, -Eigen::RowVectorXd::Ones(1), target);
    }
  }
  return qp;
}

TEST(HardRows, BothMethodsSolveRandomProblems) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    const StageQp qp = random_stage_qp(options(seed % 4 == 0 ? 40 : 8), seed);
    const Solve fast(qp), interior(qp, interior_point_at_once());
    fast.expect_solved();
    interior.expect_solved();
    EXPECT_LE((fast.w() - interior.w()).norm(), 1e-5 * (1.0 + fast.w().norm()));
  }
}

TEST(HardRows, TheCostsScaleDoesNotMatter) {
  for (unsigned seed = 0; seed < 15; ++seed) {
    SCOPED_TRACE(seed);
    const StageQp plain = random_stage_qp(options(), seed);
    const Eigen::VectorXd expected = Solve(plain).w();
    for (const double scale : {1e-6, 1e-3, 1e3, 1e6}) {
      SCOPED_TRACE(scale);
      StageQp qp = plain;
      scale_cost(qp, scale);
      for (const QpSettings& settings : {QpSettings{}, interior_point_at_once()}) {
        const Solve solve(qp, settings);
        solve.expect_solved(scale);
        EXPECT_LE((solve.w() - expected).norm(), 1e-5 * (1.0 + expected.norm()));
      }
    }
  }
}

TEST(HardRows, TheRowsScaleDoesNotMatter) {
  for (unsigned seed = 0; seed < 15; ++seed) {
    SCOPED_TRACE(seed);
    const StageQp plain = random_stage_qp(options(), seed);
    const Eigen::VectorXd expected = Solve(plain).w();
    for (const double scale : {1e-2, 1e3}) {
      StageQp qp = plain;
      for (QpStage& stage : qp.stages) {
        for (double& v : stage.inequality_jacobian.values) v *= scale;
        stage.inequality_value *= scale;
      }
      const Solve solve(qp);
      ASSERT_EQ(solve.status(), QpStatus::Solved) << scale;
      EXPECT_LE((solve.w() - expected).norm(), 1e-5 * (1.0 + expected.norm())) << scale;
    }
  }
}

/// Only the last state has to get far, and it has no cost.
TEST(HardRows, RowsOverVariablesWithoutCostAreMet) {
  for (const double scale : {1e-3, 1.0, 1e3}) {
    for (const double target : {0.5, 5.0, 9.0, 9.999, 10.0}) {
      SCOPED_TRACE(target);
      StageQp qp = reach(10, target);
      scale_cost(qp, scale);
      const Solve solve(qp);
      ASSERT_EQ(solve.status(), QpStatus::Solved);
      for (int k = 0; k < 10; ++k)
        EXPECT_NEAR(solve.solution().w[static_cast<std::size_t>(k)][1], target / 10, 1e-6);
    }
  }
}

TEST(HardRows, InfeasibleIsSaidWhereAProofExists) {
  for (const double scale : {1e-3, 1.0, 1e3}) {
    for (const double target : {10.01, 10.5, 20.0, 1e3}) {
      SCOPED_TRACE(target);
      StageQp qp = reach(10, target);
      scale_cost(qp, scale);
      const Solve solve(qp);
      ASSERT_EQ(solve.status(), QpStatus::PrimalInfeasible);
      EXPECT_LE(solve.solver().recursions(), kBounded);
      EXPECT_TRUE(solve.w().isZero());
      ASSERT_NE(solve.solver().least_violation(), nullptr);
      for (std::size_t k = 0; k < 10; ++k) {  // inputs and last state share what is missing
        const double input = solve.solver().least_violation()->w[k][1];
        EXPECT_GE(input, 1.0);
        EXPECT_LE(input, target / 10);
      }
    }
  }
}

TEST(HardRows, RandomContradictionsAreInfeasible) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    StageQp qp = random_stage_qp(options(), seed);
    QpStage& stage = qp.stages[1 + seed % 7];
    const Eigen::RowVectorXd row = Eigen::RowVectorXd::LinSpaced(stage.nw(), -1.0, 2.0);
    add_inequality(stage, row, 0.2);    // row w <= -0.2
    add_inequality(stage, -row, -0.1);  // row w >= -0.1
    const Solve solve(qp);
    EXPECT_EQ(solve.status(), QpStatus::PrimalInfeasible);
    EXPECT_LE(solve.solver().recursions(), kBounded);
  }
}

TEST(HardRows, DegenerateRowsAreSolved) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const StageQp plain = random_stage_qp(options(), seed);
    const Solve expected(plain);
    StageQp qp = plain;
    for (std::size_t k = 0; k < qp.stages.size(); ++k) {
      QpStage& stage = qp.stages[k];
      const Eigen::MatrixXd rows = plain.stages[k].inequality_jacobian.dense();
      for (Eigen::Index j = 0; j < plain.stages[k].inequality_value.size(); ++j) {
        const double value = plain.stages[k].inequality_value[j];
        add_inequality(stage, rows.row(j), value);  // once more, and longer
        add_inequality(stage, 3.0 * rows.row(j), 3.0 * value);
      }
      const Eigen::VectorXd& w = expected.solution().w[k];  // some that the optimum just meets
      const Eigen::RowVectorXd touching = Eigen::RowVectorXd::LinSpaced(stage.nw(), 1.0, -0.5);
      if (k > 0) add_inequality(stage, touching, -touching.dot(w));
      add_inequality(stage, Eigen::RowVectorXd::Zero(stage.nw()), 0.0);
    }
    const Solve solve(qp);
    ASSERT_EQ(solve.status(), QpStatus::Solved);
    EXPECT_LE(solve.solver().recursions(), kBounded);
    EXPECT_LE((solve.w() - expected.w()).norm(), 1e-5 * (1.0 + expected.w().norm()));
  }
}

/// A friction pyramid over forces that equality rows hold at 0: every side is on its bound.
TEST(HardRows, PyramidsOverAbsentForcesAreSolved) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE(seed);
    RandomStageQpOptions o = options();
    o.nu = {6, 6};
    o.equality_rows = {0, 0};
    o.inequality_rows = {0, 0};
    StageQp qp = random_stage_qp(o, seed);
    for (std::size_t k = 0; k < qp.stages.size(); ++k) {
      QpStage& stage = qp.stages[k];
      for (const int foot : {0, 1}) {
        const int x = stage.nx + 3 * foot;
        for (const int tangent : {0, 1})
          for (const double sign : {1.0, -1.0}) {
            Eigen::RowVectorXd side = Eigen::RowVectorXd::Zero(stage.nw());
            side[x + tangent] = sign;
            side[x + 2] = -0.6;
            add_inequality(stage, side, 0.0);
          }
      }
      const bool is_absent = (k + seed) % 3 != 0;
      const int held = is_absent ? 3 : 0;
      Eigen::MatrixXd equality = Eigen::MatrixXd::Zero(held, stage.nw());
      for (int i = 0; i < held; ++i) equality(i, stage.nx + i) = 1.0;
      stage.equality_jacobian = SparseBlock::from_dense(equality);
      stage.equality_value = Eigen::VectorXd::Zero(held);
    }
    const Solve solve(qp);
    solve.expect_solved();
  }
}

/// A mass that follows a reference between walls, which come and go: 400 QPs in a row.
TEST(HardRows, LongWarmSequencesNeverFailAndStayBounded) {
  const int horizon = 30;
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  const auto solver = make_qp_solver("structured");
  StageQpSolution solution;
  double position = 0.0, velocity = 0.0;
  int most = 0;
  long all = 0;
  for (int t = 0; t < 400; ++t) {
    StageQp qp;
    qp.initial_state = Eigen::Vector2d(position, velocity);
    qp.stages.resize(horizon + 1);
    qp.structure_revision = 1;
    for (int k = 0; k <= horizon; ++k) {
      QpStage& stage = qp.stages[static_cast<std::size_t>(k)];
      stage.nx = 2;
      stage.nu = k < horizon;
      const double time = 0.1 * (t + k), wall = 0.7 + 0.2 * std::sin(0.7 * time);
      stage.hessian = diagonal(k < horizon ? std::vector<double>{10.0, 0.1, 1e-3}
                                           : std::vector<double>{10.0, 0.1});
      stage.gradient = Eigen::VectorXd::Zero(stage.nw());
      stage.gradient[0] = -10.0 * std::sin(1.3 * time) * 1.5;
      Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(k == 0 ? 2 : k < horizon ? 4 : 2, stage.nw());
      Eigen::VectorXd values = Eigen::VectorXd::Constant(rows.rows(), -20.0);
      int row = 0;
      if (k < horizon) {
        rows(row++, 2) = 1.0;
        rows(row++, 2) = -1.0;
      }
      if (k > 0) {
        rows(row, 0) = 1.0;
        values[row++] = -wall;
        rows(row, 0) = -1.0;
        values[row++] = -wall;
      }
      stage.inequality_jacobian = SparseBlock::from_dense(rows);
      stage.inequality_value = values;
      if (k == horizon) continue;
      Eigen::MatrixXd dynamics(2, 3);
      dynamics << 1, 0.1, 0.005, 0, 1, 0.1;
      stage.dynamics = SparseBlock::from_dense(dynamics);
      stage.implicit = SparseBlock::from_dense(Eigen::MatrixXd::Zero(2, 2));
      stage.offset = Eigen::VectorXd::Zero(2);
    }
    solution.resize(qp);
    PenaltyModel model;
    model.expand(qp, solution.w);
    ASSERT_EQ(solver->solve(qp, model, solution), QpStatus::Solved) << t;
    most = std::max(most, solver->recursions());
    all += solver->recursions();
    position = solution.w[1][0];
    velocity = solution.w[1][1] + 0.02 * normal(generator);
  }
  EXPECT_LE(most, 60);
  EXPECT_LE(all, 400 * 25);
}

TEST(HardRows, AFailureLeavesNothingBehind) {
  const auto solver = make_qp_solver("structured");
  StageQpSolution solution;
  const StageQp infeasible = reach(10, 11.0), feasible = reach(10, 9.0);
  for (int i = 0; i < 3; ++i) {
    solution.resize(infeasible);
    PenaltyModel model;
    model.expand(infeasible, solution.w);
    for (Eigen::VectorXd& nu : solution.inequality_multiplier) nu.setConstant(1e9);
    const auto before = solution.inequality_multiplier;
    EXPECT_EQ(solver->solve(infeasible, model, solution), QpStatus::PrimalInfeasible);
    EXPECT_EQ(solution.inequality_multiplier, before);
    EXPECT_EQ(solver->solve(feasible, model, solution), QpStatus::Solved);
    EXPECT_NEAR(solution.w[3][1], 0.9, 1e-7);
  }
}

TEST(HardRows, QpsWithoutThemGoToTheRecursion) {
  RandomStageQpOptions o = options();
  o.inequality_rows = {0, 0};
  const StageQp qp = random_stage_qp(o, 1);
  const Solve solve(qp);
  solve.expect_solved();
  const Eigen::VectorXd expected = DenseQp(qp,
                                           [&] {
                                             PenaltyModel model;
                                             StageQpSolution zero;
                                             zero.resize(qp);
                                             model.expand(qp, zero.w);
                                             return model;
                                           }())
                                       .solve();
  EXPECT_LE((solve.w() - expected).norm(), 1e-9 * (1.0 + expected.norm()));
}

}  // namespace
}  // namespace palanquin
