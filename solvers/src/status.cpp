#include "palanquin/solvers/status.hpp"

namespace palanquin {

std::string_view to_string(Status status) {
  switch (status) {
    case Status::NotSolved:
      return "not_solved";
    case Status::Converged:
      return "converged";
    case Status::IterationLimit:
      return "iteration_limit";
    case Status::TimeLimit:
      return "time_limit";
    case Status::Stalled:
      return "stalled";
    case Status::Saddle:
      return "saddle";
    case Status::Unfinished:
      return "unfinished";
    case Status::Unbounded:
      return "unbounded";
    case Status::Diverged:
      return "diverged";
    case Status::Infeasible:
      return "infeasible";
    case Status::QpFailed:
      return "qp_failed";
    case Status::NonFinite:
      return "non_finite";
  }
  return "unknown";
}

}  // namespace palanquin
