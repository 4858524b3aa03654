#pragma once

#include "kernels.hpp"
#include "shuffle.hpp"

// Which of many rows pass their limits. Most do not.

namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE {

static int list_rows_above(int count, const double* limit, const double* start,
                           const double* change, int* above) {
  int listed = 0;
  for (int i = 0; i < count; i += kWidth) {
    const Vector most = load_unaligned(limit + i);
    const Vector from = load_unaligned(start + i);
    const Vector to = from + load_unaligned(change + i);
    const Mask is_below = (from <= most) & (to <= most);  // not for NaN
    if (sum_of_lanes(is_below ? Vector{} : broadcast(1.0)) == 0.0) continue;
    for (int lane = 0; lane < kWidth; ++lane)
      if (!is_below[lane]) above[listed++] = i + lane;
  }
  return listed;
}

}  // namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE
