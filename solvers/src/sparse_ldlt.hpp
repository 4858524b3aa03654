#pragma once

#include <Eigen/Core>
#include <vector>

namespace palanquin {

/// Sparse factorisation L D L' of a quasi-definite matrix (Vanderbei 1995), whose pivots' signs are
/// known beforehand, with a fill-reducing order: row by row after Davis, "Algorithm 849" (2005).
///
/// The pattern is analysed once; `factorize` and `solve` do not allocate.
class SparseLdlt {
 public:
  /// One stored entry, of either triangle. Every place comes once, each diagonal place included.
  struct Entry {
    int row = 0;
    int col = 0;
  };

  /// Chooses the order and computes the pattern of L. `pivot_signs` are +1 or -1, [size].
  void analyse(const std::vector<Entry>& entries, const std::vector<signed char>& pivot_signs);

  /// Factorises the matrix whose values come in the order of the analysed entries. A pivot lost in
  /// rounding is replaced by the smallest one that is not. Returns false when a pivot clearly has
  /// the wrong sign or is not finite: the matrix is not quasi-definite.
  bool factorize(const std::vector<double>& values);

  /// x <- A^{-1} x
  void solve(Eigen::VectorXd& x);

  /// Entries of L below the diagonal.
  long nnz() const { return static_cast<long>(l_row_.size()); }

 private:
  int size() const { return static_cast<int>(diagonal_.size()); }
  void order(const std::vector<Entry>& entries, int size);
  void place_entries(const std::vector<Entry>& entries);
  void build_factor_pattern();
  double eliminate_row(int k);

  std::vector<int> position_;  ///< new index of old index i, [size]
  std::vector<double> sign_;   ///< of the pivots, in the new order
  std::vector<int> slot_;      ///< of each analysed entry in a_value_

  // The permuted matrix's upper triangle by columns, then its diagonal.
  std::vector<int> a_start_, a_row_;
  std::vector<double> a_value_;

  // L by columns and, for the order of elimination, its pattern by rows.
  std::vector<int> l_start_, l_row_;
  std::vector<double> l_value_;
  std::vector<int> row_start_, row_col_;
  std::vector<double> diagonal_;  ///< D

  std::vector<int> filled_;   ///< entries of each column of L computed so far
  std::vector<double> work_;  ///< the row under elimination, zero in between
  Eigen::VectorXd permuted_;
};

}  // namespace palanquin
