#include "flat_qp.hpp"

#include <algorithm>

#include "palanquin/core/finite.hpp"
#include "palanquin/core/stage_qp_check.hpp"

namespace palanquin {
namespace {

void push_entry(SparseBlock& target, int row, std::vector<int>& map) {
  map.push_back(static_cast<int>(target.row_index.size()));
  target.push(row);
}

/// Appends column `j` of `block` to the column under construction.
void append_column(const SparseBlock& block, int j, int first_row, SparseBlock& target,
                   std::vector<int>& map) {
  if (j >= block.cols) return;  // a block without rows may have no columns either
  for (int p = block.column_start[j]; p < block.column_start[j + 1]; ++p)
    push_entry(target, first_row + block.row_index[p], map);
}

/// Appends column `j` of I - `implicit`, whose diagonal is one for good.
void append_implicit_column(const SparseBlock& implicit, int j, int first_row, SparseBlock& target,
                            std::vector<int>& map) {
  int p = implicit.column_start[j];
  const int end = implicit.column_start[j + 1];
  for (; p < end && implicit.row_index[p] < j; ++p)
    push_entry(target, first_row + implicit.row_index[p], map);
  target.push(first_row + j, 1.0);
  for (; p < end; ++p) push_entry(target, first_row + implicit.row_index[p], map);
}

/// target[map[i]] = sign * (value i of the block's free columns)
void scatter(const SparseBlock& block, int fixed_columns, const std::vector<int>& map, double sign,
             std::vector<double>& target) {
  const int first = block.column_start[std::min(fixed_columns, block.cols)];
  const double* values = block.values.data() + first;
  for (std::size_t i = 0; i < map.size(); ++i) target[map[i]] = sign * values[i];
}

}  // namespace

void FlatQp::analyse(const StageQp& qp) {
  require_consistent(qp);
  number_rows_and_variables(qp);
  hessian.begin(static_cast<int>(gradient.size()));
  constraints.begin(static_cast<int>(right_side.size()));
  for (int k = 0; k <= qp.horizon(); ++k) {
    list_penalty_entries(qp.stages[k], maps_[k]);
    build_hessian(qp.stages[k], maps_[k]);
    build_constraints(qp, k);
  }
  fixed_w_.setZero(qp.stages[0].nw());
  gradient_.setZero(qp.stages[0].nw());
  slope_.setZero(qp.stages[0].penalty_value.size());
}

void FlatQp::number_rows_and_variables(const StageQp& qp) {
  maps_.assign(qp.stages.size(), {});
  is_inequality.clear();
  int variable = 0;
  for (int k = 0; k <= qp.horizon(); ++k) {
    const QpStage& stage = qp.stages[k];
    StageMap& map = maps_[k];
    map.fixed_columns = k == 0 ? stage.nx : 0;
    map.first_variable = variable;
    variable += stage.nw() - map.fixed_columns;

    const auto number_rows = [this](Eigen::Index count, bool inequality) {
      const int first = static_cast<int>(is_inequality.size());
      is_inequality.insert(is_inequality.end(), count, inequality);
      return first;
    };
    map.link_row = number_rows(stage.link_value.size(), false);
    map.equality_row = number_rows(stage.equality_value.size(), false);
    map.inequality_row = number_rows(stage.inequality_value.size(), true);
    map.dynamics_row = number_rows(stage.offset.size(), false);
  }
  gradient.setZero(variable);
  right_side.setZero(static_cast<Eigen::Index>(is_inequality.size()));
}

void FlatQp::list_penalty_entries(const QpStage& stage, StageMap& map) {
  const SparseBlock& jacobian = stage.penalty_jacobian;
  map.row_start.assign(jacobian.rows + 1, 0);
  const int first = jacobian.column_start[std::min(map.fixed_columns, jacobian.cols)];
  for (int p = first; p < jacobian.nnz(); ++p) ++map.row_start[jacobian.row_index[p] + 1];
  for (int row = 0; row < jacobian.rows; ++row) map.row_start[row + 1] += map.row_start[row];

  map.entry_position.resize(map.row_start.back());
  map.entry_variable.resize(map.row_start.back());
  std::vector<int> next(map.row_start.begin(), map.row_start.end() - 1);
  for (int j = map.fixed_columns; j < jacobian.cols; ++j)
    for (int p = jacobian.column_start[j]; p < jacobian.column_start[j + 1]; ++p) {
      const int entry = next[jacobian.row_index[p]]++;
      map.entry_position[entry] = p;
      map.entry_variable[entry] = map.first_variable + j - map.fixed_columns;
    }
  for (int row = 0; row < jacobian.rows; ++row)
    penalty_row_.resize(
        std::max<std::size_t>(penalty_row_.size(), map.row_start[row + 1] - map.row_start[row]));
}

void FlatQp::build_hessian(const QpStage& stage, StageMap& map) {
  const int size = stage.nw() - map.fixed_columns;
  // First which (row, column) of the knot's upper triangle exist, then their positions in P.
  Eigen::MatrixXi slot = Eigen::MatrixXi::Identity(size, size);
  const auto for_each_penalty_pair = [&map](int row, auto&& visit) {
    for (int a = map.row_start[row]; a < map.row_start[row + 1]; ++a)
      for (int b = map.row_start[row]; b <= a; ++b)
        visit(map.entry_variable[b] - map.first_variable,
              map.entry_variable[a] - map.first_variable);
  };
  for (int j = map.fixed_columns; j < stage.nw(); ++j)
    for (int p = stage.hessian.column_start[j]; p < stage.hessian.column_start[j + 1]; ++p)
      slot(j - map.fixed_columns, stage.hessian.row_index[p] - map.fixed_columns) = 1;
  for (int row = 0; row < stage.penalty_jacobian.rows; ++row)
    for_each_penalty_pair(row, [&](int b, int a) { slot(b, a) = 1; });

  for (int a = 0; a < size; ++a) {
    for (int b = 0; b <= a; ++b)
      if (slot(b, a)) {
        slot(b, a) = static_cast<int>(hessian.row_index.size());
        hessian.push(map.first_variable + b);
      }
    hessian.end_column();
  }

  for (int j = map.fixed_columns; j < stage.nw(); ++j)
    for (int p = stage.hessian.column_start[j]; p < stage.hessian.column_start[j + 1]; ++p)
      map.hessian.push_back(
          slot(j - map.fixed_columns, stage.hessian.row_index[p] - map.fixed_columns));
  map.pair_start.assign(1, 0);
  for (int row = 0; row < stage.penalty_jacobian.rows; ++row) {
    for_each_penalty_pair(row, [&](int b, int a) { map.pairs.push_back(slot(b, a)); });
    map.pair_start.push_back(static_cast<int>(map.pairs.size()));
  }
}

void FlatQp::build_constraints(const StageQp& qp, int k) {
  const QpStage& stage = qp.stages[k];
  StageMap& map = maps_[k];
  for (int j = map.fixed_columns; j < stage.nw(); ++j) {
    if (k > 0 && j < stage.nx)
      append_implicit_column(qp.stages[k - 1].implicit, j, maps_[k - 1].dynamics_row, constraints,
                             map.implicit);
    append_column(stage.link_jacobian, j, map.link_row, constraints, map.link);
    append_column(stage.equality_jacobian, j, map.equality_row, constraints, map.equality);
    append_column(stage.inequality_jacobian, j, map.inequality_row, constraints, map.inequality);
    if (k < qp.horizon()) {
      append_column(stage.dynamics, j, map.dynamics_row, constraints, map.dynamics);
      append_column(qp.stages[k + 1].link_previous, j, maps_[k + 1].link_row, constraints,
                    map.link_previous);
    }
    constraints.end_column();
  }
}

void FlatQp::update(const StageQp& qp, const PenaltyModel& model) {
  std::fill(hessian.values.begin(), hessian.values.end(), 0.0);
  for (int k = 0; k <= qp.horizon(); ++k) {
    const QpStage& stage = qp.stages[k];
    const StageMap& map = maps_[k];
    scatter(stage.hessian, map.fixed_columns, map.hessian, 1.0, hessian.values);
    add_curvatures(stage, map, model.curvature[k]);
    update_constraints(qp, k);
    if (k == 0) continue;
    update_right_side(qp, k);
    gradient.segment(map.first_variable, stage.nw()) = stage.gradient;
    add_slopes(stage, map, model.slope[k]);
  }
  update_initial_state(qp, model);
}

/// hessian += J'D J
void FlatQp::add_curvatures(const QpStage& stage, const StageMap& map,
                            const Eigen::VectorXd& curvature) {
  for (int j = 0; j < stage.penalty_jacobian.rows; ++j) {
    if (curvature[j] == 0.0) continue;  // most rows are inactive
    const int first = map.row_start[j];
    const int length = map.row_start[j + 1] - first;
    const int* pair = map.pairs.data() + map.pair_start[j];
    for (int a = 0; a < length; ++a) {
      const double value = stage.penalty_jacobian.values[map.entry_position[first + a]];
      penalty_row_[a] = value;
      const double scaled = curvature[j] * value;
      for (int b = 0; b <= a; ++b) hessian.values[*pair++] += scaled * penalty_row_[b];
    }
  }
}

/// gradient += J'slope
void FlatQp::add_slopes(const QpStage& stage, const StageMap& map, const Eigen::VectorXd& slope) {
  for (int j = 0; j < stage.penalty_jacobian.rows; ++j) {
    if (slope[j] == 0.0) continue;
    for (int a = map.row_start[j]; a < map.row_start[j + 1]; ++a)
      gradient[map.entry_variable[a]] +=
          slope[j] * stage.penalty_jacobian.values[map.entry_position[a]];
  }
}

void FlatQp::update_constraints(const StageQp& qp, int k) {
  const QpStage& stage = qp.stages[k];
  const StageMap& map = maps_[k];
  std::vector<double>& a = constraints.values;
  if (k > 0) scatter(qp.stages[k - 1].implicit, 0, map.implicit, -1.0, a);
  scatter(stage.link_jacobian, map.fixed_columns, map.link, 1.0, a);
  scatter(stage.equality_jacobian, map.fixed_columns, map.equality, 1.0, a);
  scatter(stage.inequality_jacobian, map.fixed_columns, map.inequality, 1.0, a);
  if (k == qp.horizon()) return;
  scatter(stage.dynamics, map.fixed_columns, map.dynamics, -1.0, a);
  scatter(qp.stages[k + 1].link_previous, map.fixed_columns, map.link_previous, 1.0, a);
}

void FlatQp::update_right_side(const StageQp& qp, int k) {
  const QpStage& stage = qp.stages[k];
  const StageMap& map = maps_[k];
  right_side.segment(map.link_row, stage.link_value.size()) = -stage.link_value;
  right_side.segment(map.equality_row, stage.equality_value.size()) = -stage.equality_value;
  right_side.segment(map.inequality_row, stage.inequality_value.size()) = -stage.inequality_value;
  right_side.segment(map.dynamics_row, stage.offset.size()) = stage.offset;
}

void FlatQp::update_initial_state(const StageQp& qp, const PenaltyModel& model) {
  const QpStage& stage = qp.stages[0];
  const StageMap& map = maps_[0];
  const int size = stage.nw() - stage.nx;
  fixed_w_.head(stage.nx) = qp.initial_state;

  gradient_.setZero();
  stage.hessian.multiply_symmetric_add(fixed_w_.data(), gradient_.data());
  gradient.head(size) = stage.gradient.tail(size) + gradient_.tail(size);
  slope_.setZero();
  stage.penalty_jacobian.multiply_add(fixed_w_.data(), slope_.data());
  slope_ = model.slope[0] + model.curvature[0].cwiseProduct(slope_);
  add_slopes(stage, map, slope_);

  double* r = right_side.data();
  update_right_side(qp, 0);
  stage.equality_jacobian.multiply_add(fixed_w_.data(), r + map.equality_row, -1.0);
  stage.inequality_jacobian.multiply_add(fixed_w_.data(), r + map.inequality_row, -1.0);
  if (qp.horizon() == 0) return;
  stage.dynamics.multiply_add(fixed_w_.data(), r + map.dynamics_row);
  const Eigen::VectorXd& link = qp.stages[1].link_value;
  right_side.segment(maps_[1].link_row, link.size()) = -link;
  qp.stages[1].link_previous.multiply_add(fixed_w_.data(), r + maps_[1].link_row, -1.0);
}

bool FlatQp::is_finite() const {
  return all_finite(hessian.values) && all_finite(constraints.values) && all_finite(gradient) &&
         all_finite(right_side);
}

void FlatQp::pack(const StageQpSolution& solution, double* z, double* y) const {
  const auto copy = [](const auto& from, double* to) { std::copy(from.begin(), from.end(), to); };
  for (std::size_t k = 0; k < maps_.size(); ++k) {
    const StageMap& map = maps_[k];
    copy(solution.w[k].tail(solution.w[k].size() - map.fixed_columns), z + map.first_variable);
    copy(solution.link_multiplier[k], y + map.link_row);
    copy(solution.equality_multiplier[k], y + map.equality_row);
    copy(solution.inequality_multiplier[k], y + map.inequality_row);
    if (k + 1 < maps_.size()) copy(-solution.dynamics_multiplier[k + 1], y + map.dynamics_row);
  }
}

void FlatQp::unpack(const StageQp& qp, const PenaltyModel& model, const double* z, const double* y,
                    StageQpSolution& solution) {
  const auto copy = [](const double* from, auto&& to) {
    to = Eigen::Map<const Eigen::VectorXd>(from, to.size());
  };
  for (std::size_t k = 0; k < maps_.size(); ++k) {
    const StageMap& map = maps_[k];
    Eigen::VectorXd& w = solution.w[k];
    copy(z + map.first_variable, w.tail(w.size() - map.fixed_columns));
    copy(y + map.link_row, solution.link_multiplier[k]);
    copy(y + map.equality_row, solution.equality_multiplier[k]);
    copy(y + map.inequality_row, solution.inequality_multiplier[k]);
    if (k + 1 == maps_.size()) continue;
    copy(y + map.dynamics_row, solution.dynamics_multiplier[k + 1]);
    solution.dynamics_multiplier[k + 1] *= -1.0;  // A holds the dynamics with the opposite sign
  }
  const int nx = qp.stages[0].nx;
  solution.w[0].head(nx) = qp.initial_state;
  solution.dynamics_multiplier[0].setZero();
  lagrangian_gradient(qp, model, solution, 0, gradient_, slope_);
  solution.dynamics_multiplier[0] = gradient_.head(nx);
}

}  // namespace palanquin
