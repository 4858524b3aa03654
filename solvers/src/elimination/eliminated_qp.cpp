#include "elimination/eliminated_qp.hpp"

#include <algorithm>

#include "palanquin/core/most_kept.hpp"
#include "palanquin/core/stage_qp_check.hpp"

namespace palanquin {

std::array<int, 11> EliminatedQp::sizes(const QpStage& stage) {
  return {stage.nx,
          stage.nu,
          stage.nl,
          stage.dynamics.nnz(),
          stage.implicit.nnz(),
          stage.hessian.nnz(),
          stage.penalty_jacobian.nnz(),
          stage.penalty_jacobian.rows,
          stage.inequality_jacobian.nnz(),
          stage.inequality_jacobian.rows,
          stage.equality_jacobian.nnz()};
}

bool EliminatedQp::take(const StageQp& qp) {
  if (!is_planned(qp)) {
    knots_.assign(qp.stages.size(), {});
    for (std::size_t k = 0; k < knots_.size(); ++k)
      knots_[k].refused.assign(static_cast<std::size_t>(qp.stages[k].equality_jacobian.rows), 0);
    plan(qp);
  }
  while (!hold_pivots(qp)) plan(qp);
  whole_ = has_given_ ? &qp : nullptr;
  if (!has_given_) return false;
  reduced_.initial_state = qp.initial_state;
  for (std::size_t k = 0; k < knots_.size(); ++k)
    if (Knot& knot = knots_[k]; knot.substitution != nullptr)
      knot.substitution->write(qp.stages[k], knot.values, reduced_.stages[k]);
    else
      copy_values(qp.stages[k], reduced_.stages[k]);
  return true;
}

bool EliminatedQp::is_planned(const StageQp& qp) const {
  if (revision_ != qp.structure_revision || knots_.size() != qp.stages.size()) return false;
  for (std::size_t k = 0; k < knots_.size(); ++k)
    if (knots_[k].sizes != sizes(qp.stages[k])) return false;
  return true;
}

bool EliminatedQp::hold_pivots(const StageQp& qp) {
  bool all = true;
  for (std::size_t k = 0; k < knots_.size(); ++k)
    if (knots_[k].substitution != nullptr)
      all = knots_[k].substitution->holds(qp.stages[k], knots_[k].refused) && all;
  return all;
}

void EliminatedQp::plan(const StageQp& qp) {
  require_consistent(qp);
  const bool is_linked = std::any_of(qp.stages.begin(), qp.stages.end(),
                                     [](const QpStage& s) { return s.link_jacobian.rows > 0; });
  if (shared_.size() > most_kept(knots_.size())) shared_.clear();
  std::erase_if(shared_, [](const auto& kept) { return kept.first.first < 0; });
  revision_ = qp.structure_revision;
  has_given_ = false;
  reduced_.stages.resize(knots_.size());
  Eigen::Index longest = 0, most_rows = 0;
  for (std::size_t k = 0; k < knots_.size(); ++k) {
    Knot& knot = knots_[k];
    const QpStage& stage = qp.stages[k];
    knot.sizes = sizes(stage);
    knot.substitution = nullptr;
    longest = std::max<Eigen::Index>(longest, stage.nw());
    most_rows = std::max<Eigen::Index>(most_rows, stage.penalty_jacobian.rows);
    if (is_linked || stage.equality_jacobian.rows == 0) continue;
    const Shared& shared = find(stage, k);
    if (shared.substitution.is_empty()) continue;
    has_given_ = true;
    knot.substitution = &shared.substitution;
    knot.values = shared.substitution.make_values();
    reduced_.stages[k] = shared.substitution.pattern();
    reduced_.stages[k].pattern = shared.pattern;
  }
  if (!has_given_) return;
  for (std::size_t k = 0; k < knots_.size(); ++k)
    if (knots_[k].substitution == nullptr) reduced_.stages[k] = qp.stages[k];
  gradient_.resize(longest);
  rows_.resize(most_rows);
  ++reduced_.structure_revision;
}

const EliminatedQp::Shared& EliminatedQp::find(const QpStage& stage, std::size_t k) {
  const bool is_known = stage.pattern >= 0;
  std::unique_ptr<Shared>& shared =
      shared_[{is_known ? stage.pattern : -1 - static_cast<int>(k), knots_[k].refused}];
  if (shared == nullptr)
    shared.reset(new Shared{Substitution(stage, knots_[k].refused), is_known ? new_pattern() : -1});
  return *shared;
}

/// Of a knot without anything given.
void EliminatedQp::copy_values(const QpStage& stage, QpStage& reduced) {
  for (SparseBlock QpStage::* block :
       {&QpStage::dynamics, &QpStage::implicit, &QpStage::hessian, &QpStage::penalty_jacobian,
        &QpStage::equality_jacobian, &QpStage::inequality_jacobian})
    (reduced.*block).values = (stage.*block).values;
  for (Eigen::VectorXd QpStage::* vector :
       {&QpStage::offset, &QpStage::gradient, &QpStage::penalty_value, &QpStage::equality_value,
        &QpStage::inequality_value})
    reduced.*vector = stage.*vector;
  reduced.penalty_policy = stage.penalty_policy;
}

const PenaltyModel& EliminatedQp::reduce(const PenaltyModel& model) {
  const auto is_shifted = [](const Knot& knot) {
    return knot.substitution != nullptr && knot.values.is_shifted;
  };
  if (std::none_of(knots_.begin(), knots_.end(), is_shifted)) return model;
  model_ = model;
  for (std::size_t k = 0; k < knots_.size(); ++k)
    if (is_shifted(knots_[k]))
      model_.slope[k] += model.curvature[k].cwiseProduct(knots_[k].values.penalty_shift);
  return model_;
}

void EliminatedQp::restrict_to(const StageQpSolution& whole, StageQpSolution& reduced) const {
  reduced.resize(reduced_);
  for (std::size_t k = 0; k < knots_.size(); ++k) {
    reduced.inequality_multiplier[k] = whole.inequality_multiplier[k];
    reduced.dynamics_multiplier[k] = whole.dynamics_multiplier[k];
    if (const Substitution* s = knots_[k].substitution; s != nullptr) {
      s->restrict_variables(whole.w[k], reduced.w[k]);
      s->restrict_multipliers(whole.equality_multiplier[k], reduced.equality_multiplier[k]);
    } else {
      reduced.w[k] = whole.w[k];
      reduced.equality_multiplier[k] = whole.equality_multiplier[k];
    }
  }
}

void EliminatedQp::extend(const StageQpSolution& reduced, StageQpSolution& whole) const {
  for (std::size_t k = 0; k < knots_.size(); ++k) {
    whole.inequality_multiplier[k] = reduced.inequality_multiplier[k];
    whole.dynamics_multiplier[k] = reduced.dynamics_multiplier[k];
    if (const Substitution* s = knots_[k].substitution; s != nullptr) {
      s->extend_variables(knots_[k].values, reduced.w[k], whole.w[k]);
      s->extend_multipliers(reduced.equality_multiplier[k], whole.equality_multiplier[k]);
    } else {
      whole.w[k] = reduced.w[k];
      whole.equality_multiplier[k] = reduced.equality_multiplier[k];
    }
  }
}

void EliminatedQp::find_multipliers(const PenaltyModel& model, StageQpSolution& whole) {
  for (std::size_t k = 0; k < knots_.size(); ++k) {
    if (knots_[k].substitution == nullptr) continue;
    const QpStage& stage = whole_->stages[k];
    auto gradient = gradient_.head(stage.nw());
    lagrangian_gradient(*whole_, model, whole, static_cast<int>(k), gradient,
                        rows_.head(stage.penalty_jacobian.rows));
    knots_[k].substitution->find_multipliers(stage, gradient, whole.equality_multiplier[k]);
  }
}

void EliminatedQp::extend_gain(const Eigen::MatrixXd& reduced,
                               Eigen::Ref<Eigen::MatrixXd> gain) const {
  const Knot& first = knots_.front();
  if (first.substitution == nullptr)
    gain = reduced;
  else
    first.substitution->extend_gain(first.values, reduced, gain);
}

}  // namespace palanquin
