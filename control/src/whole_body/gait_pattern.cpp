#include "palanquin/control/whole_body/gait_pattern.hpp"

#include <cmath>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

namespace {

/// Cycles by which flags are sampled late, so that rounding never puts an instant before its event.
constexpr double kLate = 1e-6;

}  // namespace

double GaitPattern::since_touchdown(int leg, double time) const {
  const double phase = (time - start) / period + kLate - offset.at(static_cast<std::size_t>(leg));
  return phase - std::floor(phase);
}

bool GaitPattern::stands(int leg, double time) const {
  const double share = duty.at(static_cast<std::size_t>(leg));
  return time < start - kLate * period || share >= 1 || since_touchdown(leg, time) < share;
}

double GaitPattern::swing_progress(int leg, double time) const {
  const double share = duty.at(static_cast<std::size_t>(leg));
  return share >= 1 ? 0 : std::max(0.0, (since_touchdown(leg, time) - share) / (1 - share));
}

std::string GaitPattern::explain_invalid() const {
  SettingRules rules;
  rules.positive("period", period).finite("start", start);
  for (std::size_t leg = 0; leg < kLegs; ++leg) {
    const double share = duty[leg];
    rules.check(share > 0 && share <= 1, entry("duty", leg), share, "over 0 and at most 1")
        .finite(entry("offset", leg), offset[leg]);
  }
  return rules.sentence();
}

}  // namespace palanquin
