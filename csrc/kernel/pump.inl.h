/* The pattern generator: the sine that drives the active voxels, and their strain cycle by cycle. physics.md 6.6 */
#pragma once

#include "block.inl.h"

#define SV_CYCLE_SLACK 1e-3       /* cycles by which actuation may begin before a whole turn and still count as on it */
#define SV_TURN 6.283185307179586 /* rad */
#define SV_MOST_TURNS 0x1p50      /* beyond, a double no longer tells parts of a turn */

/* sin(2 pi x) for |x| < 2^51, by its Taylor series on a quarter turn (remainder below 1e-18). Our own, because
 * the last bits of a C library's sine differ between machines. */
SV_INLINE sv_wide sv_sine(sv_wide x)
{
    const double c[] = {SV_TURN,
                        -41.34170224039976,
                        81.60524927607506,
                        -76.70585975306139,
                        42.058693944897655,
                        -15.09464257682299,
                        3.819952584848282,
                        -0.7181223017785006,
                        0.10422916220813984,
                        -0.012031585942120627,
                        0.0011309237482517963};
    sv_wide r = x - sv_round(x);
    r = sv_select(sv_gt(r, sv_splat(0.25)), 0.5 - r, r);
    r = sv_select(sv_lt(r, sv_splat(-0.25)), -0.5 - r, r);
    sv_wide square = r * r, sum = sv_splat(c[10]);
    for (int n = 9; n >= 0; n--)
        sum = sum * square + c[n];
    return r * sum;
}

SV_INLINE sv_wide sv_floor(sv_wide a)
{
    sv_wide n = sv_round(a);
    return sv_select(sv_gt(n, a), n - 1.0, n);
}

/* Which voxel of which design a lane of a row has. Returns false where it has none. */
SV_INLINE bool sv_resident(const sv_block *b, int32_t row, int lane, size_t *design, int32_t *voxel)
{
    const int32_t of = b->design[b->is_across ? 0 : lane];
    *design = (size_t)of;
    *voxel = b->is_across ? row * SV_LANES + lane : row;
    return of >= 0 && *voxel < b->body.voxels;
}

/* Gives a row of voxels the strain of each lane's current cycle; past the last row of strain, that row's. */
static void sv_load_strain(sv_block *b, int32_t row, sv_wide cycle)
{
    const sv_batch *batch = b->batch;
    const size_t sites = (size_t)sv_sites(sv_lattice_of(batch)), last = (size_t)batch->cycles - 1;
    for (int lane = 0; lane < SV_LANES; lane++) {
        size_t design, of = last;
        int32_t voxel;
        if (!sv_resident(b, row, lane, &design, &voxel))
            continue;
        if (cycle[lane] < (double)last)
            of = cycle[lane] > 0 ? (size_t)cycle[lane] : 0;
        const size_t site = (size_t)b->body.site[voxel];
        const bool active = batch->digits[design * sites + site] == 2;
        b->voxels[row].strain[lane] = active ? batch->strain[(design * (last + 1) + of) * sites + site] : 0;
    }
}

/* The sine, or the cycle, of the pumps that drive a row of voxels. */
SV_INLINE sv_wide sv_driven(const sv_block *b, int32_t row, bool cycle)
{
    const sv_pump *first = &b->pumps[!b->uses && b->pump_count > 1 ? row : 0];
    sv_wide value = cycle ? first->cycle : first->sine;
    for (int32_t p = 1; b->uses && p < b->pump_count; p++)
        value = sv_select(b->uses[row * b->pump_count + p], cycle ? b->pumps[p].cycle : b->pumps[p].sine, value);
    return value;
}

static void sv_pump_step(sv_block *b)
{
    sv_mask running = sv_ge(b->time, b->settle_time);
    bool next = false;
    for (int32_t i = 0; i < b->pump_count; i++) {
        sv_pump *p = &b->pumps[i];
        sv_wide turns = b->frequency * b->time + p->phase;
        p->sine = sv_select(running, sv_sine(turns), sv_splat(0));
        if (b->batch->cycles == 1)
            continue;
        sv_wide cycle = sv_floor(turns) - p->first_turn;
        next = next || sv_any(sv_gt(cycle, p->cycle));
        p->cycle = cycle;
    }
    for (int32_t row = 0; next && row < b->rows; row++)
        sv_load_strain(b, row, sv_driven(b, row, true));
}
