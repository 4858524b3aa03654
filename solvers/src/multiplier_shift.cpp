#include "multiplier_shift.hpp"

#include <algorithm>
#include <limits>

namespace palanquin {

int find_shift(const RowMatrix& last, MatrixView guess) {
  constexpr Eigen::Index kMost = 3;
  if (last.rows() != guess.rows() || last.cols() != guess.cols()) return 0;
  double least = std::numeric_limits<double>::infinity();
  int best = 0;
  for (Eigen::Index shift = 0; shift <= kMost; ++shift) {
    // The first knot is what was measured, the last ones are invented.
    const Eigen::Index knots = last.rows() - 2 - shift;
    if (knots < 1) break;
    const double distance =
        (guess.middleRows(1, knots) - last.middleRows(1 + shift, knots)).squaredNorm() /
        static_cast<double>(knots);
    if (!(distance < least)) continue;
    least = distance;
    best = static_cast<int>(shift);
  }
  return best;
}

void shift_multipliers(int shift, StageQpSolution& solution) {
  std::vector<Eigen::VectorXd>& nu = solution.inequality_multiplier;
  if (shift <= 0) return;
  for (std::size_t k = 0; k + static_cast<std::size_t>(shift) < nu.size(); ++k)
    nu[k] = nu[k + static_cast<std::size_t>(shift)];
}

}  // namespace palanquin
