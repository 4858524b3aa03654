#include "palanquin/solvers/plan.hpp"

namespace palanquin {

std::map<std::string, double> Plan::violations() const {
  std::map<std::string, double> worst = Snapshot::violations();
  if (status == Status::NonFinite)
    for (auto& [family, value] : worst) value = Evaluation::kNaN;
  return worst;
}

std::vector<RowState> Plan::certificate_rows() const {
  if (!certificate.is_known()) return {};
  return row_states(*model, inputs, trajectory, certificate);
}

}  // namespace palanquin
