/* The pattern generator: the sine that drives the active voxels, and their strain cycle by cycle. physics.md 6.6 */
#ifndef SV_PUMP_H
#define SV_PUMP_H

#include "block.h"
#include "sine.h"

#define SV_CYCLE_SLACK 1e-3 /* cycles by which actuation may begin before a whole turn and still count as on it */

SV_INLINE vf whole_below(vf a)
{
    vf n = nearest(a);
    return select(gt(n, a), n - 1.0, n);
}

/* Gives a voxel the strain of each lane's current cycle; past the last row, that row's. */
static void load_strain(block *b, int32_t v, vf cycle)
{
    const sv_batch *batch = b->batch;
    size_t sites = (size_t)sv_sites(lattice_of(batch)), site = (size_t)b->body.site[v];
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

static void pump_step(block *b)
{
    vm running = ge(b->time, b->settle_time);
    for (int32_t i = 0; i < b->pump_count; i++) {
        pump *p = &b->pumps[i];
        vf turns = b->frequency * b->time + p->phase;
        p->sine = select(running, sine_of_turns(turns), all(0));
        if (b->batch->cycles == 1)
            continue;
        vf cycle = whole_below(turns) - p->first_turn;
        if (!any(gt(cycle, p->cycle)))
            continue;
        p->cycle = cycle;
        if (b->pump_count > 1)
            load_strain(b, i, cycle);
        else
            for (int32_t v = 0; v < b->body.voxels; v++)
                load_strain(b, v, cycle);
    }
}

#endif
