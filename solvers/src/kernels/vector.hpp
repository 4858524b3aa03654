#pragma once

// One vector register of the processor level that is being compiled, by gcc's vector extension.

namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE {

#if defined(__AVX512F__)
inline constexpr int kWidth = 8;
#elif defined(__AVX__)
inline constexpr int kWidth = 4;
#else
inline constexpr int kWidth = 2;
#endif
/// Accumulators that fit into the register file beside an operand or two.
inline constexpr int kAccumulators = kWidth == 8 ? 24 : 12;

typedef double Vector __attribute__((vector_size(8 * kWidth)));
typedef long long Mask __attribute__((vector_size(8 * kWidth)));

#define PALANQUIN_INLINE static inline __attribute__((always_inline))

// Memory is an array of double wherever it is read as a vector.
typedef Vector AliasedVector __attribute__((may_alias));
typedef Vector UnalignedVector __attribute__((may_alias, aligned(8)));

PALANQUIN_INLINE Vector load(const double* p) { return *reinterpret_cast<const AliasedVector*>(p); }
PALANQUIN_INLINE void store(double* p, Vector v) { *reinterpret_cast<AliasedVector*>(p) = v; }
PALANQUIN_INLINE Vector load_unaligned(const double* p) {
  return *reinterpret_cast<const UnalignedVector*>(p);
}
PALANQUIN_INLINE void store_unaligned(double* p, Vector v) {
  *reinterpret_cast<UnalignedVector*>(p) = v;
}
/// p += v at any address.
PALANQUIN_INLINE void add_unaligned(double* p, Vector v) {
  *reinterpret_cast<UnalignedVector*>(p) += v;
}
/// x - 0.0 is x for every x, so the compiler makes this one broadcast.
PALANQUIN_INLINE Vector broadcast(double x) { return x - Vector{}; }

}  // namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE
