#pragma once

#include "palanquin/core/stage_qp.hpp"

namespace palanquin {

/// Throws std::invalid_argument, naming knot, field, actual and expected, at the first array of
/// `qp` whose size contradicts the others. Back ends call it when the structure changes.
void require_consistent(const StageQp& qp);

}  // namespace palanquin
