#include <algorithm>
#include <numeric>

#include "structured/knot_plan.hpp"

namespace palanquin::structured {

int KnotPlanner::group_of(int local) {
  while (parent_[local] != local) local = parent_[local] = parent_[parent_[local]];
  return local;
}

/// Locals of one row belong together.
void KnotPlanner::join_row(const KnotPlan& plan, const RowPattern& rows) {
  for (int i = 0; i < rows.rows(); ++i)
    for (int e = rows.start[i] + 1; e < rows.start[i + 1] && rows.slot[e] < plan.nl; ++e)
      parent_[group_of(rows.slot[e])] = group_of(rows.slot[e - 1]);
}

/// A row's group meets all of the row's inputs and states.
void KnotPlanner::mark_row(const KnotPlan& plan, const RowPattern& rows) {
  for (int i = 0; i < rows.rows(); ++i) {
    const int begin = rows.start[i];
    if (begin == rows.start[i + 1] || rows.slot[begin] >= plan.nl) continue;
    unsigned char* meets = meets_.data() + group_of(rows.slot[begin]) * plan.slots();
    for (int e = begin; e < rows.start[i + 1]; ++e) meets[rows.slot[e]] = 1;
  }
}

void KnotPlanner::group_locals(const SparseBlock& hessian, KnotPlan& plan) {
  plan.groups.clear();
  plan.local_slot.clear();
  plan.local_row.clear();
  plan.run_slot.clear();
  plan.run_size.clear();
  plan.local_factor_size = 0;
  if (plan.nl == 0) return;
  parent_.resize(plan.nl);
  std::iota(parent_.begin(), parent_.end(), 0);
  meets_.assign(plan.nl * plan.slots(), 0);

  const auto for_local_entries = [&](auto visit) {  // visit(local slot, other slot)
    for (int j = 0; j < hessian.cols; ++j) {
      for (int e = hessian.column_start[j]; e < hessian.column_start[j + 1]; ++e) {
        const auto [low, high] = std::minmax(plan.slot[j], plan.slot[hessian.row_index[e]]);
        if (low < plan.nl) visit(low, high);
      }
    }
  };
  for_local_entries([&](int local, int other) {
    if (other < plan.nl) parent_[group_of(other)] = group_of(local);
  });
  join_row(plan, plan.penalty);
  join_row(plan, plan.hard);
  join_row(plan, plan.equality);
  for_local_entries(
      [&](int local, int other) { meets_[group_of(local) * plan.slots() + other] = 1; });
  mark_row(plan, plan.penalty);
  mark_row(plan, plan.hard);
  mark_row(plan, plan.equality);

  for (int root = 0; root < plan.nl; ++root)
    if (group_of(root) == root) list_group(root, plan);
  point_to_lists(plan);
}

/// Lists the slots that the group meets, cut into runs: its own locals among them, by their
/// diagonal entries.
void KnotPlanner::list_group(int root, KnotPlan& plan) {
  kernels::LocalGroup group{};
  group.factor_offset = plan.local_factor_size;
  const unsigned char* meets = meets_.data() + root * plan.slots();
  int previous = -1;
  for (int slot = 0; slot < plan.gradient_slot; ++slot) {
    if (!meets[slot]) continue;
    const bool goes_on = slot == previous + 1 && group.runs > 0 && slot != plan.input_slot &&
                         slot != plan.state_slot && plan.run_size.back() < kernels::kPad;
    if (!goes_on) {
      plan.run_slot.push_back(slot);
      plan.run_size.push_back(0);
      ++group.runs;
      if (slot < plan.nl) ++group.local_runs;
    }
    if (slot < plan.nl) {
      plan.local_slot.push_back(slot);
      plan.local_row.push_back((group.runs - 1) * kernels::kPad + plan.run_size.back());
      ++group.locals;
    }
    ++plan.run_size.back();
    previous = slot;
  }
  plan.groups.push_back(group);
  plan.local_factor_size += group.factor_size();
}

/// The lists no longer grow: each group gets its part of them.
void KnotPlanner::point_to_lists(KnotPlan& plan) {
  std::size_t local = 0;
  std::size_t run = 0;
  for (kernels::LocalGroup& group : plan.groups) {
    group.local_slot = plan.local_slot.data() + local;
    group.local_row = plan.local_row.data() + local;
    group.run_slot = plan.run_slot.data() + run;
    group.run_size = plan.run_size.data() + run;
    local += group.locals;
    run += group.runs;
  }
}

}  // namespace palanquin::structured
