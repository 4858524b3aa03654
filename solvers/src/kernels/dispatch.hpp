#pragma once

#include "kernels.hpp"
#include "palanquin/solvers/kernel_level.hpp"

namespace palanquin::kernels {

/// The kernels of a level that resolve_kernel_level has returned.
const Table& kernels_for(KernelLevel level);

}  // namespace palanquin::kernels
