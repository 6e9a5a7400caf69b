/* The pattern generator: the sine that drives the active voxels, and their strain cycle by cycle. physics.md 6.6 */
#pragma once

#include "block.inl.h"

#define SV_CYCLE_SLACK 1e-3  /* cycles by which actuation may begin before a whole turn and still count as on it */
#define SV_MOST_TURNS 0x1p50 /* beyond, a double no longer tells parts of a turn */

/* sin(2 pi x) for |x| < 2^51, by its Taylor series on a quarter turn (remainder below 1e-18). Our own, because
 * the last bits of a C library's sine differ between machines. */
SV_INLINE sv_wide sv_sine(sv_wide x)
{
    const double c[] = {6.283185307179586,   -41.34170224039976,    81.60524927607506,    -76.70585975306139,
                        42.058693944897655,  -15.09464257682299,    3.819952584848282,    -0.7181223017785006,
                        0.10422916220813984, -0.012031585942120627, 0.0011309237482517963};
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

/* Gives a voxel the strain of each lane's current cycle; past the last row, that row's. */
static void sv_load_strain(sv_block *b, int32_t v, sv_wide cycle)
{
    const sv_batch *batch = b->batch;
    size_t sites = (size_t)sv_sites(sv_lattice_of(batch)), site = (size_t)b->body.site[v];
    for (int lane = 0; lane < SV_LANES; lane++) {
        if (b->design[lane] < 0)
            continue;
        size_t design = (size_t)b->design[lane], row = (size_t)batch->cycles - 1;
        if (cycle[lane] < (double)row)
            row = cycle[lane] > 0 ? (size_t)cycle[lane] : 0;
        bool active = batch->digits[design * sites + site] == 2;
        b->voxels[v].strain[lane] = active ? batch->strain[(design * (size_t)batch->cycles + row) * sites + site] : 0;
    }
}

static void sv_pump_step(sv_block *b)
{
    sv_mask running = sv_ge(b->time, b->settle_time);
    for (int32_t i = 0; i < b->pump_count; i++) {
        sv_pump *p = &b->pumps[i];
        sv_wide turns = b->frequency * b->time + p->phase;
        p->sine = sv_select(running, sv_sine(turns), sv_splat(0));
        if (b->batch->cycles == 1)
            continue;
        sv_wide cycle = sv_floor(turns) - p->first_turn;
        if (!sv_any(sv_gt(cycle, p->cycle)))
            continue;
        p->cycle = cycle;
        if (b->pump_count > 1)
            sv_load_strain(b, i, cycle);
        else
            for (int32_t v = 0; v < b->body.voxels; v++)
                sv_load_strain(b, v, cycle);
    }
}
