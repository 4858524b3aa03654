#pragma once

#include "kernels.hpp"
#include "shuffle.hpp"

// Sparse times vector, by runs of neighbouring rows.

namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE {

PALANQUIN_INLINE void add_run(const SparseRuns& s, int r, const double* values, const double* x,
                              Vector (&sum)[kPad / kWidth]) {
  const Vector factor = broadcast(x[s.run_column[r]]);
  const double* run = values + s.run_entry[r];
#pragma GCC unroll 4
  for (int v = 0; v < kPad; v += kWidth) sum[v / kWidth] += factor * load_unaligned(run + v);
}

/// Lanes behind a block's rows hold the neighbours' values and are dropped. Two sums, as one would
/// wait for itself.
PALANQUIN_INLINE void add_block(const SparseRuns& s, int b, const double* values, const double* x,
                                double* y) {
  Vector even[kPad / kWidth] = {}, odd[kPad / kWidth] = {};
  int r = s.block_start[b];
  const int end = s.block_start[b + 1];
  for (; r + 1 < end; r += 2) {
    add_run(s, r, values, x, even);
    add_run(s, r + 1, values, x, odd);
  }
  if (r < end) add_run(s, r, values, x, even);
#pragma GCC unroll 4
  for (int v = 0; v < kPad; v += kWidth)
    add_unaligned(y + s.block_row[b] + v,
                  lanes_before(even[v / kWidth] + odd[v / kWidth], s.block_size[b] - v));
}

static void multiply_runs_add(const SparseRuns& s, const double* values, const double* x,
                              double* y) {
  for (int b = 0; b < s.blocks; ++b) add_block(s, b, values, x, y);
  for (int i = 0; i < s.singles; ++i)
    y[s.single_row[i]] += values[s.single_entry[i]] * x[s.single_column[i]];
}

}  // namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE
