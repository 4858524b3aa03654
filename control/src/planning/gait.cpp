#include "palanquin/control/planning/gait.hpp"

#include <algorithm>
#include <cmath>

namespace palanquin::planning {

namespace {
/// Flags are sampled so many cycles later, so that an instant which rounding has put just before a
/// touchdown or lift-off counts as after it.
constexpr double kLate = 1e-6;

/// x modulo 1, in [0, 1).
double fraction(double x) { return x - std::floor(x); }
}  // namespace

std::array<bool, kFeet> Gait::stands(double phase) const {
  std::array<bool, kFeet> flags{};
  for (std::size_t f = 0; f < kFeet; ++f)
    flags[f] = fraction(phase - (offset[f] - kLate)) < duty[f] || duty[f] == 1.0;
  return flags;
}

Stances Gait::stances(double phase) const {
  Stances s{};
  for (std::size_t f = 0; f < kFeet; ++f) {
    const double since = fraction(phase + kLate - offset[f]);
    const double begin = duty[f] == 1.0 ? -0.5 : since < duty[f] ? -since : 1.0 - since;
    s.begin[f] = period * begin;
    s.end[f] = period * (begin + duty[f]);
  }
  return s;
}

bool Gait::is_standing() const {
  return std::all_of(duty.begin(), duty.end(), [](double d) { return d >= 1.0; });
}

GaitClock::GaitClock(Gait gait, double time, double phase) {
  segments_.reserve(8);
  segments_.push_back({time, phase, std::move(gait)});
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
  return time;
}

std::array<bool, kFeet> GaitClock::contacts(double time) const {
  const Segment& segment = at(time);
  return segment.gait.stands(segment.cycles(time));
}

Stances GaitClock::stances(double time) const {
  const Segment& segment = at(time);
  Stances s = segment.gait.stances(segment.cycles(time));
  for (std::size_t f = 0; f < kFeet; ++f) {
    s.begin[f] += time;
    s.end[f] += time;
  }
  return s;
}

}  // namespace palanquin::planning
