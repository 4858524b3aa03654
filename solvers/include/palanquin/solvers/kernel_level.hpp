#pragma once

#include <string_view>

namespace palanquin {

/// The processor extensions that the inner loops of the structured solver are compiled for.
enum class KernelLevel {
  Automatic,  ///< PALANQUIN_KERNELS=x86_64|avx2|avx512 if set, else the best this processor has
  X86_64,     ///< SSE2, on every 64-bit x86 processor
  Avx2,       ///< AVX2 and FMA
  Avx512,     ///< AVX-512 F, DQ, VL, BW
};
std::string_view to_string(KernelLevel level);

/// Whether this processor runs `level`.
bool is_supported(KernelLevel level);

/// The level that `level` stands for on this processor, never Automatic. Throws
/// std::invalid_argument if the processor lacks it or the environment names no level.
KernelLevel resolve_kernel_level(KernelLevel level);

}  // namespace palanquin
