#pragma once

#include <string>

#include "palanquin/core/text_lines.hpp"
#include "palanquin/solvers/sqp_settings.hpp"

namespace palanquin::planning {

/// Every setting as a line "setting NAME VALUE", nested names with dots.
std::string to_text(const SqpSettings& settings);
/// Takes over one of those lines, from NAME on; throws std::runtime_error for an unknown name or a
/// value of another kind.
void read_setting(TextLine& line, SqpSettings& settings);

}  // namespace palanquin::planning
