/* Which instruction sets this machine runs, and what the engine was built with. */
#include "kernels.h"

int32_t sv_isa_supported(int32_t isa)
{
    switch (isa) {
    case SV_ISA_PORTABLE:
        return 1;
#if defined __x86_64__
    case SV_ISA_AVX2:
        return __builtin_cpu_supports("avx2") != 0;
    case SV_ISA_AVX512:
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
               __builtin_cpu_supports("avx512vl");
#endif
    default:
        return 0;
    }
}

int32_t sv_isa_best(void)
{
    int32_t best = SV_ISA_PORTABLE;
    for (int32_t isa = SV_ISA_PORTABLE; isa < SV_ISA_COUNT; isa++)
        if (sv_isa_supported(isa))
            best = isa;
    return best;
}

const char *sv_isa_name(int32_t isa)
{
    static const char *const names[SV_ISA_COUNT] = {"portable", "avx2", "avx512"};
    return isa >= 0 && isa < SV_ISA_COUNT ? names[isa] : "unknown";
}

int32_t sv_isa_lanes(int32_t isa)
{
    static const int32_t lanes[SV_ISA_COUNT] = {SV_LANES_PORTABLE, SV_LANES_AVX2, SV_LANES_AVX512};
    return isa >= 0 && isa < SV_ISA_COUNT ? lanes[isa] : 0;
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
