#pragma once

#include <vector>

#include "kernels/kernels.hpp"
#include "palanquin/core/stage_qp.hpp"

namespace palanquin::structured {

/// The rows of a SparseBlock, each with its entries in ascending order of slots.
struct RowPattern {
  std::vector<int> start;  ///< [rows + 1]
  std::vector<int> slot;   ///< [nnz]
  std::vector<int> entry;  ///< [nnz], where the value stands in SparseBlock::values

  int rows() const { return static_cast<int>(start.size()) - 1; }
};

/// Locals that meet each other, and the inputs and states that they meet, all as slots.
struct LocalGroup {
  int first = 0;   ///< of the group's slots in KnotPlan::group_slots: `locals` locals, then
  int locals = 0;  ///<   `others` inputs and states, then the gradient
  int others = 0;
  int factor_offset = 0;  ///< of its factor [size x locals], column-major

  int size() const { return locals + others + 1; }
};

/// Where everything of one knot stands. Its matrix G of step (3) is ordered
///     slots:  locals | inputs | states | gradient
/// with inputs and states starting at multiples of kPad. Element (i, j), i >= j, is at
/// `column_offset[j] + i` of the knot's storage, which holds three column-major matrices: the
/// locals' columns, the panel (inputs' columns) and the value (states' columns: P_k with p_k' as
/// the row below, once the knot is factorised).
struct KnotPlan {
  int nx = 0;
  int nu = 0;
  int nl = 0;
  int input_slot = 0;
  int state_slot = 0;
  int gradient_slot = 0;
  int panel_ld = 0;  ///< rows of inputs, states and gradient, padded
  int value_ld = 0;  ///< rows of states and gradient, padded
  int panel_offset = 0;
  int value_offset = 0;
  int storage_size = 0;

  std::vector<int> slot;             ///< [nw] of variable j of w = (x, u, l)
  std::vector<int> column_offset;    ///< [gradient_slot]
  std::vector<int> hessian_target;   ///< [nnz of the Hessian], offsets into the storage
  std::vector<int> gradient_target;  ///< [nw]
  RowPattern penalty;
  RowPattern equality;
  /// Columns of `implicit` with entries, each behind those that it names.
  std::vector<int> substitution_order;

  std::vector<LocalGroup> groups;
  std::vector<int> group_slots;
  int local_factor_size = 0;

  int slots() const { return state_slot + value_ld; }
};

/// Capacity of a KnotPlan's lists, the same for all knots of a problem, so that a pattern that
/// moves along the horizon (a gait does) finds room wherever it comes.
struct PlanCapacity {
  int variables = 0, slots = 0, hessian = 0, penalty_rows = 0, penalty = 0, equality_rows = 0,
      equality = 0, states = 0, locals = 0;

  void include(const QpStage& stage);
  void apply(KnotPlan& plan) const;
};

/// Plans one knot. Steps in local_groups.cpp find the groups of locals.
class KnotPlanner {
 public:
  void plan(const QpStage& stage, KnotPlan& plan);

 private:
  void lay_out(const QpStage& stage, KnotPlan& plan);
  void target_hessian(const SparseBlock& hessian, KnotPlan& plan);
  void list_rows(const SparseBlock& block, const KnotPlan& plan, RowPattern& rows);
  void order_substitution(const SparseBlock& implicit, KnotPlan& plan);

  void group_locals(const SparseBlock& hessian, KnotPlan& plan);
  void join_row(const KnotPlan& plan, const RowPattern& rows);
  void mark_row(const KnotPlan& plan, const RowPattern& rows);
  int group_of(int local);

  std::vector<int> waiting_;          // columns of `implicit` that a column still waits for
  std::vector<int> parent_;           // union-find over locals
  std::vector<unsigned char> meets_;  // [nl x slots] group meets slot
};

}  // namespace palanquin::structured
