#pragma once

#include <array>
#include <string>
#include <vector>

#include "palanquin/control/planning/arrays.hpp"

namespace palanquin::planning {

/// Time in which a foot that is late is expected to find the ground, s.
inline constexpr double kLandsWithin = 0.02;

/// From touchdown to lift-off, s.
struct Stance {
  double begin = 0, end = 0;
};

/// Stances of all feet of a quadruped, s.
struct Stances {
  std::array<double, kFeet> begin, end;
};

/// From lift-off to touchdown.
struct Swing {
  double progress = 0;                                            ///< share that is over, in [0, 1)
  double duration = 0;                                            ///< s
  double remaining() const { return (1 - progress) * duration; }  ///< s
};

/// A periodic contact pattern: foot f stands while frac(phase - offset_f) < duty_f. Without any
/// entries all feet stand always; otherwise a foot that has none is std::out_of_range.
struct Gait {
  std::string name;            ///< for messages
  double period = 0.5;         ///< length of a cycle, s, positive
  std::vector<double> duty;    ///< fraction of the cycle that a foot stands, 0 to 1; one a foot
  std::vector<double> offset;  ///< phase at which it touches down, cycles; one a foot

  /// Whether a foot stands at a phase (cycles). Instants that rounding has put just before a
  /// touchdown or lift-off count as after it.
  bool stands(int foot, double phase) const;
  /// The same of the feet of a quadruped.
  std::array<bool, kFeet> stands(double phase) const;
  /// Begin and end of the stance that holds at `phase` (cycles) or comes next, seconds from there.
  /// One that never ends is as long as a cycle, half of it past.
  Stance stance(int foot, double phase) const;
  /// How long foot f stands, s.
  double stance(int f) const { return period * duty_of(f); }
  /// Whether all feet always stand.
  bool is_standing() const;
  /// What is wrong with it, in words; empty if nothing.
  std::string explain_invalid() const;

  double duty_of(int foot) const;
  /// Cycles since the foot's last touchdown at a phase, in [0, 1).
  double since_touchdown(int foot, double phase) const;
};

/// The gait of one robot over time, with changes under way and touchdowns that come early or late:
/// the same for its planner and its controller. Contact is a function of time alone, so that both
/// may sample it at any rate; two clocks that are told the same say the same. Nothing but `change`
/// allocates.
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

  /// Says whether a foot has the ground at `time`, which no earlier call was for a later time than.
  /// One that has it before it is due stands from now on, to the end of the stance that was to
  /// come; one that is due and does not have it is counted on `lands_within` s later. Throws
  /// std::out_of_range for a foot that the gait has not.
  void sense(int foot, double time, bool has_ground, double lands_within = kLandsWithin);

  /// Whether the gait has the foot stand, whatever it felt.
  bool is_due(int foot, double time) const;
  /// Whether it stands, or is counted on to stand, by the gait and what it felt.
  bool stands(int foot, double time) const;
  /// Which feet of a quadruped stand at `time`.
  std::array<bool, kFeet> contacts(double time) const;
  /// The stance that holds at `time` or comes next, if the gait of that time goes on.
  Stance stance(int foot, double time) const;
  /// The same of all feet of a quadruped.
  Stances stances(double time) const;
  /// The swing that the gait has at `time`; for a foot that is due, one that is about to begin. One
  /// which a change of gait begins in its midst takes what is left of it.
  Swing swing(int foot, double time) const;

 private:
  /// A time in which a foot does what the gait does not say.
  struct Deviation {
    double begin = 0.0, end = 0.0;
    bool stands = false;
  };
  struct Segment {
    double start = 0.0, phase = 0.0;
    Gait gait;
    double cycles(double time) const { return phase + (time - start) / gait.period; }
  };
  std::size_t index(double time) const;
  const Segment& at(double time) const { return segments_[index(time)]; }
  /// The foot's deviation at `time`, or null.
  const Deviation* deviation(int foot, double time) const;
  /// When the gait has a foot that swings touch down, or a change of gait comes before.
  double next_touchdown(int foot, double time) const;
  Stance scheduled_stance(int foot, double time) const;
  void count_feet();

  std::vector<Segment> segments_;
  std::vector<Deviation> deviations_;  // the latest one of each foot
};

}  // namespace palanquin::planning
