#pragma once

#include <string>
#include <utility>

#include "palanquin/solvers/status.hpp"

namespace palanquin {

/// Our status for one of Ipopt's return codes (its ApplicationReturnStatus), and why it stopped in
/// words.
std::pair<Status, std::string> interpret_ipopt(int code);

}  // namespace palanquin
