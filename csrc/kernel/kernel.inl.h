/* The run of one block, and of block after block until none is left. The .c file of each instruction set includes
 * this once, after it has chosen its intrinsics, SV_LANES, SV_ISA_NAME and SV_KERNEL, the name of its kernel. */
#include "contact.inl.h"
#include "kernels.h"
#include "link.inl.h"
#include "record.inl.h"
#include "pump.inl.h"
#include "setup.inl.h"
#include "voxel.inl.h"

SV_INLINE void sv_links_along(sv_block *b, int axis, sv_wide broken, bool masked)
{
    for (int32_t i = b->body.first_link[axis]; i < b->body.first_link[axis + 1]; i++) {
        const sv_link *link = &b->body.link[i];
        sv_link_effect *e = &b->effect[i];
        sv_mask torn = sv_link_step(&b->k, broken, &b->voxels[link->a], &b->voxels[link->b], axis, &b->memory[i], e);
        if (masked) {
            sv_mask here = b->has_link[i];
            e->force = sv_select3(here, e->force, sv_zero3());
            e->moment_a = sv_select3(here, e->moment_a, sv_zero3());
            e->moment_b = sv_select3(here, e->moment_b, sv_zero3());
            torn &= here;
        }
        b->diverged |= torn;
    }
}

/* One step: links, collisions, voxels, each from the end of the step before. physics.md 3 */
SV_INLINE void sv_step(sv_block *b, bool masked)
{
    const sv_wide broken = sv_splat(SV_DIVERGED_STRETCH * b->batch->edge);
    for (int axis = 0; axis < 3; axis++)
        sv_links_along(b, axis, broken, masked);
    sv_contact_step(b);
    sv_pump_step(b);
    for (int32_t v = 0; v < b->body.voxels; v++)
        sv_voxel_step(b, v);
    b->time = b->time + b->k.dt;
    b->step++;
}

static bool sv_is_cancelled(const sv_progress *progress)
{
    return __atomic_load_n(&progress->cancel, __ATOMIC_RELAXED) != 0;
}

SV_INLINE bool sv_run_lanes(sv_block *b, const sv_progress *progress, bool masked)
{
    while (!sv_record(b)) {
        if (sv_is_cancelled(progress))
            return false;
        sv_step(b, masked);
    }
    return true;
}

/* Returns false when it was cancelled. */
static bool sv_run_block(sv_block *b, const sv_progress *progress)
{
    return b->masked ? sv_run_lanes(b, progress, true) : sv_run_lanes(b, progress, false);
}

static int64_t sv_kernel_bytes(const sv_batch *batch)
{
    sv_arena arena = sv_arena_in(NULL);
    sv_block counted;
    sv_take(&arena, 1, sizeof counted);
    sv_block_take(&counted, batch, &arena);
    sv_take(&arena, (size_t)sv_sites(sv_lattice_of(batch)), 1);
    return (int64_t)sv_arena_bytes(&arena);
}

/* Runs blocks that no thread has taken. Returns false when it was cancelled. */
static bool sv_run_blocks(sv_block *b, const sv_plan *plan, sv_progress *progress, uint8_t *occupied)
{
    while (!sv_is_cancelled(progress)) {
        int32_t next = __atomic_fetch_add(&progress->next_block, 1, __ATOMIC_RELAXED);
        if (next >= plan->blocks)
            return true;
        const int32_t *order = plan->order + (size_t)next * SV_LANES;
        if (sv_set_block(b, order, occupied) && !sv_run_block(b, progress))
            return false;
        int32_t designs = 0;
        for (int lane = 0; lane < SV_LANES; lane++)
            designs += order[lane] >= 0;
        __atomic_fetch_add(&progress->done, designs, __ATOMIC_RELAXED);
    }
    return false;
}

static int32_t sv_kernel_run(const sv_batch *batch, const sv_plan *plan, sv_results *results, sv_progress *progress,
                             void *workspace)
{
    sv_arena arena = sv_arena_in(workspace);
    sv_block *b = sv_take(&arena, 1, sizeof *b);
    sv_block_take(b, batch, &arena);
    uint8_t *occupied = sv_take(&arena, (size_t)sv_sites(sv_lattice_of(batch)), 1);
    b->batch = batch;
    b->results = results;
    bool finished = sv_run_blocks(b, plan, progress, occupied);
    sv_give_back(&arena);
    return finished ? SV_DONE : SV_CANCELLED;
}

const sv_kernel SV_KERNEL = {SV_ISA_NAME, SV_LANES, sv_kernel_bytes, sv_kernel_run};
