/* Voxels of a design that touch without a link between them. physics.md 5 */
#pragma once

#include "block.inl.h"

#define SV_LIST_TRAVEL 0.5    /* voxel widths after which the list is made anew */
#define SV_CONTACT_SHARE 0.75 /* of the two edges: the distance at which two voxels touch */

/* The lanes, of those that are due, in which voxels i < j belong on the list. */
static uint32_t sv_close_lanes(const sv_block *b, int32_t i, int32_t j, sv_mask due)
{
    const sv_voxel *vi = &b->voxels[i], *vj = &b->voxels[j];
    const sv_vec3 r = sv_sub3(vj->place, vi->place);
    const sv_wide square = sv_dot3(r, r), reach = sv_splat(3.0 * b->batch->edge), twice_edge = 2.0 * vi->edge;
    uint32_t near = sv_bits(sv_lt(square, reach * reach) & sv_lt(square, twice_edge * twice_edge) & due), close = 0;
    for (int lane = 0; near >> lane; lane++)
        if ((near >> lane & 1) && sv_may_collide(sv_vicinity_of(b, lane), b->body.site[i], b->body.site[j]))
            close |= 1u << lane;
    return close;
}

/* Makes the list anew for the lanes that are due: their old pairs go, those that are close now come,
 * in order of i, j. */
static void sv_update_pairs(sv_block *b, sv_mask due)
{
    sv_contacts *contacts = &b->contacts;
    const sv_pair *old = contacts->pair, *old_end = old + contacts->count;
    sv_pair *next = contacts->spare;
    const uint32_t others = ~sv_bits(due);
    for (int32_t i = 0; i < b->body.voxels; i++) {
        for (int32_t j = i + 1; j < b->body.voxels; j++) {
            sv_pair c = {i, j, sv_close_lanes(b, i, j, due)};
            if (old < old_end && old->a == i && old->b == j)
                c.lanes |= old++->lanes & others;
            if (c.lanes)
                *next++ = c;
        }
    }
    contacts->count = (int32_t)(next - contacts->spare);
    contacts->spare = contacts->pair;
    contacts->pair = next - contacts->count;
}

/* Adds up how far the fastest voxel has come, and makes the list anew where that is too far. */
static void sv_track_travel(sv_block *b)
{
    sv_contacts *contacts = &b->contacts;
    sv_wide fastest = sv_splat(0);
    for (int32_t v = 0; v < b->body.voxels; v++) {
        sv_wide square = sv_dot3(b->voxels[v].velocity, b->voxels[v].velocity);
        sv_mask faster = sv_gt(square, fastest);
        fastest = sv_select(b->masked ? faster & b->has_voxel[v] : faster, square, fastest);
    }
    contacts->travel = contacts->travel + sv_sqrt(fastest) * b->k.dt / b->batch->edge;
    sv_mask due = sv_gt(contacts->travel, sv_splat(SV_LIST_TRAVEL));
    contacts->travel = sv_select(due, sv_splat(0), contacts->travel);
    const sv_mask may_collide = sv_mask_of(contacts->lanes);
    due = b->step == 0 ? may_collide : due & may_collide;
    if (sv_any(due))
        sv_update_pairs(b, due);
}

static void sv_push_apart(sv_block *b, const sv_pair *c)
{
    const sv_voxel *a = &b->voxels[c->a], *other = &b->voxels[c->b];
    sv_vec3 r = sv_sub3(other->place, a->place);
    sv_wide square = sv_dot3(r, r), reach = SV_CONTACT_SHARE * (a->edge + other->edge);
    sv_mask touching = sv_lt(square, reach * reach) & sv_gt(square, sv_splat(0)) & sv_mask_of(c->lanes);
    if (!sv_any(touching))
        return;
    sv_wide length = sv_sqrt(sv_select(touching, square, sv_splat(1)));
    sv_wide push = sv_select(touching, b->k.a1 * (reach - length) / length, sv_splat(0));
    sv_vec3 force = sv_scale3(push, sv_select3(touching, r, sv_zero3()));
    b->contacts.push[c->a] = sv_sub3(b->contacts.push[c->a], force);
    b->contacts.push[c->b] = sv_add3(b->contacts.push[c->b], force);
}

static void sv_contact_step(sv_block *b)
{
    if (!b->contacts.lanes)
        return;
    sv_track_travel(b);
    if (!b->contacts.count)
        return;
    for (int32_t v = 0; v < b->body.voxels; v++)
        b->contacts.push[v] = sv_zero3();
    for (int32_t c = 0; c < b->contacts.count; c++)
        sv_push_apart(b, &b->contacts.pair[c]);
}
