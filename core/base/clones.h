#pragma once

// Before a function of plain loops over arrays: compiled once for each width of vectors, and the
// widest that this processor has is taken at run time. It may call nothing that is not inlined. The
// bits are the same, since contraction is off and the compiler may not reorder sums. Sanitisers run
// before such functions can be chosen.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define RELUME_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define RELUME_CLONES
#endif
