#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "palanquin/solvers/iteration_record.hpp"

namespace palanquin::planning {

/// The rungs of the ladder by which a planner answers trouble.
enum class EventKind {
  DampedStep,       ///< the filter shortened a step
  RefusedCycle,     ///< a full step would have led back to where the iteration was before
  RegularizedStep,  ///< a QP with Levenberg-Marquardt damping gave the step
  RestoredStep,     ///< the QP had no solution; the step brings the rows closer instead
  SureMethod,       ///< the fast method for a QP's hard rows failed; a slower one answered
  KeptPlan,         ///< no step was acceptable: the last plan, shifted, is kept
  Restart,          ///< the planner started from its references after failures in a row
  MissedDeadline,   ///< a plan came later than it was to be in use
  SafeStop,         ///< plans have failed or come late for too long: whoever executes shall stop
};
std::string_view to_string(EventKind kind);

/// Something happened in the solve for the measurement at `time` (s).
struct Event {
  double time = 0.0;
  EventKind kind = EventKind::KeptPlan;
  int count = 0;                          ///< number of the iteration, or of failures in a row
  double value = 0.0;                     ///< step length, or how late it was, s
  double damping = 0.0;                   ///< of the step's QP
  bool is_mirrored = false;               ///< whether its Hessians were
  QpStatus qp_status = QpStatus::Solved;  ///< what the slower method said

  /// In words; `message` is the plan's.
  std::string reason(const std::string& message) const;
};

/// Appends what happened in a solve, in its order.
void append_plan_events(const std::vector<IterationRecord>& history, bool is_usable, double time,
                        std::vector<Event>& events);

}  // namespace palanquin::planning
