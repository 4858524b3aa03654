#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "palanquin/solvers/kernel_level.hpp"

namespace palanquin::testing {

/// The kernel levels that this processor runs, so that tests run all of them.
inline std::vector<KernelLevel> supported_kernel_levels() {
  std::vector<KernelLevel> levels;
  for (KernelLevel level : {KernelLevel::X86_64, KernelLevel::Avx2, KernelLevel::Avx512})
    if (is_supported(level)) levels.push_back(level);
  return levels;
}

inline std::string kernel_level_name(const ::testing::TestParamInfo<KernelLevel>& info) {
  return std::string(to_string(info.param));
}

}  // namespace palanquin::testing
