#include "palanquin/control/planning/candidates.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace palanquin::planning {

namespace {
/// Cost per unit of the largest equality residual, for comparing plans after few iterations. It
/// must not outweigh what choices differ in: with 1e3 a shifted plan, whose residuals are small,
/// was kept until it had walked into a dead end, and of four courses of ditches none was crossed.
constexpr double kResidualWeight = 10.0;

double merit(const Sqp& solver) {
  const Evaluation& evaluation = solver.evaluation();
  const double merit = evaluation.total() + kResidualWeight * evaluation.equality_max;
  return std::isfinite(merit) ? merit : std::numeric_limits<double>::infinity();
}

bool is_better(const Sqp& a, const Sqp& b) {
  if (a.has_usable_plan() != b.has_usable_plan()) return a.has_usable_plan();
  return merit(a) < merit(b);
}

std::vector<std::shared_ptr<Sqp>> checked(std::vector<std::shared_ptr<Sqp>> solvers) {
  if (solvers.empty()) throw std::invalid_argument("candidates: at least 1 solver is needed");
  return solvers;
}
}  // namespace

Candidates::Candidates(std::vector<std::shared_ptr<Sqp>> solvers, int threads)
    : solvers_(checked(std::move(solvers))),
      failures_(solvers_.size()),
      pool_(threads < 1 ? threads : std::min(threads, static_cast<int>(solvers_.size()))) {}

int Candidates::solve(const std::vector<const RowMatrix*>& parameters, VectorView measured,
                      const std::vector<const RowMatrix*>& guesses) {
  const std::size_t count = guesses.size();
  if (count < 1 || count > solvers_.size() || parameters.size() != count)
    throw std::invalid_argument("candidates: " + std::to_string(count) + " guesses; 1 to " +
                                std::to_string(solvers_.size()) + " are needed");
  pool_.parallel_for(static_cast<int>(count), [&](int, int i) {
    failures_[i] = nullptr;
    try {
      solvers_[i]->solve(*parameters[i], measured, *guesses[i]);
    } catch (...) {
      failures_[i] = std::current_exception();
    }
  });
  for (std::size_t i = 0; i < count; ++i)
    if (failures_[i]) std::rethrow_exception(failures_[i]);
  std::size_t best = 0;
  for (std::size_t i = 1; i < count; ++i)
    if (is_better(*solvers_[i], *solvers_[best])) best = i;
  return static_cast<int>(best);
}

}  // namespace palanquin::planning
