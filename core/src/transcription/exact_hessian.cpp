#include "palanquin/core/transcription/exact_hessian.hpp"

#include <algorithm>
#include <cmath>

namespace palanquin {

ExactHessian::ExactHessian(const std::string& path)
    : library(path), running(library, "exact_running"), terminal(library, "exact_terminal") {}

void CurvatureMirror::apply(SparseBlock& lower) {
  // Below this, relative to the largest eigenvalue, a negative one is rounding.
  constexpr double kRounding = 1e-14;
  const Eigen::Index size = lower.rows;
  matrix_.resize(size, size);
  const double* value = lower.values.data();
  for (Eigen::Index j = 0; j < size; ++j)
    for (Eigen::Index i = j; i < size; ++i) matrix_(i, j) = *value++;
  const bool is_finite = std::all_of(lower.values.begin(), lower.values.end(),
                                     [](double v) { return std::isfinite(v); });
  if (size == 0 || !is_finite) return;  // the QP back end will say so

  eigen_.compute(matrix_);
  const Eigen::VectorXd& d = eigen_.eigenvalues();
  if (eigen_.info() != Eigen::Success || d[0] >= -kRounding * std::abs(d[size - 1])) return;
  const Eigen::MatrixXd& V = eigen_.eigenvectors();
  scaled_.noalias() = V * d.cwiseAbs().asDiagonal();
  matrix_.noalias() = scaled_ * V.transpose();
  double* target = lower.values.data();
  for (Eigen::Index j = 0; j < size; ++j)
    for (Eigen::Index i = j; i < size; ++i) *target++ = matrix_(i, j);
}

}  // namespace palanquin
