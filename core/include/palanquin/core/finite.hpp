#pragma once

#include <cmath>
#include <cstddef>

namespace palanquin {

/// Whether `size` values are finite: 0 * x is 0 for every finite x and NaN otherwise. Eight sums,
/// so that additions overlap.
inline bool all_finite(const double* values, std::ptrdiff_t size) {
  double sum[8] = {};
  std::ptrdiff_t i = 0;
  for (; i + 8 <= size; i += 8)
    for (int j = 0; j < 8; ++j) sum[j] += 0.0 * values[i + j];
  for (; i < size; ++i) sum[0] += 0.0 * values[i];
  return sum[0] + sum[1] + sum[2] + sum[3] + sum[4] + sum[5] + sum[6] + sum[7] == 0.0;
}

/// As above for a vector or matrix whose entries follow each other.
template <typename Array>
bool all_finite(const Array& values) {
  return all_finite(values.data(), static_cast<std::ptrdiff_t>(values.size()));
}

/// The larger of two values; NaN when one of them is, which std::max hides.
inline double max_or_nan(double a, double b) { return a > b || std::isnan(a) ? a : b; }

}  // namespace palanquin
