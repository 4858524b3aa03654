#include "hard_rows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palanquin {
namespace {

/// Appends column `j` of `block`, its rows moved down by `shift`.
void append_column(const SparseBlock& block, int j, int shift, SparseBlock& target) {
  if (j >= block.cols) return;  // a block without rows may have no columns either
  for (int e = block.column_start[j]; e < block.column_start[j + 1]; ++e)
    target.push(shift + block.row_index[e], block.values[e]);
}

}  // namespace

/// Calls visit(k, first row over all knots, number of rows) for every knot.
template <typename Visit>
void HardRows::for_each_knot(Visit&& visit) const {
  Eigen::Index first = 0;
  for (std::size_t k = 0; k < qp_->stages.size(); ++k) {
    const Eigen::Index rows = qp_->stages[k].inequality_value.size();
    visit(k, first, rows);
    first += rows;
  }
}

void HardRows::start(const StageQp& qp, const PenaltyModel& model, const StageQpSolution& warm,
                     double stiffness) {
  qp_ = &qp;
  relaxed_.stages.resize(qp.stages.size());
  relaxed_.initial_state = qp.initial_state;
  relaxed_.structure_revision = qp.structure_revision;
  Eigen::Index rows = 0;
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    append_rows(qp.stages[k], relaxed_.stages[k]);
    rows += qp.stages[k].inequality_value.size();
  }
  for (Eigen::VectorXd* v : {&multiplier_, &stiffness_, &value_, &change_}) v->resize(rows);
  is_active_.resize(static_cast<std::size_t>(rows));
  model_.resize(relaxed_);
  for_each_knot([&](std::size_t k, Eigen::Index first, Eigen::Index count) {
    const Eigen::Index penalties = model.slope[k].size();
    model_.slope[k].head(penalties) = model.slope[k];
    model_.curvature[k].head(penalties) = model.curvature[k];
    const Eigen::VectorXd& nu = warm.inequality_multiplier[k];
    for (Eigen::Index j = 0; j < count; ++j)
      multiplier_[first + j] = std::isfinite(nu[j]) ? std::max(0.0, nu[j]) : 0.0;
    set_stiffness(qp.stages[k], first, stiffness);
  });
  for (Eigen::Index j = 0; j < rows; ++j) is_active_[j] = multiplier_[j] > 0.0;
}

/// Copies all but the hard rows, which follow the penalised ones. Field by field: an assignment of
/// the whole would free and allocate what then changes its size.
void HardRows::append_rows(const QpStage& stage, QpStage& relaxed) const {
  relaxed.nx = stage.nx;
  relaxed.nu = stage.nu;
  relaxed.nl = stage.nl;
  relaxed.pattern = stage.pattern;
  for (SparseBlock QpStage::* block :
       {&QpStage::dynamics, &QpStage::implicit, &QpStage::hessian, &QpStage::equality_jacobian,
        &QpStage::link_previous, &QpStage::link_jacobian})
    relaxed.*block = stage.*block;
  for (Eigen::VectorXd QpStage::* vector :
       {&QpStage::offset, &QpStage::gradient, &QpStage::equality_value, &QpStage::link_value})
    relaxed.*vector = stage.*vector;

  const int penalties = stage.penalty_jacobian.rows;
  SparseBlock& jacobian = relaxed.penalty_jacobian;
  jacobian.begin(penalties + stage.inequality_jacobian.rows);
  for (int j = 0; j < stage.nw(); ++j) {
    append_column(stage.penalty_jacobian, j, 0, jacobian);
    append_column(stage.inequality_jacobian, j, penalties, jacobian);
    jacobian.end_column();
  }
  relaxed.penalty_value.resize(jacobian.rows);
  relaxed.penalty_value << stage.penalty_value, stage.inequality_value;
  relaxed.penalty_policy = stage.penalty_policy;
  relaxed.penalty_policy.resize(static_cast<std::size_t>(jacobian.rows));
}

void HardRows::set_stiffness(const QpStage& stage, Eigen::Index first, double stiffness) {
  constexpr double kFlat = 1e-12;  // rows over variables without cost get at least this curvature
  const SparseBlock& rows = stage.inequality_jacobian;
  auto curvature = stiffness_.segment(first, rows.rows);
  curvature.setConstant(kFlat);
  for (int j = 0; j < rows.cols; ++j) {
    double diagonal = 0.0;
    for (int e = stage.hessian.column_start[j]; e < stage.hessian.column_start[j + 1]; ++e)
      if (stage.hessian.row_index[e] == j) diagonal = stage.hessian.values[e];
    for (int e = rows.column_start[j]; e < rows.column_start[j + 1]; ++e)
      if (rows.values[e] != 0.0)
        curvature[rows.row_index[e]] = std::max(curvature[rows.row_index[e]], diagonal);
  }
  curvature *= stiffness;
}

const PenaltyModel& HardRows::model() {
  for_each_knot([&](std::size_t k, Eigen::Index first, Eigen::Index count) {
    const Eigen::Index penalties = model_.slope[k].size() - count;
    for (Eigen::Index j = 0; j < count; ++j) {
      const Eigen::Index row = first + j;
      const double rho = is_active_[row] ? stiffness_[row] : 0.0;
      const double nu = is_active_[row] ? multiplier_[row] : 0.0;
      model_.curvature[k][penalties + j] = rho;
      model_.slope[k][penalties + j] = nu + rho * qp_->stages[k].inequality_value[j];
    }
  });
  return model_;
}

void HardRows::evaluate(const std::vector<Eigen::VectorXd>& w) {
  for_each_knot([&](std::size_t k, Eigen::Index first, Eigen::Index count) {
    value_.segment(first, count) = qp_->stages[k].inequality_value;
    qp_->stages[k].inequality_jacobian.multiply_add(w[k].data(), value_.data() + first);
  });
}

double HardRows::search(const std::vector<Eigen::VectorXd>& from,
                        const std::vector<Eigen::VectorXd>& to) {
  direction_.resize(from.size());
  change_.setZero();
  for_each_knot([&](std::size_t k, Eigen::Index first, Eigen::Index) {
    direction_[k] = to[k] - from[k];
    qp_->stages[k].inequality_jacobian.multiply_add(direction_[k].data(), change_.data() + first);
  });
  // The model's slope along the segment is curvature (alpha - 1), since it is lowest at `to`. To
  // this comes what the rows are that the model has wrongly on or off.
  const double curvature = curvature_along();
  const auto slope = [&](double alpha) {
    double sum = curvature * (alpha - 1.0);
    for (Eigen::Index j = 0; j < value_.size(); ++j) {
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

/// d'(H + J' curvature J) d of the model.
double HardRows::curvature_along() {
  double sum = 0.0;
  for (std::size_t k = 0; k < direction_.size(); ++k) {
    const QpStage& stage = relaxed_.stages[k];
    const Eigen::Index size = std::max<Eigen::Index>(stage.nw(), stage.penalty_value.size());
    if (scratch_.size() < size) scratch_.resize(size);
    scratch_.setZero();
    stage.hessian.multiply_symmetric_add(direction_[k].data(), scratch_.data());
    sum += scratch_.head(stage.nw()).dot(direction_[k]);
    scratch_.setZero();
    stage.penalty_jacobian.multiply_add(direction_[k].data(), scratch_.data());
    sum += scratch_.head(stage.penalty_value.size()).cwiseAbs2().dot(model_.curvature[k]);
  }
  return sum;
}

bool HardRows::update_active_set() {
  bool is_changed = false;
  for (Eigen::Index j = 0; j < value_.size(); ++j) {
    const bool active = multiplier_[j] + stiffness_[j] * value_[j] > 0.0;
    is_changed = is_changed || active != static_cast<bool>(is_active_[j]);
    is_active_[j] = active;
  }
  return is_changed;
}

void HardRows::update_multipliers() {
  multiplier_ = (multiplier_ + stiffness_.cwiseProduct(value_)).cwiseMax(0.0);
}

void HardRows::store_multipliers(StageQpSolution& solution) const {
  for_each_knot([&](std::size_t k, Eigen::Index first, Eigen::Index count) {
    solution.inequality_multiplier[k] = multiplier_.segment(first, count);
  });
}

double HardRows::violation() const {
  double most = 0.0;
  for (Eigen::Index j = 0; j < value_.size(); ++j) {
    if (std::isnan(value_[j])) return std::numeric_limits<double>::quiet_NaN();
    most = std::max(most, is_active_[j] ? std::abs(value_[j]) : value_[j]);
  }
  return most;
}

}  // namespace palanquin
