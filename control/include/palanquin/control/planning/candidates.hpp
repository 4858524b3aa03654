#pragma once

#include <exception>
#include <memory>
#include <vector>

#include "palanquin/core/thread_pool.hpp"
#include "palanquin/solvers/sqp.hpp"

namespace palanquin::planning {

/// Several starting points solved side by side, of which the best plan is kept.
///
/// Which side of a ditch a foot takes is a choice that no gradient makes: a solver stays where its
/// start put it. Which solver takes which start is fixed, so results do not depend on timing.
class Candidates {
 public:
  /// Solvers of one problem, used by nobody else meanwhile. Throws std::invalid_argument when there
  /// are none or `threads` < 1.
  Candidates(std::vector<std::shared_ptr<Sqp>> solvers, int threads);

  int size() const { return static_cast<int>(solvers_.size()); }
  Sqp& solver(int i) const { return *solvers_[static_cast<std::size_t>(i)]; }

  /// Solves from every guess and returns the index of the plan of lowest cost among the usable
  /// ones. Equality residuals count with a weight, since a plan after few iterations may have some.
  /// What a solve throws is thrown when all have ended.
  int solve(const std::vector<const RowMatrix*>& parameters, VectorView measured,
            const std::vector<const RowMatrix*>& guesses);

 private:
  std::vector<std::shared_ptr<Sqp>> solvers_;
  std::vector<std::exception_ptr> failures_;
  ThreadPool pool_;
};

}  // namespace palanquin::planning
