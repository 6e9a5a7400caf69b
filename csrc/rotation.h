/* Quaternions, their matrices and rotation vectors. physics.md 7 */
#ifndef SV_ROTATION_H
#define SV_ROTATION_H

#include "lanes.h"

typedef struct {
    vf w;
    v3 v;
} quat;

typedef struct {
    v3 x, y, z; /* rows */
} m3;

SV_INLINE quat select_quat(vm mask, quat yes, quat no)
{
    return (quat){select(mask, yes.w, no.w), select3(mask, yes.v, no.v)};
}

SV_INLINE v3 times(const m3 *m, v3 a)
{
    return (v3){dot3(m->x, a), dot3(m->y, a), dot3(m->z, a)};
}

/* The transposed matrix times a: the rotation undone. */
SV_INLINE v3 times_back(const m3 *m, v3 a)
{
    return (v3){m->x.x * a.x + m->y.x * a.y + m->z.x * a.z, m->x.y * a.x + m->y.y * a.y + m->z.y * a.z,
                m->x.z * a.x + m->y.z * a.y + m->z.z * a.z};
}

/* The matrix of a -> q a q*. For a quaternion that is not normalised it scales by |q|^2, as that product does. */
SV_INLINE m3 matrix_of(quat q)
{
    vf ww = q.w * q.w, xx = q.v.x * q.v.x, yy = q.v.y * q.v.y, zz = q.v.z * q.v.z;
    vf x2 = q.v.x + q.v.x, y2 = q.v.y + q.v.y, z2 = q.v.z + q.v.z;
    vf xy = x2 * q.v.y, xz = x2 * q.v.z, yz = y2 * q.v.z, wx = x2 * q.w, wy = y2 * q.w, wz = z2 * q.w;
    vf sum = ww + xx, difference = ww - xx, yz_sum = yy + zz, yz_difference = yy - zz;
    return (m3){{sum - yz_sum, xy - wz, xz + wy},
                {xy + wz, difference + yz_difference, yz - wx},
                {xz - wy, yz + wx, difference - yz_difference}};
}

/* a* b: the rotation from a to b as a sees it. */
SV_INLINE quat relative(quat a, quat b)
{
    return (quat){a.w * b.w + a.v.x * b.v.x + a.v.y * b.v.y + a.v.z * b.v.z,
                  {a.w * b.v.x - a.v.x * b.w - a.v.y * b.v.z + a.v.z * b.v.y,
                   a.w * b.v.y + a.v.x * b.v.z - a.v.y * b.w - a.v.z * b.v.x,
                   a.w * b.v.z - a.v.x * b.v.y + a.v.y * b.v.x - a.v.z * b.w}};
}

/* k q for a k without x component. */
SV_INLINE quat after_tilt(quat k, quat q)
{
    return (quat){k.w * q.w - k.v.y * q.v.y - k.v.z * q.v.z,
                  {k.w * q.v.x + k.v.y * q.v.z - k.v.z * q.v.y, k.w * q.v.y + k.v.y * q.w + k.v.z * q.v.x,
                   k.w * q.v.z - k.v.y * q.v.x + k.v.z * q.w}};
}

/* q k* for a k without x component. */
SV_INLINE quat before_tilt_undone(quat q, quat k)
{
    return (quat){q.w * k.w + q.v.y * k.v.y + q.v.z * k.v.z,
                  {q.v.x * k.w - q.v.y * k.v.z + q.v.z * k.v.y, q.v.y * k.w - q.w * k.v.y + q.v.x * k.v.z,
                   q.v.z * k.w - q.w * k.v.z - q.v.x * k.v.y}};
}

/* Powers of y that bring rv_factor to the last bit: near by 2 / sqrt(1 - y), else by
 * 2 asin(sqrt y) / sqrt(y (1 - y)) = 2 sum 4^n n!^2 / (2n + 1)! y^n. */
SV_INLINE vf factor_near(vf y)
{
    return 2.0 + y * (1.0 + y * (0.75 + y * (0.625 + y * 0.546875)));
}

SV_INLINE vf factor_series(vf y)
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
    vf sum = all(c[12]);
    for (int n = 11; n >= 0; n--)
        sum = sum * y + c[n];
    return sum;
}

#define SV_SERIES_REACH 0.05 /* largest y for which factor_series is exact to the last bit */

/* The accurate branch for turns past factor_series: three half turns bring y within its reach, each
 * sin^2(a/2) = sin^2(a) / (2 (1 + cos a)) without cancellation. Close to a full turn rv takes the near formula. */
SV_INLINE vf factor_far(vf w, vf y)
{
    vf eighth = y;
    for (int halving = 0; halving < 3; halving++)
        eighth = eighth / (2.0 * (1.0 + vsqrt(all(1) - eighth)));
    vf angle = 8.0 * factor_series(eighth) * vsqrt(eighth * (1.0 - eighth));
    vf accurate = angle / vsqrt(y * (1.0 - y));
    vf full_turn = 2.0 * vsqrt(2.0 / (1.0 + w));
    full_turn = select(le(w, all(-1)), all(0), full_turn);
    return select(lt(w, all(-0.9988)), full_turn, accurate);
}

/* rv(q) = rv_factor(w) (x, y, z). physics.md 7 */
SV_INLINE vf rv_factor(vf w)
{
    vf y = 0.5 - 0.5 * w;
    vf factor = factor_near(y);
    vm accurate = le(w, all(0.9988));
    if (any(accurate)) {
        factor = select(accurate, factor_series(y), factor);
        vm far = gt(y, all(SV_SERIES_REACH));
        if (any(far))
            factor = select(far, factor_far(w, y), factor);
    }
    return select(lt(w, all(1)), factor, all(0));
}

#endif
