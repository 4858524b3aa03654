#include "palanquin/control/planning/events.hpp"

#include <algorithm>
#include <cstdio>

namespace palanquin::planning {

namespace {
/// With three significant digits.
std::string to_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}
}  // namespace

std::string_view to_string(EventKind kind) {
  switch (kind) {
    case EventKind::DampedStep:
      return "damped_step";
    case EventKind::RefusedCycle:
      return "refused_cycle";
    case EventKind::RegularizedStep:
      return "regularized_step";
    case EventKind::RestoredStep:
      return "restored_step";
    case EventKind::SureMethod:
      return "sure_method";
    case EventKind::KeptPlan:
      return "kept_plan";
    case EventKind::Restart:
      return "restart";
    case EventKind::MissedDeadline:
      return "missed_deadline";
    case EventKind::SafeStop:
      return "safe_stop";
  }
  return "unknown";
}

std::string Event::reason(const std::string& message) const {
  const std::string iteration = "iteration " + std::to_string(count);
  switch (kind) {
    case EventKind::RefusedCycle:
      return iteration + " would have led back to iteration " + std::to_string(count - 2);
    case EventKind::SureMethod:
      return iteration + ": the QP was " + std::string(palanquin::to_string(qp_status));
    case EventKind::KeptPlan:
      return message;
    case EventKind::Restart:
      return "solves in a row without a usable plan: " + std::to_string(count);
    case EventKind::MissedDeadline:
      return "the plan was ready " + to_text(1e3 * value) + " ms too late";
    case EventKind::SafeStop:
      return "plans in a row that failed or came late: " + std::to_string(count);
    default:
      return iteration + ": step length " + to_text(value) +
             (damping > 0.0 ? ", damping " + to_text(damping) : "") +
             (is_mirrored ? ", Hessians mirrored" : "");
  }
}

void append_plan_events(const std::vector<IterationRecord>& history, bool is_usable, double time,
                        std::vector<Event>& events) {
  const std::size_t first = events.size();
  int number = 0;
  for (const IterationRecord& record : history) {
    ++number;
    const auto add = [&](EventKind kind) {
      events.push_back({time, kind, number, record.step_length, record.damping, record.convexified,
                        record.qp_status});
    };
    if (record.refused_cycle) add(EventKind::RefusedCycle);
    if (record.fell_back) add(EventKind::SureMethod);
    switch (record.step) {
      case StepKind::Full:
        break;
      case StepKind::Damped:
        add(EventKind::DampedStep);
        break;
      case StepKind::Regularized:
        add(EventKind::RegularizedStep);
        break;
      case StepKind::Restored:
        add(EventKind::RestoredStep);
        break;
      case StepKind::Rejected:
        add(EventKind::KeptPlan);
    }
  }
  const bool is_kept =
      std::any_of(events.begin() + static_cast<std::ptrdiff_t>(first), events.end(),
                  [](const Event& e) { return e.kind == EventKind::KeptPlan; });
  if (!is_usable && !is_kept) events.push_back({time, EventKind::KeptPlan, number, 0.0});
}

}  // namespace palanquin::planning
