/* The wide float: one design per lane. C gives it + - * /; the operations that the language lacks are here.
 *
 * SV_LANES is the number of lanes; SV_AVX2 and SV_AVX512 choose native masks and square roots. Every
 * operation is exact or correctly rounded, so that all widths and instruction sets give the same bits. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define SV_INLINE static inline __attribute__((always_inline))

typedef double sv_wide __attribute__((vector_size(8 * SV_LANES)));

/* The same value in every lane. */
SV_INLINE sv_wide sv_splat(double value)
{
    return value - (sv_wide){0};
}

#if defined SV_AVX512

#include <immintrin.h>
typedef __mmask8 sv_mask; /* a mask: one truth per lane */

SV_INLINE sv_mask sv_lt(sv_wide a, sv_wide b)
{
    return _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ);
}
SV_INLINE sv_mask sv_le(sv_wide a, sv_wide b)
{
    return _mm512_cmp_pd_mask(a, b, _CMP_LE_OQ);
}
SV_INLINE sv_wide sv_select(sv_mask mask, sv_wide yes, sv_wide no)
{
    return _mm512_mask_blend_pd(mask, no, yes);
}
SV_INLINE sv_wide sv_sqrt(sv_wide a)
{
    return _mm512_sqrt_pd(a);
}
SV_INLINE uint32_t sv_bits(sv_mask mask)
{
    return mask;
}
SV_INLINE sv_mask sv_mask_of(uint32_t bits)
{
    return (sv_mask)bits;
}

#else

typedef int64_t sv_mask __attribute__((vector_size(8 * SV_LANES))); /* a mask: all bits set, or none, per lane */

SV_INLINE sv_mask sv_lt(sv_wide a, sv_wide b)
{
    return (sv_mask)(a < b);
}
SV_INLINE sv_mask sv_le(sv_wide a, sv_wide b)
{
    return (sv_mask)(a <= b);
}
SV_INLINE sv_mask sv_mask_of(uint32_t bits)
{
    sv_mask mask = {0};
    for (int lane = 0; lane < SV_LANES; lane++)
        mask[lane] = -(int64_t)(bits >> lane & 1);
    return mask;
}

#if defined SV_AVX2

#include <immintrin.h>

SV_INLINE sv_wide sv_select(sv_mask mask, sv_wide yes, sv_wide no)
{
    return _mm256_blendv_pd(no, yes, (sv_wide)mask);
}
SV_INLINE sv_wide sv_sqrt(sv_wide a)
{
    return _mm256_sqrt_pd(a);
}
SV_INLINE uint32_t sv_bits(sv_mask mask)
{
    return (uint32_t)_mm256_movemask_pd((sv_wide)mask);
}

#else

SV_INLINE sv_wide sv_select(sv_mask mask, sv_wide yes, sv_wide no)
{
    return (sv_wide)((mask & (sv_mask)yes) | (~mask & (sv_mask)no));
}
SV_INLINE sv_wide sv_sqrt(sv_wide a)
{
    for (int lane = 0; lane < SV_LANES; lane++)
        a[lane] = __builtin_sqrt(a[lane]);
    return a;
}
SV_INLINE uint32_t sv_bits(sv_mask mask)
{
    uint32_t bits = 0;
    for (int lane = 0; lane < SV_LANES; lane++)
        bits |= (uint32_t)(mask[lane] & 1) << lane;
    return bits;
}

#endif
#endif

SV_INLINE bool sv_any(sv_mask mask)
{
    return sv_bits(mask) != 0;
}
SV_INLINE bool sv_lane(sv_mask mask, int lane)
{
    return sv_bits(mask) >> lane & 1;
}
SV_INLINE sv_mask sv_gt(sv_wide a, sv_wide b)
{
    return sv_lt(b, a);
}
SV_INLINE sv_mask sv_ge(sv_wide a, sv_wide b)
{
    return sv_le(b, a);
}
SV_INLINE sv_wide sv_abs(sv_wide a)
{
    typedef int64_t bits __attribute__((vector_size(8 * SV_LANES)));
    return (sv_wide)((bits)a & INT64_MAX);
}

/* The nearest whole number, ties to even, for |a| < 2^51. */
SV_INLINE sv_wide sv_round(sv_wide a)
{
    const sv_wide shift = sv_splat(6755399441055744.0); /* 1.5 * 2^52 */
    return (a + shift) - shift;
}

/* A vector of space, and the products that the physics asks for. */
typedef struct {
    sv_wide x, y, z;
} sv_vec3;

SV_INLINE sv_vec3 sv_add3(sv_vec3 a, sv_vec3 b)
{
    return (sv_vec3){a.x + b.x, a.y + b.y, a.z + b.z};
}
SV_INLINE sv_vec3 sv_sub3(sv_vec3 a, sv_vec3 b)
{
    return (sv_vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}
SV_INLINE sv_vec3 sv_scale3(sv_wide k, sv_vec3 a)
{
    return (sv_vec3){k * a.x, k * a.y, k * a.z};
}
SV_INLINE sv_wide sv_dot3(sv_vec3 a, sv_vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
SV_INLINE sv_vec3 sv_select3(sv_mask mask, sv_vec3 yes, sv_vec3 no)
{
    return (sv_vec3){sv_select(mask, yes.x, no.x), sv_select(mask, yes.y, no.y), sv_select(mask, yes.z, no.z)};
}
SV_INLINE sv_vec3 sv_zero3(void)
{
    return (sv_vec3){sv_splat(0), sv_splat(0), sv_splat(0)};
}
