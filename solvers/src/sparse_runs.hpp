#pragma once

#include <vector>

#include "kernels/kernels.hpp"
#include "palanquin/core/sparse_block.hpp"

namespace palanquin {

/// The lists of a kernels::SparseRuns.
class SparseRuns {
 public:
  /// Finds the runs of `block`. x in a product has column j of the block at slot[j], or at j if
  /// `slot` is empty.
  void make(const SparseBlock& block, const std::vector<int>& slot = {});
  /// Makes room for blocks of up to `entries` entries.
  void reserve(int entries);
  int entries() const { return entries_; }

  kernels::SparseRuns lists() const {
    return {static_cast<int>(block_row_.size()),
            block_row_.data(),
            block_size_.data(),
            block_start_.data(),
            run_column_.data(),
            run_entry_.data(),
            static_cast<int>(single_row_.size()),
            single_row_.data(),
            single_column_.data(),
            single_entry_.data()};
  }

 private:
  struct Run {
    int row = 0, size = 0, column = 0, entry = 0;
    auto operator<=>(const Run&) const = default;
  };

  int entries_ = 0;
  std::vector<Run> runs_;
  std::vector<int> block_row_, block_size_, block_start_;
  std::vector<int> run_column_, run_entry_;
  std::vector<int> single_row_, single_column_, single_entry_;
};

}  // namespace palanquin
