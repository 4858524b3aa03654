#pragma once

#include "palanquin/core/transcription/workspace.hpp"

namespace palanquin {

/// Where the values of the lowered functions (or the cost's gradient, which is looked at with
/// them) are not finite at the trajectory that linearize() has just seen.
NonFinite find_non_finite_value(const TranscriptionWorkspace& workspace);

/// Where the derivatives in the QP of the last linearize() are not finite.
NonFinite find_non_finite_derivative(const TranscriptionWorkspace& workspace);

}  // namespace palanquin
