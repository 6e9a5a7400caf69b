/* The wide float: a design, or a voxel or link of one body, per lane. C gives it + - * /; the operations that the
 * language lacks are here.
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
/* Exchanges rows and columns of a square of wides. */
SV_INLINE void sv_transpose(sv_wide r[SV_LANES])
{
    sv_wide pair[8], half[8];
    for (int i = 0; i < 8; i += 2) {
        pair[i] = _mm512_unpacklo_pd(r[i], r[i + 1]);
        pair[i + 1] = _mm512_unpackhi_pd(r[i], r[i + 1]);
    }
    for (int i = 0; i < 2; i++) {
        half[4 * i] = _mm512_shuffle_f64x2(pair[i], pair[2 + i], 0x44);
        half[4 * i + 1] = _mm512_shuffle_f64x2(pair[4 + i], pair[6 + i], 0x44);
        half[4 * i + 2] = _mm512_shuffle_f64x2(pair[i], pair[2 + i], 0xee);
        half[4 * i + 3] = _mm512_shuffle_f64x2(pair[4 + i], pair[6 + i], 0xee);
    }
    for (int i = 0; i < 2; i++) {
        r[i] = _mm512_shuffle_f64x2(half[4 * i], half[4 * i + 1], 0x88);
        r[2 + i] = _mm512_shuffle_f64x2(half[4 * i], half[4 * i + 1], 0xdd);
        r[4 + i] = _mm512_shuffle_f64x2(half[4 * i + 2], half[4 * i + 3], 0x88);
        r[6 + i] = _mm512_shuffle_f64x2(half[4 * i + 2], half[4 * i + 3], 0xdd);
    }
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
SV_INLINE void sv_transpose(sv_wide r[SV_LANES])
{
    sv_wide a = _mm256_unpacklo_pd(r[0], r[1]), b = _mm256_unpackhi_pd(r[0], r[1]);
    sv_wide c = _mm256_unpacklo_pd(r[2], r[3]), d = _mm256_unpackhi_pd(r[2], r[3]);
    r[0] = _mm256_permute2f128_pd(a, c, 0x20);
    r[1] = _mm256_permute2f128_pd(b, d, 0x20);
    r[2] = _mm256_permute2f128_pd(a, c, 0x31);
    r[3] = _mm256_permute2f128_pd(b, d, 0x31);
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
SV_INLINE void sv_transpose(sv_wide r[SV_LANES])
{
    sv_wide first = {r[0][0], r[1][0]}, second = {r[0][1], r[1][1]};
    r[0] = first;
    r[1] = second;
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

/* Eight numbers that belong to one voxel, side by side: what lanes that differ in the voxel read and write. */
typedef struct {
    sv_wide part[8 / SV_LANES];
} sv_line;

/* Reads a line per lane: number i of every lane becomes out[i]. */
SV_INLINE void sv_load_lines(const sv_line *lines, const int32_t index[SV_LANES], sv_wide out[8])
{
    for (int part = 0; part < 8 / SV_LANES; part++) {
        for (int lane = 0; lane < SV_LANES; lane++)
            out[part * SV_LANES + lane] = lines[index[lane]].part[part];
        sv_transpose(out + part * SV_LANES);
    }
}

/* Writes SV_LANES lines that follow one another, a lane's numbers into each. */
SV_INLINE void sv_store_lines(sv_line lines[SV_LANES], sv_wide in[8])
{
    for (int part = 0; part < 8 / SV_LANES; part++) {
        sv_transpose(in + part * SV_LANES);
        for (int lane = 0; lane < SV_LANES; lane++)
            lines[lane].part[part] = in[part * SV_LANES + lane];
    }
}
