#include "palanquin/solvers/iteration_record.hpp"

namespace palanquin {

std::string_view to_string(StepKind kind) {
  switch (kind) {
    case StepKind::Full:
      return "full";
    case StepKind::Damped:
      return "damped";
    case StepKind::Regularized:
      return "regularized";
    case StepKind::Restored:
      return "restored";
    case StepKind::Rejected:
      return "rejected";
  }
  return "unknown";
}

PhaseTimes sum_of(const std::vector<IterationRecord>& history) {
  PhaseTimes sum;
  for (const IterationRecord& record : history) {
    sum.transcribe += record.times.transcribe;
    sum.linearize += record.times.linearize;
    sum.update += record.times.update;
    sum.solve += record.times.solve;
    sum.globalize += record.times.globalize;
  }
  return sum;
}

}  // namespace palanquin
