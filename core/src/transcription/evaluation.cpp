#include "palanquin/core/transcription/evaluation.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "transcription/sizes.hpp"

namespace palanquin {

KnotValues::KnotValues(const LoweredProblem& problem)
    : next_state(size_of(problem.nx())),
      defect(size_of(problem.ndx())),
      equality(most_rows(problem, RowKind::Equality)),
      inequality(most_rows(problem, RowKind::Inequality)),
      link(size_of(problem.link_linear.result(0).nnz())) {}

Evaluation summarize(const std::vector<const KnotRows*>& rows, const RowPolicies& policies,
                     const std::vector<KnotValues>& values) {
  double cost = 0.0, penalty = 0.0;
  double equality_max = 0.0, equality_squared = 0.0;
  double inequality_max = 0.0, inequality_squared = 0.0;
  const auto residual = [&](double value) {
    equality_max = std::max(equality_max, std::abs(value));
    equality_squared += value * value;
  };
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const KnotRows& knot = *rows[k];
    const KnotValues& at = values[k];
    const RowPolicies::Stage& policy = policies.at(knot.stage);
    cost += at.cost;
    for (int row : knot.penalty_rows) {
      const double h = at.inequality[size_of(row)];
      if (h <= policy.vanishes_until[size_of(row)]) continue;
      penalty += evaluate_penalty(policy.policy[size_of(row)], h).value;
    }
    for (int row : knot.inequality_rows) {
      const double h = at.inequality[size_of(row)];
      inequality_max = std::max(inequality_max, h);
      if (!(h <= 0.0)) inequality_squared += h * h;
    }
    for (int row : knot.equality_rows) residual(at.equality[size_of(row)]);
    for (int row : knot.own_links) residual(at.link[size_of(row)]);
    for (int row : knot.link_rows) residual(at.link[size_of(row)]);
    if (knot.stage == StageKind::Terminal || at.defect.empty()) continue;
    const Eigen::Map<const Eigen::VectorXd> defect(at.defect.data(),
                                                   static_cast<Eigen::Index>(at.defect.size()));
    equality_max = std::max(equality_max, defect.lpNorm<Eigen::Infinity>());
    equality_squared += defect.squaredNorm();
  }
  // std::max drops a NaN; the sums of squares don't.
  const auto unless_nan = [](double largest, double squared) {
    return std::isnan(squared) ? Evaluation::kNaN : largest;
  };
  Evaluation total;
  total.cost = cost;
  total.penalty = penalty;
  total.equality_max = unless_nan(equality_max, equality_squared);
  total.inequality_max = unless_nan(inequality_max, inequality_squared);
  total.infeasibility = std::sqrt(equality_squared + inequality_squared);
  total.is_finite = std::isfinite(total.total()) && std::isfinite(total.infeasibility);
  return total;
}

}  // namespace palanquin
