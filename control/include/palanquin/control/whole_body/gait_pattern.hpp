#pragma once

#include <string>
#include <vector>

namespace palanquin {

/// A periodic contact pattern: from `start` on, foot f stands while frac(phase - offset_f) <
/// duty_f; before, all feet do. Without any entries all feet stand always; otherwise a foot that
/// has none is std::out_of_range.
struct GaitPattern {
  double period = 0.4;         ///< s
  std::vector<double> duty;    ///< share of the cycle that a foot stands, in (0, 1]; one a foot
  std::vector<double> offset;  ///< phase of its touchdown, cycles; one a foot
  double start = 0;            ///< s

  bool stands(int foot, double time) const;
  double stance_duration(int foot) const { return duty_of(foot) * period; }
  double swing_duration(int foot) const { return period - stance_duration(foot); }
  /// Share of the swing that is over, in [0, 1); only of use for a foot that swings.
  double swing_progress(int foot, double time) const;

  /// What is wrong with it, in words; empty if nothing.
  std::string explain_invalid() const;

 private:
  double duty_of(int foot) const;
  double since_touchdown(int foot, double time) const;  ///< in cycles, [0, 1)
};

}  // namespace palanquin
