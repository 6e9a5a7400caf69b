/* A step of designs that have a lane each: every link and voxel is a row of its own. */
#pragma once

#include "link.inl.h"
#include "voxel.inl.h"

SV_INLINE void sv_link_apart(sv_block *b, int32_t i, const sv_mat3 *axes, int32_t axis, sv_wide broken)
{
    const sv_link *link = &b->body.link[i];
    sv_link_effect *e = &b->effect[i];
    sv_mask torn = sv_link_step(&b->k, broken, &b->voxels[link->a].pose, axes, &b->voxels[link->b].pose,
                                (sv_axis){.all = axis}, &b->memory[i], e);
    if (b->masked) {
        sv_mask here = b->has_link[i];
        e->force = sv_select3(here, e->force, sv_zero3());
        e->moment_a = sv_select3(here, e->moment_a, sv_zero3());
        e->moment_b = sv_select3(here, e->moment_b, sv_zero3());
        e->tension = sv_select(here, e->tension, sv_splat(0));
        torn &= here;
    }
    b->diverged |= torn;
}

/* Force and moment on a voxel from its links. */
SV_INLINE void sv_gather(const sv_block *b, const sv_joints *joints, sv_vec3 *force, sv_vec3 *moment)
{
    sv_vec3 f = sv_zero3(), m = sv_zero3();
    for (int32_t i = joints->first; i < joints->first + joints->starting; i++) {
        f = sv_add3(f, b->effect[i].force);
        m = sv_sub3(m, b->effect[i].moment_a);
    }
    for (int32_t i = 0; i < joints->ending; i++) {
        f = sv_sub3(f, b->effect[joints->end[i]].force);
        m = sv_sub3(m, b->effect[joints->end[i]].moment_b);
    }
    *force = f;
    *moment = m;
}

/* How hard its links pull at a voxel, all together. */
SV_INLINE sv_wide sv_gather_tension(const sv_block *b, const sv_joints *joints)
{
    sv_wide sum = sv_splat(0);
    for (int32_t i = joints->first; i < joints->first + joints->starting; i++)
        sum = sum + b->effect[i].tension;
    for (int32_t i = 0; i < joints->ending; i++)
        sum = sum + b->effect[joints->end[i]].tension;
    return sum;
}

/* A voxel moves right after the links that start at it, while they are at hand; those that end at it came before. */
SV_INLINE void sv_move_apart(sv_block *b, sv_wide broken)
{
    for (int32_t v = 0; v < b->body.voxels; v++) {
        const sv_joints *joints = &b->body.joints[v];
        const sv_mat3 axes = sv_matrix(b->voxels[v].pose.turn);
        for (int32_t i = joints->first; i < joints->first + joints->starting; i++) {
            switch (b->body.link[i].axis) {
            case 0:
                sv_link_apart(b, i, &axes, 0, broken);
                break;
            case 1:
                sv_link_apart(b, i, &axes, 1, broken);
                break;
            default:
                sv_link_apart(b, i, &axes, 2, broken);
            }
        }
        sv_vec3 force, moment;
        sv_gather(b, joints, &force, &moment);
        sv_voxel_step(b, v, force, moment, b->meter.work ? sv_gather_tension(b, joints) : sv_splat(0));
    }
}
