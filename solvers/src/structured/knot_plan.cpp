#include "structured/knot_plan.hpp"

#include <algorithm>
#include <stdexcept>

namespace palanquin::structured {

using kernels::padded;

void PlanCapacity::Rows::include(const SparseBlock& block) {
  rows = std::max(rows, block.rows);
  entries = std::max(entries, block.nnz());
}

void PlanCapacity::Rows::apply(RowPattern& pattern) const {
  pattern.start.reserve(rows + 1);
  pattern.slot.reserve(entries);
  pattern.entry.reserve(entries);
  pattern.run_start.reserve(rows + 1);
  pattern.run_begin.reserve(entries + 1);
}

void PlanCapacity::include(const QpStage& stage) {
  variables = std::max(variables, stage.nw());
  slots = std::max(slots, lay_out(stage).slots());
  hessian = std::max(hessian, stage.hessian.nnz());
  dynamics = std::max(dynamics, stage.dynamics.nnz());
  states = std::max(states, stage.implicit.cols);
  locals = std::max(locals, stage.nl);
  penalty.include(stage.penalty_jacobian);
  hard.include(stage.inequality_jacobian);
  equality.include(stage.equality_jacobian);
}

void PlanCapacity::apply(KnotPlan& plan) const {
  plan.slot.reserve(variables);
  for (auto* entries : {&plan.local_hessian, &plan.input_hessian, &plan.state_hessian})
    entries->reserve(hessian);
  plan.dynamics.reserve(dynamics);
  penalty.apply(plan.penalty);
  hard.apply(plan.hard);
  equality.apply(plan.equality);
  plan.substitution_order.reserve(states);
  plan.remembered.hessian.reserve(hessian);
  plan.remembered.penalty.reserve(penalty.rows);
  plan.remembered.hard.reserve(hard.rows);
  plan.groups.reserve(locals);
  plan.local_slot.reserve(locals);
  plan.local_row.reserve(locals);
  plan.run_slot.reserve(locals * slots);
  plan.run_size.reserve(locals * slots);
}

KnotLayout lay_out(const QpStage& stage) {
  KnotLayout layout;
  layout.nx = stage.nx;
  layout.nu = stage.nu;
  layout.nl = stage.nl;
  layout.input_slot = padded(stage.nl);
  layout.state_slot = layout.input_slot + padded(stage.nu);
  layout.gradient_slot = layout.state_slot + stage.nx;
  layout.value_ld = padded(stage.nx + 1);
  layout.panel_ld = padded(stage.nu) + layout.value_ld;
  return layout;
}

bool KnotPlan::fits(const QpStage& stage) const {
  const auto has_rows = [](const RowPattern& rows, const SparseBlock& block) {
    return rows.rows() == block.rows && rows.slot.size() == block.values.size();
  };
  return nx == stage.nx && nu == stage.nu && nl == stage.nl &&
         local_hessian.size() + input_hessian.size() + state_hessian.size() ==
             stage.hessian.values.size() &&
         next_nx == stage.dynamics.rows && dynamics.entries() == stage.dynamics.nnz() &&
         implicit_entries == stage.implicit.nnz() && has_rows(penalty, stage.penalty_jacobian) &&
         has_rows(hard, stage.inequality_jacobian) && has_rows(equality, stage.equality_jacobian);
}

void KnotPlanner::plan(const QpStage& stage, KnotPlan& plan) {
  static_cast<KnotLayout&>(plan) = lay_out(stage);
  number_slots(stage, plan);
  list_hessian(stage.hessian, plan);
  plan.next_nx = stage.dynamics.rows;
  plan.dynamics.make(stage.dynamics, plan.slot);
  plan.implicit_entries = stage.implicit.nnz();
  list_rows(stage.penalty_jacobian, plan, plan.penalty);
  list_rows(stage.inequality_jacobian, plan, plan.hard);
  list_rows(stage.equality_jacobian, plan, plan.equality);
  order_substitution(stage.implicit, plan);
  find_remembered(stage, plan);
  group_locals(stage.hessian, plan);
}

void KnotPlanner::number_slots(const QpStage& stage, KnotPlan& plan) {
  plan.slot.resize(stage.nw());
  for (int j = 0; j < stage.nx; ++j) plan.slot[j] = plan.state_slot + j;
  for (int j = 0; j < stage.nu; ++j) plan.slot[stage.nx + j] = plan.input_slot + j;
  for (int j = 0; j < stage.nl; ++j) plan.slot[stage.nx + stage.nu + j] = j;
}

void KnotPlanner::list_hessian(const SparseBlock& hessian, KnotPlan& plan) {
  for (auto* entries : {&plan.local_hessian, &plan.input_hessian, &plan.state_hessian})
    entries->clear();
  for (int j = 0; j < hessian.cols; ++j) {
    for (int e = hessian.column_start[j]; e < hessian.column_start[j + 1]; ++e) {
      const auto [low, high] = std::minmax(plan.slot[j], plan.slot[hessian.row_index[e]]);
      if (low < plan.nl) {
        plan.local_hessian.push_back({e, low * plan.local_ld() + high});
      } else {
        const bool is_input = low < plan.state_slot;
        const int first = is_input ? plan.input_slot : plan.state_slot;
        const int ld = is_input ? plan.panel_ld : plan.value_ld;
        (is_input ? plan.input_hessian : plan.state_hessian)
            .push_back({e, (low - first) * ld + high - first});
      }
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
  cut_runs(plan, rows);
}

void KnotPlanner::cut_runs(const KnotPlan& plan, RowPattern& rows) {
  const auto kind = [&](int slot) { return (slot >= plan.input_slot) + (slot >= plan.state_slot); };
  rows.run_start.clear();
  rows.run_begin.clear();
  for (int i = 0; i < rows.rows(); ++i) {
    rows.run_start.push_back(static_cast<int>(rows.run_begin.size()));
    for (int e = rows.start[i]; e < rows.start[i + 1]; ++e) {
      const int slot = rows.slot[e];
      const bool goes_on = e > rows.start[i] && slot == rows.slot[e - 1] + 1 &&
                           kind(slot) == kind(slot - 1) &&
                           e - rows.run_begin.back() < kernels::kPad;
      if (!goes_on) rows.run_begin.push_back(e);
    }
  }
  rows.run_start.push_back(static_cast<int>(rows.run_begin.size()));
  rows.run_begin.push_back(static_cast<int>(rows.slot.size()));
}

/// Equality rows are always held: their states count as in use.
void KnotPlanner::find_remembered(const QpStage& stage, KnotPlan& plan) {
  const auto has_entries = [](const SparseBlock& block, int column) {
    return block.nnz() > 0 && block.column_start[column] < block.column_start[column + 1];
  };
  RememberedStates& found = plan.remembered;
  int first = plan.nx;
  while (first > 0 && !has_entries(stage.dynamics, first - 1) &&
         !has_entries(stage.equality_jacobian, first - 1))
    --first;
  found.count = plan.nx - first;
  found.hessian.clear();
  const SparseBlock& hessian = stage.hessian;
  for (int j = 0; j < hessian.cols; ++j)
    for (int e = hessian.column_start[j]; e < hessian.column_start[j + 1]; ++e) {
      const int row = hessian.row_index[e];
      const int state = row < plan.nx ? row : j;
      if (state >= first && state < plan.nx) found.hessian.push_back({e, state + 1});
    }
  const auto find_ends = [&](const RowPattern& rows, std::vector<int>& until) {
    until.assign(rows.rows(), 0);
    for (int i = 0; i < rows.rows(); ++i) {
      if (rows.start[i] == rows.start[i + 1]) continue;
      const int last = rows.slot[rows.start[i + 1] - 1] - plan.state_slot;
      if (last >= first) until[i] = last + 1;
    }
  };
  find_ends(plan.penalty, found.penalty);
  find_ends(plan.hard, found.hard);
}

void KnotPlanner::order_substitution(const SparseBlock& implicit, KnotPlan& plan) {
  plan.substitution_order.clear();
  plan.implicit_states = 0;
  if (implicit.nnz() == 0) return;
  for (int c = 0; c < implicit.cols; ++c)
    for (int e = implicit.column_start[c]; e < implicit.column_start[c + 1]; ++e)
      plan.implicit_states = std::max({plan.implicit_states, c + 1, implicit.row_index[e] + 1});
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
