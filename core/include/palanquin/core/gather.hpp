#pragma once

#include <algorithm>
#include <vector>

#include "palanquin/core/sparse_block.hpp"

namespace palanquin {

/// value[destination] += source value * slope_a * slope_b, where a negative slope index means 1.
struct GatherEntry {
  int destination;
  int source;  ///< negative: the constant 1
  int slope_a;
  int slope_b;
};

/// How the values of a reduced matrix follow from those of a larger one and the slopes of what is
/// substituted. Most variables stay as they are, so most values are copied.
struct Gather {
  /// Neighbouring values that are copied to neighbouring places.
  struct Run {
    int destination, source, size;
  };
  std::vector<int> sources;  ///< per destination: the value to copy, or 0 where none is
  std::vector<Run> runs;     ///< the same, where runs are long; else empty
  std::vector<int> cleared;  ///< those destinations: zero plus what `entries` add
  std::vector<GatherEntry> entries;

  /// Moves what can be copied from `entries` to `sources`; call once when the recipe for `size`
  /// values is complete. Neighbouring source values will be `stride` apart.
  void separate_copies(int size, int stride = 1);
  /// Writes every value of `destination`. `source` has at least one value.
  void write(const double* source, const double* slopes, double* destination) const;
  /// Adds `entries` alone to `destination`.
  void add(const double* source, const double* slopes, double* destination) const;
};

/// One term of a reduced matrix before its pattern is known.
struct GatherTerm {
  static constexpr int kConstant = -1;    ///< a source whose value is 1
  static constexpr int kStructural = -2;  ///< one that only makes room in the pattern
  int row, column, source, slope_a, slope_b;
};

/// Sorts terms into a pattern; terms that meet in one entry add up. The recipe still has to
/// separate its copies.
void assemble(std::vector<GatherTerm> terms, int rows, int cols, SparseBlock& block,
              Gather& gather);

/// Terms of T'HT for the lower triangle H of `pattern`, as a lower triangle. The parts of column j
/// of T', each with a `column` and a `slope`, stand between columns.begin(j) and columns.end(j).
template <typename Pattern, typename Columns>
void add_congruence_terms(const Pattern& pattern, const Columns& columns,
                          std::vector<GatherTerm>& terms) {
  for (int j = 0; j < pattern.cols; ++j)
    for (int n = pattern.column_start[j]; n < pattern.column_start[j + 1]; ++n) {
      const int i = pattern.row_index[n];
      for (const auto* a = columns.begin(i); a != columns.end(i); ++a)
        for (const auto* b = columns.begin(j); b != columns.end(j); ++b) {
          // The stored (i, j) stands for (j, i) too, which lands at (b, a).
          if (a->column >= b->column)
            terms.push_back({a->column, b->column, n, a->slope, b->slope});
          if (i != j && b->column >= a->column)
            terms.push_back({b->column, a->column, n, b->slope, a->slope});
        }
    }
}

}  // namespace palanquin
