#pragma once

#include <array>
#include <string>
#include <vector>

#include "palanquin/control/planning/arrays.hpp"

namespace palanquin::planning {

/// When stances begin and end, s.
struct Stances {
  std::array<double, kFeet> begin, end;
};

/// A periodic contact pattern: foot f stands while frac(phase - offset_f) < duty_f.
struct Gait {
  std::string name;                    ///< for messages
  double period = 0.5;                 ///< length of a cycle, s, positive
  std::array<double, kFeet> duty{};    ///< fraction of the cycle that a foot stands, 0 to 1
  std::array<double, kFeet> offset{};  ///< phase at which it touches down, cycles

  /// Which feet stand at a phase (cycles). Instants that rounding has put just before a touchdown
  /// or lift-off count as after it.
  std::array<bool, kFeet> stands(double phase) const;
  /// Begin and end of the stance that holds at `phase` (cycles) or comes next, seconds from there.
  /// One that never ends is as long as a cycle, half of it past.
  Stances stances(double phase) const;
  /// How long foot f stands, s.
  double stance(int f) const { return period * duty[static_cast<std::size_t>(f)]; }
  /// Whether all feet always stand.
  bool is_standing() const;
};

/// The gait of one robot over time, with changes under way. Contact is a function of time alone, so
/// that planners and controllers may sample it at any rate. Nothing but `change` allocates.
class GaitClock {
 public:
  /// A gait whose cycle is at `phase` (cycles) at `time` (s).
  explicit GaitClock(Gait gait, double time = 0.0, double phase = 0.0);

  /// The gait at `time`; before the start, the first one.
  const Gait& gait(double time) const { return at(time).gait; }
  /// Phase in cycles, in [0, 1).
  double phase(double time) const;
  /// Plans a change at the first end of a cycle from `time` on and returns when that is. Changes
  /// planned for later are dropped; the new gait begins at phase 0. A standing robot has no cycle
  /// to end, so its change happens at `time`, as does any with `at_once`.
  double change(const Gait& gait, double time, bool at_once = false);

  /// Which feet stand at `time`.
  std::array<bool, kFeet> contacts(double time) const;
  /// The stances that hold at `time` or come next, if the gait of that time goes on.
  Stances stances(double time) const;

 private:
  struct Segment {
    double start = 0.0, phase = 0.0;
    Gait gait;
    double cycles(double time) const { return phase + (time - start) / gait.period; }
  };
  std::size_t index(double time) const;
  const Segment& at(double time) const { return segments_[index(time)]; }

  std::vector<Segment> segments_;
};

}  // namespace palanquin::planning
