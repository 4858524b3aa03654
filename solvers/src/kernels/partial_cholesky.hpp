#pragma once

#include "kernels.hpp"
#include "sparse_product.hpp"
#include "symmetric.hpp"

// Left-looking partial Cholesky factorisation in panels of kPad columns, and its substitutions.

namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE {

/// Tiles: V vectors of rows times C columns. The trailing update wants as many accumulators as
/// there are registers; a panel's tile holds all kPad columns, because it is solved against the
/// diagonal block before it leaves the registers.
inline constexpr int kTrailingVectors = 3;
inline constexpr int kTrailingColumns = kAccumulators / kTrailingVectors;
inline constexpr int kPanelVectors = kWidth == 8 ? 3 : 1;

/// Keeps the compiler from holding one address per vector of a tile: one per column will do.
template <class T>
PALANQUIN_INLINE void forget_origin(T*& p) {
  __asm__("" : "+r"(p));
}

template <int C, int V>
PALANQUIN_INLINE void load_tile(Vector (&t)[C][V], const double* a, int ld) {
#pragma GCC unroll 8
  for (int c = 0; c < C; ++c, a += ld) {
    forget_origin(a);
#pragma GCC unroll 4
    for (int v = 0; v < V; ++v) t[c][v] = load(a + v * kWidth);
  }
}
template <int C, int V>
PALANQUIN_INLINE void store_tile(const Vector (&t)[C][V], double* a, int ld) {
#pragma GCC unroll 8
  for (int c = 0; c < C; ++c, a += ld) {
    forget_origin(a);
#pragma GCC unroll 4
    for (int v = 0; v < V; ++v) store(a + v * kWidth, t[c][v]);
  }
}

/// t -= A B' with `depth` columns of A (the tile's rows) and B (its columns' rows).
template <int C, int V>
PALANQUIN_INLINE void subtract_product(Vector (&t)[C][V], int depth, const double* a,
                                       const double* b, int ld) {
  for (int k = 0; k < depth; ++k, a += ld, b += ld) {
    Vector x[V];
#pragma GCC unroll 4
    for (int v = 0; v < V; ++v) x[v] = load(a + v * kWidth);
#pragma GCC unroll 8
    for (int c = 0; c < C; ++c) {
      const Vector y = broadcast(b[c]);
#pragma GCC unroll 4
      for (int v = 0; v < V; ++v) t[c][v] -= x[v] * y;
    }
  }
}

/// Cholesky factor of the kPad x kPad block t. What the next pivot waits for is one division and
/// one scalar update: vectors and square roots run beside this chain. Returns the first bad pivot
/// or -1.
template <int V>
PALANQUIN_INLINE int factorize_block(Vector (&t)[kPad][V], const double* threshold,
                                     double* reciprocal) {
  int bad = -1;
  double pivot = t[0][0][0];
#pragma GCC unroll 8
  for (int k = 0; k < kPad; ++k) {
    if (!(pivot > threshold[k]) && bad < 0) bad = k;
    const double inverse = 1.0 / pivot;
    reciprocal[k] = 1.0 / __builtin_sqrt(pivot);
    if (k + 1 < kPad) {
      const int next = k + 1;
      const double entry = t[k][next / kWidth][next % kWidth];
      pivot = t[next][next / kWidth][next % kWidth] - entry * entry * inverse;
    }
#pragma GCC unroll 8
    for (int j = k + 1; j < kPad; ++j) {
      const Vector factor = broadcast(t[k][j / kWidth][j % kWidth]);
#pragma GCC unroll 4
      for (int v = j / kWidth; v < V; ++v) t[j][v] -= t[k][v] * factor * broadcast(inverse);
    }
    const Vector root = broadcast(reciprocal[k]);
#pragma GCC unroll 4
    for (int v = k / kWidth; v < V; ++v) t[k][v] *= root;
  }
  return bad;
}

/// Updates and factorises the diagonal block at row and column j of the panel.
PALANQUIN_INLINE int diagonal_block(int j, double tolerance, double* panel, int ld) {
  constexpr int kVectors = kPad / kWidth;
  double* block = panel + j + static_cast<long>(j) * ld;
  double threshold[kPad];
  for (int k = 0; k < kPad; ++k) threshold[k] = tolerance * block[k + static_cast<long>(k) * ld];
  Vector t[kPad][kVectors];
  load_tile(t, block, ld);
  subtract_product(t, j, panel + j, panel + j, ld);
  double reciprocal[kPad];
  const int bad = factorize_block(t, threshold, reciprocal);
  store_tile(t, block, ld);
  for (int k = 0; k < kPad; ++k) block[k + static_cast<long>(k) * ld] = reciprocal[k];
  return bad < 0 ? -1 : j + bad;
}

/// t := t L^{-T} with the factorised diagonal block.
template <int V>
PALANQUIN_INLINE void solve_against_block(Vector (&t)[kPad][V], const double* block, int ld) {
#pragma GCC unroll 8
  for (int k = 0; k < kPad; ++k) {
    const double* l = block + static_cast<long>(k) * ld;
    const Vector reciprocal = broadcast(l[k]);
#pragma GCC unroll 4
    for (int v = 0; v < V; ++v) t[k][v] *= reciprocal;
#pragma GCC unroll 8
    for (int j = k + 1; j < kPad; ++j) {
      const Vector factor = broadcast(l[j]);
#pragma GCC unroll 4
      for (int v = 0; v < V; ++v) t[j][v] -= t[k][v] * factor;
    }
  }
}

/// Rows row .. row + V kWidth - 1 of the panel's columns j .. j + kPad - 1.
template <int V>
static void panel_tile(int j, int row, double* panel, int ld) {
  double* block = panel + static_cast<long>(j) * ld;
  Vector t[kPad][V];
  load_tile(t, block + row, ld);
  subtract_product(t, j, panel + row, panel + j, ld);
  solve_against_block(t, block + j, ld);
  store_tile(t, block + row, ld);
}

/// A tile of C -= (B L^{-T}) (B L^{-T})'.
template <int V>
static void trailing_tile(int depth, const double* a, const double* b, int ld, double* c,
                          int ld_c) {
  Vector t[kTrailingColumns][V];
  load_tile(t, c, ld_c);
  subtract_product(t, depth, a, b, ld);
  store_tile(t, c, ld_c);
}

static int partial_cholesky(int pivots, int rows, int cols, double tolerance, double* panel, int ld,
                            double* c, int ld_c) {
  static constexpr decltype(&panel_tile<1>) kPanelTile[] = {nullptr, panel_tile<1>, panel_tile<2>,
                                                            panel_tile<3>};
  static constexpr decltype(&trailing_tile<1>) kTrailingTile[] = {
      nullptr, trailing_tile<1>, trailing_tile<2>, trailing_tile<3>};
  int bad = -1;
  for (int j = 0; j < pivots; j += kPad) {
    const int block_bad = diagonal_block(j, tolerance, panel, ld);
    if (bad < 0) bad = block_bad;
    const int below = j + kPad;
    for_row_chunks(padded(pivots) + rows - below, kPanelVectors,
                   [&](int row, int vectors) { kPanelTile[vectors](j, below + row, panel, ld); });
  }
  const double* b = panel + padded(pivots);
  for (int j = 0; j < cols; j += kTrailingColumns) {
    for_row_chunks(rows - j, kTrailingVectors, [&](int row, int vectors) {
      kTrailingTile[vectors](pivots, b + j + row, b + j, ld,
                             c + j + row + static_cast<long>(j) * ld_c, ld_c);
    });
  }
  return bad;
}

/// A vector made in registers: one store of it can be read back at once, kWidth narrow ones can't.
template <int... L>
PALANQUIN_INLINE Vector gather_lanes(const double* v, Lanes<L...>) {
  return Vector{v[L]...};
}

static void back_substitute(int pivots, int rows, const double* panel, int ld, double* z) {
  const int total = padded(pivots) + rows;
  for (int j = padded(pivots) - kPad; j >= 0; j -= kPad) {
    const double* block = panel + j + static_cast<long>(j) * ld;
    const int below = j + kPad;
    double sum[kPad] __attribute__((aligned(64)));
    for (int c = 0; c < kPad; c += kWidth) {
      const double* columns = block + kPad + static_cast<long>(c) * ld;
      store(sum + c, load(z + j + c) + dots(total - below, columns, ld, z + below));
    }
    double u[kPad];
#pragma GCC unroll 8
    for (int k = kPad - 1; k >= 0; --k) {
      const double* l = block + static_cast<long>(k) * ld;
      double s = sum[k];
#pragma GCC unroll 8
      for (int i = kPad - 1; i > k; --i) s += l[i] * u[i];
      u[k] = -l[k] * s;
    }
#pragma GCC unroll 4
    for (int c = 0; c < kPad; c += kWidth) store(z + j + c, gather_lanes(u + c, AllLanes{}));
  }
}

static void forward_substitute(int pivots, int rows, const double* panel, int ld, double* g) {
  const int total = padded(pivots) + rows;
  for (int j = 0; j < pivots; j += kPad) {
    const double* columns = panel + static_cast<long>(j) * ld;
    for (int k = j; k < j + kPad; ++k) {
      const double* l = panel + static_cast<long>(k) * ld;
      g[k] *= l[k];
      for (int i = k + 1; i < j + kPad; ++i) g[i] -= l[i] * g[k];
    }
    for (int i = j + kPad; i < total; i += kWidth) {
      Vector sum = load(g + i);
#pragma GCC unroll 8
      for (int c = 0; c < kPad; ++c)
        sum -= broadcast(g[j + c]) * load(columns + i + static_cast<long>(c) * ld);
      store(g + i, sum);
    }
  }
}

}  // namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE
