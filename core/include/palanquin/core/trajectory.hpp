#pragma once

#include <Eigen/Core>

#include "palanquin/core/lowered_problem.hpp"

namespace palanquin {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using MatrixView = Eigen::Ref<const RowMatrix>;
using VectorView = Eigen::Ref<const Eigen::VectorXd>;

// A trajectory is an [N + 1, nz] matrix: row k is the knot vector z_k, all blocks in the problem's
// order. Blocks that are no states mean nothing at knot N.

/// A trajectory with identity quaternions and zeros elsewhere.
RowMatrix neutral_trajectory(const LoweredProblem& problem, int horizon);

/// Parameters [N + 1, np] at the defaults that were stated with the problem, the same at each knot.
RowMatrix default_parameters(const LoweredProblem& problem, int horizon);

/// z (+) dz for one knot; `step` is scaled by `alpha`. All are raw knot vectors of the problem.
void retract(const LoweredProblem& problem, const double* z, const double* dz, double alpha,
             double* moved);

/// a (-) b of the states of two knots, written to `difference` [ndx].
void state_difference(const LoweredProblem& problem, const double* a, const double* b,
                      double* difference);

/// The plan as seen `elapsed` seconds later, for a warm start: states are interpolated on their
/// manifolds (and extrapolated with the last interval's rate beyond the end), other blocks hold the
/// interval that covers the new interval's middle. Solver rate and knot spacing are independent.
///
/// `spacing` [N + 1] is the length of the interval after each knot (its last entry is not used).
/// Throws std::invalid_argument for a negative or non-finite `elapsed` or non-positive spacing.
void shift(const LoweredProblem& problem, MatrixView trajectory, VectorView spacing, double elapsed,
           Eigen::Ref<RowMatrix> shifted);

/// Flips every quaternion of `z` (a knot vector) to the side of the one in `reference`.
void align_quaternions(const LoweredProblem& problem, const double* reference, double* z);

}  // namespace palanquin
