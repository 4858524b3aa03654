#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <string>
#include <vector>

#include "palanquin/core/lowered_function.hpp"
#include "palanquin/core/sparse_block.hpp"

namespace palanquin {

/// The functions of a problem's "exact" library: Hessians of the stages' Lagrangians, with
/// arguments as listed in palanquin/lowering/__init__.py.
struct ExactHessian {
  /// Throws std::runtime_error when the library cannot be loaded or is of another kind.
  explicit ExactHessian(const std::string& path);

  LoweredLibrary library;
  LoweredFunction running, terminal;
};

/// Makes a symmetric matrix positive semidefinite by mirroring its negative eigenvalues, H = V D V'
/// becoming V |D| V'. Against cutting them off at zero, directions of strong negative curvature
/// keep steps of a sensible length. A matrix that is positive semidefinite keeps its values.
class CurvatureMirror {
 public:
  /// `lower` is a dense lower triangle. Allocates (Eigen's eigenvalue solver does).
  void apply(SparseBlock& lower);

 private:
  Eigen::MatrixXd matrix_, scaled_;
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen_;
};

}  // namespace palanquin
