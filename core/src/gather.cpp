#include "palanquin/core/gather.hpp"

#include <algorithm>
#include <cstddef>

namespace palanquin {

namespace {
constexpr int kNoSource = -1;     // a destination that no term reaches
constexpr int kSum = -2;          // one that needs more than a copy
constexpr std::size_t kLong = 4;  // values a run, on average, from which runs are worth it
}  // namespace

void Gather::separate_copies(int size, int stride) {
  std::vector<int> source(static_cast<std::size_t>(size), kNoSource);
  const auto source_of = [&](const GatherEntry& e) -> int& {
    return source[static_cast<std::size_t>(e.destination)];
  };
  const auto is_plain = [](const GatherEntry& e) {
    return e.source >= 0 && e.slope_a < 0 && e.slope_b < 0;
  };
  for (const GatherEntry& e : entries) {
    const bool is_first = source_of(e) == kNoSource;
    source_of(e) = is_first && is_plain(e) ? e.source : kSum;
  }
  std::erase_if(entries, [&](const GatherEntry& e) { return source_of(e) != kSum; });
  for (GatherEntry& e : entries)
    if (e.source > 0) e.source *= stride;
  for (int i = 0; i < size; ++i) {
    const int from = source[static_cast<std::size_t>(i)];
    if (from < 0) cleared.push_back(i);
    sources.push_back(std::max(from, 0) * stride);
    if (from < 0 || stride != 1) continue;
    const bool goes_on = !runs.empty() && runs.back().destination + runs.back().size == i &&
                         runs.back().source + runs.back().size == from;
    if (goes_on)
      ++runs.back().size;
    else
      runs.push_back({i, from, 1});
  }
  if (runs.size() * kLong > sources.size()) runs.clear();
}

void Gather::write(const double* source, const double* slopes, double* destination) const {
  for (const Run& run : runs)
    std::copy_n(source + run.source, run.size, destination + run.destination);
  const std::size_t size = runs.empty() ? sources.size() : 0;
  const int* from = sources.data();
#pragma GCC unroll 8
  for (std::size_t i = 0; i < size; ++i) destination[i] = source[from[i]];
  for (int i : cleared) destination[i] = 0.0;
  add(source, slopes, destination);
}

void Gather::add(const double* source, const double* slopes, double* destination) const {
  for (const GatherEntry& e : entries) {
    double value = e.source < 0 ? 1.0 : source[e.source];
    if (e.slope_a >= 0) value *= slopes[e.slope_a];
    if (e.slope_b >= 0) value *= slopes[e.slope_b];
    destination[e.destination] += value;
  }
}

void assemble(std::vector<GatherTerm> terms, int rows, int cols, SparseBlock& block,
              Gather& gather) {
  std::stable_sort(terms.begin(), terms.end(), [](const GatherTerm& a, const GatherTerm& b) {
    return a.column != b.column ? a.column < b.column : a.row < b.row;
  });
  block.begin(rows);
  gather = {};
  std::size_t next = 0;
  for (int column = 0; column < cols; ++column) {
    int last_row = -1;
    for (; next < terms.size() && terms[next].column == column; ++next) {
      const GatherTerm& t = terms[next];
      if (t.row != last_row) block.push(t.row);
      last_row = t.row;
      if (t.source != GatherTerm::kStructural)
        gather.entries.push_back(
            {static_cast<int>(block.values.size()) - 1, t.source, t.slope_a, t.slope_b});
    }
    block.end_column();
  }
}

}  // namespace palanquin
