#include "penalty_segment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/dispatch.hpp"

namespace palanquin {
namespace {

constexpr int kMaxSearchSteps = 50;
/// The search ends at a slope this small relative to the one at the start.
constexpr double kSlopeTolerance = 1e-9;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Calls visit(stage, k, first penalised row) for every knot.
template <typename Visit>
void for_each_knot(const StageQp& qp, Visit&& visit) {
  Eigen::Index row = 0;
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    visit(qp.stages[k], k, row);
    row += qp.stages[k].penalty_value.size();
  }
}

bool is_zero(const std::vector<Eigen::VectorXd>& w) {
  return std::all_of(w.begin(), w.end(), [](const auto& part) { return part.isZero(0.0); });
}

/// The h at which a C2 penalty has the slope `force` > 0.
double find_row(const Policy& policy, double force) {
  const double k = policy.stiffness, eps = policy.smoothing;
  if (force >= 2.0 * k * eps) return force / (2.0 * k);
  return eps * (std::sqrt(2.0 * force / (k * eps)) - 1.0);
}

}  // namespace

PenaltySegment::PenaltySegment(KernelLevel level)
    : kernels_(kernels::kernels_for(resolve_kernel_level(level))) {}

void PenaltySegment::add_rows(std::size_t k, const double* v, double* rows) const {
  kernels_.multiply_runs_add(plans_[k].rows(), qp_->stages[k].penalty_jacobian.values.data(), v,
                             rows);
}

void PenaltySegment::start(const StageQp& qp, const std::vector<Eigen::VectorXd>& w) {
  qp_ = &qp;
  plans_.find(qp);
  is_at_origin_ = is_zero(w);  // where an SQP starts
  Eigen::Index rows = 0, widest = 0;
  for (const QpStage& stage : qp.stages) {
    rows += stage.penalty_value.size();
    widest = std::max<Eigen::Index>(widest, stage.nw());
  }
  if (direction_.size() < widest) direction_.resize(widest);
  for (Eigen::VectorXd* v : {&row_, &row_change_, &limit_}) v->resize(rows + kernels::kPad);
  row_change_.setZero();
  limit_.tail<kernels::kPad>().setConstant(kInfinity);
  row_.tail<kernels::kPad>().setZero();
  listed_.resize(limit_.size());
  for_each_knot(qp, [&](const QpStage& stage, std::size_t, Eigen::Index first) {
    row_.segment(first, stage.penalty_value.size()) = stage.penalty_value;
    for (Eigen::Index j = 0; j < stage.penalty_value.size(); ++j)
      limit_[first + j] = vanishes_until(stage.penalty_policy[j]);
  });
  if (!is_at_origin_)
    for_each_knot(qp, [&](const QpStage&, std::size_t k, Eigen::Index first) {
      add_rows(k, w[k].data(), row_.data() + first);
    });
  list_active_rows();
}

void PenaltySegment::list_active_rows() {
  active_.clear();
  const int count =
      kernels_.list_rows_above(static_cast<int>(row_.size()) - kernels::kPad, limit_.data(),
                               row_.data(), row_change_.data(), listed_.data());
  const int* listed = listed_.data();
  const int* const end = listed + count;
  for_each_knot(*qp_, [&](const QpStage& stage, std::size_t k, Eigen::Index first) {
    for (; listed != end && *listed < first + stage.penalty_value.size(); ++listed) {
      const Eigen::Index j = *listed - first;
      active_.push_back({*listed, k, j, &stage.penalty_policy[j]});
    }
  });
}

void PenaltySegment::watch(const PenaltyModel& model) {
  for_each_knot(*qp_, [&](const QpStage& stage, std::size_t k, Eigen::Index first) {
    for (Eigen::Index j = 0; j < stage.penalty_value.size(); ++j)
      if (model.slope[k][j] != 0.0 || model.curvature[k][j] != 0.0) limit_[first + j] = -kInfinity;
  });
}

void PenaltySegment::aim(const std::vector<Eigen::VectorXd>& w,
                         const std::vector<Eigen::VectorXd>& target) {
  slope_ = curvature_ = 0.0;
  row_change_.setZero();
  for_each_knot(*qp_, [&](const QpStage& stage, std::size_t k, Eigen::Index first) {
    auto d = direction_.head(stage.nw());
    d = target[k] - w[k];
    slope_ += stage.gradient.dot(d);
    if (!is_at_origin_) slope_ += plans_[k].bilinear(stage.hessian, w[k].data(), d.data());
    curvature_ += plans_[k].bilinear(stage.hessian, d.data(), d.data());
    add_rows(k, d.data(), row_change_.data() + first);
  });
  list_active_rows();
}

void PenaltySegment::advance(double alpha) {
  row_ += alpha * row_change_;
  is_at_origin_ = false;
}

double PenaltySegment::change(double alpha) const {
  double total = alpha * (slope_ + 0.5 * alpha * curvature_);
  for (const ActiveRow& active : active_) {
    const double start = row_[active.row];
    const double end = start + alpha * row_change_[active.row];
    total +=
        evaluate_penalty(*active.policy, end).value - evaluate_penalty(*active.policy, start).value;
  }
  return total;
}

PenaltySegment::Derivatives PenaltySegment::at(double alpha) const {
  Derivatives phi{slope_ + alpha * curvature_, curvature_};
  for (const ActiveRow& active : active_) {
    const double change = row_change_[active.row];
    const PenaltyValue s = evaluate_penalty(*active.policy, row_[active.row] + alpha * change);
    phi.slope += s.slope * change;
    phi.curvature += s.curvature * change * change;
  }
  return phi;
}

double PenaltySegment::minimize(const Derivatives& start) const {
  if (!(start.slope < 0.0)) return 0.0;
  const double tolerance = kSlopeTolerance * -start.slope;
  if (at(1.0).slope <= tolerance) return 1.0;
  double low = 0.0, high = 1.0;  // phi' < 0 at low, > 0 at high
  Derivatives phi = start;
  double alpha = 0.0;
  for (int i = 0; i < kMaxSearchSteps; ++i) {
    const double newton = alpha - phi.slope / phi.curvature;
    alpha = newton > low && newton < high ? newton : 0.5 * (low + high);
    phi = at(alpha);
    if (std::abs(phi.slope) <= tolerance) return alpha;
    (phi.slope < 0.0 ? low : high) = alpha;
  }
  return low;
}

PenaltySegment::ModelError PenaltySegment::model_error(const PenaltyModel& model) const {
  double error = 0.0, largest = 0.0, gain = 0.0;
  bool is_nan = false;
  for (const auto& [row, k, j, policy] : active_) {
    const double h = row_[row] + row_change_[row];
    const double modelled =
        model.slope[k][j] + model.curvature[k][j] * (h - qp_->stages[k].penalty_value[j]);
    const PenaltyValue exact = evaluate_penalty(*policy, h);
    const double difference = std::abs(modelled - exact.slope);
    is_nan = is_nan || std::isnan(difference);  // which std::max would lose
    error = std::max(error, difference);
    largest = std::max({largest, std::abs(modelled), std::abs(exact.slope)});
    if (difference > 0.0) gain += 0.5 * difference * difference / exact.curvature;
  }
  if (is_nan) error = std::numeric_limits<double>::quiet_NaN();
  return {largest > 0.0 ? error / largest : error, gain};
}

void PenaltySegment::expand(PenaltyModel& model) const {
  for (std::size_t k = 0; k < model.slope.size(); ++k) {
    model.slope[k].setZero();
    model.curvature[k].setZero();
  }
  for (const auto& [row, k, j, policy] : active_)
    expand_row(k, j, row_[row], evaluate_penalty(*policy, row_[row]), model);
}

void PenaltySegment::update(PenaltyModel& model) {
  for (const auto& [row, k, j, policy] : active_) {
    double h = row_[row];
    const double curvature = model.curvature[k][j];
    const double force = model.slope[k][j] + curvature * (h - qp_->stages[k].penalty_value[j]);
    if (policy->kind == PolicyKind::C2Penalty && curvature > 0.0 && force > 0.0) {
      h = find_row(*policy, force);
      limit_[row] = -kInfinity;
    }
    expand_row(k, j, h, evaluate_penalty(*policy, h), model);
  }
}

void PenaltySegment::expand_row(std::size_t k, Eigen::Index index, double h, const PenaltyValue& s,
                                PenaltyModel& model) const {
  model.curvature[k][index] = s.curvature;
  model.slope[k][index] = s.slope - s.curvature * (h - qp_->stages[k].penalty_value[index]);
}

}  // namespace palanquin
