/* What a beam does to the two voxels that it joins. physics.md 4 */
#ifndef SV_LINK_H
#define SV_LINK_H

#include "block.h"

#define SV_SMALL_TURN 0.01732                /* rad, theta */
#define SV_COS_SMALL_TURN 0.9999625024343469 /* cos(theta / 2) */
#define SV_COS_LARGE_TURN 0.9999546280051071 /* cos(1.1 theta / 2) */
#define SV_DIVERGED_STRETCH 100.0            /* voxel widths; physics.md 8 */

/* How a link is bent: u is voxel b as voxel a sees it, n the relative rotation, d and the two bends what
 * they are measured by, all in the link's frame; `outward` leads from the link's frame back to the world. */
typedef struct {
    v3 d, bend_a, bend_b;
    quat outward;
} deformation;

/* To the frame in which the link points along x, and back. */
SV_INLINE v3 into_link(int axis, v3 a)
{
    return axis == 0 ? a : axis == 1 ? (v3){a.y, -a.x, a.z} : (v3){a.z, a.y, -a.x};
}
SV_INLINE v3 out_of_link(int axis, v3 a)
{
    return axis == 0 ? a : axis == 1 ? (v3){-a.y, a.x, a.z} : (v3){-a.z, a.y, a.x};
}

/* The regime, with hysteresis. A link folded past a right angle (u.x < 0) counts as not turned. */
SV_INLINE vm next_regime(vm large, v3 u, vf rest, vf cos_half_turn)
{
    vf aside = vabs(u.y) + vabs(u.z);
    vm folded = lt(u.x, all(0));
    vm calm = gt(cos_half_turn, all(SV_COS_SMALL_TURN)) & (lt(aside, 0.05 * u.x) | folded) & lt(u.x, 1.3 * rest);
    vm strained = le(cos_half_turn, all(SV_COS_LARGE_TURN)) | (gt(aside, 0.055 * u.x) & ~folded) | gt(u.x, 1.43 * rest);
    return (large & ~calm) | (~large & strained);
}

/* k, the rotation that takes u onto +x, for u of the given length. physics.md 7 */
SV_INLINE quat tilt_of(v3 u, vf length)
{
    vf reach = SV_SMALL_TURN * u.x;
    vm near = gt(u.x, all(0)) & lt(vabs(u.y), reach) & lt(vabs(u.z), reach);
    vf sum = length + u.x;
    vf divisor = select(near, u.x + u.x, vsqrt((length + length) * sum));
    vm turns = gt(divisor, all(0));
    vf inverse = 1.0 / select(turns, divisor, all(1));
    vf ky = u.z * inverse, kz = -u.y * inverse;
    vf kw = select(near, 1.0 - 0.5 * (ky * ky + kz * kz), sum * inverse);
    return (quat){select(turns, kw, all(0)), {all(0), select(turns, ky, all(1)), select(turns, kz, all(0))}};
}

SV_INLINE deformation deform_small(v3 u, quat n, vf rest)
{
    return (deformation){{u.x - rest, u.y, u.z}, zero3(), scale3(rv_factor(n.w), n.v), n};
}

/* Lanes in the large regime measure along the line between the voxels, the others like deform_small. */
SV_INLINE deformation deform_mixed(vm large, v3 u, quat n, quat turn_a, vf rest)
{
    vf length = vsqrt(dot3(u, u));
    quat k = tilt_of(u, length), kn = after_tilt(k, n), bend = select_quat(large, kn, n);
    vf factor_a = rv_factor(k.w);
    v3 bend_a = {all(0), factor_a * k.v.y, factor_a * k.v.z};
    v3 d = {select(large, length, u.x) - rest, select(large, all(0), u.y), select(large, all(0), u.z)};
    return (deformation){d, select3(large, bend_a, zero3()), scale3(rv_factor(bend.w), bend.v),
                         select_quat(large, before_tilt_undone(turn_a, k), turn_a)};
}

/* Elastic force and moments plus their damping by the rates of d and the bends, all per step. */
SV_INLINE link_effect beam(const coefficients *k, v3 d, v3 a, v3 b, v3 d_rate, v3 a_rate, v3 b_rate)
{
    vf bend_y = a.y + b.y, bend_z = a.z + b.z, bend_y_rate = a_rate.y + b_rate.y, bend_z_rate = a_rate.z + b_rate.z;
    v3 force = {k->a1 * d.x + k->damp_a1 * d_rate.x,
                k->b1 * d.y - k->b2 * bend_z + (k->damp_b1 * d_rate.y - k->damp_b2 * bend_z_rate),
                k->b1 * d.z + k->b2 * bend_y + (k->damp_b1 * d_rate.z + k->damp_b2 * bend_y_rate)};
    vf torsion = k->a2 * (a.x - b.x) + k->turn_damp_a2 * (a_rate.x - b_rate.x);
    vf shear_z = k->b2 * d.z + k->turn_damp_b2 * d_rate.z, shear_y = k->b2 * d.y + k->turn_damp_b2 * d_rate.y;
    v3 moment_a = {torsion, shear_z + (k->b3 * (bend_y + a.y) + k->turn_damp_b3 * (bend_y_rate + a_rate.y)),
                   k->b3 * (bend_z + a.z) + k->turn_damp_b3 * (bend_z_rate + a_rate.z) - shear_y};
    v3 moment_b = {-torsion, shear_z + (k->b3 * (bend_y + b.y) + k->turn_damp_b3 * (bend_y_rate + b_rate.y)),
                   k->b3 * (bend_z + b.z) + k->turn_damp_b3 * (bend_z_rate + b_rate.z) - shear_y};
    return (link_effect){force, moment_a, moment_b};
}

/* The beam's effect, and its memory brought up to date. A lane that changed its regime on this step is
 * not damped and remembers what it did. */
SV_INLINE link_effect beam_with_memory(const coefficients *k, const deformation *now, link_memory *memory, vm changed)
{
    v3 d = memory->stretch, a = memory->bend_a, b = memory->bend_b;
    if (any(changed)) {
        memory->stretch = select3(changed, d, now->d);
        memory->bend_a = select3(changed, a, now->bend_a);
        memory->bend_b = select3(changed, b, now->bend_b);
        d = select3(changed, now->d, d);
        a = select3(changed, now->bend_a, a);
        b = select3(changed, now->bend_b, b);
    } else {
        memory->stretch = now->d;
        memory->bend_a = now->bend_a;
        memory->bend_b = now->bend_b;
    }
    return beam(k, now->d, now->bend_a, now->bend_b, sub3(now->d, d), sub3(now->bend_a, a), sub3(now->bend_b, b));
}

SV_INLINE link_effect to_world(const m3 *outward, int axis, link_effect e)
{
    return (link_effect){times(outward, out_of_link(axis, e.force)), times(outward, out_of_link(axis, e.moment_a)),
                         times(outward, out_of_link(axis, e.moment_b))};
}

/* One link along `axis` for one step. Returns the lanes in which it is stretched beyond all bounds. */
SV_INLINE vm link_step(const coefficients *k, vf broken, const voxel *va, const voxel *vb, int axis,
                       link_memory *memory, link_effect *effect)
{
    v3 u = into_link(axis, times_back(&va->axes, sub3(vb->place, va->place)));
    quat n = relative(va->turn, vb->turn);
    n.v = into_link(axis, n.v);
    vf rest = 0.5 * (va->edge + vb->edge);
    vm before = memory->large, large = next_regime(before, u, rest, n.w);
    memory->large = large;
    if (any(large)) {
        quat turn_a = {va->turn.w, into_link(axis, va->turn.v)};
        deformation now = deform_mixed(large, u, n, turn_a, rest);
        link_effect e = beam_with_memory(k, &now, memory, large ^ before);
        now.outward.v = out_of_link(axis, now.outward.v);
        m3 outward = matrix_of(now.outward);
        *effect = to_world(&outward, axis, e);
        return gt(now.d.x, broken);
    }
    deformation now = deform_small(u, n, rest);
    link_effect e = beam_with_memory(k, &now, memory, large ^ before);
    *effect = to_world(&va->axes, axis, e);
    return gt(now.d.x, broken);
}

#endif
