#include "palanquin/solvers/plan.hpp"

namespace palanquin {

std::map<std::string, double> Plan::violations() const {
  std::map<std::string, double> worst = Snapshot::violations();
  if (status == Status::NonFinite)
    for (auto& [family, value] : worst) value = Evaluation::kNaN;
  return worst;
}

}  // namespace palanquin
