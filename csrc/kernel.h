/* The run of one block, and of block after block until none is left. Each kernel_*.c includes this once,
 * after it has chosen SV_LANES, an instruction set and SV_KERNEL, the suffix of the two functions' names. */
#include "collide.h"
#include "kernels.h"
#include "link.h"
#include "measure.h"
#include "pump.h"
#include "setup.h"
#include "voxel.h"

#define SV_JOIN_(a, b) a##b
#define SV_JOIN(a, b) SV_JOIN_(a, b)

SV_INLINE void links_along(block *b, int axis, vf broken, bool masked)
{
    for (int32_t i = b->body.first_link[axis]; i < b->body.first_link[axis + 1]; i++) {
        const sv_link *link = &b->body.link[i];
        link_effect *e = &b->effect[i];
        vm torn = link_step(&b->k, broken, &b->voxels[link->a], &b->voxels[link->b], axis, &b->memory[i], e);
        if (masked) {
            vm here = b->has_link[i];
            e->force = select3(here, e->force, zero3());
            e->moment_a = select3(here, e->moment_a, zero3());
            e->moment_b = select3(here, e->moment_b, zero3());
            torn &= here;
        }
        b->diverged |= torn;
    }
}

/* One step: links, collisions, voxels, each from the end of the step before. physics.md 3 */
SV_INLINE void step(block *b, bool masked)
{
    const vf broken = all(SV_DIVERGED_STRETCH * b->batch->edge);
    for (int axis = 0; axis < 3; axis++)
        links_along(b, axis, broken, masked);
    collide(b);
    pump_step(b);
    for (int32_t v = 0; v < b->body.voxels; v++)
        voxel_step(b, v);
    b->time = b->time + b->k.dt;
    b->step++;
}

static bool is_cancelled(const sv_progress *progress)
{
    return __atomic_load_n(&progress->cancel, __ATOMIC_RELAXED) != 0;
}

SV_INLINE bool run_lanes(block *b, const sv_progress *progress, bool masked)
{
    while (!look(b)) {
        if (is_cancelled(progress))
            return false;
        step(b, masked);
    }
    return true;
}

/* Returns false when it was cancelled. */
static bool run_block(block *b, const sv_progress *progress)
{
    return b->masked ? run_lanes(b, progress, true) : run_lanes(b, progress, false);
}

int64_t SV_JOIN(sv_kernel_bytes_, SV_KERNEL)(const sv_batch *batch)
{
    sv_arena arena = sv_arena_in(NULL);
    block counted;
    sv_take(&arena, 1, sizeof counted);
    take_block(&counted, batch, &arena);
    sv_take(&arena, (size_t)sv_sites(lattice_of(batch)), 1);
    return (int64_t)sv_arena_bytes(&arena);
}

/* Runs blocks that nobody has taken. Returns false when it was cancelled. */
static bool run_blocks(block *b, const sv_plan *plan, sv_progress *progress, uint8_t *occupied)
{
    while (!is_cancelled(progress)) {
        int32_t next = __atomic_fetch_add(&progress->next_block, 1, __ATOMIC_RELAXED);
        if (next >= plan->blocks)
            return true;
        const int32_t *order = plan->order + (size_t)next * SV_LANES;
        if (set_block(b, order, occupied) && !run_block(b, progress))
            return false;
        int32_t designs = 0;
        for (int lane = 0; lane < SV_LANES; lane++)
            designs += order[lane] >= 0;
        __atomic_fetch_add(&progress->done, designs, __ATOMIC_RELAXED);
    }
    return false;
}

int32_t SV_JOIN(sv_kernel_run_, SV_KERNEL)(const sv_batch *batch, const sv_plan *plan, sv_results *results,
                                           sv_progress *progress, void *workspace)
{
    sv_arena arena = sv_arena_in(workspace);
    block *b = sv_take(&arena, 1, sizeof *b);
    take_block(b, batch, &arena);
    uint8_t *occupied = sv_take(&arena, (size_t)sv_sites(lattice_of(batch)), 1);
    b->batch = batch;
    b->results = results;
    bool finished = run_blocks(b, plan, progress, occupied);
    sv_give_back(&arena);
    return finished ? SV_DONE : SV_CANCELLED;
}
