/* Arithmetic on one value per knot, for functions that are evaluated at several knots at once. A
   knot is a lane of the processor's widest registers; GCC and Clang. */
#include <math.h>

#if defined(__AVX512F__)
#include <immintrin.h>
#define LANES 8
#define SQUARE_ROOTS _mm512_sqrt_pd
#elif defined(__AVX2__)
#include <immintrin.h>
#define LANES 4
#define SQUARE_ROOTS _mm256_sqrt_pd
#else
#define LANES 2
#endif

typedef double lanes __attribute__((vector_size(8 * LANES)));
typedef long long lane_bits __attribute__((vector_size(8 * LANES)));
typedef double unaligned_lanes __attribute__((vector_size(8 * LANES), aligned(8), may_alias));

/* ---- operations ----------------------------------------------------------------------------- */

static inline lanes constant(double value) { return (lanes){} + value; }
static inline lane_bits bits(lanes x) { return (lane_bits)x; }
/* A comparison's lanes are all ones or all zeros; expressions count in 1 and 0. */
static inline lanes truth(lane_bits mask) { return (lanes)(mask & bits(constant(1.0))); }
static inline lane_bits is_true(lanes x) { return x != 0.0; }
static inline lanes if_else_zero(lanes condition, lanes x) {
  return (lanes)(is_true(condition) & bits(x));
}
static inline lanes choose(lane_bits mask, lanes x, lanes y) {
  return (lanes)((mask & bits(x)) | (~mask & bits(y)));
}

static inline lane_bits signs(lanes x) { return bits(x) & bits(constant(-0.0)); }
static inline lanes lane_fabs(lanes x) { return (lanes)(bits(x) ^ signs(x)); }
static inline lanes lane_copysign(lanes x, lanes y) {
  return (lanes)(bits(lane_fabs(x)) | signs(y));
}
static inline lanes lane_sign(lanes x) {
  return choose(x < 0.0, constant(-1.0), choose(x > 0.0, constant(1.0), x));
}
/* As C's: the other argument where one is not a number. */
static inline lanes lane_fmin(lanes x, lanes y) { return choose((x < y) | (y != y), x, y); }
static inline lanes lane_fmax(lanes x, lanes y) { return choose((x > y) | (y != y), x, y); }

#define LANE_BY_LANE(function)                                     \
  static __attribute__((noinline)) lanes lane_##function(lanes x) { \
    for (int i = 0; i < LANES; ++i) x[i] = function(x[i]);         \
    return x;                                                      \
  }
#define LANE_BY_LANE_OF_TWO(function)                                       \
  static __attribute__((noinline)) lanes lane_##function(lanes x, lanes y) { \
    for (int i = 0; i < LANES; ++i) x[i] = function(x[i], y[i]);            \
    return x;                                                               \
  }
/* clang-format off */
LANE_BY_LANE(exp) LANE_BY_LANE(log) LANE_BY_LANE(log1p) LANE_BY_LANE(expm1)
LANE_BY_LANE(sin) LANE_BY_LANE(cos) LANE_BY_LANE(tan)
LANE_BY_LANE(asin) LANE_BY_LANE(acos) LANE_BY_LANE(atan)
LANE_BY_LANE(sinh) LANE_BY_LANE(cosh) LANE_BY_LANE(tanh)
LANE_BY_LANE(asinh) LANE_BY_LANE(acosh) LANE_BY_LANE(atanh)
LANE_BY_LANE(floor) LANE_BY_LANE(ceil) LANE_BY_LANE(erf)
LANE_BY_LANE_OF_TWO(pow) LANE_BY_LANE_OF_TWO(fmod) LANE_BY_LANE_OF_TWO(remainder)
LANE_BY_LANE_OF_TWO(atan2) LANE_BY_LANE_OF_TWO(hypot)
/* clang-format on */

#if defined(SQUARE_ROOTS)
static inline lanes lane_sqrt(lanes x) { return (lanes)SQUARE_ROOTS(x); }
#else
LANE_BY_LANE(sqrt)
#endif

/* ---- knots to lanes --------------------------------------------------------------------------- */

#if defined(__clang__)
#define SHUFFLE(x, y, ...) __builtin_shufflevector(x, y, __VA_ARGS__)
#else
#define SHUFFLE(x, y, ...) __builtin_shuffle(x, y, (lane_bits){__VA_ARGS__})
#endif

#if LANES == 8
#define LOWER_4 0, 1, 2, 3, 8, 9, 10, 11
#define UPPER_4 4, 5, 6, 7, 12, 13, 14, 15
#define LOWER_2 0, 1, 8, 9, 4, 5, 12, 13
#define UPPER_2 2, 3, 10, 11, 6, 7, 14, 15
#define LOWER_1 0, 8, 2, 10, 4, 12, 6, 14
#define UPPER_1 1, 9, 3, 11, 5, 13, 7, 15
#elif LANES == 4
#define LOWER_2 0, 1, 4, 5
#define UPPER_2 2, 3, 6, 7
#define LOWER_1 0, 4, 2, 6
#define UPPER_1 1, 5, 3, 7
#else
#define LOWER_1 0, 2
#define UPPER_1 1, 3
#endif

/* Exchanges the off-diagonal blocks of `distance` rows and columns. */
#define EXCHANGE(distance)                                         \
  _Pragma("GCC unroll 8") for (int i = 0; i < LANES; ++i)          \
    if ((i & distance) == 0) {                                     \
      const lanes x = block[i], y = block[i + distance];           \
      block[i] = SHUFFLE(x, y, LOWER_##distance);                  \
      block[i + distance] = SHUFFLE(x, y, UPPER_##distance);       \
    }

static inline void transpose(lanes block[LANES]) {
#if LANES == 8
  EXCHANGE(4)
#endif
#if LANES >= 4
  EXCHANGE(2)
#endif
  EXCHANGE(1)
}

#define WINDOW 8

/* values[i][lane] = rows[lane][i] for WINDOW entries i from each of `starts` on, or for all of them
   where there are fewer. */
static __attribute__((noinline)) void read_rows(const double* const* rows, int size,
                                                const int* starts, int count, lanes* values) {
  if (size < WINDOW) {
    for (int i = 0; i < size; ++i)
      for (int lane = 0; lane < LANES; ++lane) values[i][lane] = rows[lane][i];
    return;
  }
  for (int n = 0; n < count; ++n)
    for (int first = starts[n]; first < starts[n] + WINDOW; first += LANES) {
      lanes block[LANES];
      _Pragma("GCC unroll 8") for (int lane = 0; lane < LANES; ++lane) block[lane] =
          *(const unaligned_lanes*)(rows[lane] + first);
      transpose(block);
      _Pragma("GCC unroll 8") for (int i = 0; i < LANES; ++i) values[first + i] = block[i];
    }
}

/* ---- results ---------------------------------------------------------------------------------- */

/* Is given each result in turn, as values[i * LANES + lane], valid during the call. */
typedef void (*take_result)(void* context, int result, const double* values);

struct first_lane {
  double** results;
  const int* sizes;
};

static void take_first_lane(void* context, int result, const double* values) {
  const struct first_lane* to = context;
  for (int i = 0; i < to->sizes[result]; ++i) to->results[result][i] = values[i * LANES];
}
