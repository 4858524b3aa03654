#include "sparse_runs.hpp"

#include <algorithm>

namespace palanquin {

void SparseRuns::make(const SparseBlock& block, const std::vector<int>& slot) {
  entries_ = block.nnz();
  runs_.clear();
  for (auto* list : {&block_row_, &block_size_, &block_start_, &run_column_, &run_entry_,
                     &single_row_, &single_column_, &single_entry_})
    list->clear();
  for (int j = 0; j < block.cols; ++j) {
    const int column = slot.empty() ? j : slot[j];
    int size = 0;
    for (int e = block.column_start[j]; e < block.column_start[j + 1]; e += size) {
      const int row = block.row_index[e];
      size = 1;
      while (size < kernels::kPad && e + size < block.column_start[j + 1] &&
             block.row_index[e + size] == row + size)
        ++size;
      if (size > 1 && e + kernels::kPad <= entries_) {
        runs_.push_back({row, size, column, e});
        continue;
      }
      for (int i = 0; i < size; ++i) {
        single_row_.push_back(row + i);
        single_column_.push_back(column);
        single_entry_.push_back(e + i);
      }
    }
  }
  std::sort(runs_.begin(), runs_.end());
  for (const Run& run : runs_) {
    if (block_row_.empty() || block_row_.back() != run.row || block_size_.back() != run.size) {
      block_row_.push_back(run.row);
      block_size_.push_back(run.size);
      block_start_.push_back(static_cast<int>(run_column_.size()));
    }
    run_column_.push_back(run.column);
    run_entry_.push_back(run.entry);
  }
  block_start_.push_back(static_cast<int>(runs_.size()));
}

void SparseRuns::reserve(int entries) {
  runs_.reserve(entries);
  for (auto* list : {&block_row_, &block_size_, &block_start_, &run_column_, &run_entry_,
                     &single_row_, &single_column_, &single_entry_})
    list->reserve(entries + 1);
}

}  // namespace palanquin
