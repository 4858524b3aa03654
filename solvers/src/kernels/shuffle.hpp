#pragma once

#if defined(__AVX512F__)
#include <immintrin.h>
#endif

#include "vector.hpp"

// Transposition and lane-wise reduction of a square of registers.

namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE {

template <int... L>
struct Lanes {};
#if defined(__AVX512F__)
using AllLanes = Lanes<0, 1, 2, 3, 4, 5, 6, 7>;
#elif defined(__AVX__)
using AllLanes = Lanes<0, 1, 2, 3>;
#else
using AllLanes = Lanes<0, 1>;
#endif

/// Lanes with bit S clear take a's, the others b's lane S below.
template <int S, int... L>
PALANQUIN_INLINE Vector interleave_low(Vector a, Vector b, Lanes<L...>) {
  return __builtin_shuffle(a, b, Mask{(L & S ? kWidth + L - S : L)...});
}
/// Lanes with bit S set take b's, the others a's lane S above.
template <int S, int... L>
PALANQUIN_INLINE Vector interleave_high(Vector a, Vector b, Lanes<L...>) {
  return __builtin_shuffle(a, b, Mask{(L & S ? kWidth + L : L + S)...});
}

template <int S>
PALANQUIN_INLINE void transpose_bit(Vector (&v)[kWidth]) {
#pragma GCC unroll 8
  for (int i = 0; i < kWidth; ++i) {
    if (i & S) continue;
    const Vector low = interleave_low<S>(v[i], v[i + S], AllLanes{});
    v[i + S] = interleave_high<S>(v[i], v[i + S], AllLanes{});
    v[i] = low;
  }
}

/// Lane j of v[i] and lane i of v[j] change places.
PALANQUIN_INLINE void transpose_registers(Vector (&v)[kWidth]) {
  transpose_bit<1>(v);
  if constexpr (kWidth > 2) transpose_bit<2>(v);
  if constexpr (kWidth > 4) transpose_bit<4>(v);
}

/// v[i], lane j = a(i, j) of a column-major square. The widest exchange is done by loads of half
/// vectors, as shuffles have one port and loads have two.
PALANQUIN_INLINE void load_transposed(const double* a, int ld, Vector (&v)[kWidth]) {
#if defined(__AVX512F__)
  // An intrinsic, as the compiler would make a shuffle on that port of __builtin_shufflevector.
  const auto join = [](const double* low, const double* high) {
    const __m512d lower = _mm512_castpd256_pd512(_mm256_load_pd(low));
    return reinterpret_cast<Vector>(_mm512_mask_broadcast_f64x4(lower, 0xf0, _mm256_load_pd(high)));
  };
#pragma GCC unroll 4
  for (int i = 0; i < 4; ++i) {
    const double* left = a + static_cast<long>(i) * ld;
    const double* right = a + static_cast<long>(i + 4) * ld;
    v[i] = join(left, right);
    v[i + 4] = join(left + 4, right + 4);
  }
  transpose_bit<1>(v);
  transpose_bit<2>(v);
#else
#pragma GCC unroll 4
  for (int j = 0; j < kWidth; ++j) v[j] = load(a + static_cast<long>(j) * ld);
  transpose_registers(v);
#endif
}
PALANQUIN_INLINE void store_square(double* a, int ld, const Vector (&v)[kWidth]) {
#pragma GCC unroll 8
  for (int j = 0; j < kWidth; ++j) store(a + static_cast<long>(j) * ld, v[j]);
}

/// A vector whose lane j is the sum of the lanes of v[j].
PALANQUIN_INLINE Vector sum_lanes(Vector (&v)[kWidth]) {
  transpose_registers(v);
#pragma GCC unroll 3
  for (int half = kWidth / 2; half > 0; half /= 2)
    for (int i = 0; i < half; ++i) v[i] += v[i + half];
  return v[0];
}

PALANQUIN_INLINE double sum_of_lanes(Vector v) {
  double sum = v[0] + v[1];
#pragma GCC unroll 4
  for (int i = 2; i < kWidth; i += 2) sum += v[i] + v[i + 1];
  return sum;
}

template <int... L>
PALANQUIN_INLINE Mask lane_numbers(Lanes<L...>) {
  return Mask{L...};
}
/// The lanes before `end`, zeros from there on.
PALANQUIN_INLINE Vector lanes_before(Vector v, int end) {
  return lane_numbers(AllLanes{}) < end ? v : Vector{};
}
/// The lanes from `first` on, zeros before.
PALANQUIN_INLINE Vector lanes_from(Vector v, int first) {
  return lane_numbers(AllLanes{}) >= first ? v : Vector{};
}

}  // namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE
