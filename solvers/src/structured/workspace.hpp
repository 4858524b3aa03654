#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "kernels/kernels.hpp"
#include "palanquin/core/stage_qp.hpp"
#include "palanquin/solvers/qp_structured.hpp"
#include "structured/aligned_buffer.hpp"
#include "structured/plan_store.hpp"

namespace palanquin::structured {

/// One knot's plan and its memory, which the Workspace owns. Vectors over slots have
/// plan->slots() entries, zeros where no variable stands.
///
/// Of G's lower triangle the columns of inputs stand in `panel`, those of states in `value`, both
/// column-major; those of locals, which are zero but while a knot is in work, in Workspace::locals.
struct Knot {
  const KnotPlan* plan = nullptr;
  int pattern = -1;         ///< QpStage::pattern that `plan` belongs to
  int nx = 0;               ///< states but for the idle ones at the end; set by the factorisation
  double* panel = nullptr;  ///< [panel_ld x padded(nu)]
  double* value = nullptr;  ///< [value_ld x padded(nx)]; holds P_k, and p_k' in the row below
                            ///< it, once the knot is factorised; of the first `nx` states
  double* local_factor = nullptr;  ///< [plan->local_factor_size]
  double* z = nullptr;             ///< over slots: locals, inputs, states
  double* multiplier = nullptr;    ///< [padded], of x_k

  // Used only if the problem has equality rows.
  double* equality_stiffness = nullptr;   ///< [ne]
  double* equality_multiplier = nullptr;  ///< [ne]
  double* equality_residual = nullptr;    ///< [ne]
  double* correction = nullptr;           ///< over slots: right-hand side, then step
  double* value_correction = nullptr;     ///< [padded], change of p_k, then of the multiplier

  /// Rows of states and gradient, padded.
  int value_rows() const { return kernels::padded(nx + 1); }
  /// Rows of inputs, states and gradient, padded.
  int panel_rows() const { return kernels::padded(plan->nu) + value_rows(); }
};

/// The largest knot's share of each kind of memory. Every knot gets as much, so that a pattern that
/// moves along the horizon does not ask for more.
struct MemorySizes {
  std::size_t panel = 0, value = 0, panel_ld = 0, value_ld = 0, slots = 0, locals = 0,
              local_factor = 0, equality_rows = 0, row_entries = 0;

  void include(const KnotPlan& plan);
  void include(const MemorySizes& other);
  bool operator==(const MemorySizes&) const = default;
};

/// All that a StructuredQpSolver keeps between two solves.
struct Workspace {
  StructuredQpSettings settings;
  KernelLevel level = KernelLevel::X86_64;
  const kernels::Table* kernels = nullptr;

  std::vector<Knot> knots;  ///< [N + 1]
  bool has_equality_rows = false;
  /// Equality rows are held at least as stiffly as if they met a Hessian's diagonal entry of this.
  double least_curvature = 0.0;

  // Intermediates of the knot in work.
  double* value = nullptr;      ///< P L
  double* product = nullptr;    ///< (P L F)'
  double* slope = nullptr;      ///< P L b + p
  double* gradient = nullptr;   ///< of the knot's own cost and rows, over slots
  double* locals = nullptr;     ///< G's columns of locals
  double* scratch = nullptr;    ///< values of a row, by runs
  std::vector<int> column_end;  ///< of the dynamics without the rows of idle states
  std::vector<double*> column;  ///< element (i, j), i >= j, of its G is column[j][i]

  const StageQp* factorized = nullptr;  ///< the QP whose factors stand, or null
  bool is_solved = false;               ///< whether the knots' z are the solution with them
  bool has_multipliers = false;         ///< whether the knots' multipliers are that solution's
  std::vector<double> model;            ///< slopes and curvatures of these factors, knot by knot

  /// Finds every knot's plan and gives it memory. Throws std::invalid_argument if a block does not
  /// fit its knot.
  void analyze(const StageQp& qp);
  /// Whether the last analysis holds for `qp`.
  bool is_analyzed(const StageQp& qp) const;
  /// Drops analysis and factors and zeros all memory, what kernels read beyond a matrix's edge
  /// included: a NaN that was met may stand anywhere in it.
  void clear();

 private:
  void hand_out_memory(const MemorySizes& sizes);

  PlanStore plans_;
  MemorySizes sizes_;
  std::size_t laid_out_ = 0;  // knots that have memory
  bool is_analyzed_ = false;
  std::uint64_t revision_ = 0;
  AlignedBuffer memory_;
};

/// See StructuredQpSolver::flops.
double count_flops(const StageQp& qp, const std::vector<Knot>& knots);

}  // namespace palanquin::structured
