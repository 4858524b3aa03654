#include "palanquin/solvers/qp_solver.hpp"

namespace palanquin {

std::string_view to_string(QpStatus status) {
  switch (status) {
    case QpStatus::NotSolved:
      return "not solved";
    case QpStatus::Solved:
      return "solved";
    case QpStatus::Inaccurate:
      return "inaccurate";
    case QpStatus::PrimalInfeasible:
      return "primal infeasible";
    case QpStatus::FactorizationFailed:
      return "factorization failed";
    case QpStatus::NonFinite:
      return "non-finite";
    case QpStatus::Unsupported:
      return "unsupported";
  }
  return "unknown";
}

}  // namespace palanquin
