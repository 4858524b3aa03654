#include "palanquin/solvers/dense_qp.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace palanquin {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kProximal = 1e-7;    ///< of E: relative to H's diagonal entry
constexpr double kFlat = 1e-6;        ///< of H's largest entry: what E takes for a diagonal one
constexpr double kChosen = 1e-10;     ///< relative violation from which on a row is chosen
constexpr double kRow = 1e-7;         ///< violation of a row that a solution may have, per norm
constexpr double kRelative = 1e-9;    ///< residual that it may have, relative to its terms
constexpr double kEmpty = 1e-14;      ///< of the largest norm: a row without variables
constexpr double kDependent = 1e-20;  ///< share of |d|^2 that the active rows leave free
constexpr double kCertified = 1e3;    ///< a contradiction holds for x up to this times larger
constexpr int kRefinements = 4;       ///< rounds with E = 0
constexpr int kProximalSteps = 200;   ///< rounds with E > 0

void check_size(const char* name, Eigen::Index is, Eigen::Index must) {
  if (is != must)
    throw std::invalid_argument("DenseQp." + std::string(name) + " has " + std::to_string(is) +
                                " entries along one side, " + std::to_string(must) + " are needed");
}

void check_sizes(const DenseQp& qp) {
  const auto n = qp.g.size(), m = qp.b.size();
  check_size("H", qp.H.rows(), n);
  check_size("H", qp.H.cols(), n);
  check_size("A", qp.A.rows(), m);
  if (m > 0) check_size("A", qp.A.cols(), n);
  if (qp.equalities < 0 || qp.equalities > m)
    throw std::invalid_argument("DenseQp.equalities is " + std::to_string(qp.equalities) +
                                ", it must be from 0 to " + std::to_string(m) + ", the rows");
}

}  // namespace

void DenseQpSolver::resize(const DenseQp& qp) {
  check_sizes(qp);
  const auto n = qp.g.size(), m = qp.b.size();
  factors_.resize(n);
  for (Eigen::VectorXd* v :
       {&x_, &centre_, &proximal_, &normal_, &d_, &z_, &r_, &residual_, &step_})
    v->resize(n);
  for (Eigen::VectorXd* v : {&multipliers_, &norm_, &slack_}) v->resize(m);
  u_.resize(n + 1);
  active_.reserve(static_cast<std::size_t>(n) + 1);
  sign_.reserve(static_cast<std::size_t>(n) + 1);
  equalities_ = qp.equalities;
  changes_ = 0;
  is_measured_ = false;
  limit_ = static_cast<int>(20 * (n + m));
}

Status DenseQpSolver::solve(const DenseQp& qp) {
  resize(qp);
  x_.setZero();
  multipliers_.setZero();
  if (!qp.H.allFinite() || !qp.g.allFinite()) return Status::NonFinite;
  if (factorize(qp, false)) {
    const Status status = run(qp, kRefinements);
    if (status != Status::QpFailed && status != Status::IterationLimit) return status;
  }
  if (!factorize(qp, true)) return Status::NonFinite;
  changes_ = 0;
  return run(qp, kProximalSteps);
}

bool DenseQpSolver::factorize(const DenseQp& qp, bool is_proximal) {
  proximal_.setZero();
  if (is_proximal) {
    const auto diagonal = qp.H.diagonal();
    const double largest = qp.g.size() > 0 ? diagonal.maxCoeff() : 0;
    const double flat =
        largest > 0 ? kFlat * largest : std::max(qp.g.lpNorm<Eigen::Infinity>(), 1.0);
    proximal_ = kProximal * diagonal.cwiseMax(flat);
  }
  return factors_.factorize(qp.H, proximal_);
}

/// Alternates between the QP with a fixed centre and moving the centre to its solution.
Status DenseQpSolver::run(const DenseQp& qp, int rounds) {
  if (const Status status = start(qp); status != Status::Converged) return status;
  for (int round = 0;; ++round) {
    if (const Status status = settle(qp); status != Status::Converged) return status;
    write_multipliers();
    if (is_optimal(qp)) return Status::Converged;
    if (round == rounds) return Status::QpFailed;
    recentre(qp);
  }
}

/// The minimiser without inequalities.
Status DenseQpSolver::start(const DenseQp& qp) {
  active_.clear();
  sign_.clear();
  rows_.assign(static_cast<std::size_t>(qp.b.size()), Row::Inactive);
  is_measured_ = false;
  centre_.setZero();
  factors_.minimise(qp.g, x_);
  if (!x_.allFinite()) return Status::NonFinite;
  size_ = x_.lpNorm<Eigen::Infinity>();
  if (equalities_ > 0) {
    if (!qp.A.topRows(equalities_).allFinite() || !qp.b.head(equalities_).allFinite())
      return Status::NonFinite;
    measure_rows(qp);
  }
  for (int i = 0; i < equalities_; ++i)
    if (const Status status = add_row(qp, i); status != Status::Converged) return status;
  return Status::Converged;
}

/// Adds violated rows until none is left.
Status DenseQpSolver::settle(const DenseQp& qp) {
  for (;;) {
    slack_.noalias() = qp.A * x_;
    slack_ -= qp.b;
    if (!slack_.allFinite()) return Status::QpFailed;
    if (has_drifted(qp) && ++changes_ <= limit_) {
      restore(qp);
      slack_.noalias() = qp.A * x_;
      slack_ -= qp.b;
    }
    const int row = most_violated(qp);
    if (row < 0) return Status::Converged;
    if (const Status status = add_row(qp, row); status != Status::Converged) return status;
  }
}

/// Norms, for tolerances. A row without variables is measured against the longest.
void DenseQpSolver::measure_rows(const DenseQp& qp) {
  norm_.setZero();
  for (Eigen::Index j = 0; j < qp.A.cols(); ++j) norm_ += qp.A.col(j).cwiseAbs2();
  norm_ = norm_.cwiseSqrt();
  const double longest = norm_.maxCoeff();
  norm_ = (norm_.array() > kEmpty * longest).select(norm_, longest > 0 ? longest : 1);
  is_measured_ = true;
}

double DenseQpSolver::tolerance(const DenseQp& qp, int row, double absolute,
                                double relative) const {
  return absolute * norm_[row] + relative * (norm_[row] * size_ + std::abs(qp.b[row]));
}

/// Of the rows that may be chosen, the one with the largest violation per norm; -1: none.
int DenseQpSolver::most_violated(const DenseQp& qp) {
  if (slack_.size() == equalities_ || slack_.tail(slack_.size() - equalities_).minCoeff() >= 0)
    return -1;
  if (!is_measured_) measure_rows(qp);
  size_ = x_.lpNorm<Eigen::Infinity>();
  int worst = -1;
  double least = 0;
  for (int i = equalities_; i < slack_.size(); ++i) {
    if (rows_[static_cast<std::size_t>(i)] != Row::Inactive || !(slack_[i] < least * norm_[i]) ||
        slack_[i] >= -tolerance(qp, i, kChosen, kChosen))
      continue;
    least = slack_[i] / norm_[i];
    worst = i;
  }
  return worst;
}

/// Moves along the row's direction until it holds, and drops rows whose multiplier gets 0 before.
Status DenseQpSolver::add_row(const DenseQp& qp, int row) {
  normal_ = qp.A.row(row);
  double slack = normal_.dot(x_) - qp.b[row];
  const double sign = row < equalities_ && slack > 0 ? -1 : 1;
  normal_ *= sign;
  slack *= sign;
  if (normal_.norm() <= kEmpty * norm_[row]) normal_.setZero();
  double multiplier = 0;
  while (++changes_ <= limit_) {
    const auto q = factors_.active();
    // Step directions: z of x, -r of the active multipliers, per unit of the new row's multiplier.
    factors_.project(normal_, d_);
    z_.noalias() = factors_.free_columns() * d_.tail(d_.size() - q);
    r_.head(q) = d_.head(q);
    factors_.triangle().solveInPlace(r_.head(q));

    double partial = kInfinity;  // the longest step that keeps the active multipliers' signs
    int dropped = -1;
    for (Eigen::Index i = 0; i < q; ++i) {
      if (active_[static_cast<std::size_t>(i)] < equalities_ || !(r_[i] > 0)) continue;
      if (const double step = u_[i] / r_[i]; step < partial) {
        partial = step;
        dropped = static_cast<int>(i);
      }
    }
    const double curvature = d_.tail(d_.size() - q).squaredNorm();
    const bool is_dependent = !(curvature > kDependent * d_.squaredNorm());
    const double full = is_dependent ? kInfinity : std::max(-slack, 0.0) / curvature;

    if (is_dependent && dropped < 0) {
      if (contradicts(qp, row, sign, -slack)) return Status::Infeasible;
      rows_[static_cast<std::size_t>(row)] = Row::Dependent;
      return Status::Converged;
    }
    const double step = std::min(partial, full);
    u_.head(q) -= step * r_.head(q);
    multiplier += step;
    if (!is_dependent) {
      x_ += step * z_;
      slack = normal_.dot(x_) - sign * qp.b[row];
    }
    if (full <= partial) {
      factors_.append(d_, z_);
      u_[q] = multiplier;
      active_.push_back(row);
      sign_.push_back(sign);
      rows_[static_cast<std::size_t>(row)] = Row::Active;
      return Status::Converged;
    }
    if (dropped < 0) return Status::QpFailed;  // the step is not a number: overflow
    drop(dropped);
  }
  return Status::IterationLimit;
}

/// Farkas' lemma: y = 1 for the row and -r for the active ones is not negative at inequalities, so
/// all x that hold them have v'x >= b'y, v = A'y, which is 0 but for rounding.
bool DenseQpSolver::contradicts(const DenseQp& qp, int row, double sign, double violation) {
  if (violation <= tolerance(qp, row, kRow, kRelative)) return false;
  residual_ = normal_;
  double bound = sign * qp.b[row];
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const double y = -sign_[i] * r_[static_cast<Eigen::Index>(i)];
    residual_ += y * qp.A.row(active_[i]).transpose();
    bound += y * qp.b[active_[i]];
  }
  return bound > kCertified * (1 + size_) * residual_.lpNorm<1>();
}

void DenseQpSolver::drop(int position) {
  const auto at = static_cast<std::size_t>(position);
  const auto behind = static_cast<Eigen::Index>(active_.size()) - position - 1;
  rows_[static_cast<std::size_t>(active_[at])] = Row::Inactive;
  active_.erase(active_.begin() + position);
  sign_.erase(sign_.begin() + position);
  for (Eigen::Index i = 0; i < behind; ++i) u_[position + i] = u_[position + i + 1];
  factors_.drop(position);
  std::replace(rows_.begin(), rows_.end(), Row::Dependent, Row::Inactive);
}

/// Whether rounding has moved x off the active rows.
bool DenseQpSolver::has_drifted(const DenseQp& qp) {
  size_ = x_.lpNorm<Eigen::Infinity>();
  return std::any_of(active_.begin(), active_.end(), [&](int row) {
    return std::abs(slack_[row]) > tolerance(qp, row, kChosen, kChosen);
  });
}

/// Moves the centre to x and solves again.
void DenseQpSolver::recentre(const DenseQp& qp) {
  centre_ = x_;
  std::replace(rows_.begin(), rows_.end(), Row::Dependent, Row::Inactive);
  restore(qp);
}

/// Solves with the active rows, dropping inequalities with negative multipliers.
void DenseQpSolver::restore(const DenseQp& qp) {
  for (correct(qp);; correct(qp)) {
    const int row = most_negative();
    if (row < 0) return;
    drop(row);
  }
}

/// One Newton step to the solution with the active rows as equalities. With r the stationarity's
/// residual and p that of the rows, dx = J y and
///   R'y1 = p,   y2 = -J2'r,   R du = y1 + J1'r.
void DenseQpSolver::correct(const DenseQp& qp) {
  const auto q = factors_.active();
  residual_.noalias() = qp.H.selfadjointView<Eigen::Lower>() * x_;
  residual_ += qp.g + proximal_.cwiseProduct(x_ - centre_);
  for (Eigen::Index i = 0; i < q; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const auto row = qp.A.row(active_[at]).transpose();
    residual_ -= sign_[at] * u_[i] * row;
    r_[i] = sign_[at] * (qp.b[active_[at]] - row.dot(x_));
  }
  factors_.project(residual_, d_);
  factors_.transposed_triangle().solveInPlace(r_.head(q));
  step_.noalias() = factors_.active_columns() * r_.head(q);
  step_.noalias() -= factors_.free_columns() * d_.tail(d_.size() - q);
  x_ += step_;
  r_.head(q) += d_.head(q);
  factors_.triangle().solveInPlace(r_.head(q));
  u_.head(q) += r_.head(q);
}

int DenseQpSolver::most_negative() const {
  int worst = -1;
  double least = 0;
  for (std::size_t i = 0; i < active_.size(); ++i)
    if (const double u = u_[static_cast<Eigen::Index>(i)]; active_[i] >= equalities_ && u < least) {
      least = u;
      worst = static_cast<int>(i);
    }
  return worst;
}

void DenseQpSolver::write_multipliers() {
  multipliers_.setZero();
  for (std::size_t i = 0; i < active_.size(); ++i)
    multipliers_[active_[i]] = sign_[i] * u_[static_cast<Eigen::Index>(i)];
}

/// Whether the KKT residuals of the QP itself, without the proximal term, are small.
bool DenseQpSolver::is_optimal(const DenseQp& qp) {
  size_ = x_.lpNorm<Eigen::Infinity>();
  for (int i = 0; i < slack_.size(); ++i) {
    const double violation = i < equalities_ ? std::abs(slack_[i]) : -slack_[i];
    if (violation > 0 && !is_measured_) measure_rows(qp);
    if (violation > 0 && violation > tolerance(qp, i, kRow, kRelative)) return false;
  }
  residual_.noalias() = qp.H.selfadjointView<Eigen::Lower>() * x_;
  double terms = std::max(residual_.lpNorm<Eigen::Infinity>(), qp.g.lpNorm<Eigen::Infinity>());
  residual_ += qp.g;
  if (!active_.empty()) {
    step_.noalias() = qp.A.transpose() * multipliers_;
    terms = std::max(terms, step_.lpNorm<Eigen::Infinity>());
    residual_ -= step_;
  }
  return residual_.lpNorm<Eigen::Infinity>() <= kRelative * (1 + terms);
}

}  // namespace palanquin
