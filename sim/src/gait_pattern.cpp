#include "palanquin/sim/gait_pattern.hpp"

#include <cmath>

namespace palanquin {

namespace {

/// Cycles by which flags are sampled late, so that rounding never puts an instant before its event.
constexpr double kLate = 1e-6;

}  // namespace

double GaitPattern::since_touchdown(int leg, double time) const {
  const double phase = (time - start) / period + kLate - offset[static_cast<std::size_t>(leg)];
  return phase - std::floor(phase);
}

bool GaitPattern::stands(int leg, double time) const {
  const double share = duty[static_cast<std::size_t>(leg)];
  return time < start - kLate * period || share >= 1 || since_touchdown(leg, time) < share;
}

double GaitPattern::swing_progress(int leg, double time) const {
  const double share = duty[static_cast<std::size_t>(leg)];
  return share >= 1 ? 0 : std::max(0.0, (since_touchdown(leg, time) - share) / (1 - share));
}

std::string GaitPattern::explain_invalid() const {
  if (!(period > 0) || !std::isfinite(period))
    return "period is " + std::to_string(period) + " s; it must be positive";
  if (!std::isfinite(start)) return "start must be finite";
  for (int leg = 0; leg < kLegs; ++leg) {
    const double share = duty[static_cast<std::size_t>(leg)];
    if (!(share > 0 && share <= 1))
      return "duty is " + std::to_string(share) + "; it must be over 0 and at most 1";
    if (!std::isfinite(offset[static_cast<std::size_t>(leg)])) return "offset must be finite";
  }
  return {};
}

}  // namespace palanquin
