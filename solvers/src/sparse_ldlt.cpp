#include "sparse_ldlt.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <utility>

namespace palanquin {
namespace {

/// A pivot below this part of what was added up to make it is rounding error.
constexpr double kRounding = 1e-14;

}  // namespace

void SparseLdlt::analyse(const std::vector<Entry>& entries,
                         const std::vector<signed char>& pivot_signs) {
  const int size = static_cast<int>(pivot_signs.size());
  order(entries, size);
  place_entries(entries);
  build_factor_pattern();
  sign_.resize(size);
  for (int i = 0; i < size; ++i) sign_[position_[i]] = pivot_signs[i];
  work_.assign(size, 0.0);
  permuted_.resize(size);
}

void SparseLdlt::order(const std::vector<Entry>& entries, int size) {
  std::vector<Eigen::Triplet<double, int>> triplets;
  triplets.reserve(entries.size());
  for (const Entry& e : entries)
    triplets.emplace_back(std::max(e.row, e.col), std::min(e.row, e.col), 1.0);
  Eigen::SparseMatrix<double> lower(size, size);
  lower.setFromTriplets(triplets.begin(), triplets.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> new_to_old;
  Eigen::AMDOrdering<int>()(lower.selfadjointView<Eigen::Lower>(), new_to_old);
  position_.resize(size);
  for (int i = 0; i < size; ++i) position_[new_to_old.indices()[i]] = i;
}

void SparseLdlt::place_entries(const std::vector<Entry>& entries) {
  const int size = static_cast<int>(position_.size());
  const auto upper = [this](const Entry& e) {
    return std::minmax(position_[e.row], position_[e.col]);
  };
  a_start_.assign(size + 1, 0);
  for (const Entry& e : entries)
    if (e.row != e.col) ++a_start_[upper(e).second + 1];
  for (int j = 0; j < size; ++j) a_start_[j + 1] += a_start_[j];
  a_row_.resize(a_start_.back());
  // The diagonal follows the strict triangle, so that one array of values takes all.
  a_value_.assign(a_start_.back() + size, 0.0);
  slot_.clear();
  std::vector<int> next(a_start_.begin(), a_start_.end() - 1);
  for (const Entry& e : entries) {
    const auto [row, col] = upper(e);
    if (row == col) {
      slot_.push_back(a_start_.back() + col);
    } else {
      a_row_[next[col]] = row;
      slot_.push_back(next[col]++);
    }
  }
}

void SparseLdlt::build_factor_pattern() {
  const int size = static_cast<int>(position_.size());
  // Row k of L holds what the elimination tree reaches from the entries of column k of A.
  std::vector<int> parent(size, -1), mark(size, -1), count(size, 0);
  row_start_.assign(1, 0);
  row_col_.clear();
  for (int k = 0; k < size; ++k) {
    mark[k] = k;
    for (int p = a_start_[k]; p < a_start_[k + 1]; ++p)
      for (int i = a_row_[p]; mark[i] != k; i = parent[i]) {
        if (parent[i] < 0) parent[i] = k;
        mark[i] = k;
        row_col_.push_back(i);
        ++count[i];
      }
    std::sort(row_col_.begin() + row_start_.back(), row_col_.end());
    row_start_.push_back(static_cast<int>(row_col_.size()));
  }
  l_start_.assign(size + 1, 0);
  for (int j = 0; j < size; ++j) l_start_[j + 1] = l_start_[j] + count[j];
  l_row_.assign(l_start_.back(), 0);
  l_value_.assign(l_start_.back(), 0.0);
  std::vector<int> next(l_start_.begin(), l_start_.end() - 1);
  for (int k = 0; k < size; ++k)
    for (int p = row_start_[k]; p < row_start_[k + 1]; ++p) l_row_[next[row_col_[p]]++] = k;
  diagonal_.assign(size, 0.0);
  filled_.assign(size, 0);
}

bool SparseLdlt::factorize(const std::vector<double>& values) {
  for (std::size_t e = 0; e < slot_.size(); ++e) a_value_[slot_[e]] = values[e];
  std::copy(l_start_.begin(), l_start_.end() - 1, filled_.begin());
  for (int k = 0; k < size(); ++k) {
    const double threshold = kRounding * eliminate_row(k);
    const double pivot = sign_[k] * diagonal_[k];
    if (!std::isfinite(pivot) || pivot < -1e3 * threshold) return false;
    if (pivot < threshold) diagonal_[k] = sign_[k] * threshold;
    if (diagonal_[k] == 0.0) return false;
  }
  return true;
}

/// Computes row k of L and D_k; returns the sum of magnitudes that made D_k.
double SparseLdlt::eliminate_row(int k) {
  for (int p = a_start_[k]; p < a_start_[k + 1]; ++p) work_[a_row_[p]] = a_value_[p];
  double pivot = a_value_[a_start_.back() + k];
  double magnitude = std::abs(pivot);
  for (int q = row_start_[k]; q < row_start_[k + 1]; ++q) {
    const int i = row_col_[q];
    const double y = std::exchange(work_[i], 0.0);
    const int end = filled_[i]++;
    for (int p = l_start_[i]; p < end; ++p) work_[l_row_[p]] -= l_value_[p] * y;
    const double l = y / diagonal_[i];
    l_value_[end] = l;
    pivot -= l * y;
    magnitude += std::abs(l * y);
  }
  diagonal_[k] = pivot;
  return magnitude;
}

void SparseLdlt::solve(Eigen::VectorXd& x) {
  for (int i = 0; i < size(); ++i) permuted_[position_[i]] = x[i];
  for (int j = 0; j < size(); ++j)
    for (int p = l_start_[j]; p < l_start_[j + 1]; ++p)
      permuted_[l_row_[p]] -= l_value_[p] * permuted_[j];
  for (int j = 0; j < size(); ++j) permuted_[j] /= diagonal_[j];
  for (int j = size() - 1; j >= 0; --j)
    for (int p = l_start_[j]; p < l_start_[j + 1]; ++p)
      permuted_[j] -= l_value_[p] * permuted_[l_row_[p]];
  for (int i = 0; i < size(); ++i) x[i] = permuted_[position_[i]];
}

}  // namespace palanquin
