#pragma once

#include <string>

#include "palanquin/control/planning/arrays.hpp"
#include "palanquin/core/lowered_problem.hpp"

namespace palanquin::planning {

// Where quantities stand in a problem's knot and parameter vectors: found by name once, then read
// and written by number.

/// Names of a robot's feet in blocks and parameters.
inline constexpr const char* kFootNames[kFeet] = {"LF", "RF", "LH", "RH"};

/// The parameter of a name; null if there is none.
const ParameterInfo* find_parameter(const LoweredProblem& problem, const std::string& name);

/// Offset of a parameter; throws std::invalid_argument unless there is one of `size` numbers.
int parameter_slot(const LoweredProblem& problem, const std::string& name, int size);

/// Offset of a block in a knot vector z; throws std::invalid_argument unless it has `size` numbers.
int block_slot(const LoweredProblem& problem, const std::string& name, int size);

}  // namespace palanquin::planning
