#include "palanquin/control/planning/slots.hpp"

#include <stdexcept>

namespace palanquin::planning {

const ParameterInfo* find_parameter(const LoweredProblem& problem, const std::string& name) {
  for (const ParameterInfo& p : problem.parameters())
    if (p.name == name) return &p;
  return nullptr;
}

int parameter_slot(const LoweredProblem& problem, const std::string& name, int size) {
  const ParameterInfo* p = find_parameter(problem, name);
  if (p == nullptr || p->size != size)
    throw std::invalid_argument("problem '" + problem.name() + "' has no parameter '" + name +
                                "' of " + std::to_string(size) + " numbers");
  return p->offset;
}

int block_slot(const LoweredProblem& problem, const std::string& name, int size) {
  const BlockInfo& b = problem.block(name);
  if (b.size != size)
    throw std::invalid_argument("block '" + name + "' has " + std::to_string(b.size) +
                                " numbers; " + std::to_string(size) + " are needed");
  return b.offset;
}

}  // namespace palanquin::planning
