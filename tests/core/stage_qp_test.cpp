#include "palanquin/core/stage_qp.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "support/random_stage_qp.hpp"

namespace palanquin {
namespace {

using testing::random_stage_qp;
using testing::RandomStageQpOptions;

std::vector<Eigen::VectorXd> random_point(const StageQp& qp, unsigned seed) {
  std::srand(seed);
  std::vector<Eigen::VectorXd> w;
  for (const QpStage& stage : qp.stages) w.push_back(Eigen::VectorXd::Random(stage.nw()));
  return w;
}

/// Cost of the quadratic that `model` makes of the penalties, without constants.
double model_cost(const StageQp& qp, const PenaltyModel& model,
                  const std::vector<Eigen::VectorXd>& w) {
  double cost = 0.0;
  for (std::size_t k = 0; k < w.size(); ++k) {
    const QpStage& stage = qp.stages[k];
    const Eigen::MatrixXd lower = stage.hessian.dense();
    const Eigen::MatrixXd h = lower.selfadjointView<Eigen::Lower>();
    const Eigen::VectorXd t = stage.penalty_jacobian.dense() * w[k];
    cost += 0.5 * w[k].dot(h * w[k]) + stage.gradient.dot(w[k]) + model.slope[k].dot(t) +
            0.5 * t.dot(model.curvature[k].cwiseProduct(t));
  }
  return cost;
}

double lagrangian(const StageQp& qp, const PenaltyModel& model, const StageQpSolution& s) {
  double value = model_cost(qp, model, s.w);
  value += s.dynamics_multiplier[0].dot(qp.initial_state - s.w[0].head(qp.stages[0].nx));
  for (int k = 0; k <= qp.horizon(); ++k) {
    const QpStage& stage = qp.stages[k];
    if (k < qp.horizon()) {
      const auto next = s.w[k + 1].head(qp.stages[k + 1].nx);
      value += s.dynamics_multiplier[k + 1].dot(stage.dynamics.dense() * s.w[k] + stage.offset -
                                                next + stage.implicit.dense() * next);
    }
    value += s.equality_multiplier[k].dot(stage.equality_jacobian.dense() * s.w[k]);
    value += s.inequality_multiplier[k].dot(stage.inequality_jacobian.dense() * s.w[k]);
    value += s.link_multiplier[k].dot(stage.link_jacobian.dense() * s.w[k]);
    if (k > 0) value += s.link_multiplier[k].dot(stage.link_previous.dense() * s.w[k - 1]);
  }
  return value;
}

RandomStageQpOptions all_rows() {
  RandomStageQpOptions options;
  options.equality_rows = {0, 1};
  options.link_rows = {0, 1};
  options.inequality_rows = {0, 2};
  return options;
}

TEST(SparseBlock, ProductsMatchTheDenseOnes) {
  const StageQp qp = random_stage_qp({}, 3);
  const QpStage& stage = qp.stages[1];
  const Eigen::VectorXd w = Eigen::VectorXd::Random(stage.nw());
  const Eigen::VectorXd x = Eigen::VectorXd::Random(stage.dynamics.rows);
  Eigen::VectorXd y = x;
  stage.dynamics.multiply_add(w.data(), y.data(), -2.0);
  EXPECT_TRUE(y.isApprox(x - 2.0 * stage.dynamics.dense() * w, 1e-14));
  Eigen::VectorXd z = w;
  stage.dynamics.multiply_transposed_add(x.data(), z.data(), 3.0);
  EXPECT_TRUE(z.isApprox(w + 3.0 * stage.dynamics.dense().transpose() * x, 1e-14));
  Eigen::VectorXd hw = Eigen::VectorXd::Zero(stage.nw());
  stage.hessian.multiply_symmetric_add(w.data(), hw.data());
  const Eigen::MatrixXd lower = stage.hessian.dense();
  EXPECT_TRUE(hw.isApprox(lower.selfadjointView<Eigen::Lower>() * w, 1e-13));
}

TEST(StageQpSolution, ResizeFollowsTheDimensionsOfEveryKnot) {
  StageQpSolution solution;
  for (unsigned seed : {1u, 2u}) {
    const StageQp qp = random_stage_qp(all_rows(), seed);
    solution.resize(qp);
    for (std::size_t k = 0; k < qp.stages.size(); ++k) {
      EXPECT_EQ(solution.w[k].size(), qp.stages[k].nw());
      EXPECT_EQ(solution.dynamics_multiplier[k].size(), qp.stages[k].nx);
      EXPECT_EQ(solution.link_multiplier[k].size(), qp.stages[k].link_value.size());
    }
  }
}

TEST(StageQpSolution, ResizeKeepsAWarmStartOfTheSameSize) {
  const StageQp qp = random_stage_qp({}, 1);
  StageQpSolution solution;
  solution.resize(qp);
  solution.w[2].setConstant(5.0);
  solution.resize(qp);
  EXPECT_TRUE((solution.w[2].array() == 5.0).all());
}

TEST(PenaltyModel, HasTheCostsGradientAtItsExpansionPoint) {
  const StageQp qp = random_stage_qp({}, 5);
  const auto w = random_point(qp, 5);
  PenaltyModel model;
  model.expand(qp, w);
  const double step = 1e-6;
  for (std::size_t k = 0; k < w.size(); ++k) {
    for (Eigen::Index i = 0; i < w[k].size(); ++i) {
      auto left = w, right = w;
      left[k][i] -= step;
      right[k][i] += step;
      const double exact = (evaluate_cost(qp, right) - evaluate_cost(qp, left)) / (2 * step);
      const double modelled =
          (model_cost(qp, model, right) - model_cost(qp, model, left)) / (2 * step);
      EXPECT_NEAR(modelled, exact, 1e-5 * (1 + std::abs(exact)));
    }
  }
}

TEST(PenaltyModel, HasTheCostsCurvatureAtItsExpansionPoint) {
  const StageQp qp = random_stage_qp({}, 6);
  auto w = random_point(qp, 6);
  PenaltyModel model;
  model.expand(qp, w);
  for (std::size_t k = 0; k < w.size(); ++k)
    for (Eigen::Index j = 0; j < model.curvature[k].size(); ++j) {
      const double h =
          (qp.stages[k].penalty_value + qp.stages[k].penalty_jacobian.dense() * w[k])[j];
      EXPECT_DOUBLE_EQ(model.curvature[k][j],
                       evaluate_penalty(qp.stages[k].penalty_policy[j], h).curvature);
    }
}

TEST(KktResidual, StationarityIsTheGradientOfTheStatedLagrangian) {
  const StageQp qp = random_stage_qp(all_rows(), 7);
  StageQpSolution s;
  s.resize(qp);
  s.w = random_point(qp, 1);
  for (auto* list : {&s.dynamics_multiplier, &s.equality_multiplier, &s.inequality_multiplier,
                     &s.link_multiplier})
    for (auto& v : *list) v = Eigen::VectorXd::Random(v.size());
  PenaltyModel model;
  model.expand(qp, s.w);

  double largest = 0.0;
  for (std::size_t k = 0; k < s.w.size(); ++k)
    for (Eigen::Index i = 0; i < s.w[k].size(); ++i) {
      StageQpSolution left = s, right = s;  // the Lagrangian is quadratic: a wide step is exact
      left.w[k][i] -= 0.5;
      right.w[k][i] += 0.5;
      const double slope = lagrangian(qp, model, right) - lagrangian(qp, model, left);
      largest = std::max(largest, std::abs(slope));
    }
  EXPECT_NEAR(kkt_residual(qp, model, s).stationarity, largest, 1e-9 * largest);
}

TEST(KktResidual, SeesEveryKindOfRow) {
  StageQp qp = random_stage_qp({.horizon = 2,
                                .nx = {1, 1},
                                .nu = {2, 2},
                                .nl = {0, 0},
                                .penalty_rows = {0, 0},
                                .equality_rows = {1, 1},
                                .link_rows = {1, 1}},
                               8);
  StageQpSolution s;
  s.resize(qp);
  PenaltyModel model;
  model.resize(qp);
  for (QpStage& stage : qp.stages) {
    stage.offset.setZero();
    stage.equality_value.setZero();
    stage.link_value.setZero();
  }
  qp.initial_state.setConstant(-0.25);
  EXPECT_DOUBLE_EQ(kkt_residual(qp, model, s).dynamics, 0.25);
  qp.stages[1].offset.setConstant(0.5);
  EXPECT_DOUBLE_EQ(kkt_residual(qp, model, s).dynamics, 0.5);
  qp.stages[2].equality_value.setConstant(-2.0);
  EXPECT_DOUBLE_EQ(kkt_residual(qp, model, s).equality, 2.0);
  qp.stages[1].link_value.setConstant(3.0);
  EXPECT_DOUBLE_EQ(kkt_residual(qp, model, s).equality, 3.0);
  EXPECT_GE(kkt_residual(qp, model, s).max(), 3.0);
}

TEST(KktResidual, KeepsNaN) {
  const StageQp qp = random_stage_qp({}, 9);
  StageQpSolution s;
  s.resize(qp);
  s.w[1][0] = std::numeric_limits<double>::quiet_NaN();
  PenaltyModel model;
  model.resize(qp);
  EXPECT_TRUE(std::isnan(kkt_residual(qp, model, s).stationarity));
}

}  // namespace
}  // namespace palanquin
