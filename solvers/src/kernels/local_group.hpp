#pragma once

#include "kernels.hpp"
#include "shuffle.hpp"

// Elimination of a few variables that meet few others: all rows by runs, a column in registers'
// reach.

namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE {

/// Rows of a group's factor: its runs, then a vector with the gradient's entry and 1 / L_cc.
PALANQUIN_INLINE int group_rows(const LocalGroup& group) { return (group.runs + 1) * kPad; }
inline constexpr int kGradientLane = 0;
inline constexpr int kReciprocalLane = 1;

/// The part of a column of G from its diagonal entry on, one run of it: what is above the diagonal
/// or behind the run's end is masked.
PALANQUIN_INLINE Vector load_run(const double* column, const LocalGroup& group, int run, int v,
                                 int row) {
  const Vector entries = load_unaligned(column + group.run_slot[run] + v);
  return lanes_from(lanes_before(entries, group.run_size[run] - v), row - run * kPad - v);
}

/// Column c of the factor, from G's column and the factor's columns before. Zeros stay behind in G.
/// Whole vectors are read and written, never single entries: a vector load that follows a narrower
/// store to the same place stalls. Returns whether the pivot is good.
PALANQUIN_INLINE bool factorize_column(const LocalGroup& group, int c, double tolerance,
                                       double* source, double gradient, double* factor) {
  const int ld = group_rows(group);
  const int row = group.local_row[c];
  double* a = factor + c * ld;
  const auto without_columns_before = [&](Vector entries, int i) {
    for (int k = 0; k < c; ++k)
      entries -= broadcast(factor[k * ld + row]) * load(factor + k * ld + i);
    return entries;
  };
  const double threshold = tolerance * source[group.local_slot[c]];
  for (int r = 0; r < group.runs; ++r)
    for (int v = 0; v < kPad; v += kWidth) {
      const int i = r * kPad + v;
      store(a + i, without_columns_before(load_run(source, group, r, v, row), i));
    }
  for (int r = 0; r < group.runs; ++r)
    for (int v = 0; v < kPad; v += kWidth)
      store_unaligned(source + group.run_slot[r] + v, Vector{});

  const double pivot = a[row];
  const double reciprocal = 1.0 / __builtin_sqrt(pivot);
  for (int i = 0; i < group.runs * kPad; i += kWidth)  // without the diagonal and what is above it
    store(a + i, lanes_from(load(a + i) * broadcast(reciprocal), row + 1 - i));
  Vector last = {};
  last[kGradientLane] = gradient;
  last = without_columns_before(last, group.runs * kPad) * broadcast(reciprocal);
  last[kReciprocalLane] = reciprocal;
  store(a + group.runs * kPad, last);
  for (int v = kWidth; v < kPad; v += kWidth) store(a + group.runs * kPad + v, Vector{});
  return pivot > threshold;
}

/// target -= sum_c factor_c(row) factor_c(run), where `run` points to the first column's.
template <int Locals>
PALANQUIN_INLINE void subtract_run(const double* row, const double* run, int ld, double* target) {
#pragma GCC unroll 4
  for (int v = 0; v < kPad; v += kWidth) {
    Vector sum = load_unaligned(target + v);
#pragma GCC unroll 8
    for (int c = 0; c < Locals; ++c) sum -= broadcast(row[c * ld]) * load(run + c * ld + v);
    store_unaligned(target + v, sum);
  }
}

/// The complement of `Locals` columns of the factor.
template <int Locals>
PALANQUIN_INLINE void subtract_columns(const LocalGroup& group, double* const* column,
                                       double* gradient, const double* factor) {
  const int ld = group_rows(group);
  for (int a = group.local_runs; a < group.runs; ++a) {
    const int slot = group.run_slot[a];
    const double* run = factor + a * kPad;
    for (int b = a; b < group.runs; ++b)
      for (int e = 0; e < group.run_size[a]; ++e)
        subtract_run<Locals>(run + e, factor + b * kPad, ld, column[slot + e] + group.run_slot[b]);
    subtract_run<Locals>(factor + group.runs * kPad + kGradientLane, run, ld, gradient + slot);
  }
}

/// By three columns as long as there are so many: most groups are the coordinates of a point.
PALANQUIN_INLINE void subtract_complement(const LocalGroup& group, double* const* column,
                                          double* gradient, const double* factor) {
  int c = 0;
  for (; c + 3 <= group.locals; c += 3)
    subtract_columns<3>(group, column, gradient, factor + c * group_rows(group));
  for (; c < group.locals; ++c)
    subtract_columns<1>(group, column, gradient, factor + c * group_rows(group));
}

static bool eliminate_groups(const LocalGroup* groups, int count, double tolerance,
                             double* const* column, double* gradient, double* factors) {
  bool good = true;
  bool is_left = count > 0;
  for (int c = 0; is_left; ++c) {  // of all groups in turn: their chains of divisions overlap
    is_left = false;
    for (int g = 0; g < count; ++g) {
      const LocalGroup& group = groups[g];
      if (c >= group.locals) continue;
      const int slot = group.local_slot[c];
      good &= factorize_column(group, c, tolerance, column[slot], gradient[slot],
                               factors + group.factor_offset);
      is_left |= c + 1 < group.locals;
    }
  }
  if (!good) return false;
  for (int g = 0; g < count; ++g)
    subtract_complement(groups[g], column, gradient, factors + groups[g].factor_offset);
  return true;
}

PALANQUIN_INLINE void back_substitute_group(const LocalGroup& group, const double* factor,
                                            double constant, double* z) {
  const int ld = group_rows(group);
  for (int c = 0; c < group.locals; ++c) {  // others first: no local waits for another's sum
    const double* a = factor + c * ld;
    Vector sum = {};
    for (int r = group.local_runs; r < group.runs; ++r)
      for (int v = 0; v < kPad; v += kWidth)
        sum += load(a + r * kPad + v) * load_unaligned(z + group.run_slot[r] + v);
    z[group.local_slot[c]] += constant * a[group.runs * kPad + kGradientLane] + sum_of_lanes(sum);
  }
  for (int c = group.locals - 1; c >= 0; --c) {
    const double* a = factor + c * ld;
    double sum = z[group.local_slot[c]];
    for (int after = c + 1; after < group.locals; ++after)
      sum += a[group.local_row[after]] * z[group.local_slot[after]];
    z[group.local_slot[c]] = -a[group.runs * kPad + kReciprocalLane] * sum;
  }
}

PALANQUIN_INLINE void forward_substitute_group(const LocalGroup& group, const double* factor,
                                               double* g) {
  const int ld = group_rows(group);
  for (int c = 0; c < group.locals; ++c) {
    const double* a = factor + c * ld;
    double& local = g[group.local_slot[c]];
    local *= a[group.runs * kPad + kReciprocalLane];
    const Vector scale = broadcast(-local);
    for (int r = 0; r < group.runs; ++r)
      for (int v = 0; v < kPad; v += kWidth)
        add_unaligned(g + group.run_slot[r] + v, scale * load(a + r * kPad + v));
  }
}

static void back_substitute_groups(const LocalGroup* groups, int count, const double* factors,
                                   double constant, double* z) {
  for (int g = 0; g < count; ++g)
    back_substitute_group(groups[g], factors + groups[g].factor_offset, constant, z);
}

static void forward_substitute_groups(const LocalGroup* groups, int count, const double* factors,
                                      double* gradient) {
  for (int g = 0; g < count; ++g)
    forward_substitute_group(groups[g], factors + groups[g].factor_offset, gradient);
}

}  // namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE
