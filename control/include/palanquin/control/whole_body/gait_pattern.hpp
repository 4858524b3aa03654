#pragma once

#include <array>
#include <string>

namespace palanquin {

constexpr int kLegs = 4;  ///< LF, RF, LH, RH

/// A periodic contact pattern: from `start` on, leg l stands while frac(phase - offset_l) < duty_l;
/// before, all legs do. A leg other than 0 to 3 is std::out_of_range.
struct GaitPattern {
  double period = 0.4;                                 ///< s
  std::array<double, kLegs> duty{0.5, 0.5, 0.5, 0.5};  ///< share of the cycle, in (0, 1]
  std::array<double, kLegs> offset{0, 0.5, 0.5, 0};    ///< phase of the touchdown, cycles
  double start = 0;                                    ///< s

  bool stands(int leg, double time) const;
  double stance_duration(int leg) const { return duty.at(static_cast<std::size_t>(leg)) * period; }
  double swing_duration(int leg) const { return period - stance_duration(leg); }
  /// Share of the swing that is over, in [0, 1); only of use for a leg that swings.
  double swing_progress(int leg, double time) const;

  /// What is wrong with it, in words; empty if nothing.
  std::string explain_invalid() const;

 private:
  double since_touchdown(int leg, double time) const;  ///< in cycles, [0, 1)
};

}  // namespace palanquin
