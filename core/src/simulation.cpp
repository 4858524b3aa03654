#include "palanquin/core/simulation.hpp"

#include <array>
#include <stdexcept>

namespace palanquin {

Eigen::VectorXd step_dynamics(const LoweredProblem& problem, VectorView z, VectorView p) {
  if (z.size() != problem.nz() || p.size() != problem.np())
    throw std::invalid_argument("step_dynamics: z has " + std::to_string(z.size()) + " and p " +
                                std::to_string(p.size()) + " entries; " +
                                std::to_string(problem.nz()) + " and " +
                                std::to_string(problem.np()) + " are needed");
  FunctionWorkspace w;
  problem.running.prepare(w);
  Eigen::VectorXd next = z;
  Eigen::VectorXd state(problem.nx());
  std::array<Eigen::VectorXd, 3> unused;  // cost and rows
  for (std::size_t i = 0; i < unused.size(); ++i)
    unused[i].resize(problem.running.result(static_cast<int>(i) + 1).nnz());
  // Rows may use the next value of other states (semi-implicit schemes). The dependence closes no
  // cycle, so every pass settles at least one more state.
  for (std::size_t pass = 0; pass < problem.blocks().size(); ++pass) {
    w.arguments[0] = z.data();
    w.arguments[1] = next.data();
    w.arguments[2] = p.data();
    w.results[0] = state.data();
    for (std::size_t i = 0; i < unused.size(); ++i) w.results[i + 1] = unused[i].data();
    problem.running(w);
    bool changed = false;
    int row = 0;
    for (const BlockInfo& b : problem.states()) {
      if (next.segment(b.offset, b.size) != state.segment(row, b.size)) changed = true;
      next.segment(b.offset, b.size) = state.segment(row, b.size);
      row += b.size;
    }
    if (!changed) break;
  }
  for (const BlockInfo& b : problem.blocks())
    if (b.is_quaternion) next.segment(b.offset, b.size).normalize();
  return next;
}

}  // namespace palanquin
