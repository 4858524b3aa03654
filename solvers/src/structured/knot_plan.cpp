#include "structured/knot_plan.hpp"

#include <algorithm>
#include <stdexcept>

namespace palanquin::structured {

using kernels::padded;

void PlanCapacity::include(const QpStage& stage) {
  variables = std::max(variables, stage.nw());
  slots = std::max(slots, padded(stage.nl) + padded(stage.nu) + padded(stage.nx + 1));
  hessian = std::max(hessian, stage.hessian.nnz());
  penalty_rows = std::max(penalty_rows, stage.penalty_jacobian.rows);
  penalty = std::max(penalty, stage.penalty_jacobian.nnz());
  equality_rows = std::max(equality_rows, stage.equality_jacobian.rows);
  equality = std::max(equality, stage.equality_jacobian.nnz());
  states = std::max(states, stage.implicit.cols);
  locals = std::max(locals, stage.nl);
}

void PlanCapacity::apply(KnotPlan& plan) const {
  plan.slot.reserve(variables);
  plan.column_offset.reserve(slots);
  plan.hessian_target.reserve(hessian);
  plan.gradient_target.reserve(variables);
  plan.penalty.start.reserve(penalty_rows + 1);
  plan.penalty.slot.reserve(penalty);
  plan.penalty.entry.reserve(penalty);
  plan.equality.start.reserve(equality_rows + 1);
  plan.equality.slot.reserve(equality);
  plan.equality.entry.reserve(equality);
  plan.substitution_order.reserve(states);
  plan.groups.reserve(locals);
  plan.group_slots.reserve(locals * (slots + 2));
}

void KnotPlanner::plan(const QpStage& stage, KnotPlan& plan) {
  lay_out(stage, plan);
  target_hessian(stage.hessian, plan);
  list_rows(stage.penalty_jacobian, plan, plan.penalty);
  list_rows(stage.equality_jacobian, plan, plan.equality);
  order_substitution(stage.implicit, plan);
  group_locals(stage.hessian, plan);
}

void KnotPlanner::lay_out(const QpStage& stage, KnotPlan& plan) {
  plan.nx = stage.nx;
  plan.nu = stage.nu;
  plan.nl = stage.nl;
  plan.input_slot = padded(stage.nl);
  plan.state_slot = plan.input_slot + padded(stage.nu);
  plan.gradient_slot = plan.state_slot + stage.nx;
  plan.value_ld = padded(stage.nx + 1);
  plan.panel_ld = padded(stage.nu) + plan.value_ld;
  plan.panel_offset = stage.nl * plan.slots();
  // Whole cache lines: nl * slots() is a multiple of kPad as slots() is.
  plan.value_offset = plan.panel_offset + padded(stage.nu) * plan.panel_ld;
  plan.storage_size = plan.value_offset + padded(stage.nx) * plan.value_ld;

  plan.slot.resize(stage.nw());
  for (int j = 0; j < stage.nx; ++j) plan.slot[j] = plan.state_slot + j;
  for (int j = 0; j < stage.nu; ++j) plan.slot[stage.nx + j] = plan.input_slot + j;
  for (int j = 0; j < stage.nl; ++j) plan.slot[stage.nx + stage.nu + j] = j;

  plan.column_offset.resize(plan.gradient_slot);
  for (int j = 0; j < plan.input_slot; ++j) plan.column_offset[j] = j * plan.slots();
  for (int j = plan.input_slot; j < plan.state_slot; ++j)
    plan.column_offset[j] =
        plan.panel_offset + (j - plan.input_slot) * plan.panel_ld - plan.input_slot;
  for (int j = plan.state_slot; j < plan.gradient_slot; ++j)
    plan.column_offset[j] =
        plan.value_offset + (j - plan.state_slot) * plan.value_ld - plan.state_slot;

  plan.gradient_target.resize(stage.nw());
  for (int j = 0; j < stage.nw(); ++j)
    plan.gradient_target[j] = plan.column_offset[plan.slot[j]] + plan.gradient_slot;
}

void KnotPlanner::target_hessian(const SparseBlock& hessian, KnotPlan& plan) {
  plan.hessian_target.resize(hessian.nnz());
  for (int j = 0; j < hessian.cols; ++j) {
    for (int e = hessian.column_start[j]; e < hessian.column_start[j + 1]; ++e) {
      const int a = plan.slot[j];
      const int b = plan.slot[hessian.row_index[e]];
      plan.hessian_target[e] = plan.column_offset[std::min(a, b)] + std::max(a, b);
    }
  }
}

void KnotPlanner::list_rows(const SparseBlock& block, const KnotPlan& plan, RowPattern& rows) {
  rows.start.assign(block.rows + 1, 0);
  rows.slot.resize(block.nnz());
  rows.entry.resize(block.nnz());
  for (int e = 0; e < block.nnz(); ++e) ++rows.start[block.row_index[e] + 1];
  for (int i = 0; i < block.rows; ++i) rows.start[i + 1] += rows.start[i];
  const auto append_columns = [&](int first, int count) {
    for (int j = first; j < first + count; ++j) {
      for (int e = block.column_start[j]; e < block.column_start[j + 1]; ++e) {
        const int at = rows.start[block.row_index[e]]++;
        rows.slot[at] = plan.slot[j];
        rows.entry[at] = e;
      }
    }
  };
  if (block.nnz() > 0) {  // in the order of slots: locals, inputs, states
    append_columns(plan.nx + plan.nu, plan.nl);
    append_columns(plan.nx, plan.nu);
    append_columns(0, plan.nx);
  }
  for (int i = block.rows; i > 0; --i) rows.start[i] = rows.start[i - 1];
  rows.start[0] = 0;
}

void KnotPlanner::order_substitution(const SparseBlock& implicit, KnotPlan& plan) {
  plan.substitution_order.clear();
  if (implicit.nnz() == 0) return;
  // A column is ready when every column that it names stands in the order or is empty.
  const auto is_empty = [&](int c) {
    return implicit.column_start[c] == implicit.column_start[c + 1];
  };
  waiting_.assign(implicit.cols, 0);
  int left = 0;
  for (int c = 0; c < implicit.cols; ++c) {
    if (is_empty(c)) continue;
    waiting_[c] = 1;
    ++left;
  }
  while (left > 0) {
    const int before = left;
    for (int c = 0; c < implicit.cols; ++c) {
      if (waiting_[c] == 0) continue;
      bool ready = true;
      for (int e = implicit.column_start[c]; e < implicit.column_start[c + 1]; ++e)
        ready = ready && waiting_[implicit.row_index[e]] == 0;
      if (!ready) continue;
      plan.substitution_order.push_back(c);
      waiting_[c] = 0;
      --left;
    }
    if (left == before)
      throw std::invalid_argument(
          "StageQp: the entries of `implicit` close a chain, but it must "
          "be nilpotent");
  }
}

}  // namespace palanquin::structured
