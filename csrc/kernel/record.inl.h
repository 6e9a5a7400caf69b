/* What is read off a run: the centre of mass, its track, whole frames, and whether it diverged. physics.md 8 */
#pragma once

#include "block.inl.h"
#include "kernels.h"

#include <math.h>

static void sv_centre_of_mass(const sv_block *b, int lane, double centre[3])
{
    double x = 0, y = 0, z = 0;
    for (int32_t v = 0; v < b->body.voxels; v++) {
        if (!sv_lane_has(b, lane, v))
            continue;
        const sv_seat seat = sv_seat_of(b, lane, v);
        const sv_vec3 *place = &b->voxels[seat.row].pose.place;
        x += place->x[seat.lane];
        y += place->y[seat.lane];
        z += place->z[seat.lane];
    }
    centre[0] = x / b->voxel_count[lane];
    centre[1] = y / b->voxel_count[lane];
    centre[2] = z / b->voxel_count[lane];
}

static double sv_sample_time(const sv_block *b, int lane, int32_t sample)
{
    return b->settle_time[lane] + sample / (b->batch->track_per_cycle * b->frequency[lane]);
}

/* The time of a lane's next event. */
static double sv_next_event(const sv_block *b, int lane)
{
    const sv_clock *clock = &b->clock[lane];
    if (clock->ended)
        return INFINITY;
    if (!clock->measuring)
        return b->settle_time[lane];
    if (clock->sample < b->batch->track_samples)
        return fmin(sv_sample_time(b, lane, clock->sample), b->duration[lane]);
    return b->duration[lane];
}

/* Samples j at the first step after settle_time + j / (k f). The end of the run stands for all that are due by then. */
static void sv_record_track(sv_block *b, int lane, const double centre[3])
{
    sv_clock *clock = &b->clock[lane];
    double due = clock->ended ? b->duration[lane] + SV_SAMPLE_SLACK / b->frequency[lane] : b->time[lane];
    while (clock->sample < b->batch->track_samples && sv_sample_time(b, lane, clock->sample) < due) {
        size_t row = (size_t)b->design[lane] * (size_t)b->batch->track_samples + (size_t)clock->sample++;
        for (int i = 0; i < 3; i++)
            b->results->track[3 * row + (size_t)i] = centre[i] - clock->start[i];
    }
}

static void sv_record_lane(sv_block *b, int lane)
{
    sv_clock *clock = &b->clock[lane];
    double centre[3];
    sv_centre_of_mass(b, lane, centre);
    if (!clock->measuring) {
        clock->measuring = true;
        for (int i = 0; i < 3; i++)
            clock->start[i] = b->results->start[3 * b->design[lane] + i] = centre[i];
    }
    if (b->time[lane] > b->duration[lane]) {
        clock->ended = true;
        b->results->steps[b->design[lane]] = b->step;
        for (int i = 0; i < 3; i++)
            b->results->end[3 * b->design[lane] + i] = centre[i];
    }
    sv_record_track(b, lane, centre);
}

/* A lane is finite when every number that it carries from step to step is. */
static bool sv_lane_is_finite(const sv_block *b, int lane)
{
    double sum = 0;
    for (int32_t v = 0; v < b->body.voxels; v++) {
        if (!sv_lane_has(b, lane, v))
            continue;
        const sv_seat seat = sv_seat_of(b, lane, v);
        const sv_voxel *x = &b->voxels[seat.row];
        const sv_vec3 *of[] = {&x->pose.place, &x->velocity, &x->spin, &x->pose.turn.v};
        for (int i = 0; i < 4; i++)
            sum += 0.0 * of[i]->x[seat.lane] + 0.0 * of[i]->y[seat.lane] + 0.0 * of[i]->z[seat.lane];
        sum += 0.0 * x->pose.turn.w[seat.lane] + 0.0 * x->pose.edge[seat.lane];
    }
    return sum == 0.0;
}

static void sv_record_status(sv_block *b, int lane)
{
    const bool torn = b->is_across ? sv_any(b->diverged) : sv_lane(b->diverged, lane);
    if (torn || !sv_lane_is_finite(b, lane))
        b->results->status[b->design[lane]] = SV_DIVERGED;
}

static void sv_record_frame(const sv_block *b, int lane, int32_t row)
{
    const sv_batch *batch = b->batch;
    size_t sites = (size_t)sv_sites(sv_lattice_of(batch));
    double *frame =
        b->results->frames + ((size_t)b->design[lane] * (size_t)batch->frame_count + (size_t)row) * sites * 8;
    for (int32_t v = 0; v < b->body.voxels; v++) {
        if (!sv_lane_has(b, lane, v))
            continue;
        const sv_seat seat = sv_seat_of(b, lane, v);
        const sv_pose *x = &b->voxels[seat.row].pose;
        const double values[8] = {x->place.x[seat.lane],  x->place.y[seat.lane],  x->place.z[seat.lane],
                                  x->turn.w[seat.lane],   x->turn.v.x[seat.lane], x->turn.v.y[seat.lane],
                                  x->turn.v.z[seat.lane], x->edge[seat.lane]};
        for (int i = 0; i < 8; i++)
            frame[(size_t)b->body.site[v] * 8 + (size_t)i] = values[i];
    }
}

static bool sv_has_ended(const sv_block *b)
{
    bool all = true;
    for (int lane = 0; lane < SV_LANES; lane++)
        all = all && b->clock[lane].ended;
    return all;
}

/* Everything that is due at the start of a step. Returns whether all lanes have ended. */
static bool sv_record(sv_block *b)
{
    if (b->batch->frame_count && b->step % b->batch->frame_every == 0) {
        int32_t row = b->step / b->batch->frame_every;
        for (int lane = 0; lane < SV_LANES; lane++)
            if (b->design[lane] >= 0 && !b->clock[lane].ended && row < b->batch->frame_count)
                sv_record_frame(b, lane, row);
    }
    if (!sv_any(sv_gt(b->time, b->next_event)))
        return false;
    for (int lane = 0; lane < SV_LANES; lane++) {
        if (b->design[lane] >= 0 && !b->clock[lane].ended && b->time[lane] > b->next_event[lane]) {
            sv_record_lane(b, lane);
            b->next_event[lane] = sv_next_event(b, lane);
            if (b->clock[lane].ended)
                sv_record_status(b, lane);
        }
    }
    return sv_has_ended(b);
}
