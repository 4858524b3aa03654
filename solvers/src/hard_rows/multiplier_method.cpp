#include "hard_rows/multiplier_method.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palanquin {
namespace {

constexpr double kEnough = 0.25;   ///< an update that leaves more of the violation is a poor one
constexpr double kStiffen = 10.0;  ///< what rho grows by after a poor update
/// Stiffer rows would spoil the refinement of equality rows; where there are none, all rows are as
/// stiff from the start.
constexpr double kLargestGrowth = 10.0;
constexpr int kPatience = 2;  ///< full steps that may change no fewer rows than one before
/// [|w|] What bounds are moved outwards by. Without it rounding puts rows in and out that other
/// rows hold at their bounds.
constexpr double kOutwards = 1e-9;
constexpr double kTie = 1e-11;  ///< [|w|] over the stiffness: forces that are zero to rounding
/// Rows are called contradicting when no point within so many times the solution's size holds them.
constexpr double kCertified = 1e3;

double largest_entry(const std::vector<Eigen::VectorXd>& w) {
  double largest = 0.0;
  for (const Eigen::VectorXd& part : w)
    if (part.size() > 0) largest = std::max(largest, part.lpNorm<Eigen::Infinity>());
  return largest;
}

}  // namespace

QpStatus MultiplierMethod::run(StageQpSolution& point, int recursions) {
  start(point);
  double before = std::numeric_limits<double>::infinity();
  double growth = qp_.has_equality_rows() ? 1.0 : kLargestGrowth;
  while (recursions_ < recursions) {
    const QpStatus status = take_newton_step(point);
    if (!is_usable(status)) return status;
    if (const int changes = update_active_set(); changes > 0) {
      watch_progress(changes);
      continue;
    }
    restart_search();

    const double most = violation();
    if (std::isnan(most)) return QpStatus::NonFinite;
    update_multipliers();
    qp_.write_multipliers(multiplier_, point);
    if (most + kOutwards <= settings_.tolerance) return status;
    if (is_contradiction(point)) return QpStatus::PrimalInfeasible;
    if (most > kEnough * before && growth < kLargestGrowth) {
      growth *= kStiffen;
      stiffness_ *= kStiffen;
    }
    before = most;
  }
  qp_.write_multipliers(multiplier_, point);
  return QpStatus::NotSolved;
}

void MultiplierMethod::start(const StageQpSolution& point) {
  target_.resize(qp_.qp());
  qp_.read_multipliers(point, multiplier_);
  stiffness_ = settings_.stiffness * qp_.stiffness();
  if (!qp_.has_equality_rows()) stiffness_ *= kLargestGrowth;
  outwards_ = kOutwards * qp_.norm().cwiseMin(1.0);
  is_active_.resize(static_cast<std::size_t>(multiplier_.size()));
  misjudged_.reserve(is_active_.size());
  for (Eigen::Index j = 0; j < multiplier_.size(); ++j) is_active_[j] = multiplier_[j] > 0.0;
  direction_.resize(point.w.size());
  for (std::size_t k = 0; k < point.w.size(); ++k) direction_[k].resize(point.w[k].size());
  change_.resize(multiplier_.size());
  has_last_ = false;
  restart_search();
  recursions_ = 0;
  update_ms_ = 0.0;
}

/// Step 1: one recursion, and the point that it leads to.
QpStatus MultiplierMethod::take_newton_step(StageQpSolution& point) {
  base_.resize(multiplier_.size());
  curvature_.resize(multiplier_.size());
  for (Eigen::Index j = 0; j < multiplier_.size(); ++j) {
    base_[j] = is_active_[j] ? multiplier_[j] - stiffness_[j] * outwards_[j] : 0.0;
    curvature_[j] = is_active_[j] ? stiffness_[j] : 0.0;
  }
  qp_.set_forces(base_, curvature_);
  const QpStatus status = recursions_ == 0 ? solver_.solve(qp_.qp(), qp_.model(), target_)
                                           : solver_.resolve(qp_.qp(), qp_.model(), target_);
  update_ms_ += solver_.update_ms();
  if (!is_usable(status)) return status;
  double alpha = 1.0;
  if (is_searching_) {
    for (std::size_t k = 0; k < point.w.size(); ++k) direction_[k] = target_.w[k] - point.w[k];
    alpha = search();
  }
  ++recursions_;
  if (alpha == 1.0)
    std::swap(point, target_);
  else
    for (std::size_t k = 0; k < point.w.size(); ++k) point.w[k] += alpha * direction_[k];
  qp_.evaluate(point.w, value_);
  value_ -= outwards_;
  return status;
}

/// The step length in [0, 1] of lowest cost along direction_, which ends at the model's minimiser.
/// The model's slope there is curvature (alpha - 1); to this comes what the rows are that the model
/// has wrongly on or off, now or at the end.
double MultiplierMethod::search() {
  qp_.multiply(direction_, change_);
  misjudged_.clear();
  for (Eigen::Index j = 0; j < value_.size(); ++j) {
    const double force = multiplier_[j] + stiffness_[j] * value_[j];
    const double force_at_end = force + stiffness_[j] * change_[j];
    const bool is_active = is_active_[j] != 0;
    if ((force > 0.0) != is_active || (force_at_end > 0.0) != is_active) misjudged_.push_back(j);
  }
  if (misjudged_.empty()) return 1.0;
  const double curvature = qp_.curvature_along(direction_);
  const auto slope = [&](double alpha) {
    double sum = curvature * (alpha - 1.0);
    for (const Eigen::Index j : misjudged_) {
      const double force = multiplier_[j] + stiffness_[j] * (value_[j] + alpha * change_[j]);
      sum += change_[j] * (std::max(0.0, force) - (is_active_[j] ? force : 0.0));
    }
    return sum;
  };
  if (!(slope(1.0) > 0.0)) return 1.0;
  double low = 0.0, high = 1.0;
  constexpr int kBisections = 40;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (slope(middle) > 0.0 ? high : low) = middle;
  }
  return high;
}

void MultiplierMethod::restart_search() {
  is_searching_ = false;
  fewest_changes_ = std::numeric_limits<int>::max();
  stalled_ = 0;
}

/// Full steps find most active sets soonest, but may go in circles: as soon as the rows that change
/// do not get fewer, the search takes over.
void MultiplierMethod::watch_progress(int changes) {
  stalled_ = changes < fewest_changes_ ? 0 : stalled_ + 1;
  fewest_changes_ = std::min(fewest_changes_, changes);
  is_searching_ = is_searching_ || stalled_ >= kPatience;
}

/// Replaces the active set by that of the point; how many rows that changes. A row whose force is
/// zero to rounding stays what it is.
int MultiplierMethod::update_active_set() {
  int changes = 0;
  for (Eigen::Index j = 0; j < value_.size(); ++j) {
    const double tie = kTie * stiffness_[j] * qp_.norm()[j];
    const double force = multiplier_[j] + stiffness_[j] * value_[j];
    const bool active = force > (is_active_[j] ? -tie : tie);
    changes += static_cast<int>(active != static_cast<bool>(is_active_[j]));
    is_active_[j] = active;
  }
  return changes;
}

double MultiplierMethod::violation() const {
  double most = 0.0;
  for (Eigen::Index j = 0; j < value_.size(); ++j) {
    if (std::isnan(value_[j])) return std::numeric_limits<double>::quiet_NaN();
    most = std::max(most, is_active_[j] ? std::abs(value_[j]) : value_[j]);
  }
  return most;
}

void MultiplierMethod::update_multipliers() {
  increase_ = -multiplier_;
  for (Eigen::Index j = 0; j < value_.size(); ++j)
    multiplier_[j] =
        is_active_[j] ? std::max(0.0, multiplier_[j] + stiffness_[j] * value_[j]) : 0.0;
  increase_ += multiplier_;
}

/// Farkas' lemma with y = the last increase of the multipliers, not negative. Between two updates
/// D'(nu2 - nu1) = -(H + J'curvature J)(w2 - w1) on every direction that dynamics and equality rows
/// leave free. With v = that and what decreases add, a point x that they hold has
/// y'(D x + d) = y'h(w2) + v'(x - w2): rows are violated until |x - w2| >= y'h / |v|.
bool MultiplierMethod::is_contradiction(const StageQpSolution& point) {
  bool is_proved = false;
  if (has_last_) {
    double v = 0.0;
    std::size_t longest = 0;
    for (std::size_t k = 0; k < last_.size(); ++k) {
      last_[k] = point.w[k] - last_[k];
      longest = std::max(longest, static_cast<std::size_t>(last_[k].size()));
    }
    v = qp_.gradient_change(last_) + std::sqrt(static_cast<double>(longest)) *
                                         increase_.cwiseMin(0.0).cwiseAbs().dot(qp_.norm());
    is_proved =
        increase_.cwiseMax(0.0).dot(value_) > kCertified * (1.0 + largest_entry(point.w)) * v;
  }
  last_ = point.w;
  has_last_ = true;
  return is_proved;
}

}  // namespace palanquin
