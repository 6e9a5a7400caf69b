/* Voxels of a design that touch without a link between them. physics.md 5 */
#pragma once

#include "across.inl.h"
#include "surface.inl.h"

#define SV_LIST_TRAVEL 0.5    /* voxel widths after which the list is made anew */
#define SV_CONTACT_SHARE 0.75 /* of the two edges: the distance at which two voxels touch */

/* Lists the pairs of a lane's surface from the point `listed` on: the lane's old pairs go, those of other lanes stay,
 * in order of a, b. Across the lanes there may be no room for all. */
static void sv_list_pairs(sv_block *b, int lane)
{
    sv_contacts *c = &b->contacts;
    const uint32_t bit = 1u << lane;
    const sv_pair *old = c->pair, *old_end = old + c->count;
    sv_pair *next = c->spare;
    c->surface.gathered = NULL;
    for (; c->listed < c->surface.count; c->listed++) {
        const int32_t partners = sv_find_partners(b, lane, c->listed);
        if (partners > c->room - (next - c->spare))
            break;
        for (int32_t i = 0; i < partners; i++) {
            sv_pair pair = {c->surface.point[c->listed].voxel, c->surface.found[i], bit};
            for (; old < old_end && (old->a < pair.a || (old->a == pair.a && old->b < pair.b)); old++)
                if (old->lanes & ~bit)
                    *next++ = (sv_pair){old->a, old->b, old->lanes & ~bit};
            if (old < old_end && old->a == pair.a && old->b == pair.b)
                pair.lanes |= old++->lanes;
            *next++ = pair;
        }
    }
    for (; old < old_end; old++)
        if (old->lanes & ~bit)
            *next++ = (sv_pair){old->a, old->b, old->lanes & ~bit};
    c->count = (int32_t)(next - c->spare);
    next = c->spare;
    c->spare = c->pair;
    c->pair = next;
}

/* Makes a lane's list anew from where its voxels were. */
static void sv_make_list(sv_block *b, int lane)
{
    sv_contacts *contacts = &b->contacts;
    sv_take_surface(b, lane);
    contacts->listed = 0;
    contacts->count = b->is_across ? 0 : contacts->count;
    sv_list_pairs(b, lane);
    contacts->is_whole = contacts->listed == contacts->surface.count;
}

/* Adds up how far the fastest voxel has come, and returns the lanes in which that is so far that their list is due. */
static sv_mask sv_track_travel(sv_block *b)
{
    sv_contacts *contacts = &b->contacts;
    sv_wide fastest = sv_splat(0);
    for (int32_t row = 0; row < b->rows; row++) {
        sv_wide square = sv_dot3(b->voxels[row].velocity, b->voxels[row].velocity);
        fastest = sv_select(sv_gt(square, fastest) & b->has_voxel[row], square, fastest);
    }
    for (int lane = 1; b->is_across && lane < SV_LANES; lane++)
        fastest[0] = fastest[lane] > fastest[0] ? fastest[lane] : fastest[0];
    contacts->travel = contacts->travel + sv_sqrt(fastest) * b->k.dt / b->batch->edge;
    sv_mask due = sv_gt(contacts->travel, sv_splat(SV_LIST_TRAVEL));
    contacts->travel = sv_select(due, sv_splat(0), contacts->travel);
    const sv_mask may_collide = sv_mask_of(contacts->lanes);
    return b->step == 0 ? may_collide : due & may_collide;
}

/* The lanes, of those given, in which two voxels touch, and the force on the second. */
SV_INLINE sv_mask sv_touch(sv_wide stiffness, const sv_pose *a, const sv_pose *b, sv_mask lanes, sv_vec3 *force)
{
    sv_vec3 r = sv_sub3(b->place, a->place);
    sv_wide square = sv_dot3(r, r), reach = SV_CONTACT_SHARE * (a->edge + b->edge);
    sv_mask touching = sv_lt(square, reach * reach) & sv_gt(square, sv_splat(0)) & lanes;
    if (!sv_any(touching))
        return touching;
    sv_wide length = sv_sqrt(sv_select(touching, square, sv_splat(1)));
    sv_wide push = sv_select(touching, stiffness * (reach - length) / length, sv_splat(0));
    *force = sv_scale3(push, sv_select3(touching, r, sv_zero3()));
    return touching;
}

static void sv_push_lanes(sv_block *b, const sv_pair *c)
{
    sv_contacts *contacts = &b->contacts;
    sv_vec3 force;
    if (!sv_any(sv_touch(b->k.a1, &b->voxels[c->a].pose, &b->voxels[c->b].pose, sv_mask_of(c->lanes), &force)))
        return;
    contacts->push[c->a] = sv_sub3(contacts->push[c->a], force);
    contacts->push[c->b] = sv_add3(contacts->push[c->b], force);
    contacts->pushed[c->a] = contacts->pushed[c->b] = 1;
}

/* Adds to the push on one voxel of a row. */
SV_INLINE void sv_push_voxel(sv_contacts *contacts, int32_t v, double x, double y, double z)
{
    const int32_t row = v / SV_LANES, lane = v % SV_LANES;
    contacts->push[row].x[lane] += x;
    contacts->push[row].y[lane] += y;
    contacts->push[row].z[lane] += z;
    contacts->pushed[row] = 1;
}

/* Pairs first ... first + SV_LANES - 1 of one body, or as many as are listed, a pair per lane. */
static void sv_push_row(sv_block *b, int32_t first)
{
    sv_contacts *contacts = &b->contacts;
    int32_t a[SV_LANES], other[SV_LANES];
    uint32_t lanes = 0;
    for (int lane = 0; lane < SV_LANES; lane++) {
        const bool listed = first + lane < contacts->count;
        const sv_pair *pair = &contacts->pair[listed ? first + lane : first];
        a[lane] = pair->a, other[lane] = pair->b;
        lanes |= (uint32_t)listed << lane;
    }
    const sv_pose pose_a = sv_read_pose(b->across.pose, a), pose_b = sv_read_pose(b->across.pose, other);
    sv_vec3 f;
    const uint32_t touching = sv_bits(sv_touch(b->k.a1, &pose_a, &pose_b, sv_mask_of(lanes), &f));
    for (int lane = 0; touching >> lane; lane++) {
        if (touching >> lane & 1) {
            sv_push_voxel(contacts, a[lane], -f.x[lane], -f.y[lane], -f.z[lane]);
            sv_push_voxel(contacts, other[lane], f.x[lane], f.y[lane], f.z[lane]);
        }
    }
}

static void sv_push_pairs(sv_block *b)
{
    if (b->is_across)
        for (int32_t c = 0; c < b->contacts.count; c += SV_LANES)
            sv_push_row(b, c);
    else
        for (int32_t c = 0; c < b->contacts.count; c++)
            sv_push_lanes(b, &b->contacts.pair[c]);
}

static void sv_contact_step(sv_block *b)
{
    sv_contacts *contacts = &b->contacts;
    if (!contacts->lanes)
        return;
    const uint32_t due = sv_bits(sv_track_travel(b));
    for (int lane = 0; due >> lane; lane++) {
        if (due >> lane & 1) {
            sv_mark_spots(b, lane);
            sv_make_list(b, lane);
        }
    }
    if (contacts->is_whole) {
        sv_push_pairs(b);
        return;
    }
    for (contacts->listed = 0; contacts->listed < contacts->surface.count;) {
        contacts->count = 0;
        sv_list_pairs(b, 0);
        sv_push_pairs(b);
    }
}
