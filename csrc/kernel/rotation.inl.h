/* Quaternions, their matrices and rotation vectors. physics.md 7 */
#pragma once

#include "lanes.inl.h"

typedef struct {
    sv_wide w;
    sv_vec3 v;
} sv_quat;

typedef struct {
    sv_vec3 x, y, z; /* rows */
} sv_mat3;

SV_INLINE sv_quat sv_select_quat(sv_mask mask, sv_quat yes, sv_quat no)
{
    return (sv_quat){sv_select(mask, yes.w, no.w), sv_select3(mask, yes.v, no.v)};
}

SV_INLINE sv_vec3 sv_apply(const sv_mat3 *m, sv_vec3 a)
{
    return (sv_vec3){sv_dot3(m->x, a), sv_dot3(m->y, a), sv_dot3(m->z, a)};
}

/* The transposed matrix times a: the rotation undone. */
SV_INLINE sv_vec3 sv_apply_inverse(const sv_mat3 *m, sv_vec3 a)
{
    return (sv_vec3){m->x.x * a.x + m->y.x * a.y + m->z.x * a.z, m->x.y * a.x + m->y.y * a.y + m->z.y * a.z,
                     m->x.z * a.x + m->y.z * a.y + m->z.z * a.z};
}

/* The matrix of a -> q a q*. For a quaternion that is not normalised it scales by |q|^2, as that product does. */
SV_INLINE sv_mat3 sv_matrix(sv_quat q)
{
    sv_wide ww = q.w * q.w, xx = q.v.x * q.v.x, yy = q.v.y * q.v.y, zz = q.v.z * q.v.z;
    sv_wide x2 = q.v.x + q.v.x, y2 = q.v.y + q.v.y, z2 = q.v.z + q.v.z;
    sv_wide xy = x2 * q.v.y, xz = x2 * q.v.z, yz = y2 * q.v.z, wx = x2 * q.w, wy = y2 * q.w, wz = z2 * q.w;
    sv_wide sum = ww + xx, difference = ww - xx, yz_sum = yy + zz, yz_difference = yy - zz;
    return (sv_mat3){{sum - yz_sum, xy - wz, xz + wy},
                     {xy + wz, difference + yz_difference, yz - wx},
                     {xz - wy, yz + wx, difference - yz_difference}};
}

/* a* b: the rotation from a to b as a sees it. */
SV_INLINE sv_quat sv_relative(sv_quat a, sv_quat b)
{
    return (sv_quat){a.w * b.w + a.v.x * b.v.x + a.v.y * b.v.y + a.v.z * b.v.z,
                     {a.w * b.v.x - a.v.x * b.w - a.v.y * b.v.z + a.v.z * b.v.y,
                      a.w * b.v.y + a.v.x * b.v.z - a.v.y * b.w - a.v.z * b.v.x,
                      a.w * b.v.z - a.v.x * b.v.y + a.v.y * b.v.x - a.v.z * b.w}};
}

/* k q for a k without x component. */
SV_INLINE sv_quat sv_after_tilt(sv_quat k, sv_quat q)
{
    return (sv_quat){k.w * q.w - k.v.y * q.v.y - k.v.z * q.v.z,
                     {k.w * q.v.x + k.v.y * q.v.z - k.v.z * q.v.y, k.w * q.v.y + k.v.y * q.w + k.v.z * q.v.x,
                      k.w * q.v.z - k.v.y * q.v.x + k.v.z * q.w}};
}

/* q k* for a k without x component. */
SV_INLINE sv_quat sv_undo_tilt(sv_quat q, sv_quat k)
{
    return (sv_quat){q.w * k.w + q.v.y * k.v.y + q.v.z * k.v.z,
                     {q.v.x * k.w - q.v.y * k.v.z + q.v.z * k.v.y, q.v.y * k.w - q.w * k.v.y + q.v.x * k.v.z,
                      q.v.z * k.w - q.w * k.v.z - q.v.x * k.v.y}};
}

/* Powers of y that bring sv_rv_factor to the last bit: near by 2 / sqrt(1 - y), else by
 * 2 asin(sqrt y) / sqrt(y (1 - y)) = 2 sum 4^n n!^2 / (2n + 1)! y^n. */
SV_INLINE sv_wide sv_factor_near(sv_wide y)
{
    return 2.0 + y * (1.0 + y * (0.75 + y * (0.625 + y * 0.546875)));
}

SV_INLINE sv_wide sv_factor_series(sv_wide y)
{
    const double c[] = {2.0,
                        4.0 / 3,
                        16.0 / 15,
                        32.0 / 35,
                        256.0 / 315,
                        512.0 / 693,
                        2048.0 / 3003,
                        4096.0 / 6435,
                        65536.0 / 109395,
                        131072.0 / 230945,
                        524288.0 / 969969,
                        1048576.0 / 2028117,
                        8388608.0 / 16900975};
    sv_wide sum = sv_splat(c[12]);
    for (int n = 11; n >= 0; n--)
        sum = sum * y + c[n];
    return sum;
}

#define SV_SERIES_REACH 0.05 /* largest y for which sv_factor_series is exact to the last bit */

/* The accurate branch for turns past sv_factor_series: three half turns bring y within its reach, each
 * sin^2(a/2) = sin^2(a) / (2 (1 + cos a)) without cancellation. Close to a full turn rv takes the near formula. */
SV_INLINE sv_wide sv_factor_far(sv_wide w, sv_wide y)
{
    sv_wide eighth = y;
    for (int halving = 0; halving < 3; halving++)
        eighth = eighth / (2.0 * (1.0 + sv_sqrt(sv_splat(1) - eighth)));
    sv_wide angle = 8.0 * sv_factor_series(eighth) * sv_sqrt(eighth * (1.0 - eighth));
    sv_wide accurate = angle / sv_sqrt(y * (1.0 - y));
    sv_wide full_turn = 2.0 * sv_sqrt(2.0 / (1.0 + w));
    full_turn = sv_select(sv_le(w, sv_splat(-1)), sv_splat(0), full_turn);
    return sv_select(sv_lt(w, sv_splat(-0.9988)), full_turn, accurate);
}

/* rv(q) = sv_rv_factor(w) (x, y, z). physics.md 7 */
SV_INLINE sv_wide sv_rv_factor(sv_wide w)
{
    sv_wide y = 0.5 - 0.5 * w;
    sv_wide factor = sv_factor_near(y);
    sv_mask accurate = sv_le(w, sv_splat(0.9988));
    if (sv_any(accurate)) {
        factor = sv_select(accurate, sv_factor_series(y), factor);
        sv_mask far = sv_gt(y, sv_splat(SV_SERIES_REACH));
        if (sv_any(far))
            factor = sv_select(far, sv_factor_far(w, y), factor);
    }
    return sv_select(sv_lt(w, sv_splat(1)), factor, sv_splat(0));
}
