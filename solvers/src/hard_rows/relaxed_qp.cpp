#include "hard_rows/relaxed_qp.hpp"

#include <algorithm>
#include <cmath>

namespace palanquin {
namespace {

/// Rows over variables without cost get at least this share of the cost's largest curvature.
constexpr double kFlat = 1e-3;

/// Entry (j, j) of a lower triangle, its rows ascending.
double diagonal(const SparseBlock& lower, int j) {
  const int e = lower.column_start[j];
  return e < lower.column_start[j + 1] && lower.row_index[e] == j ? lower.values[e] : 0.0;
}

}  // namespace

/// Calls visit(k, first row over all knots, number of rows) for every knot.
template <typename Visit>
void RelaxedQp::for_each_knot(Visit&& visit) const {
  Eigen::Index first = 0;
  for (std::size_t k = 0; k < original_->stages.size(); ++k) {
    const Eigen::Index rows = original_->stages[k].inequality_value.size();
    visit(k, first, rows);
    first += rows;
  }
}

void RelaxedQp::take(const StageQp& qp, const PenaltyModel& model) {
  original_ = &qp;
  Eigen::Index rows = 0;
  double largest = 0.0;
  has_equality_rows_ = false;
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    rows += qp.stages[k].inequality_value.size();
    has_equality_rows_ = has_equality_rows_ || qp.stages[k].equality_value.size() > 0;
    for (int j = 0; j < qp.stages[k].hessian.cols; ++j)
      largest = std::max(largest, diagonal(qp.stages[k].hessian, j));
  }
  Eigen::Index longest = 0, most_rows = 0;
  for (const QpStage& stage : qp.stages) {
    longest = std::max<Eigen::Index>(longest, stage.nw());
    most_rows = std::max({most_rows, stage.penalty_value.size(), stage.inequality_value.size()});
  }
  product_.resize(longest);
  row_product_.resize(most_rows);
  norm_.resize(rows);
  stiffness_.resize(rows);
  stiffness_.setConstant(largest > 0.0 ? kFlat * largest : 1.0);
  largest_curvature_ = largest > 0.0 ? largest : 1.0;
  model_.slope.resize(qp.stages.size());
  model_.curvature.resize(qp.stages.size());
  for_each_knot([&](std::size_t k, Eigen::Index first, Eigen::Index rows_here) {
    const Eigen::Index penalties = model.slope[k].size();
    model_.slope[k].resize(penalties + rows_here);
    model_.curvature[k].resize(penalties + rows_here);
    model_.slope[k].head(penalties) = model.slope[k];
    model_.curvature[k].head(penalties) = model.curvature[k];
    measure_rows(qp.stages[k], first);
  });
}

/// Norms of a knot's rows, and their stiffness out of the largest curvature that they meet.
void RelaxedQp::measure_rows(const QpStage& stage, Eigen::Index first) {
  const SparseBlock& rows = stage.inequality_jacobian;
  auto norm = norm_.segment(first, rows.rows);
  auto stiffness = stiffness_.segment(first, rows.rows);
  norm.setZero();
  for (int j = 0; j < rows.cols; ++j) {
    if (rows.column_start[j] == rows.column_start[j + 1]) continue;
    const double curvature = diagonal(stage.hessian, j);
    for (int e = rows.column_start[j]; e < rows.column_start[j + 1]; ++e) {
      const int i = rows.row_index[e];
      if (rows.values[e] != 0.0) stiffness[i] = std::max(stiffness[i], curvature);
      norm[i] += rows.values[e] * rows.values[e];
    }
  }
  norm = (norm.array() > 0.0).select(norm, 1.0);
  stiffness.array() /= norm.array();
  norm = norm.cwiseSqrt();
}

void RelaxedQp::set_forces(const Eigen::VectorXd& base, const Eigen::VectorXd& curvature) {
  for_each_knot([&](std::size_t k, Eigen::Index first, Eigen::Index count) {
    const auto rho = curvature.segment(first, count);
    model_.curvature[k].tail(count) = rho;
    model_.slope[k].tail(count) =
        base.segment(first, count) + rho.cwiseProduct(original_->stages[k].inequality_value);
  });
}

void RelaxedQp::evaluate(const std::vector<Eigen::VectorXd>& w, Eigen::VectorXd& h) const {
  h.resize(rows());
  for_each_knot([&](std::size_t k, Eigen::Index first, Eigen::Index count) {
    h.segment(first, count) = original_->stages[k].inequality_value;
    original_->stages[k].inequality_jacobian.multiply_add(w[k].data(), h.data() + first);
  });
}

void RelaxedQp::multiply(const std::vector<Eigen::VectorXd>& dw, Eigen::VectorXd& change) const {
  change.setZero(rows());
  for_each_knot([&](std::size_t k, Eigen::Index first, Eigen::Index) {
    original_->stages[k].inequality_jacobian.multiply_add(dw[k].data(), change.data() + first);
  });
}

/// The head of product_ becomes (H + J'curvature J) dw of a knot, J the penalised rows and, if
/// asked for, the hard ones.
Eigen::Ref<const Eigen::VectorXd> RelaxedQp::multiply_cost(std::size_t k, const Eigen::VectorXd& dw,
                                                           bool with_hard_rows) {
  const QpStage& stage = original_->stages[k];
  auto product = product_.head(stage.nw());
  product.setZero();
  stage.hessian.multiply_symmetric_add(dw.data(), product.data());
  const auto add_rows = [&](const SparseBlock& jacobian, Eigen::Index first) {
    auto force = row_product_.head(jacobian.rows);
    force.setZero();
    jacobian.multiply_add(dw.data(), force.data());
    force.array() *= model_.curvature[k].segment(first, jacobian.rows).array();
    jacobian.multiply_transposed_add(force.data(), product.data());
  };
  add_rows(stage.penalty_jacobian, 0);
  if (with_hard_rows) add_rows(stage.inequality_jacobian, stage.penalty_jacobian.rows);
  return product;
}

double RelaxedQp::curvature_along(const std::vector<Eigen::VectorXd>& dw) {
  double sum = 0.0;
  for (std::size_t k = 0; k < dw.size(); ++k) sum += multiply_cost(k, dw[k], true).dot(dw[k]);
  return sum;
}

double RelaxedQp::gradient_change(const std::vector<Eigen::VectorXd>& dw) {
  double sum = 0.0;
  for (std::size_t k = 0; k < dw.size(); ++k) sum += multiply_cost(k, dw[k], false).lpNorm<1>();
  return sum;
}

void RelaxedQp::read_multipliers(const StageQpSolution& solution, Eigen::VectorXd& nu) const {
  nu.resize(rows());
  for_each_knot([&](std::size_t k, Eigen::Index first, Eigen::Index count) {
    nu.segment(first, count) = solution.inequality_multiplier[k];
  });
  nu = nu.unaryExpr([](double v) { return std::isfinite(v) ? std::max(0.0, v) : 0.0; });
}

void RelaxedQp::write_multipliers(const Eigen::VectorXd& nu, StageQpSolution& solution) const {
  for_each_knot([&](std::size_t k, Eigen::Index first, Eigen::Index count) {
    solution.inequality_multiplier[k] = nu.segment(first, count);
  });
}

}  // namespace palanquin
