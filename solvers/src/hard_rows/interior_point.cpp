#include "hard_rows/interior_point.hpp"

#include <algorithm>
#include <cmath>

namespace palanquin {
namespace {

constexpr double kStiffest = 1e5;      ///< 1 / delta, times the rows' stiffness
constexpr double kToBoundary = 0.995;  ///< share of the way to the boundary that a step may go
constexpr double kShortest = 1e-8;     ///< step length that counts as none
constexpr double kSmallest = 1e-2;     ///< [|w|] of slacks and violations at the start

}  // namespace

QpStatus InteriorPoint::run(double goal, int iterations, StageQpSolution& point) {
  recursions_ = 0;
  update_ms_ = 0.0;
  for (int i = 0; i < iterations; ++i) {
    const double mu = s_.dot(nu_) / static_cast<double>(s_.size());
    if (mu <= goal * mu_at_start_) {
      point = target_;
      return QpStatus::Solved;
    }
    c_.setZero();  // the predictor
    if (const QpStatus status = find_target(); !is_usable(status)) return status;
    const double alpha = longest_step();
    const double predicted = (s_ + alpha * ds_).dot(nu_ + alpha * dnu_);
    const double sigma = std::pow(predicted / s_.dot(nu_), 3.0);

    c_ = -ds_.cwiseProduct(dnu_);  // the corrector
    c_.array() += sigma * mu;
    if (const QpStatus status = find_target(); !is_usable(status)) return status;
    const double step = std::min(1.0, kToBoundary * longest_step());
    if (!(step > kShortest)) return QpStatus::NotSolved;
    s_ += step * ds_;
    nu_ += step * dnu_;
  }
  return QpStatus::NotSolved;
}

/// Slacks as the point has them, but at least as large as the largest violation; multipliers such
/// that every row has one product, that of a violated row with the cost's own stiffness.
void InteriorPoint::start(const StageQpSolution& point) {
  target_ = point;
  delta_ = (kStiffest * qp_.stiffness()).cwiseInverse();
  qp_.evaluate(point.w, h_);
  const double violation = std::max(kSmallest, h_.cwiseQuotient(qp_.norm()).maxCoeff());
  s_ = (-h_).cwiseMax(violation * qp_.norm());
  const double mu =
      violation * violation * qp_.stiffness().cwiseProduct(qp_.norm().cwiseAbs2()).mean();
  nu_ = mu * s_.cwiseInverse();
  mu_at_start_ = mu;
  c_.resize(s_.size());
}

/// One recursion for c_: the point, slacks and multipliers that the linear equations lead to.
QpStatus InteriorPoint::find_target() {
  denominator_ = s_ + delta_.cwiseProduct(nu_);
  curvature_ = nu_.cwiseQuotient(denominator_);
  base_ = nu_ + c_.cwiseQuotient(denominator_);
  qp_.set_forces(base_, curvature_);
  const QpStatus status = recursions_ == 0 ? solver_.solve(qp_.qp(), qp_.model(), target_)
                                           : solver_.resolve(qp_.qp(), qp_.model(), target_);
  ++recursions_;
  update_ms_ += solver_.update_ms();
  if (!is_usable(status)) return status;
  qp_.evaluate(target_.w, h_);
  if (!h_.allFinite()) return QpStatus::NonFinite;
  nu_target_ = base_ + curvature_.cwiseProduct(h_);
  dnu_ = nu_target_ - nu_;
  ds_ = delta_.cwiseProduct(dnu_) - h_ - s_;
  return status;
}

/// In [0, 1], to where a slack or a multiplier gets 0.
double InteriorPoint::longest_step() const {
  double alpha = 1.0;
  for (Eigen::Index j = 0; j < s_.size(); ++j) {
    if (ds_[j] < 0.0) alpha = std::min(alpha, -s_[j] / ds_[j]);
    if (dnu_[j] < 0.0) alpha = std::min(alpha, -nu_[j] / dnu_[j]);
  }
  return alpha;
}

void InteriorPoint::write_active_multipliers(StageQpSolution& point) const {
  qp_.write_multipliers((nu_.array() > qp_.stiffness().array() * s_.array()).select(nu_, 0.0),
                        point);
}

}  // namespace palanquin
