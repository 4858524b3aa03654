#pragma once

#include "structured/workspace.hpp"

namespace palanquin::structured {

/// Inputs and locals of `z` from its states, by the knot's factors, with `constant` times their
/// gradient's row. On entry they hold what the forward substitution left of a right-hand side, zero
/// if that is the gradient's row.
void solve_inputs(const Workspace& workspace, const Knot& knot, double constant, double* z);
void solve_locals(const Workspace& workspace, const Knot& knot, double constant, double* z);

/// y = P x + constant p for the states x of `z`. y has room for value_ld entries.
void multiply_value(const Workspace& workspace, const Knot& knot, double constant, double* z,
                    double* y);

/// States of the next knot: next_x := (I - N)^{-1} (F w + x), where x is what next_x holds on
/// entry.
void advance(const Workspace& workspace, const QpStage& stage, const KnotPlan& plan,
             const double* z, double* next_x);

/// v := (I - N')^{-1} v: the value function's slope in x+, taken over to the rows F w + b.
void substitute_transposed(const QpStage& stage, const KnotPlan& plan, double* v);

/// Step (6): z of every knot from `initial_state`. Returns whether all of them are finite.
bool roll_out(Workspace& workspace, const StageQp& qp, const Eigen::VectorXd& initial_state);

/// The multipliers of the dynamics at the knots' z.
void find_multipliers(Workspace& workspace, const StageQp& qp);

/// Copies the knots' z and multipliers of equality rows into `solution`.
void unpack(const Workspace& workspace, StageQpSolution& solution);

}  // namespace palanquin::structured
