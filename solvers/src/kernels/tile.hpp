#pragma once

#include "vector.hpp"

// Tiles of a column-major matrix in registers: C columns of V vectors each.

namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE {

/// Keeps the compiler from holding an address for every vector of a tile: one per column will do.
template <class T>
PALANQUIN_INLINE void forget_origin(T*& p) {
  __asm__("" : "+r"(p));
}

template <int C, int V>
PALANQUIN_INLINE void load_tile(Vector (&t)[C][V], const double* a, int ld) {
#pragma GCC unroll 8
  for (int c = 0; c < C; ++c, a += ld) {
    forget_origin(a);
#pragma GCC unroll 12
    for (int v = 0; v < V; ++v) t[c][v] = load(a + v * kWidth);
  }
}
template <int C, int V>
PALANQUIN_INLINE void store_tile(const Vector (&t)[C][V], double* a, int ld) {
#pragma GCC unroll 8
  for (int c = 0; c < C; ++c, a += ld) {
    forget_origin(a);
#pragma GCC unroll 12
    for (int v = 0; v < V; ++v) store(a + v * kWidth, t[c][v]);
  }
}

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

}  // namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE
