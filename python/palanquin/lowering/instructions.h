/* Which instructions the compiler was allowed to use that this processor lacks; null when none. */
#define NEEDS(name) \
  if (!__builtin_cpu_supports(name)) return name

CASADI_SYMBOL_EXPORT const char* palanquin_missing_instructions(void) {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_cpu_init();
#ifdef __SSE4_2__
  NEEDS("sse4.2");
#endif
#ifdef __AVX__
  NEEDS("avx");
#endif
#ifdef __AVX2__
  NEEDS("avx2");
#endif
#ifdef __FMA__
  NEEDS("fma");
#endif
#ifdef __BMI__
  NEEDS("bmi");
#endif
#ifdef __BMI2__
  NEEDS("bmi2");
#endif
#ifdef __AVX512F__
  NEEDS("avx512f");
#endif
#ifdef __AVX512VL__
  NEEDS("avx512vl");
#endif
#ifdef __AVX512DQ__
  NEEDS("avx512dq");
#endif
#ifdef __AVX512BW__
  NEEDS("avx512bw");
#endif
#endif
  return 0;
}
