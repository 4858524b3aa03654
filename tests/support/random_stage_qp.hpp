#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "palanquin/core/stage_qp.hpp"

namespace palanquin::testing {

/// A range of integers, both ends included, from which every knot draws its own dimension.
struct Range {
  int low = 0;
  int high = 0;
};

/// What a random StageQp contains. Equality and link rows together never outnumber a knot's inputs
/// and locals, so that the rows stay independent.
struct RandomStageQpOptions {
  int horizon = 5;
  Range nx{3, 6};
  Range nu{2, 4};
  Range nl{0, 2};
  Range penalty_rows{0, 6};
  Range equality_rows{0, 0};
  Range link_rows{0, 0};
  Range inequality_rows{0, 0};
  double density = 0.4;    ///< of dynamics and cost residuals
  bool implicit = true;    ///< give the dynamics an implicit part
  bool last_input = true;  ///< the last knot has inputs too
};

/// Draws StageQps that are feasible by construction: a random trajectory satisfies every row, the
/// hard inequalities with a random slack. The pattern depends on `seed` alone, the values on
/// `value_seed` as well, and equal patterns get equal structure revisions.
class RandomStageQp {
 public:
  RandomStageQp(const RandomStageQpOptions& options, unsigned seed, unsigned value_seed = 0)
      : options_(options), pattern_(seed), values_(7919u * seed + value_seed + 1u) {}

  StageQp draw() {
    StageQp qp;
    const int horizon = options_.horizon;
    qp.stages.resize(horizon + 1);
    for (int k = 0; k <= horizon; ++k) {
      QpStage& stage = qp.stages[k];
      stage.nx = draw_int(options_.nx);
      stage.nu = k < horizon || options_.last_input ? draw_int(options_.nu) : 0;
      stage.nl = draw_int(options_.nl);
    }
    qp.initial_state = vector(qp.stages[0].nx);
    Eigen::VectorXd previous;  // the feasible trajectory, knot by knot
    Eigen::VectorXd x = qp.initial_state;
    for (int k = 0; k <= horizon; ++k) {
      QpStage& stage = qp.stages[k];
      Eigen::VectorXd w(stage.nw());
      w << x, vector(stage.nu + stage.nl);
      add_cost(stage);
      add_penalties(stage);
      add_rows(stage, k > 0 ? &qp.stages[k - 1] : nullptr, previous, w);
      if (k < horizon) x = add_dynamics(stage, qp.stages[k + 1].nx, w);
      previous = w;
    }
    qp.structure_revision = pattern_hash(qp);
    return qp;
  }

 private:
  int draw_int(Range range) {
    return std::uniform_int_distribution<int>(range.low, range.high)(pattern_);
  }
  bool flip(double probability) { return std::bernoulli_distribution(probability)(pattern_); }
  double value(double low = -1.0, double high = 1.0) {
    return std::uniform_real_distribution<double>(low, high)(values_);
  }
  Eigen::VectorXd vector(int size) {
    return Eigen::VectorXd::NullaryExpr(size, [this](Eigen::Index) { return value(); });
  }
  Eigen::MatrixXd sparse(int rows, int cols, double density) {
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(rows, cols);
    for (int j = 0; j < cols; ++j)
      for (int i = 0; i < rows; ++i)
        if (flip(density)) m(i, j) = value();
    return m;
  }

  /// H = B'B + diag(0, positive): semidefinite in w, definite in (u, l).
  void add_cost(QpStage& stage) {
    const int nw = stage.nw();
    const Eigen::MatrixXd residual = sparse(nw, nw, options_.density);
    Eigen::MatrixXd h = residual.transpose() * residual;
    for (int i = stage.nx; i < nw; ++i) h(i, i) += value(0.1, 1.0);
    stage.hessian.begin(nw);
    for (int j = 0; j < nw; ++j) {
      for (int i = j; i < nw; ++i)
        if (i == j || h(i, j) != 0.0) stage.hessian.push(i, h(i, j));
      stage.hessian.end_column();
    }
    stage.gradient = vector(nw);
  }

  void add_penalties(QpStage& stage) {
    const int rows = draw_int(options_.penalty_rows);
    stage.penalty_jacobian = SparseBlock::from_dense(sparse(rows, stage.nw(), 0.3));
    stage.penalty_value = vector(rows);
    for (int j = 0; j < rows; ++j) {
      const auto kind = static_cast<PolicyKind>(1 + j % 3);
      const double stiffness = kind == PolicyKind::RelaxedBarrier ? 0.1 : value(1.0, 50.0);
      stage.penalty_policy.push_back({kind, stiffness, value(0.05, 0.3)});
    }
  }

  /// Equality and link rows each get an input or local of their own, so that they are independent.
  void add_rows(QpStage& stage, const QpStage* before, const Eigen::VectorXd& w_before,
                const Eigen::VectorXd& w) {
    const int nw = stage.nw();
    const int free = stage.nu + stage.nl;
    const int equalities = std::min(draw_int(options_.equality_rows), free);
    const int links = before ? std::min(draw_int(options_.link_rows), free - equalities) : 0;

    Eigen::MatrixXd c = sparse(equalities, nw, 0.3);
    for (int i = 0; i < equalities; ++i) c(i, stage.nx + i) += 3.0;
    stage.equality_jacobian = SparseBlock::from_dense(c);
    stage.equality_value = -c * w;

    Eigen::MatrixXd e = sparse(links, nw, 0.3);
    for (int i = 0; i < links; ++i) e(i, stage.nx + equalities + i) += 3.0;
    stage.link_jacobian = SparseBlock::from_dense(e);
    stage.link_value = -e * w;
    if (before) {
      const Eigen::MatrixXd p = sparse(links, before->nw(), 0.3);
      stage.link_previous = SparseBlock::from_dense(p);
      stage.link_value -= p * w_before;
    }

    const int inequalities = draw_int(options_.inequality_rows);
    const Eigen::MatrixXd d = sparse(inequalities, nw, 0.4);
    stage.inequality_jacobian = SparseBlock::from_dense(d);
    stage.inequality_value = -d * w;
    for (double& slack : stage.inequality_value) slack -= value(0.0, 0.5);
  }

  /// Returns the next state of the feasible trajectory.
  Eigen::VectorXd add_dynamics(QpStage& stage, int next_nx, const Eigen::VectorXd& w) {
    // Scaled so that the state neither dies out nor blows up over a long horizon.
    const int cols = stage.nx + stage.nu;
    const double scale = 0.5 / std::sqrt(std::max(1.0, options_.density * cols));
    Eigen::MatrixXd f = Eigen::MatrixXd::Zero(next_nx, stage.nw());
    f.leftCols(cols) = scale * sparse(next_nx, cols, options_.density);
    for (int i = 0; i < std::min(next_nx, stage.nx); ++i) f(i, i) += 0.8;
    stage.dynamics = SparseBlock::from_dense(f);
    stage.offset = vector(next_nx);

    // An implicit part along a random order of the states: entry (i, j) only if j comes before i.
    std::vector<int> order(next_nx);
    for (int i = 0; i < next_nx; ++i) order[i] = i;
    std::shuffle(order.begin(), order.end(), pattern_);
    Eigen::MatrixXd n = Eigen::MatrixXd::Zero(next_nx, next_nx);
    for (int i = 0; i < next_nx; ++i)
      for (int j = 0; j < i; ++j)
        if (options_.implicit && flip(1.5 / next_nx)) n(order[i], order[j]) = 0.5 * value();
    stage.implicit = SparseBlock::from_dense(n);

    if (next_nx == 0) return Eigen::VectorXd(0);  // Eigen's LU asserts on an empty matrix
    const Eigen::MatrixXd left = Eigen::MatrixXd::Identity(next_nx, next_nx) - n;
    return left.fullPivLu().solve(f * w + stage.offset);
  }

  static void mix(std::uint64_t& hash, std::uint64_t number) {
    hash = (hash ^ number) * 1099511628211ull;
  }
  static void mix(std::uint64_t& hash, const SparseBlock& block) {
    mix(hash, static_cast<std::uint64_t>(block.rows));
    for (int start : block.column_start) mix(hash, static_cast<std::uint64_t>(start));
    for (int row : block.row_index) mix(hash, static_cast<std::uint64_t>(row));
  }
  static std::uint64_t pattern_hash(const StageQp& qp) {
    std::uint64_t hash = 14695981039346656037ull;
    for (const QpStage& s : qp.stages) {
      for (int size : {s.nx, s.nu, s.nl}) mix(hash, static_cast<std::uint64_t>(size));
      for (const SparseBlock* block :
           {&s.dynamics, &s.implicit, &s.hessian, &s.penalty_jacobian, &s.equality_jacobian,
            &s.inequality_jacobian, &s.link_previous, &s.link_jacobian})
        mix(hash, *block);
    }
    return hash;
  }

  RandomStageQpOptions options_;
  std::mt19937 pattern_;
  std::mt19937 values_;
};

inline StageQp random_stage_qp(const RandomStageQpOptions& options, unsigned seed,
                               unsigned value_seed = 0) {
  return RandomStageQp(options, seed, value_seed).draw();
}

}  // namespace palanquin::testing
