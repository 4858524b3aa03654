#include "palanquin/solvers/dense_qp.hpp"

#include <Eigen/Jacobi>
#include <cmath>
#include <limits>

namespace palanquin {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kFeasible = 1e-9;    ///< of a row, relative to its norm and right-hand side
constexpr double kDependent = 1e-14;  ///< share of a row's norm that the active ones leave free

}  // namespace

void DenseQpSolver::resize(Eigen::Index n, Eigen::Index m) {
  J_.resize(n, n);
  R_.resize(n, n);
  x_.resize(n);
  d_.resize(n);
  z_.resize(n);
  r_.resize(n);
  u_.resize(n + 1);
  multipliers_.resize(m);
  scale_.resize(m);
  active_.clear();
  active_.reserve(static_cast<std::size_t>(n) + 1);
  sign_.clear();
  sign_.reserve(static_cast<std::size_t>(n) + 1);
  is_active_.assign(static_cast<std::size_t>(m), 0);
  changes_ = 0;
  limit_ = static_cast<int>(10 * (n + m));
}

bool DenseQpSolver::factorize(const DenseQp& qp) {
  cholesky_.compute(qp.H);
  if (cholesky_.info() != Eigen::Success) return false;
  J_.setIdentity();
  cholesky_.matrixU().solveInPlace(J_);
  z_.noalias() = J_.transpose() * qp.g;
  x_.noalias() = -J_ * z_;
  return x_.allFinite();
}

int DenseQpSolver::most_violated(const DenseQp& qp) const {
  int worst = -1;
  double least = -kFeasible;
  for (int i = qp.equalities; i < qp.A.rows(); ++i) {
    if (is_active_[static_cast<std::size_t>(i)]) continue;
    const double slack = (qp.A.row(i).dot(x_) - qp.b[i]) / scale_[i];
    if (slack < least) {
      least = slack;
      worst = i;
    }
  }
  return worst;
}

Status DenseQpSolver::solve(const DenseQp& qp) {
  resize(qp.g.size(), qp.b.size());
  equalities_ = qp.equalities;
  multipliers_.setZero();
  if (!qp.H.allFinite() || !qp.g.allFinite() || !qp.A.allFinite() || !qp.b.allFinite())
    return Status::NonFinite;
  if (!factorize(qp)) return Status::NonFinite;
  for (Eigen::Index i = 0; i < qp.b.size(); ++i)
    scale_[i] = std::max(qp.A.row(i).norm(), 1e-300) + std::abs(qp.b[i]);

  for (int i = 0; i < qp.equalities; ++i)
    if (const Status status = add_row(qp, i); status != Status::Converged) return status;
  for (int row = most_violated(qp); row >= 0; row = most_violated(qp))
    if (const Status status = add_row(qp, row); status != Status::Converged) return status;

  for (std::size_t i = 0; i < active_.size(); ++i)
    multipliers_[active_[i]] = sign_[i] * u_[static_cast<Eigen::Index>(i)];
  return x_.allFinite() ? Status::Converged : Status::NonFinite;
}

Status DenseQpSolver::add_row(const DenseQp& qp, int row) {
  const Eigen::Index n = x_.size();
  const bool is_equality = row < qp.equalities;
  double slack = qp.A.row(row).dot(x_) - qp.b[row];
  const double sign = is_equality && slack > 0 ? -1 : 1;
  slack *= sign;
  double multiplier = 0;
  for (; changes_ < limit_; ++changes_) {
    const auto q = static_cast<Eigen::Index>(active_.size());
    // Step directions: z of x, -r of the active multipliers, per unit of the new row's multiplier.
    d_.noalias() = sign * J_.transpose() * qp.A.row(row).transpose();
    z_.noalias() = J_.rightCols(n - q) * d_.tail(n - q);
    r_.head(q) = R_.topLeftCorner(q, q).triangularView<Eigen::Upper>().solve(d_.head(q));

    double partial = kInfinity;  // the longest step that keeps the active multipliers' signs
    int dropped = -1;
    for (Eigen::Index i = 0; i < q; ++i) {
      if (active_[static_cast<std::size_t>(i)] < equalities_ || !(r_[i] > 0)) continue;
      if (const double step = u_[i] / r_[i]; step < partial) {
        partial = step;
        dropped = static_cast<int>(i);
      }
    }
    const double curvature = d_.tail(n - q).squaredNorm();
    const bool is_dependent = !(curvature > kDependent * d_.squaredNorm());
    const double full = is_dependent ? kInfinity : -slack / curvature;

    if (is_dependent && dropped < 0) {  // the row says nothing new, or contradicts the others
      return -slack <= 1e-6 * scale_[row] ? Status::Converged : Status::Infeasible;
    }
    const double step = std::min(partial, full);
    u_.head(q) -= step * r_.head(q);
    multiplier += step;
    if (!is_dependent) {
      x_ += step * z_;
      slack = sign * (qp.A.row(row).dot(x_) - qp.b[row]);
    }
    if (full <= partial) {
      sign_.push_back(sign);
      append(row, multiplier);
      ++changes_;
      return Status::Converged;
    }
    drop(dropped);
  }
  return Status::IterationLimit;
}

/// Rotates J's free columns so that the new row's d becomes (d_1 .. d_q, |d_free|, 0 .. 0).
void DenseQpSolver::append(int row, double multiplier) {
  const auto q = static_cast<Eigen::Index>(active_.size());
  for (Eigen::Index i = d_.size() - 1; i > q; --i) {
    if (d_[i] == 0) continue;
    Eigen::JacobiRotation<double> rotation;
    double length = 0;
    rotation.makeGivens(d_[i - 1], d_[i], &length);
    d_[i - 1] = length;
    d_[i] = 0;
    J_.applyOnTheRight(i - 1, i, rotation);
  }
  R_.col(q).head(q + 1) = d_.head(q + 1);
  u_[q] = multiplier;
  active_.push_back(row);
  is_active_[static_cast<std::size_t>(row)] = 1;
}

/// Takes a row out of the active set and makes R triangular again.
void DenseQpSolver::drop(int position) {
  const auto at = static_cast<std::size_t>(position);
  is_active_[static_cast<std::size_t>(active_[at])] = 0;
  active_.erase(active_.begin() + position);
  sign_.erase(sign_.begin() + position);
  const auto q = static_cast<Eigen::Index>(active_.size());
  for (Eigen::Index i = position; i < q; ++i) {
    R_.col(i).head(i + 2) = R_.col(i + 1).head(i + 2);
    u_[i] = u_[i + 1];
    Eigen::JacobiRotation<double> rotation;
    double length = 0;
    rotation.makeGivens(R_(i, i), R_(i + 1, i), &length);
    R_(i, i) = length;
    R_(i + 1, i) = 0;
    for (Eigen::Index j = i + 2; j <= q; ++j) {  // columns that are still to move left
      const double upper = R_(i, j), lower = R_(i + 1, j);
      R_(i, j) = rotation.c() * upper - rotation.s() * lower;
      R_(i + 1, j) = rotation.s() * upper + rotation.c() * lower;
    }
    J_.applyOnTheRight(i, i + 1, rotation);
  }
}

}  // namespace palanquin
