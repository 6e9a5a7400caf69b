#if defined __x86_64__

#if defined __clang__
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC target("avx2")
#endif

#define SV_AVX2
#define SV_LANES 4
#define SV_ISA_NAME "avx2"
#define SV_KERNEL sv_kernel_avx2
#include "kernel.inl.h"

#if defined __clang__
#pragma clang attribute pop
#endif

#endif
