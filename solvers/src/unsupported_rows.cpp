#include "unsupported_rows.hpp"

#include "palanquin/solvers/qp_factory.hpp"

namespace palanquin {

std::string explain_unsupported(const TranscriptionWorkspace& transcription,
                                const QpSolver& solver) {
  const LoweredProblem& problem = transcription.problem();
  const auto takers = [](bool QpCapabilities::* kind) {
    std::string names;
    for (std::string_view name : qp_solver_names())
      if (make_qp_solver(name)->capabilities().*kind)
        names += (names.empty() ? "'" : ", '") + std::string(name) + "'";
    return names;
  };
  const std::string start = "the QP back end '" + std::string(solver.name()) + "' does not take ";
  for (int k = 0; k <= transcription.horizon(); ++k) {
    const KnotShape& shape = transcription.shape(k);
    const StageKind stage = shape.signature.stage;
    if (!solver.capabilities().inequality_rows && !shape.inequality_rows.empty())
      return start + "hard inequalities such as " +
             problem.row_name(stage, RowKind::Inequality, shape.inequality_rows.front(), k) +
             "; give the family a penalty, or use " + takers(&QpCapabilities::inequality_rows);
  }
  return start + "rows of this problem";
}

}  // namespace palanquin
