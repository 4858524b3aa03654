#pragma once

#include "kernels.hpp"
#include "vector.hpp"

// J'D J and J's for sparse rows, by runs of neighbouring columns.

namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE {

// A vector load stalls while a narrower store to the same place is under way. So the values of a
// batch of rows are expanded before the first is used.
inline constexpr int kBatch = 64;

/// Lists the rows of a batch that have a weight or a slope. Written without a branch: which rows
/// are active can't be predicted.
PALANQUIN_INLINE int list_active(int first, int end, const double* weight, const double* slope,
                                 int* active) {
  int count = 0;
  for (int i = first; i < end; ++i) {
    active[count] = i;
    count += !(weight[i] == 0.0) | !(slope[i] == 0.0);
  }
  return count;
}

/// The row's values by runs, each filled up to kPad with zeros.
PALANQUIN_INLINE double* expand_runs(const SparseRows& rows, int row, const double* values,
                                     double* to) {
  for (int r = rows.run_start[row]; r < rows.run_start[row + 1]; ++r, to += kPad) {
    for (int v = 0; v < kPad; v += kWidth) store(to + v, Vector{});
    const int begin = rows.run_begin[r];
    for (int e = begin; e < rows.run_begin[r + 1]; ++e) to[e - begin] = values[rows.entry[e]];
  }
  return to;
}

PALANQUIN_INLINE void add_scaled_run(double* target, double scale, const double* run) {
#pragma GCC unroll 4
  for (int v = 0; v < kPad; v += kWidth)
    add_unaligned(target + v, broadcast(scale) * load(run + v));
}

/// One row, whose expanded values start at `expanded`. Returns where they end.
PALANQUIN_INLINE const double* add_weighted_row(const SparseRows& rows, int row, double weight,
                                                double slope, double* const* column,
                                                double* gradient, const double* expanded) {
  const int first = rows.run_start[row];
  const int last = rows.run_start[row + 1];
  for (int a = first; a < last; ++a) {
    const int slot = rows.slot[rows.run_begin[a]];
    const int size = rows.run_begin[a + 1] - rows.run_begin[a];
    const double* run = expanded + (a - first) * kPad;
    add_scaled_run(gradient + slot, slope, run);
    for (int e = 0; e < size; ++e)
      for (int b = a; b < last; ++b)
        add_scaled_run(column[slot + e] + rows.slot[rows.run_begin[b]], weight * run[e],
                       expanded + (b - first) * kPad);
  }
  return expanded + (last - first) * kPad;
}

static void add_weighted_rows(const SparseRows& rows, const double* values, const double* weight,
                              const double* slope, double* const* column, double* gradient,
                              double* scratch) {
  int active[kBatch];
  for (int first = 0; first < rows.count; first += kBatch) {
    const int end = rows.count - first < kBatch ? rows.count : first + kBatch;
    const int count = list_active(first, end, weight, slope, active);
    double* expanded = scratch;
    for (int i = 0; i < count; ++i) expanded = expand_runs(rows, active[i], values, expanded);
    const double* next = scratch;
    for (int i = 0; i < count; ++i)
      next = add_weighted_row(rows, active[i], weight[active[i]], slope[active[i]], column,
                              gradient, next);
  }
}

}  // namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE
