#pragma once

#include <algorithm>
#include <cstddef>

#include "palanquin/core/lowered_problem.hpp"

namespace palanquin {

/// A quaternion shorter than this has no direction.
constexpr double kZeroNorm = 1e-6;

/// An int as a standard container counts.
inline std::size_t size_of(int count) { return static_cast<std::size_t>(count); }

/// Rows of a kind at a running knot or at the terminal one, whichever has more.
inline std::size_t most_rows(const LoweredProblem& problem, RowKind kind) {
  return size_of(std::max(problem.row_count(StageKind::Running, kind),
                          problem.row_count(StageKind::Terminal, kind)));
}

}  // namespace palanquin
