#include "palanquin/control/planning/gait.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin::planning {

namespace {
/// Flags are sampled so many cycles later, so that an instant which rounding has put just before a
/// touchdown or lift-off counts as after it.
constexpr double kLate = 1e-6;

/// x modulo 1, in [0, 1).
double fraction(double x) { return x - std::floor(x); }
}  // namespace

double Gait::duty_of(int foot) const {
  if (duty.empty()) return 1.0;
  if (foot < 0 || static_cast<std::size_t>(foot) >= duty.size())
    throw std::out_of_range("foot is " + std::to_string(foot) + "; the gait has " +
                            std::to_string(duty.size()));
  return duty[static_cast<std::size_t>(foot)];
}

double Gait::since_touchdown(int foot, double phase) const {
  const auto f = static_cast<std::size_t>(foot);
  return fraction(phase + kLate - (f < offset.size() ? offset[f] : 0.0));
}

bool Gait::stands(int foot, double phase) const {
  const double share = duty_of(foot);
  return share >= 1.0 || since_touchdown(foot, phase) < share;
}

std::array<bool, kFeet> Gait::stands(double phase) const {
  std::array<bool, kFeet> flags{};
  for (int f = 0; f < kFeet; ++f) flags[static_cast<std::size_t>(f)] = stands(f, phase);
  return flags;
}

Stance Gait::stance(int foot, double phase) const {
  const double share = duty_of(foot), since = since_touchdown(foot, phase);
  const double begin = share >= 1.0 ? -0.5 : since < share ? -since : 1.0 - since;
  return {period * begin, period * (begin + share)};
}

bool Gait::is_standing() const {
  return std::all_of(duty.begin(), duty.end(), [](double d) { return d >= 1.0; });
}

std::string Gait::explain_invalid() const {
  SettingRules rules;
  rules.positive("period", period)
      .check(offset.size() == duty.size(), "number of offsets", offset.size(),
             std::to_string(duty.size()) + ", as that of duties");
  for (std::size_t foot = 0; foot < std::min(duty.size(), offset.size()); ++foot)
    rules.check(duty[foot] >= 0 && duty[foot] <= 1, entry("duty", foot), duty[foot], "from 0 to 1")
        .finite(entry("offset", foot), offset[foot]);
  rules.check(duty.empty() || std::any_of(duty.begin(), duty.end(), [](double d) { return d > 0; }),
              "duty", 0, "over 0 for one foot at least");
  return rules.sentence();
}

GaitClock::GaitClock(Gait gait, double time, double phase) {
  segments_.reserve(8);
  segments_.push_back({time, phase, std::move(gait)});
  count_feet();
}

/// Every foot of a gait, and of one without entries as many as a quadruped's, may deviate.
void GaitClock::count_feet() {
  const std::size_t feet = std::max<std::size_t>(kFeet, segments_.back().gait.duty.size());
  deviations_.resize(std::max(deviations_.size(), feet));
}

std::size_t GaitClock::index(double time) const {
  const double late = kLate * segments_.back().gait.period;
  std::size_t i = segments_.size() - 1;
  while (i > 0 && segments_[i].start > time + late) --i;
  return i;
}

double GaitClock::phase(double time) const { return fraction(at(time).cycles(time)); }

double GaitClock::change(const Gait& gait, double time, bool at_once) {
  segments_.resize(index(time) + 1, segments_.front());
  const Gait& current = segments_.back().gait;
  if (!at_once && !current.is_standing()) {
    const double remaining = fraction(-phase(time));
    // A cycle that ended a rounding error ago has ended now.
    if (remaining < 1.0 - kLate) time += remaining * current.period;
  }
  if (time <= segments_.front().start) segments_.clear();
  segments_.push_back({time, 0.0, gait});
  count_feet();
  for (Deviation& d : deviations_) d.end = std::min(d.end, time);
  return time;
}

void GaitClock::sense(int foot, double time, bool has_ground, double lands_within) {
  if (foot < 0) throw std::out_of_range("foot is " + std::to_string(foot));
  const bool is_due_now = is_due(foot, time), deviates = deviation(foot, time) != nullptr;
  const auto f = static_cast<std::size_t>(foot);
  if (f >= deviations_.size()) deviations_.resize(f + 1);
  Deviation& d = deviations_[f];
  if (has_ground == is_due_now) {
    if (deviates) d.end = time;
  } else if (!has_ground) {
    d = {deviates ? d.begin : time, time + lands_within, false};
  } else if (!deviates) {
    d = {time, next_touchdown(foot, time), true};
  }
}

const GaitClock::Deviation* GaitClock::deviation(int foot, double time) const {
  const auto f = static_cast<std::size_t>(foot);
  if (f >= deviations_.size()) return nullptr;
  const double late = time + kLate * segments_.back().gait.period;
  return deviations_[f].begin <= late && late < deviations_[f].end ? &deviations_[f] : nullptr;
}

double GaitClock::next_touchdown(int foot, double time) const {
  const std::size_t next = index(time) + 1;
  const double touchdown = scheduled_stance(foot, time).begin;
  return next < segments_.size() ? std::min(touchdown, segments_[next].start) : touchdown;
}

bool GaitClock::is_due(int foot, double time) const {
  const Segment& segment = at(time);
  return segment.gait.stands(foot, segment.cycles(time));
}

bool GaitClock::stands(int foot, double time) const {
  const Deviation* d = deviation(foot, time);
  return d != nullptr ? d->stands : is_due(foot, time);
}

std::array<bool, kFeet> GaitClock::contacts(double time) const {
  std::array<bool, kFeet> all{};
  for (int f = 0; f < kFeet; ++f) all[static_cast<std::size_t>(f)] = stands(f, time);
  return all;
}

Stance GaitClock::scheduled_stance(int foot, double time) const {
  const Segment& segment = at(time);
  const Stance from_now = segment.gait.stance(foot, segment.cycles(time));
  return {time + from_now.begin, time + from_now.end};
}

Stance GaitClock::stance(int foot, double time) const {
  Stance stance = scheduled_stance(foot, time);
  if (const Deviation* d = deviation(foot, time); d != nullptr && d->stands)
    stance.begin = d->begin;
  else if (d != nullptr && is_due(foot, time))
    stance.begin = std::min(d->end, stance.end);
  return stance;
}

Stances GaitClock::stances(double time) const {
  Stances all{};
  for (int f = 0; f < kFeet; ++f) {
    const Stance one = stance(f, time);
    all.begin[static_cast<std::size_t>(f)] = one.begin;
    all.end[static_cast<std::size_t>(f)] = one.end;
  }
  return all;
}

Swing GaitClock::swing(int foot, double time) const {
  const Segment& segment = at(time);
  const Gait& gait = segment.gait;
  const double share = gait.duty_of(foot), whole = gait.period - gait.stance(foot);
  const double since = gait.since_touchdown(foot, segment.cycles(time));
  if (share >= 1.0 || since < share) return {0.0, whole};
  const double gone = since - share, here = (time - segment.start) / gait.period;
  if (&segment == segments_.data() || gone <= here) return {gone / (1.0 - share), whole};
  const double left = std::max(here, 0.0) + 1.0 - since;  // the change began it, cycles
  return {std::min(std::max(here, 0.0) / left, 1.0), left * gait.period};
}

}  // namespace palanquin::planning
