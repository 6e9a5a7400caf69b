/* A step of one body whose voxels and links lie across the lanes. */
#pragma once

#include "link.inl.h"
#include "voxel.inl.h"

SV_INLINE sv_pose sv_read_pose(const sv_line *lines, const int32_t voxel[SV_LANES])
{
    sv_wide n[8];
    sv_load_lines(lines, voxel, n);
    return (sv_pose){{n[0], n[1], n[2]}, n[3], {n[4], {n[5], n[6], n[7]}}};
}

/* Shows a row of voxels to the links and collisions of the next step. */
SV_INLINE void sv_write_pose(sv_block *b, int32_t row)
{
    const sv_pose *p = &b->voxels[row].pose;
    sv_wide n[8] = {p->place.x, p->place.y, p->place.z, p->edge, p->turn.w, p->turn.v.x, p->turn.v.y, p->turn.v.z};
    sv_store_lines(&b->across.pose[row * SV_LANES], n);
}

SV_INLINE void sv_link_row_along(sv_block *b, int32_t row, sv_axis axis, sv_wide broken)
{
    sv_across *x = &b->across;
    const sv_link_row *link = &x->link[row];
    const sv_pose pose_a = sv_read_pose(x->pose, link->a), pose_b = sv_read_pose(x->pose, link->b);
    const sv_mat3 axes = sv_matrix(pose_a.turn);
    sv_link_effect e;
    b->diverged |= sv_link_step(&b->k, broken, &pose_a, &axes, &pose_b, axis, &b->memory[row], &e);
    sv_wide on_a[8] = {e.force.x, e.force.y, e.force.z, -e.moment_a.x, -e.moment_a.y, -e.moment_a.z, e.tension};
    sv_wide on_b[8] = {-e.force.x, -e.force.y, -e.force.z, -e.moment_b.x, -e.moment_b.y, -e.moment_b.z, e.tension};
    const int32_t line = row * SV_LANES & (x->lines - 1);
    sv_store_lines(&x->effect[line], on_a);
    sv_store_lines(&x->effect[x->lines + line], on_b);
}

SV_INLINE void sv_link_row_step(sv_block *b, int32_t row, sv_wide broken)
{
    const sv_axis axis = b->across.link[row].axis;
    switch (axis.all) {
    case 0:
        sv_link_row_along(b, row, (sv_axis){.all = 0}, broken);
        break;
    case 1:
        sv_link_row_along(b, row, (sv_axis){.all = 1}, broken);
        break;
    case 2:
        sv_link_row_along(b, row, (sv_axis){.all = 2}, broken);
        break;
    default:
        sv_link_row_along(b, row, (sv_axis){SV_MIXED, axis.y, axis.z}, broken);
    }
}

/* Force and moment on a row of voxels from their links, and how hard these pull: six lines each, of zeros where there
 * is no link. */
SV_INLINE void sv_add_lines(const sv_across *x, int32_t row, sv_vec3 *force, sv_vec3 *moment, sv_wide *tension)
{
    sv_wide sum[8];
    for (int part = 0; part < 8 / SV_LANES; part++) {
        for (int lane = 0; lane < SV_LANES; lane++) {
            const int32_t *adds = x->adds[row * SV_LANES + lane];
            sv_wide added = sv_splat(0);
            for (int i = 0; i < 6; i++)
                added = added + x->effect[adds[i]].part[part];
            sum[part * SV_LANES + lane] = added;
        }
        sv_transpose(sum + part * SV_LANES);
    }
    *force = (sv_vec3){sum[0], sum[1], sum[2]};
    *moment = (sv_vec3){sum[3], sum[4], sum[5]};
    *tension = sum[6];
}

/* A row of voxels moves right after the links that start at it, while they are at hand. */
SV_INLINE void sv_move_across(sv_block *b, sv_wide broken)
{
    for (int32_t row = 0, link = 0; row < b->rows; row++) {
        for (; link < b->across.links_end[row]; link++)
            sv_link_row_step(b, link, broken);
        sv_vec3 force, moment;
        sv_wide tension;
        sv_add_lines(&b->across, row, &force, &moment, &tension);
        sv_voxel_step(b, row, force, moment, tension);
        sv_write_pose(b, row);
    }
}
