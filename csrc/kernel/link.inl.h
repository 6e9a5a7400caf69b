/* What a beam does to the two voxels that it joins. physics.md 4 */
#pragma once

#include "block.inl.h"

#define SV_SMALL_TURN 0.01732                /* rad, theta */
#define SV_COS_SMALL_TURN 0.9999625024343469 /* cos(theta / 2) */
#define SV_COS_LARGE_TURN 0.9999546280051071 /* cos(1.1 theta / 2) */
#define SV_DIVERGED_STRETCH 100.0            /* voxel widths; physics.md 8 */

/* How a link is bent: u is voxel b as voxel a sees it, n the relative rotation, d and the two bends what
 * they are measured by, all in the link's frame; `outward` leads from the link's frame back to the world. */
typedef struct {
    sv_vec3 d, bend_a, bend_b;
    sv_quat outward;
} sv_deformation;

/* To the frame in which the link points along x, and back. */
SV_INLINE sv_vec3 sv_into_link(sv_axis axis, sv_vec3 a)
{
    const sv_vec3 along_y = {a.y, -a.x, a.z}, along_z = {a.z, a.y, -a.x};
    if (axis.all == SV_MIXED)
        return sv_select3(axis.y, along_y, sv_select3(axis.z, along_z, a));
    return axis.all == 0 ? a : axis.all == 1 ? along_y : along_z;
}
SV_INLINE sv_vec3 sv_out_of_link(sv_axis axis, sv_vec3 a)
{
    const sv_vec3 along_y = {-a.y, a.x, a.z}, along_z = {-a.z, a.y, a.x};
    if (axis.all == SV_MIXED)
        return sv_select3(axis.y, along_y, sv_select3(axis.z, along_z, a));
    return axis.all == 0 ? a : axis.all == 1 ? along_y : along_z;
}

/* The regime, with hysteresis. A link folded past a right angle (u.x < 0) counts as not turned. */
SV_INLINE sv_mask sv_next_regime(sv_mask large, sv_vec3 u, sv_wide rest, sv_wide cos_half_turn)
{
    sv_wide aside = sv_abs(u.y) + sv_abs(u.z);
    sv_mask folded = sv_lt(u.x, sv_splat(0));
    sv_mask calm = sv_gt(cos_half_turn, sv_splat(SV_COS_SMALL_TURN)) & (sv_lt(aside, 0.05 * u.x) | folded) &
                   sv_lt(u.x, 1.3 * rest);
    sv_mask strained = sv_le(cos_half_turn, sv_splat(SV_COS_LARGE_TURN)) | (sv_gt(aside, 0.055 * u.x) & ~folded) |
                       sv_gt(u.x, 1.43 * rest);
    return (large & ~calm) | (~large & strained);
}

/* k, the rotation that takes u onto +x, for u of the given length. physics.md 7 */
SV_INLINE sv_quat sv_tilt(sv_vec3 u, sv_wide length)
{
    sv_wide reach = SV_SMALL_TURN * u.x;
    sv_mask near = sv_gt(u.x, sv_splat(0)) & sv_lt(sv_abs(u.y), reach) & sv_lt(sv_abs(u.z), reach);
    sv_wide sum = length + u.x;
    sv_wide divisor = sv_select(near, u.x + u.x, sv_sqrt((length + length) * sum));
    sv_mask turns = sv_gt(divisor, sv_splat(0));
    sv_wide inverse = 1.0 / sv_select(turns, divisor, sv_splat(1));
    sv_wide ky = u.z * inverse, kz = -u.y * inverse;
    sv_wide kw = sv_select(near, 1.0 - 0.5 * (ky * ky + kz * kz), sum * inverse);
    return (sv_quat){sv_select(turns, kw, sv_splat(0)),
                     {sv_splat(0), sv_select(turns, ky, sv_splat(1)), sv_select(turns, kz, sv_splat(0))}};
}

SV_INLINE sv_deformation sv_deform_small(sv_vec3 u, sv_quat n, sv_wide rest)
{
    return (sv_deformation){{u.x - rest, u.y, u.z}, sv_zero3(), sv_scale3(sv_rv_factor(n.w), n.v), n};
}

/* Lanes in the large regime measure along the line between the voxels, the others like deform_small. */
SV_INLINE sv_deformation sv_deform_mixed(sv_mask large, sv_vec3 u, sv_quat n, sv_quat turn_a, sv_wide rest)
{
    sv_wide length = sv_sqrt(sv_dot3(u, u));
    sv_quat k = sv_tilt(u, length), kn = sv_after_tilt(k, n), bend = sv_select_quat(large, kn, n);
    sv_wide factor_a = sv_rv_factor(k.w);
    sv_vec3 bend_a = {sv_splat(0), factor_a * k.v.y, factor_a * k.v.z};
    sv_vec3 d = {sv_select(large, length, u.x) - rest, sv_select(large, sv_splat(0), u.y),
                 sv_select(large, sv_splat(0), u.z)};
    return (sv_deformation){d, sv_select3(large, bend_a, sv_zero3()), sv_scale3(sv_rv_factor(bend.w), bend.v),
                            sv_select_quat(large, sv_undo_tilt(turn_a, k), turn_a)};
}

/* Elastic force and moments plus their damping by the rates of d and the bends, all per step. */
SV_INLINE sv_link_effect sv_beam(const sv_coefficients *k, sv_vec3 d, sv_vec3 a, sv_vec3 b, sv_vec3 d_rate,
                                 sv_vec3 a_rate, sv_vec3 b_rate)
{
    sv_wide bend_y = a.y + b.y, bend_z = a.z + b.z, bend_y_rate = a_rate.y + b_rate.y,
            bend_z_rate = a_rate.z + b_rate.z;
    sv_vec3 force = {k->a1 * d.x + k->damp_a1 * d_rate.x,
                     k->b1 * d.y - k->b2 * bend_z + (k->damp_b1 * d_rate.y - k->damp_b2 * bend_z_rate),
                     k->b1 * d.z + k->b2 * bend_y + (k->damp_b1 * d_rate.z + k->damp_b2 * bend_y_rate)};
    sv_wide torsion = k->a2 * (a.x - b.x) + k->turn_damp_a2 * (a_rate.x - b_rate.x);
    sv_wide shear_z = k->b2 * d.z + k->turn_damp_b2 * d_rate.z, shear_y = k->b2 * d.y + k->turn_damp_b2 * d_rate.y;
    sv_vec3 moment_a = {torsion, shear_z + (k->b3 * (bend_y + a.y) + k->turn_damp_b3 * (bend_y_rate + a_rate.y)),
                        k->b3 * (bend_z + a.z) + k->turn_damp_b3 * (bend_z_rate + a_rate.z) - shear_y};
    sv_vec3 moment_b = {-torsion, shear_z + (k->b3 * (bend_y + b.y) + k->turn_damp_b3 * (bend_y_rate + b_rate.y)),
                        k->b3 * (bend_z + b.z) + k->turn_damp_b3 * (bend_z_rate + b_rate.z) - shear_y};
    return (sv_link_effect){force, moment_a, moment_b, force.x};
}

/* The beam's effect, and its memory brought up to date. A lane that changed its regime on this step is
 * not damped and remembers what it did. */
SV_INLINE sv_link_effect sv_beam_with_memory(const sv_coefficients *k, const sv_deformation *now,
                                             sv_link_memory *memory, sv_mask changed)
{
    sv_vec3 d = memory->stretch, a = memory->bend_a, b = memory->bend_b;
    if (sv_any(changed)) {
        memory->stretch = sv_select3(changed, d, now->d);
        memory->bend_a = sv_select3(changed, a, now->bend_a);
        memory->bend_b = sv_select3(changed, b, now->bend_b);
        d = sv_select3(changed, now->d, d);
        a = sv_select3(changed, now->bend_a, a);
        b = sv_select3(changed, now->bend_b, b);
    } else {
        memory->stretch = now->d;
        memory->bend_a = now->bend_a;
        memory->bend_b = now->bend_b;
    }
    return sv_beam(k, now->d, now->bend_a, now->bend_b, sv_sub3(now->d, d), sv_sub3(now->bend_a, a),
                   sv_sub3(now->bend_b, b));
}

SV_INLINE sv_link_effect sv_to_world(const sv_mat3 *outward, sv_axis axis, sv_link_effect e)
{
    return (sv_link_effect){sv_apply(outward, sv_out_of_link(axis, e.force)),
                            sv_apply(outward, sv_out_of_link(axis, e.moment_a)),
                            sv_apply(outward, sv_out_of_link(axis, e.moment_b)), e.tension};
}

/* One link for one step, between voxels a and b; axes is the matrix of a's turn. Returns the lanes in which it is
 * stretched beyond all bounds. */
SV_INLINE sv_mask sv_link_step(const sv_coefficients *k, sv_wide broken, const sv_pose *a, const sv_mat3 *axes,
                               const sv_pose *b, sv_axis axis, sv_link_memory *memory, sv_link_effect *effect)
{
    sv_vec3 u = sv_into_link(axis, sv_apply_inverse(axes, sv_sub3(b->place, a->place)));
    sv_quat n = sv_relative(a->turn, b->turn);
    n.v = sv_into_link(axis, n.v);
    sv_wide rest = 0.5 * (a->edge + b->edge);
    sv_mask before = memory->large, large = sv_next_regime(before, u, rest, n.w);
    memory->large = large;
    if (sv_any(large)) {
        sv_quat turn_a = {a->turn.w, sv_into_link(axis, a->turn.v)};
        sv_deformation now = sv_deform_mixed(large, u, n, turn_a, rest);
        sv_link_effect e = sv_beam_with_memory(k, &now, memory, large ^ before);
        now.outward.v = sv_out_of_link(axis, now.outward.v);
        sv_mat3 outward = sv_matrix(now.outward);
        *effect = sv_to_world(&outward, axis, e);
        return sv_gt(now.d.x, broken);
    }
    sv_deformation now = sv_deform_small(u, n, rest);
    sv_link_effect e = sv_beam_with_memory(k, &now, memory, large ^ before);
    *effect = sv_to_world(axes, axis, e);
    return sv_gt(now.d.x, broken);
}
