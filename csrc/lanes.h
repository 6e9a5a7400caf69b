/* The wide float: one design per lane. C gives it + - * /; the verbs that the language lacks are here.
 *
 * SV_LANES is the number of lanes; SV_AVX2 and SV_AVX512 choose native masks and square roots. Every
 * verb is exact or correctly rounded, so that all widths and instruction sets give the same bits. */
#ifndef SV_LANES_H
#define SV_LANES_H

#include <stdbool.h>
#include <stdint.h>

#define SV_INLINE static inline __attribute__((always_inline))

typedef double vf __attribute__((vector_size(8 * SV_LANES)));

/* The same value in every lane. */
SV_INLINE vf all(double value)
{
    return value - (vf){0};
}

#if defined SV_AVX512

#include <immintrin.h>
typedef __mmask8 vm; /* a mask: one truth per lane */

SV_INLINE vm lt(vf a, vf b)
{
    return _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ);
}
SV_INLINE vm le(vf a, vf b)
{
    return _mm512_cmp_pd_mask(a, b, _CMP_LE_OQ);
}
SV_INLINE vf select(vm mask, vf yes, vf no)
{
    return _mm512_mask_blend_pd(mask, no, yes);
}
SV_INLINE vf vsqrt(vf a)
{
    return _mm512_sqrt_pd(a);
}
SV_INLINE uint32_t bits_of(vm mask)
{
    return mask;
}
SV_INLINE vm lanes_of_bits(uint32_t bits)
{
    return (vm)bits;
}

#else

typedef int64_t vm __attribute__((vector_size(8 * SV_LANES))); /* a mask: all bits set, or none, per lane */

SV_INLINE vm lt(vf a, vf b)
{
    return (vm)(a < b);
}
SV_INLINE vm le(vf a, vf b)
{
    return (vm)(a <= b);
}
SV_INLINE vm lanes_of_bits(uint32_t bits)
{
    vm mask = {0};
    for (int lane = 0; lane < SV_LANES; lane++)
        mask[lane] = -(int64_t)(bits >> lane & 1);
    return mask;
}

#if defined SV_AVX2

#include <immintrin.h>

SV_INLINE vf select(vm mask, vf yes, vf no)
{
    return _mm256_blendv_pd(no, yes, (vf)mask);
}
SV_INLINE vf vsqrt(vf a)
{
    return _mm256_sqrt_pd(a);
}
SV_INLINE uint32_t bits_of(vm mask)
{
    return (uint32_t)_mm256_movemask_pd((vf)mask);
}

#else

SV_INLINE vf select(vm mask, vf yes, vf no)
{
    return (vf)((mask & (vm)yes) | (~mask & (vm)no));
}
SV_INLINE vf vsqrt(vf a)
{
    for (int lane = 0; lane < SV_LANES; lane++)
        a[lane] = __builtin_sqrt(a[lane]);
    return a;
}
SV_INLINE uint32_t bits_of(vm mask)
{
    uint32_t bits = 0;
    for (int lane = 0; lane < SV_LANES; lane++)
        bits |= (uint32_t)(mask[lane] & 1) << lane;
    return bits;
}

#endif
#endif

SV_INLINE bool any(vm mask)
{
    return bits_of(mask) != 0;
}
SV_INLINE bool lane_of(vm mask, int lane)
{
    return bits_of(mask) >> lane & 1;
}
SV_INLINE vm gt(vf a, vf b)
{
    return lt(b, a);
}
SV_INLINE vm ge(vf a, vf b)
{
    return le(b, a);
}
SV_INLINE vf vabs(vf a)
{
    typedef int64_t bits __attribute__((vector_size(8 * SV_LANES)));
    return (vf)((bits)a & INT64_MAX);
}

/* The nearest whole number, ties to even, for |a| < 2^51. */
SV_INLINE vf nearest(vf a)
{
    const vf shift = all(6755399441055744.0); /* 1.5 * 2^52 */
    return (a + shift) - shift;
}

/* A vector of space, and the products that the physics asks for. */
typedef struct {
    vf x, y, z;
} v3;

SV_INLINE v3 add3(v3 a, v3 b)
{
    return (v3){a.x + b.x, a.y + b.y, a.z + b.z};
}
SV_INLINE v3 sub3(v3 a, v3 b)
{
    return (v3){a.x - b.x, a.y - b.y, a.z - b.z};
}
SV_INLINE v3 scale3(vf k, v3 a)
{
    return (v3){k * a.x, k * a.y, k * a.z};
}
SV_INLINE vf dot3(v3 a, v3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
SV_INLINE v3 select3(vm mask, v3 yes, v3 no)
{
    return (v3){select(mask, yes.x, no.x), select(mask, yes.y, no.y), select(mask, yes.z, no.z)};
}
SV_INLINE v3 zero3(void)
{
    return (v3){all(0), all(0), all(0)};
}

#endif
