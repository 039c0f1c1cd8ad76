/* What GCC and Clang offer beyond C99. With SLIDE_SCALAR, which scalar sources define, the runtime
 * uses nothing of it: neither vector types nor attributes. */
#ifndef SLIDE_DIALECT_H
#define SLIDE_DIALECT_H

#if defined(SLIDE_SCALAR)
#define SLIDE_CALLED static
#define SLIDE_INLINE static inline
#define SLIDE_LIKE_PRINTF(at, first)
#else
/* Called, not inlined: libraries hold every kernel, and FMUs hold several libraries. */
#define SLIDE_CALLED static __attribute__((noinline))
/* Inlined even where large: sums stay in registers. */
#define SLIDE_INLINE static inline __attribute__((always_inline))
#define SLIDE_LIKE_PRINTF(at, first) __attribute__((format(printf, at, first)))
#endif

#endif
