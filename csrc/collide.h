/* Voxels of a design that touch without a link between them. physics.md 5 */
#ifndef SV_COLLIDE_H
#define SV_COLLIDE_H

#include "block.h"

#define SV_LIST_TRAVEL 0.5    /* voxel widths after which the list is made anew */
#define SV_CONTACT_SHARE 0.75 /* of the two edges: the distance at which two voxels touch */

/* The lanes, of those that are due, in which voxels i < j belong on the list. */
static uint32_t close_lanes(const block *b, int32_t i, int32_t j, vm due)
{
    const voxel *vi = &b->voxels[i], *vj = &b->voxels[j];
    const v3 r = sub3(vj->place, vi->place);
    const vf square = dot3(r, r), reach = all(3.0 * b->batch->edge), twice_edge = 2.0 * vi->edge;
    uint32_t near = bits_of(lt(square, reach * reach) & lt(square, twice_edge * twice_edge) & due), close = 0;
    for (int lane = 0; near >> lane; lane++)
        if ((near >> lane & 1) && sv_may_collide(vicinity_of(b, lane), b->body.site[i], b->body.site[j]))
            close |= 1u << lane;
    return close;
}

/* Makes the list anew for the lanes that are due: their old pairs go, those that are close now come,
 * in order of i, j. */
static void relist(block *b, vm due)
{
    collisions *hits = &b->hits;
    const candidate *old = hits->pair, *old_end = old + hits->count;
    candidate *next = hits->spare;
    const uint32_t others = ~bits_of(due);
    for (int32_t i = 0; i < b->body.voxels; i++) {
        for (int32_t j = i + 1; j < b->body.voxels; j++) {
            candidate c = {i, j, close_lanes(b, i, j, due)};
            if (old < old_end && old->a == i && old->b == j)
                c.lanes |= old++->lanes & others;
            if (c.lanes)
                *next++ = c;
        }
    }
    hits->count = (int32_t)(next - hits->spare);
    hits->spare = hits->pair;
    hits->pair = next - hits->count;
}

/* Adds up how far the fastest voxel has come, and makes the list anew where that is too far. */
static void keep_list(block *b)
{
    collisions *hits = &b->hits;
    vf fastest = all(0);
    for (int32_t v = 0; v < b->body.voxels; v++) {
        vf square = dot3(b->voxels[v].velocity, b->voxels[v].velocity);
        vm faster = gt(square, fastest);
        fastest = select(b->masked ? faster & b->has_voxel[v] : faster, square, fastest);
    }
    hits->travel = hits->travel + vsqrt(fastest) * b->k.dt / b->batch->edge;
    vm due = gt(hits->travel, all(SV_LIST_TRAVEL));
    hits->travel = select(due, all(0), hits->travel);
    const vm may_collide = lanes_of_bits(hits->lanes);
    due = b->step == 0 ? may_collide : due & may_collide;
    if (any(due))
        relist(b, due);
}

static void push_apart(block *b, const candidate *c)
{
    const voxel *a = &b->voxels[c->a], *other = &b->voxels[c->b];
    v3 r = sub3(other->place, a->place);
    vf square = dot3(r, r), reach = SV_CONTACT_SHARE * (a->edge + other->edge);
    vm touching = lt(square, reach * reach) & gt(square, all(0)) & lanes_of_bits(c->lanes);
    if (!any(touching))
        return;
    vf length = vsqrt(select(touching, square, all(1)));
    vf push = select(touching, b->k.a1 * (reach - length) / length, all(0));
    v3 force = scale3(push, select3(touching, r, zero3()));
    b->hits.push[c->a] = sub3(b->hits.push[c->a], force);
    b->hits.push[c->b] = add3(b->hits.push[c->b], force);
}

static void collide(block *b)
{
    if (!b->hits.lanes)
        return;
    keep_list(b);
    if (!b->hits.count)
        return;
    for (int32_t v = 0; v < b->body.voxels; v++)
        b->hits.push[v] = zero3();
    for (int32_t c = 0; c < b->hits.count; c++)
        push_apart(b, &b->hits.pair[c]);
}

#endif
