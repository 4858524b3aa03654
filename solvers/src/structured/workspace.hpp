#pragma once

#include <cstdint>
#include <vector>

#include "kernels/kernels.hpp"
#include "palanquin/core/stage_qp.hpp"
#include "palanquin/solvers/qp_structured.hpp"
#include "structured/aligned_buffer.hpp"
#include "structured/knot_plan.hpp"

namespace palanquin::structured {

/// One knot's plan and its memory, which the Workspace owns. Vectors over slots have
/// plan.slots() entries, zeros where no variable stands.
struct Knot {
  KnotPlan plan;
  double* storage = nullptr;       ///< G, then its factor (see KnotPlan)
  double* local_factor = nullptr;  ///< [plan.local_factor_size]
  double* z = nullptr;             ///< over slots: locals, inputs, states and a constant 1
  double* multiplier = nullptr;    ///< [padded], of x_k

  // Used only if the problem has equality rows.
  double* equality_stiffness = nullptr;   ///< [ne]
  double* equality_multiplier = nullptr;  ///< [ne]
  double* equality_residual = nullptr;    ///< [ne]
  double* correction = nullptr;           ///< over slots: right-hand side, then step
  double* value_correction = nullptr;     ///< [padded], change of p_k, then of the multiplier

  double* panel() const { return storage + plan.panel_offset; }
  double* value() const { return storage + plan.value_offset; }
};

/// All that a StructuredQpSolver keeps between two solves.
struct Workspace {
  StructuredQpSettings settings;
  KernelLevel level = KernelLevel::X86_64;
  const kernels::Table* kernels = nullptr;

  std::vector<Knot> knots;  ///< [N + 1]
  bool has_equality_rows = false;
  double flops = 0.0;

  // Intermediates of the knot in work: P L, (P L F)' and P L b + p.
  AlignedBuffer value, product, slope;

  const StageQp* factorized = nullptr;  ///< the QP whose factors stand, or null
  std::vector<double> model;            ///< slopes and curvatures of these factors, knot by knot

  /// Plans every knot of `qp` and hands out memory. Throws std::invalid_argument if a block does
  /// not fit its knot.
  void analyze(const StageQp& qp);
  /// Whether the last analysis holds for `qp`.
  bool is_analyzed(const StageQp& qp) const;

 private:
  void hand_out_memory();

  KnotPlanner planner_;
  std::uint64_t revision_ = 0;
  AlignedBuffer storage_, vectors_;
};

/// Throws std::invalid_argument, naming knot and block, if dimensions contradict each other.
void check_dimensions(const StageQp& qp);

/// See StructuredQpSolver::flops.
double count_flops(const StageQp& qp, const std::vector<Knot>& knots);

}  // namespace palanquin::structured
