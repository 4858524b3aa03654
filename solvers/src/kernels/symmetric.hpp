#pragma once

#include "kernels.hpp"
#include "shuffle.hpp"

// Symmetric matrices of which the lower triangle is stored.

namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE {

static void symmetrize(int n, const double* lower, int ld_lower, double* full, int ld_full) {
  for (int j = 0; j < n; j += kWidth) {
    for (int i = j; i < n; i += kWidth) {
      const double* block = lower + i + static_cast<long>(j) * ld_lower;
      double* mirrored = full + j + static_cast<long>(i) * ld_full;
      Vector below[kWidth], above[kWidth];
#pragma GCC unroll 8
      for (int c = 0; c < kWidth; ++c) below[c] = load(block + static_cast<long>(c) * ld_lower);
      load_transposed(block, ld_lower, above);
      if (i == j) {
#pragma GCC unroll 8
        for (int c = 0; c < kWidth; ++c)
          above[c] = lane_numbers(AllLanes{}) >= c ? below[c] : above[c];
      } else {
        store_square(full + i + static_cast<long>(j) * ld_full, ld_full, below);
      }
      store_square(mirrored, ld_full, above);
    }
  }
}

/// Lane j: the scalar product of column j of a [rows x kWidth] with x.
PALANQUIN_INLINE Vector dots(int rows, const double* a, int ld, const double* x) {
  Vector sum[kWidth] = {};
  for (int i = 0; i < rows; i += kWidth) {
    const Vector xi = load(x + i);
#pragma GCC unroll 8
    for (int j = 0; j < kWidth; ++j) sum[j] += load(a + i + static_cast<long>(j) * ld) * xi;
  }
  return sum_lanes(sum);
}

static void symmetric_multiply(int rows, int cols, const double* lower, int ld, const double* x,
                               double* y) {
  for (int i = 0; i < rows; i += kWidth) store(y + i, Vector{});
  for (int j = 0; j < cols; j += kWidth) {
    const double* diagonal = lower + j + static_cast<long>(j) * ld;
    const Vector xj = load(x + j);
    Vector below = {};   // the diagonal block's lower triangle times x_j
    Vector dot[kWidth];  // and the transposed columns times x, without the diagonal
    Vector factor[kWidth];
#pragma GCC unroll 8
    for (int c = 0; c < kWidth; ++c) {
      const Vector a = load(diagonal + static_cast<long>(c) * ld);
      factor[c] = broadcast(j + c < cols ? x[j + c] : 0.0);
      below += lanes_from(a, c) * factor[c];
      dot[c] = lanes_from(a, c + 1) * xj;
    }
    for (int i = j + kWidth; i < rows; i += kWidth) {
      const Vector xi = load(x + i);
      Vector yi = load(y + i);
#pragma GCC unroll 8
      for (int c = 0; c < kWidth; ++c) {
        const Vector a = load(diagonal + (i - j) + static_cast<long>(c) * ld);
        yi += a * factor[c];
        dot[c] += a * xi;
      }
      store(y + i, yi);
    }
    store(y + j, load(y + j) + below + sum_lanes(dot));
  }
}

}  // namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE
