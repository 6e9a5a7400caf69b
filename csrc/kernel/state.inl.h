/* All that changes in a run, to keep it and to go on from it: in the order of designs and sites, whatever the seating.
 */
#pragma once

#include "setup.inl.h"

static void sv_copy(double *kept, sv_wide *wide, int lane, bool out)
{
    if (out)
        *kept = (*wide)[lane];
    else
        (*wide)[lane] = *kept;
}

static void sv_copy3(double kept[3], sv_vec3 *wide, int lane, bool out)
{
    sv_copy(&kept[0], &wide->x, lane, out);
    sv_copy(&kept[1], &wide->y, lane, out);
    sv_copy(&kept[2], &wide->z, lane, out);
}

static void sv_copy_mask(double *kept, sv_mask *mask, int lane, bool out)
{
    if (out)
        *kept = sv_lane(*mask, lane);
    else
        *mask = sv_mask_of((sv_bits(*mask) & ~(1u << lane)) | (uint32_t)(*kept != 0) << lane);
}

static void sv_copy_clock(sv_block *b, int lane, double kept[SV_CLOCK], bool out)
{
    sv_clock *clock = &b->clock[lane];
    const bool torn = b->is_across ? sv_any(b->diverged) : sv_lane(b->diverged, lane);
    const double now[] = {b->step, clock->sample, clock->measuring, clock->ended, torn};
    for (int i = 0; i < 5 && out; i++)
        kept[1 + i] = now[i];
    if (!out) {
        b->step = (int32_t)kept[1];
        clock->sample = (int32_t)kept[2];
        clock->measuring = kept[3] != 0, clock->ended = kept[4] != 0;
    }
    sv_copy(&kept[0], &b->time, lane, out);
    sv_copy_mask(&kept[5], &b->diverged, lane, out);
    kept[5] = out ? torn : kept[5];
    sv_copy(&kept[6], &b->contacts.travel, lane, out);
    for (int i = 0; i < 3; i++)
        *(out ? &kept[7 + i] : &clock->start[i]) = out ? clock->start[i] : kept[7 + i];
    if (out)
        sv_centre_of_mass(b, lane, &kept[10]);
    sv_copy(&kept[13], &b->first_energy, lane, out);
    sv_copy(&kept[14], &b->gain, lane, out);
}

static void sv_copy_voxels(sv_block *b, int lane, double (*kept)[14], bool out)
{
    for (int32_t v = 0; v < b->body.voxels; v++) {
        if (!sv_lane_has(b, lane, v))
            continue;
        const sv_seat seat = sv_seat_of(b, lane, v);
        sv_voxel *x = &b->voxels[seat.row];
        double *row = kept[b->body.site[v]];
        sv_copy3(&row[0], &x->pose.place, seat.lane, out);
        sv_copy(&row[3], &x->pose.edge, seat.lane, out);
        sv_copy(&row[4], &x->pose.turn.w, seat.lane, out);
        sv_copy3(&row[5], &x->pose.turn.v, seat.lane, out);
        sv_copy3(&row[8], &x->velocity, seat.lane, out);
        sv_copy3(&row[11], &x->spin, seat.lane, out);
    }
}

static void sv_copy_links(sv_block *b, int lane, double (*kept)[3][10], bool out)
{
    for (int32_t l = 0; l < b->body.links; l++) {
        const sv_link *link = &b->body.link[l];
        if (!sv_lane_has(b, lane, link->a) || !sv_lane_has(b, lane, link->b))
            continue;
        const sv_seat seat = sv_seat_of(b, lane, b->is_across ? b->across.slot[l] : l);
        sv_link_memory *memory = &b->memory[seat.row];
        double *row = kept[b->body.site[link->a]][link->axis];
        sv_copy3(&row[0], &memory->stretch, seat.lane, out);
        sv_copy3(&row[3], &memory->bend_a, seat.lane, out);
        sv_copy3(&row[6], &memory->bend_b, seat.lane, out);
        sv_copy_mask(&row[9], &memory->large, seat.lane, out);
    }
}

static void sv_copy_surface(sv_block *b, int lane, double (*kept)[4], bool out)
{
    for (int32_t v = 0; v < b->body.voxels; v++) {
        if (!sv_lane_has(b, lane, v))
            continue;
        const sv_seat seat = sv_seat_of(b, lane, v);
        double *row = kept[b->body.site[v]];
        sv_copy3(&row[0], &b->contacts.spot[seat.row].place, seat.lane, out);
        sv_copy(&row[3], &b->contacts.spot[seat.row].edge, seat.lane, out);
    }
}

/* Brings what follows from the state up to date, once it was copied in. */
static void sv_resume(sv_block *b)
{
    for (int lane = 0; lane < SV_LANES; lane++) {
        const int from = b->is_across || b->design[lane] < 0 ? b->first : lane;
        b->time[lane] = b->time[from];
        b->contacts.travel[lane] = b->contacts.travel[from];
        b->next_event[lane] = sv_next_event(b, lane);
        if (b->step > 0 && b->contacts.lanes >> lane & 1)
            sv_make_list(b, lane);
    }
    for (int32_t row = 0; b->is_across && row < b->rows; row++)
        sv_write_pose(b, row);
}

static void sv_kernel_copy(void *memory, sv_state *state, bool out)
{
    sv_block *b = sv_block_at(memory);
    const size_t sites = (size_t)sv_sites(sv_lattice_of(b->batch));
    for (int lane = 0; lane < SV_LANES; lane++) {
        if (b->design[lane] < 0)
            continue;
        const size_t design = (size_t)b->design[lane], at = design * sites;
        if (state->clock)
            sv_copy_clock(b, lane, state->clock + design * SV_CLOCK, out);
        if (state->voxel)
            sv_copy_voxels(b, lane, (double (*)[14])(state->voxel + at * 14), out);
        if (state->link)
            sv_copy_links(b, lane, (double (*)[3][10])(state->link + at * 30), out);
        if (state->surface)
            sv_copy_surface(b, lane, (double (*)[4])(state->surface + at * 4), out);
    }
    if (!out && b->first >= 0)
        sv_resume(b);
}
