/* Which instruction sets this machine runs, and what the engine was built with. */
#include "kernels.h"

#include <stddef.h>

const sv_kernel *sv_kernel_of(int32_t isa)
{
    switch (isa) {
    case SV_ISA_PORTABLE:
        return &sv_kernel_portable;
#if defined __x86_64__
    case SV_ISA_AVX2:
        return __builtin_cpu_supports("avx2") ? &sv_kernel_avx2 : NULL;
    case SV_ISA_AVX512:
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                       __builtin_cpu_supports("avx512vl")
                   ? &sv_kernel_avx512
                   : NULL;
#endif
    default:
        return NULL;
    }
}

int32_t sv_isa_supported(int32_t isa)
{
    return sv_kernel_of(isa) != NULL;
}

const char *sv_isa_name(int32_t isa)
{
    const sv_kernel *kernel = sv_kernel_of(isa);
    return kernel ? kernel->name : "unknown";
}

int32_t sv_isa_lanes(int32_t isa)
{
    const sv_kernel *kernel = sv_kernel_of(isa);
    return kernel ? kernel->lanes : 0;
}

const char *sv_compiler(void)
{
#if defined __clang__
    return "clang " __clang_version__;
#else
    return "gcc " __VERSION__;
#endif
}

const char *sv_flags(void)
{
#if defined SV_FLAGS
    return SV_FLAGS;
#else
    return "";
#endif
}
