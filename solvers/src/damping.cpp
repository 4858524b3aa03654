#include "palanquin/solvers/damping.hpp"

#include <algorithm>
#include <cmath>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

std::string DampingSettings::explain_invalid() const {
  return SettingRules("damping.")
      .positive("first", first)
      .positive("smallest", smallest)
      .check(largest >= first, "largest", largest, "at least damping.first")
      .check(growth > 1.0, "growth", growth, "above 1")
      .check(poor >= 0.0 && poor < 1.0, "poor", poor, "in [0, 1)")
      .at_least("max_attempts", max_attempts, 1)
      .sentence();
}

bool Damping::grow_to_factorize() {
  constexpr double kStride = 100.0;  // what is missing is unknown by orders of magnitude
  if (weight_ >= settings_.largest) return false;
  weight_ = std::clamp(kStride * weight_, settings_.smallest, settings_.largest);
  needed_ = weight_;
  return true;
}

bool Damping::grow() {
  if (weight_ >= settings_.largest) return false;
  weight_ = std::clamp(settings_.growth * weight_, settings_.first, settings_.largest);
  return true;
}

void Damping::update(double ratio, bool is_full_step) {
  constexpr double kNegligible = 1e-2;  // of `first`
  if (!is_full_step || ratio < settings_.poor) {
    grow();
    return;
  }
  const double known = std::isnan(ratio) ? 1.0 : std::min(ratio, 1.0);
  weight_ *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * known - 1.0, 3));
  if (weight_ < kNegligible * settings_.first) weight_ = needed_;
}

void Damping::measure(const StageQp& qp) {
  scale_.resize(qp.stages.size());
  double sum = 0.0;
  int count = 0;
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    const SparseBlock& hessian = qp.stages[k].hessian;
    scale_[k].resize(hessian.cols);
    for (int j = 0; j < hessian.cols; ++j) {  // the diagonal leads its column
      const double diagonal =
          std::abs(hessian.values[static_cast<std::size_t>(hessian.column_start[j])]);
      scale_[k][j] = diagonal;
      if (!(diagonal > 0.0)) continue;
      sum += std::log(diagonal);
      ++count;
    }
  }
  const double mean = count > 0 ? std::exp(sum / count) : 1.0;
  for (Eigen::VectorXd& knot : scale_) knot = (knot.array() > 0.0).select(knot, mean);
}

}  // namespace palanquin
