#include "penalty_segment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palanquin {
namespace {

constexpr int kMaxSearchSteps = 50;
/// The search ends at a slope this small relative to the one at the start.
constexpr double kSlopeTolerance = 1e-9;

/// Calls visit(stage, k, first variable, first penalised row) for every knot.
template <typename Visit>
void for_each_knot(const StageQp& qp, Visit&& visit) {
  Eigen::Index variable = 0, row = 0;
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    visit(qp.stages[k], k, variable, row);
    variable += qp.stages[k].nw();
    row += qp.stages[k].penalty_value.size();
  }
}

/// d'Hd, where `h` is a lower triangle whose columns begin with their diagonal entries.
double quadratic_form(const SparseBlock& h, const double* d) {
  double total = 0.0;
  for (int j = 0; j < h.cols; ++j) {
    int e = h.column_start[j];
    double sum = 0.5 * h.values[e] * d[j];
    while (++e < h.column_start[j + 1]) sum += h.values[e] * d[h.row_index[e]];
    total += sum * d[j];
  }
  return 2.0 * total;
}

/// Below this a penalty is zero, for good.
double activation(const Policy& policy) {
  switch (policy.kind) {
    case PolicyKind::C2Penalty:
      return -policy.smoothing;
    case PolicyKind::SquaredHinge:
      return 0.0;
    case PolicyKind::Hard:
    case PolicyKind::RelaxedBarrier:
      break;
  }
  return -std::numeric_limits<double>::infinity();
}

}  // namespace

void PenaltySegment::start(const StageQp& qp, const std::vector<Eigen::VectorXd>& w) {
  qp_ = &qp;
  Eigen::Index variables = 0, rows = 0;
  for (const QpStage& stage : qp.stages) {
    variables += stage.nw();
    rows += stage.penalty_value.size();
  }
  for (Eigen::VectorXd* v : {&direction_, &gradient_}) v->resize(variables);
  for (Eigen::VectorXd* v : {&row_, &row_change_}) v->resize(rows);
  for_each_knot(qp, [&](const QpStage& stage, std::size_t k, Eigen::Index i, Eigen::Index j) {
    gradient_.segment(i, stage.nw()) = stage.gradient;
    row_.segment(j, stage.penalty_value.size()) = stage.penalty_value;
    if (w[k].isZero(0.0)) return;  // where an SQP starts
    stage.hessian.multiply_symmetric_add(w[k].data(), gradient_.data() + i);
    stage.penalty_jacobian.multiply_add(w[k].data(), row_.data() + j);
  });
  row_change_.setZero();
  list_active_rows();
}

void PenaltySegment::list_active_rows() {
  active_.clear();
  for_each_knot(*qp_, [&](const QpStage& stage, std::size_t k, Eigen::Index, Eigen::Index first) {
    for (Eigen::Index j = 0; j < stage.penalty_value.size(); ++j) {
      const Policy& policy = stage.penalty_policy[j];
      const double start = row_[first + j];
      const double highest = std::max(start, start + row_change_[first + j]);
      if (!(highest <= activation(policy))) active_.push_back({first + j, k, j, &policy});
    }
  });
}

void PenaltySegment::aim(const StageQp& qp, const std::vector<Eigen::VectorXd>& w,
                         const std::vector<Eigen::VectorXd>& target) {
  row_change_.setZero();
  curvature_ = 0.0;
  for_each_knot(qp, [&](const QpStage& stage, std::size_t k, Eigen::Index i, Eigen::Index j) {
    direction_.segment(i, stage.nw()) = target[k] - w[k];
    curvature_ += quadratic_form(stage.hessian, direction_.data() + i);
    stage.penalty_jacobian.multiply_add(direction_.data() + i, row_change_.data() + j);
  });
  slope_ = gradient_.dot(direction_);
  list_active_rows();
}

void PenaltySegment::advance(double alpha) {
  direction_ *= alpha;
  for_each_knot(*qp_, [&](const QpStage& stage, std::size_t, Eigen::Index i, Eigen::Index) {
    stage.hessian.multiply_symmetric_add(direction_.data() + i, gradient_.data() + i);
  });
  row_ += alpha * row_change_;
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
  auto active = active_.begin();  // in the order of the rows
  for_each_knot(*qp_, [&](const QpStage& stage, std::size_t k, Eigen::Index, Eigen::Index first) {
    for (Eigen::Index j = 0; j < stage.penalty_value.size(); ++j) {
      const double h = row_[first + j] + row_change_[first + j];
      const double modelled =
          model.slope[k][j] + model.curvature[k][j] * (h - stage.penalty_value[j]);
      PenaltyValue exact;
      if (active != active_.end() && active->row == first + j)
        exact = evaluate_penalty(*active++->policy, h);
      const double difference = std::abs(modelled - exact.slope);
      is_nan = is_nan || std::isnan(difference);  // which std::max would lose
      error = std::max(error, difference);
      largest = std::max({largest, std::abs(modelled), std::abs(exact.slope)});
      if (difference > 0.0) gain += 0.5 * difference * difference / exact.curvature;
    }
  });
  if (is_nan) error = std::numeric_limits<double>::quiet_NaN();
  return {largest > 0.0 ? error / largest : error, gain};
}

void PenaltySegment::expand(PenaltyModel& model) const {
  for (std::size_t k = 0; k < model.slope.size(); ++k) {
    model.slope[k].setZero();
    model.curvature[k].setZero();
  }
  for (const auto& [row, k, j, policy] : active_) {
    const PenaltyValue s = evaluate_penalty(*policy, row_[row]);
    model.curvature[k][j] = s.curvature;
    model.slope[k][j] = s.slope - s.curvature * (row_[row] - qp_->stages[k].penalty_value[j]);
  }
}

}  // namespace palanquin
