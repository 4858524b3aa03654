#pragma once

#include "kernels.hpp"
#include "shuffle.hpp"

// Dense times sparse: every column of the result is a combination of a few dense columns, summed in
// registers. Rows go in chunks of at most kMaxChunk vectors.

namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE {

inline constexpr int kMaxChunk = 12;

/// Calls block(first_row, vectors) for chunks of nearly equal size that cover `rows`.
template <class Block>
PALANQUIN_INLINE void for_row_chunks(int rows, int max_chunk, Block block) {
  const int vectors = rows / kWidth;
  int chunks = (vectors + max_chunk - 1) / max_chunk;
  for (int done = 0; done < vectors; --chunks) {
    const int size = (vectors - done + chunks - 1) / chunks;
    block(done * kWidth, size);
    done += size;
  }
}

template <int V>
PALANQUIN_INLINE void add_combination(Vector (&sum)[V], const SparseColumns& s, int column,
                                      const double* src, int ld) {
  const int end = s.end[column];
  for (int e = s.start[column]; e < end; ++e) {
    const Vector factor = broadcast(s.value[e]);
    const double* a = src + static_cast<long>(s.row[e]) * ld;
#pragma GCC unroll 12
    for (int v = 0; v < V; ++v) sum[v] += factor * load(a + v * kWidth);
  }
}

template <int V>
static void multiply_chunk(const SparseColumns& s, int first, int count, const double* src,
                           int ld_src, double* dst, int ld_dst) {
  for (int j = 0; j < count; ++j, dst += ld_dst) {
    Vector sum[V] = {};
    add_combination(sum, s, first + j, src, ld_src);
#pragma GCC unroll 12
    for (int v = 0; v < V; ++v) store(dst + v * kWidth, sum[v]);
  }
}

/// Products of kWidth columns stay in the first-level cache until they are turned.
template <int V>
static void multiply_transposed_chunk(const SparseColumns& s, int first, int count,
                                      const double* src, int ld_src, double* dst, int ld_dst) {
  constexpr int kRows = V * kWidth;
  alignas(64) double block[kWidth * kRows];
  for (int j = 0; j < padded(count); j += kWidth) {
    const int columns = count - j < kWidth ? count - j : kWidth;
    multiply_chunk<V>(s, first + j, columns, src, ld_src, block, kRows);
    for (int i = columns > 0 ? columns * kRows : 0; i < kWidth * kRows; i += kWidth)
      store(block + i, Vector{});
    for (int i = 0; i < kRows; i += kWidth) {
      Vector square[kWidth];
      load_transposed(block + i, kRows, square);
      store_square(dst + j + static_cast<long>(i) * ld_dst, ld_dst, square);
    }
  }
}

template <int V>
static void substitute_chunk(const SparseColumns& n, const int* order, int count, double* a,
                             int ld) {
  for (int t = 0; t < count; ++t) {
    double* column = a + static_cast<long>(order[t]) * ld;
    Vector sum[V];
#pragma GCC unroll 12
    for (int v = 0; v < V; ++v) sum[v] = load(column + v * kWidth);
    add_combination(sum, n, order[t], a, ld);
#pragma GCC unroll 12
    for (int v = 0; v < V; ++v) store(column + v * kWidth, sum[v]);
  }
}

template <int V>
static void multiply_add_chunk(int cols, const double* a, int ld, const double* x, double* y) {
  Vector sum[V];
#pragma GCC unroll 12
  for (int v = 0; v < V; ++v) sum[v] = load(y + v * kWidth);
  for (int j = 0; j < cols; ++j, a += ld) {
    const Vector factor = broadcast(x[j]);
#pragma GCC unroll 12
    for (int v = 0; v < V; ++v) sum[v] += factor * load(a + v * kWidth);
  }
#pragma GCC unroll 12
  for (int v = 0; v < V; ++v) store(y + v * kWidth, sum[v]);
}

/// chunk<1> .. chunk<kMaxChunk>, indexed by the number of vectors.
#define PALANQUIN_CHUNK_TABLE(chunk)                                       \
  {nullptr,  chunk<1>, chunk<2>, chunk<3>,  chunk<4>,  chunk<5>, chunk<6>, \
   chunk<7>, chunk<8>, chunk<9>, chunk<10>, chunk<11>, chunk<12>}

static void multiply_transposed(int rows, const SparseColumns& s, int first, int count,
                                const double* src, int ld_src, double* dst, int ld_dst) {
  static constexpr decltype(&multiply_chunk<1>) kChunk[] =
      PALANQUIN_CHUNK_TABLE(multiply_transposed_chunk);
  for_row_chunks(rows, kMaxChunk, [&](int row, int vectors) {
    kChunk[vectors](s, first, count, src + row, ld_src, dst + static_cast<long>(row) * ld_dst,
                    ld_dst);
  });
}

static void multiply_lower(int rows, const SparseColumns& s, int first, int count,
                           const double* src, int ld_src, double* dst, int ld_dst) {
  static constexpr decltype(&multiply_chunk<1>) kChunk[] = PALANQUIN_CHUNK_TABLE(multiply_chunk);
  for (int j = 0; j < count; j += kPad) {
    const int columns = count - j < kPad ? count - j : kPad;
    double* block = dst + j + static_cast<long>(j) * ld_dst;
    for_row_chunks(rows - j, kMaxChunk, [&](int row, int vectors) {
      kChunk[vectors](s, first + j, columns, src + j + row, ld_src, block + row, ld_dst);
    });
  }
}

static void substitute(int rows, const SparseColumns& n, const int* order, int count, double* a,
                       int ld) {
  static constexpr decltype(&substitute_chunk<1>) kChunk[] =
      PALANQUIN_CHUNK_TABLE(substitute_chunk);
  for_row_chunks(rows, kMaxChunk,
                 [&](int row, int vectors) { kChunk[vectors](n, order, count, a + row, ld); });
}

static void multiply_add(int rows, int cols, const double* a, int ld, const double* x, double* y) {
  static constexpr decltype(&multiply_add_chunk<1>) kChunk[] =
      PALANQUIN_CHUNK_TABLE(multiply_add_chunk);
  for_row_chunks(rows, kMaxChunk,
                 [&](int row, int vectors) { kChunk[vectors](cols, a + row, ld, x, y + row); });
}

#undef PALANQUIN_CHUNK_TABLE

}  // namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE
