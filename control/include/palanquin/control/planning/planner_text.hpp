#pragma once

#include <functional>
#include <string>

#include "palanquin/core/lowered_problem.hpp"
#include "palanquin/core/text_lines.hpp"
#include "palanquin/core/trajectory.hpp"

namespace palanquin::planning {

// What the files "planner" of all planners' folders share: lines of words, of which the first says
// what the line states.

/// Numbers, each after a space.
template <typename Numbers>
std::string words(const Numbers& numbers) {
  std::string text;
  for (const double number : numbers) text += ' ' + palanquin::to_text(number);
  return text;
}

/// A line "parameter NAME VALUE..." [N + 1, size] for each parameter that is not at its default at
/// every knot, but for those that `is_left_out` by their offset.
std::string parameters_text(
    const LoweredProblem& problem, const RowMatrix& values,
    const std::function<bool(int)>& is_left_out = [](int) { return false; });

/// Takes over one of those lines, from NAME on; throws std::runtime_error for an unknown name.
void read_parameter(TextLine& line, const LoweredProblem& problem, RowMatrix& values);

/// Writes a folder's file; throws std::runtime_error when it cannot be written.
void write_planner_text(const std::string& folder, const std::string& text);

/// Reads it line by line; throws std::runtime_error that names the line and what is wrong with it.
void read_planner_text(const std::string& folder, const std::function<void(TextLine&)>& read);

}  // namespace palanquin::planning
