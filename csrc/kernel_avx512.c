#if defined __x86_64__

#if defined __clang__
#pragma clang attribute push(__attribute__((target("avx512f,avx512dq,avx512vl"))), apply_to = function)
#else
#pragma GCC target("avx512f,avx512dq,avx512vl")
#endif

#include "kernels.h"

#define SV_AVX512
#define SV_LANES SV_LANES_AVX512
#define SV_KERNEL avx512
#include "kernel.h"

#if defined __clang__
#pragma clang attribute pop
#endif

#endif
