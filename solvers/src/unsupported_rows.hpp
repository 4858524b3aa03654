#pragma once

#include <string>

#include "palanquin/core/transcription/workspace.hpp"
#include "palanquin/solvers/qp_solver.hpp"

namespace palanquin {

/// Which row of the problem `solver` does not take, and which back ends do.
std::string explain_unsupported(const TranscriptionWorkspace& transcription,
                                const QpSolver& solver);

}  // namespace palanquin
