#include "palanquin/control/whole_body/gait_pattern.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

namespace {

/// Cycles by which flags are sampled late, so that rounding never puts an instant before its event.
constexpr double kLate = 1e-6;

}  // namespace

double GaitPattern::duty_of(int foot) const {
  if (duty.empty()) return 1;
  if (foot < 0 || static_cast<std::size_t>(foot) >= duty.size())
    throw std::out_of_range("foot is " + std::to_string(foot) + "; the gait has " +
                            std::to_string(duty.size()));
  return duty[static_cast<std::size_t>(foot)];
}

double GaitPattern::since_touchdown(int foot, double time) const {
  const double phase = (time - start) / period + kLate - offset.at(static_cast<std::size_t>(foot));
  return phase - std::floor(phase);
}

bool GaitPattern::stands(int foot, double time) const {
  const double share = duty_of(foot);
  return time < start - kLate * period || share >= 1 || since_touchdown(foot, time) < share;
}

double GaitPattern::swing_progress(int foot, double time) const {
  const double share = duty_of(foot);
  return share >= 1 ? 0 : std::max(0.0, (since_touchdown(foot, time) - share) / (1 - share));
}

std::string GaitPattern::explain_invalid() const {
  SettingRules rules;
  rules.positive("period", period)
      .finite("start", start)
      .check(offset.size() == duty.size(), "number of offsets", offset.size(),
             std::to_string(duty.size()) + ", as that of duties");
  for (std::size_t foot = 0; foot < std::min(duty.size(), offset.size()); ++foot) {
    const double share = duty[foot];
    rules.check(share > 0 && share <= 1, entry("duty", foot), share, "over 0 and at most 1")
        .finite(entry("offset", foot), offset[foot]);
  }
  return rules.sentence();
}

}  // namespace palanquin
