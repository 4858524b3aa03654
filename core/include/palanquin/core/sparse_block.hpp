#pragma once

#include <Eigen/Core>
#include <vector>

namespace palanquin {

/// A small sparse matrix in compressed-column form, the unit in which stage data is stored.
///
/// The pattern is rebuilt when roles change (once per planning period at most) and the values are
/// rewritten at every linearisation. Buffers only ever grow, so neither allocates once the largest
/// pattern has been seen.
struct SparseBlock {
  int rows = 0;
  int cols = 0;
  std::vector<int> column_start{0};  ///< [cols + 1]
  std::vector<int> row_index;        ///< [nnz], ascending within a column
  std::vector<double> values;        ///< [nnz]

  int nnz() const { return column_start.back(); }

  /// Starts a new pattern of `new_rows` rows and no columns.
  void begin(int new_rows) {
    rows = new_rows;
    cols = 0;
    column_start.clear();
    column_start.push_back(0);
    row_index.clear();
    values.clear();
  }
  /// Appends an entry to the column under construction; rows must ascend.
  void push(int row, double value = 0.0) {
    row_index.push_back(row);
    values.push_back(value);
  }
  /// Closes the column under construction.
  void end_column() {
    ++cols;
    column_start.push_back(static_cast<int>(row_index.size()));
  }

  /// y += scale * M x
  void multiply_add(const double* x, double* y, double scale = 1.0) const {
    for (int j = 0; j < cols; ++j) {
      const double xj = scale * x[j];
      for (int i = column_start[j]; i < column_start[j + 1]; ++i) y[row_index[i]] += values[i] * xj;
    }
  }
  /// y += scale * M^T x
  void multiply_transposed_add(const double* x, double* y, double scale = 1.0) const {
    for (int j = 0; j < cols; ++j) {
      double sum = 0.0;
      for (int i = column_start[j]; i < column_start[j + 1]; ++i)
        sum += values[i] * x[row_index[i]];
      y[j] += scale * sum;
    }
  }
  /// y += S x, where this block stores one triangle of the symmetric S
  void multiply_symmetric_add(const double* x, double* y) const {
    for (int j = 0; j < cols; ++j)
      for (int p = column_start[j]; p < column_start[j + 1]; ++p) {
        const int i = row_index[p];
        y[i] += values[p] * x[j];
        if (i != j) y[j] += values[p] * x[i];
      }
  }

  /// Dense copy, for tests and reports.
  Eigen::MatrixXd dense() const {
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(rows, cols);
    for (int j = 0; j < cols; ++j)
      for (int i = column_start[j]; i < column_start[j + 1]; ++i) m(row_index[i], j) = values[i];
    return m;
  }
  /// A block that stores every nonzero of `m` (`keep_zeros`: every entry).
  static SparseBlock from_dense(const Eigen::MatrixXd& m, bool keep_zeros = false) {
    SparseBlock block;
    block.begin(static_cast<int>(m.rows()));
    for (int j = 0; j < m.cols(); ++j) {
      for (int i = 0; i < m.rows(); ++i)
        if (keep_zeros || m(i, j) != 0.0) block.push(i, m(i, j));
      block.end_column();
    }
    return block;
  }
};

}  // namespace palanquin
