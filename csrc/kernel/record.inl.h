/* What is read off a run: the centre of mass, its track, whole frames, and whether it diverged. physics.md 8 */
#pragma once

#include "pump.inl.h"

#include <math.h>

#define SV_WATCH_EVERY 32    /* steps between looks at the energy */
#define SV_FASTEST_SHARE 0.2 /* of the speed of sound: what the pump can give a voxel at most */

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

/* Kinetic and potential energy of each lane's body over its mass, J/kg; of one body across the lanes, in the first. The
 * order of the sum is that of the voxels, whatever the seating. physics.md 8 */
static sv_wide sv_energy(const sv_block *b)
{
    const sv_vec3 gravity = sv_scale3(b->k.dt_over_mass / b->k.dt, b->k.weight);
    sv_wide sum = sv_splat(0);
    for (int32_t row = 0; row < b->rows; row++) {
        const sv_voxel *x = &b->voxels[row];
        sv_wide energy = 0.5 * sv_dot3(x->velocity, x->velocity) - sv_dot3(gravity, x->pose.place);
        energy = sv_select(b->has_voxel[row], energy, sv_splat(0));
        if (!b->is_across)
            sum = sum + energy;
        for (int lane = 0; b->is_across && lane < SV_LANES; lane++)
            sum[0] += energy[lane];
    }
    for (int lane = 0; lane < SV_LANES; lane++)
        sum[lane] /= b->voxel_count[lane];
    return sum;
}

/* The most that pump and gravity can add to the energy of a lane's body, J/kg. physics.md 8 */
static double sv_most_gain(const sv_block *b, int lane)
{
    const sv_batch *batch = b->batch;
    const double L = batch->edge, per_mass = b->k.dt_over_mass[lane] / b->k.dt[lane];
    const double sound = __builtin_sqrt(b->k.a1[lane] * per_mass); /* voxel widths/s */
    const double n = fmax(batch->nx, fmax(batch->ny, batch->nz));
    const size_t sites = (size_t)sv_sites(sv_lattice_of(batch)), design = (size_t)b->design[lane];
    double most = 0, jump = 0;
    for (size_t site = 0; site < sites; site++) {
        if (batch->digits[design * sites + site] != 2)
            continue;
        const double *strain = batch->strain + design * (size_t)batch->cycles * sites + site;
        for (size_t row = 0; row < (size_t)batch->cycles; row++)
            most = fmax(most, fabs(strain[row * sites]));
        const double phase = batch->phase ? batch->phase[design * sites + site] : 0;
        const double first = strain[0] * sv_sine(sv_splat(b->frequency[lane] * b->settle_time[lane] + phase))[0];
        jump = fmax(jump, batch->actuation == SV_EXPAND_AND_CONTRACT ? fabs(first) : first);
    }
    jump = batch->steered ? most : jump;
    const double x = b->k.weight.x[lane], y = b->k.weight.y[lane], z = b->k.weight.z[lane];
    const double fall = per_mass * __builtin_sqrt(x * x + y * y + z * z);
    const double push = fmax(SV_TURN * b->frequency[lane] * most, sound * jump);
    const double speed = n * L * fmin(push, SV_FASTEST_SHARE * sound);
    return 0.5 * n * L * (1 + most) * fall + 0.25 * speed * speed;
}

/* Takes up what the pump can give now, beside what it could before. */
static void sv_allow_energy(sv_block *b)
{
    for (int lane = 0; lane < SV_LANES; lane++)
        if (b->design[lane] >= 0)
            b->gain[lane] = fmax(b->gain[lane], sv_most_gain(b, lane));
}

/* A lane whose body has more energy than it can have come by since the measurement began has diverged. */
static void sv_watch_energy(sv_block *b)
{
    b->diverged |= sv_gt(sv_energy(b), b->first_energy + b->gain);
}

/* The pump's work on the links of a lane's design, J. */
static double sv_pump_work(const sv_block *b, int lane)
{
    double sum = 0;
    for (int32_t v = 0; v < b->body.voxels; v++) {
        const sv_seat seat = sv_seat_of(b, lane, v);
        if (sv_lane_has(b, lane, v))
            sum += b->meter.work[seat.row][seat.lane];
    }
    return 0.25 * sum;
}

static void sv_record_lane(sv_block *b, int lane)
{
    sv_clock *clock = &b->clock[lane];
    double centre[3];
    sv_centre_of_mass(b, lane, centre);
    if (!clock->measuring) {
        clock->measuring = true;
        b->first_energy[lane] = sv_energy(b)[lane];
        for (int i = 0; i < 3; i++)
            clock->start[i] = b->results->start[3 * b->design[lane] + i] = centre[i];
    }
    if (b->time[lane] > b->duration[lane]) {
        clock->ended = true;
        b->results->steps[b->design[lane]] = b->step;
        if (b->meter.work)
            b->results->energy[b->design[lane]] = sv_pump_work(b, lane);
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
    if (b->step % SV_WATCH_EVERY == 0)
        sv_watch_energy(b);
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
