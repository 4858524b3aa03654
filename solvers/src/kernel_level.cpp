#include "palanquin/solvers/kernel_level.hpp"

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "kernels/dispatch.hpp"

namespace palanquin {
namespace kernels {
namespace x86_64 {
extern const Table kTable;
}
namespace avx2 {
extern const Table kTable;
}
namespace avx512 {
extern const Table kTable;
}

const Table& kernels_for(KernelLevel level) {
  switch (level) {
    case KernelLevel::Avx512:
      return avx512::kTable;
    case KernelLevel::Avx2:
      return avx2::kTable;
    default:
      return x86_64::kTable;
  }
}
}  // namespace kernels

namespace {

constexpr KernelLevel kBestFirst[] = {KernelLevel::Avx512, KernelLevel::Avx2, KernelLevel::X86_64};

KernelLevel level_from_environment(std::string_view name) {
  for (KernelLevel level : kBestFirst)
    if (name == to_string(level)) return level;
  throw std::invalid_argument("PALANQUIN_KERNELS is \"" + std::string(name) +
                              "\": it must be x86_64, avx2 or avx512");
}

}  // namespace

std::string_view to_string(KernelLevel level) {
  switch (level) {
    case KernelLevel::Automatic:
      return "automatic";
    case KernelLevel::X86_64:
      return "x86_64";
    case KernelLevel::Avx2:
      return "avx2";
    case KernelLevel::Avx512:
      return "avx512";
  }
  return "unknown";
}

bool is_supported(KernelLevel level) {
  switch (level) {
    case KernelLevel::Avx512:
      return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
             __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw") &&
             is_supported(KernelLevel::Avx2);
    case KernelLevel::Avx2:
      return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    default:
      return true;
  }
}

KernelLevel resolve_kernel_level(KernelLevel level) {
  if (level == KernelLevel::Automatic) {
    if (const char* name = std::getenv("PALANQUIN_KERNELS"); name != nullptr && *name != '\0') {
      level = level_from_environment(name);
    } else {
      for (KernelLevel best : kBestFirst)
        if (is_supported(best)) return best;
    }
  }
  if (!is_supported(level))
    throw std::invalid_argument("kernel level " + std::string(to_string(level)) +
                                ": this processor does not have it");
  return level;
}

}  // namespace palanquin
