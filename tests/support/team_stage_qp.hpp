#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "palanquin/core/stage_qp.hpp"

namespace palanquin::testing {

enum class TeamGait { Trot, Stand, Flight };

struct TeamStageQpOptions {
  int robots = 2;
  int horizon = 15;
  TeamGait gait = TeamGait::Trot;
  int swap_interval = 7;  ///< knots between two swaps of a trot's diagonal pairs
  int phase = 0;          ///< knots since the last swap at the first knot
  int ditches = 0;        ///< one row per ditch and movable foot
};

/// A StageQp with the pattern of quadruped robots that carry a payload, values random: what the
/// linearisation of that problem looks like once footholds have their roles.
///
/// States: per body (payload first) position, rotation, velocity, angular velocity; then (x, y) of
/// every foot that touched down within the horizon and still stands. Inputs: stance forces, one
/// hand wrench per robot, (x, y) of the feet that touch down. Locals: positions of swing feet.
class TeamStageQp {
 public:
  TeamStageQp(const TeamStageQpOptions& options, unsigned seed)
      : options_(options), random_(seed) {}

  StageQp draw() {
    StageQp qp;
    for (int k = 0; k <= options_.horizon; ++k) knots_.push_back(lay_out(k));
    qp.stages.resize(knots_.size());
    for (int k = 0; k <= options_.horizon; ++k) {
      QpStage& stage = qp.stages[k];
      stage.nx = knots_[k].nx;
      stage.nu = knots_[k].nu;
      stage.nl = knots_[k].nl;
      add_cost(knots_[k], stage);
      add_penalties(knots_[k], stage);
      stage.equality_jacobian.begin(0);
      for (int j = 0; j < stage.nw(); ++j) stage.equality_jacobian.end_column();
      if (k < options_.horizon) add_dynamics(knots_[k], knots_[k + 1], stage);
    }
    qp.initial_state = vector(knots_[0].nx, 0.05);
    qp.structure_revision =
        ((options_.robots * 1000ull + options_.horizon) * 100 + options_.swap_interval) * 100 +
        options_.phase * 4 + static_cast<int>(options_.gait) + 100000000ull * options_.ditches;
    return qp;
  }

  /// A penalty model with about `active` of the rows curved and sloped, the others idle.
  PenaltyModel draw_model(const StageQp& qp, double active) {
    PenaltyModel model;
    model.resize(qp);
    for (int k = 0; k <= qp.horizon(); ++k)
      for (int j = 0; j < model.slope[k].size(); ++j) {
        const bool is_active = std::bernoulli_distribution(active)(random_);
        model.curvature[k][j] = is_active ? 840.0 : 0.0;
        model.slope[k][j] = is_active ? value(1.0) : 0.0;
      }
    return model;
  }

 private:
  static constexpr double kDt = 1.0 / 30.0;

  struct Foot {
    bool stance = false;
    int force = -1;     ///< first column of the force
    int position = -1;  ///< first column of the position: state, input (2) or local (3)
    int coordinates = 0;
    bool carried_on = false;  ///< a state of the next knot
  };
  struct Layout {
    int nx = 0, nu = 0, nl = 0;
    std::vector<std::array<Foot, 4>> feet;
    std::vector<int> wrench;  ///< first column per robot, -1 at the last knot
    int nw() const { return nx + nu + nl; }
  };

  static int body(int b) { return 12 * b; }  // payload is body 0, robot r body r + 1

  bool stands(int foot, int k) const {
    if (options_.gait != TeamGait::Trot) return options_.gait == TeamGait::Stand;
    const int pair = foot == 0 || foot == 3 ? 0 : 1;
    return ((k + options_.phase) / options_.swap_interval + pair) % 2 == 0;
  }
  bool stood_since_start(int foot, int k) const {
    for (int i = 0; i <= k; ++i)
      if (!stands(foot, i)) return false;
    return true;
  }

  Layout lay_out(int k) {
    Layout knot;
    const bool last = k == options_.horizon;
    knot.feet.resize(options_.robots);
    knot.wrench.assign(options_.robots, -1);
    knot.nx = body(options_.robots + 1);
    if (last) return knot;
    const auto for_feet = [&](auto visit) {
      for (auto& feet : knot.feet)
        for (int f = 0; f < 4; ++f) visit(feet[f], f);
    };
    for_feet([&](Foot& foot, int f) {
      foot.stance = stands(f, k);
      if (!foot.stance || stood_since_start(f, k)) return;
      foot.carried_on = k + 1 < options_.horizon && stands(f, k + 1);
      if (!stands(f, k - 1)) return;
      foot.position = knot.nx;
      foot.coordinates = 2;
      knot.nx += 2;
    });
    int next = knot.nx;
    for_feet([&](Foot& foot, int) {
      if (foot.stance) foot.force = next, next += 3;
    });
    for (int& wrench : knot.wrench) wrench = next, next += 6;
    for_feet([&](Foot& foot, int f) {  // touching down
      if (foot.stance && foot.position < 0 && !stood_since_start(f, k))
        foot.position = next, foot.coordinates = 2, next += 2;
    });
    knot.nu = next - knot.nx;
    for_feet([&](Foot& foot, int) {
      if (!foot.stance) foot.position = next, foot.coordinates = 3, next += 3;
    });
    knot.nl = next - knot.nx - knot.nu;
    return knot;
  }

  double value(double size) {
    const double v = std::uniform_real_distribution<double>(0.1, 1.0)(random_);
    return std::bernoulli_distribution(0.5)(random_) ? size * v : -size * v;
  }
  Eigen::VectorXd vector(int n, double size) {
    return Eigen::VectorXd::NullaryExpr(n, [&](Eigen::Index) { return value(size); });
  }
  Eigen::MatrixXd dense(int rows, int cols, double size) {
    return Eigen::MatrixXd::NullaryExpr(rows, cols,
                                        [&](Eigen::Index, Eigen::Index) { return value(size); });
  }

  void add_cost(const Layout& knot, QpStage& stage) {
    Eigen::MatrixXd h = Eigen::MatrixXd::Zero(knot.nw(), knot.nw());
    for (int j = 0; j < knot.nw(); ++j) h(j, j) = j < knot.nx ? 1.0 : 0.01;
    for (int r = 0; r < options_.robots; ++r) {
      for (const Foot& foot : knot.feet[r]) {  // weight (foot - position)^2
        for (int i = 0; i < foot.coordinates; ++i) {
          const int a = foot.position + i;
          const int b = body(r + 1) + i;
          h(a, a) += 5.0;
          h(b, b) += 5.0;
          h(std::max(a, b), std::min(a, b)) -= 5.0;
        }
      }
    }
    stage.hessian = SparseBlock::from_dense(h);
    stage.gradient = vector(knot.nw(), 0.1);
  }

  void add_penalties(const Layout& knot, QpStage& stage) {
    std::vector<Eigen::RowVectorXd> rows;
    const auto new_row = [&]() -> Eigen::RowVectorXd& {
      return rows.emplace_back(Eigen::RowVectorXd::Zero(knot.nw()));
    };
    for (int r = 0; r < options_.robots; ++r) {
      for (const Foot& foot : knot.feet[r]) {
        for (int i = 0; foot.stance && i < 5; ++i) {  // friction pyramid and normal force
          Eigen::RowVectorXd& row = new_row();
          row.segment(foot.force, 3) = vector(3, 1.0).transpose();
          if (foot.position >= 0) row.segment(foot.position, 2) = vector(2, 0.2).transpose();
        }
        if (knot.nu == 0) continue;
        for (int i = 0; i < 3; ++i) {  // leg's reach
          Eigen::RowVectorXd& row = new_row();
          row.segment(body(r + 1), 6) = vector(6, 0.5).transpose();
          row.segment(std::max(foot.position, 0), foot.coordinates) =
              vector(foot.coordinates, 0.5).transpose();
        }
        for (int i = 0; foot.position >= 0 && i < options_.ditches; ++i)
          new_row().segment(foot.position, 2) = vector(2, 1.0).transpose();
      }
      if (knot.nu > 0) {  // arm's reach
        Eigen::RowVectorXd& row = new_row();
        row.segment(body(0), 6) = vector(6, 0.5).transpose();
        row.segment(body(r + 1), 6) = vector(6, 0.5).transpose();
      }
    }
    Eigen::MatrixXd jacobian(rows.size(), knot.nw());
    for (std::size_t i = 0; i < rows.size(); ++i) jacobian.row(i) = rows[i];
    stage.penalty_jacobian = SparseBlock::from_dense(jacobian);
    stage.penalty_value = vector(static_cast<int>(rows.size()), 0.5);
    stage.penalty_policy.assign(rows.size(), Policy{PolicyKind::C2Penalty, 420.0, 1e-3});
  }

  void add_dynamics(const Layout& knot, const Layout& next, QpStage& stage) {
    Eigen::MatrixXd f = Eigen::MatrixXd::Zero(next.nx, knot.nw());
    Eigen::MatrixXd n = Eigen::MatrixXd::Zero(next.nx, next.nx);
    const auto identity = Eigen::Matrix3d::Identity();
    for (int b = 0; b <= options_.robots; ++b) {
      const int p = body(b), q = p + 3, v = p + 6, w = p + 9;
      f.block(p, p, 3, 3) = identity;
      n.block(p, v, 3, 3) = kDt * identity;
      f.block(q, q, 3, 3) = dense(3, 3, 0.02);
      f.block(q, q, 3, 3) += identity;
      n.block(q, w, 3, 3) = dense(3, 3, 0.1 * kDt);
      n.block(q, w, 3, 3) += kDt * identity;
      f.block(v, v, 3, 3) = identity;
      f.block(w, p, 3, 3) = dense(3, 3, kDt);
      f.block(w, q, 3, 3) = dense(3, 3, kDt);
      f.block(w, w, 3, 3) = dense(3, 3, 0.02);
      f.block(w, w, 3, 3) += identity;
    }
    for (int r = 0; r < options_.robots; ++r) {
      const int v = body(r + 1) + 6, w = v + 3;
      for (const Foot& foot : knot.feet[r]) {
        if (!foot.stance) continue;
        f.block(v, foot.force, 3, 3) = 4.0 * kDt * identity;
        f.block(w, foot.force, 3, 3) = dense(3, 3, 20.0 * kDt);
        if (foot.position >= 0) f.block(w, foot.position, 3, 2) = dense(3, 2, 20.0 * kDt);
      }
      const int hand = knot.wrench[r];
      f.block(v, hand, 3, 3) = 4.0 * kDt * identity;
      f.block(w, hand, 3, 6) = dense(3, 6, 20.0 * kDt);
      f.block(w, body(0), 3, 6) = dense(3, 6, kDt);
      f.block(6, hand, 3, 3) = -6.0 * kDt * identity;
      f.block(9, hand, 3, 6) = dense(3, 6, 20.0 * kDt);
    }
    f.block(9, 0, 3, 3).setZero();  // the payload's moments do not depend on where it is
    for (int r = 0; r < options_.robots; ++r)
      for (int i = 0; i < 4; ++i)
        if (knot.feet[r][i].carried_on)
          f.block(next.feet[r][i].position, knot.feet[r][i].position, 2, 2).setIdentity();
    stage.dynamics = SparseBlock::from_dense(f);
    stage.implicit = SparseBlock::from_dense(n);
    stage.offset = vector(next.nx, 0.01);
  }

  TeamStageQpOptions options_;
  std::mt19937 random_;
  std::vector<Layout> knots_;
};

}  // namespace palanquin::testing
