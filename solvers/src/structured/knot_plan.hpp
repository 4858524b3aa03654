#pragma once

#include <vector>

#include "kernels/kernels.hpp"
#include "palanquin/core/stage_qp.hpp"
#include "sparse_runs.hpp"

namespace palanquin::structured {

/// The rows of a SparseBlock, each with its entries in ascending order of slots, and cut into runs
/// of neighbouring slots of one kind (see kernels::SparseRows).
struct RowPattern {
  std::vector<int> start;      ///< [rows + 1]
  std::vector<int> slot;       ///< [nnz]
  std::vector<int> entry;      ///< [nnz], where the value stands in SparseBlock::values
  std::vector<int> run_start;  ///< [rows + 1]
  std::vector<int> run_begin;  ///< [runs + 1]

  int rows() const { return static_cast<int>(start.size()) - 1; }
  kernels::SparseRows by_runs() const {
    return {rows(), run_start.data(), run_begin.data(), slot.data(), entry.data()};
  }
};

/// An entry of a stage's Hessian and its place in the array that holds its column of G.
struct HessianEntry {
  int entry = 0;
  int place = 0;
};

/// The last states, which the dynamics do not depend on (what a knot remembers of the one before,
/// as limits of rates need it), and what may make the cost depend on them. With nothing of it but
/// zeros they are idle: the value function does not depend on them either.
struct RememberedStates {
  struct Entry {
    int entry;  ///< of the Hessian
    int until;  ///< one more than the last state that it is of
  };
  int count = 0;
  std::vector<Entry> hessian;
  /// For every row one more than the last state that it is over; 0 where that is no such state.
  std::vector<int> penalty, hard;
};

/// How G of step (3) is laid out. Its rows and columns are slots in the order
///     locals | inputs | states | gradient
/// with inputs and states starting at multiples of kPad.
struct KnotLayout {
  int nx = 0;
  int nu = 0;
  int nl = 0;
  int input_slot = 0;
  int state_slot = 0;
  int gradient_slot = 0;
  int panel_ld = 0;  ///< rows of inputs, states and gradient, padded
  int value_ld = 0;  ///< rows of states and gradient, padded

  int slots() const { return state_slot + value_ld; }
  /// A run is cleared by whole vectors, which reach over the end of a column of locals.
  int local_ld() const { return slots() + kernels::kPad; }
  int panel_size() const { return kernels::padded(nu) * panel_ld; }
  int value_size() const { return kernels::padded(nx) * value_ld; }
};
KnotLayout lay_out(const QpStage& stage);

/// Where everything of a knot stands, by slots: knots of one pattern share it.
struct KnotPlan : KnotLayout {
  std::vector<int> slot;  ///< [nw] of variable j of w = (x, u, l)
  // Entries of the Hessian in G's columns of locals, inputs and states.
  std::vector<HessianEntry> local_hessian, input_hessian, state_hessian;
  int next_nx = 0;  ///< rows of the dynamics
  /// States that the dynamics depend on are among the first so many.
  int moving_nx() const { return nx - remembered.count; }
  SparseRuns dynamics;
  int implicit_entries = 0;
  /// The implicit rows are among the first so many next states, and over these alone.
  int implicit_states = 0;
  RowPattern penalty;
  RowPattern hard;
  RowPattern equality;
  RememberedStates remembered;
  /// Columns of `implicit` with entries, each behind those that it names.
  std::vector<int> substitution_order;

  std::vector<kernels::LocalGroup> groups;  ///< into the lists below
  std::vector<int> local_slot, local_row, run_slot, run_size;
  int local_factor_size = 0;

  /// Whether the plan reads nothing of `stage` out of bounds.
  bool fits(const QpStage& stage) const;
};

/// Capacity of a KnotPlan's lists, the same for all knots of a problem, so that a pattern that
/// moves along the horizon (a gait does) finds room wherever it comes.
struct PlanCapacity {
  struct Rows {
    int rows = 0, entries = 0;
    void include(const SparseBlock& block);
    void apply(RowPattern& pattern) const;
  };
  int variables = 0, slots = 0, hessian = 0, dynamics = 0, states = 0, locals = 0;
  Rows penalty, hard, equality;

  void include(const QpStage& stage);
  void apply(KnotPlan& plan) const;
};

/// Plans one knot. Steps in local_groups.cpp find the groups of locals.
class KnotPlanner {
 public:
  void plan(const QpStage& stage, KnotPlan& plan);

 private:
  void number_slots(const QpStage& stage, KnotPlan& plan);
  void list_hessian(const SparseBlock& hessian, KnotPlan& plan);
  void list_rows(const SparseBlock& block, const KnotPlan& plan, RowPattern& rows);
  void cut_runs(const KnotPlan& plan, RowPattern& rows);
  void order_substitution(const SparseBlock& implicit, KnotPlan& plan);
  void find_remembered(const QpStage& stage, KnotPlan& plan);

  void group_locals(const SparseBlock& hessian, KnotPlan& plan);
  void join_row(const KnotPlan& plan, const RowPattern& rows);
  void mark_row(const KnotPlan& plan, const RowPattern& rows);
  void list_group(int root, KnotPlan& plan);
  void point_to_lists(KnotPlan& plan);
  int group_of(int local);

  std::vector<int> waiting_;          // columns of `implicit` that a column still waits for
  std::vector<int> parent_;           // union-find over locals
  std::vector<unsigned char> meets_;  // [nl x slots] group meets slot
};

}  // namespace palanquin::structured
