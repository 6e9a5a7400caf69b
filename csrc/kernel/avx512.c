#if defined __x86_64__

#if defined __clang__
#pragma clang attribute push(__attribute__((target("avx512f,avx512dq,avx512vl"))), apply_to = function)
#else
#pragma GCC target("avx512f,avx512dq,avx512vl")
#endif

#define SV_AVX512
#define SV_LANES 8
#define SV_ISA_NAME "avx512"
#define SV_KERNEL sv_kernel_avx512
#include "kernel.inl.h"

#if defined __clang__
#pragma clang attribute pop
#endif

#endif
