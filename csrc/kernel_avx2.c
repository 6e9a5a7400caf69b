#if defined __x86_64__

#if defined __clang__
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC target("avx2")
#endif

#include "kernels.h"

#define SV_AVX2
#define SV_LANES SV_LANES_AVX2
#define SV_KERNEL avx2
#include "kernel.h"

#if defined __clang__
#pragma clang attribute pop
#endif

#endif
