/* The run of one block, and of block after block until none is left. The .c file of each instruction set includes
 * this once, after it has chosen its intrinsics, SV_LANES, SV_ISA_NAME and SV_KERNEL, the name of its kernel. */
#include "apart.inl.h"
#include "setup.inl.h"

/* One step: collisions, links, voxels, each from the end of the step before. physics.md 3 */
SV_INLINE void sv_step(sv_block *b, bool is_across, bool masked)
{
    const sv_wide broken = sv_splat(SV_DIVERGED_STRETCH * b->batch->edge);
    sv_contact_step(b);
    sv_pump_step(b);
    if (is_across)
        sv_move_across(b, broken);
    else
        sv_move_apart(b, broken, masked);
    b->time = b->time + b->k.dt;
    b->step++;
}

static bool sv_is_cancelled(const sv_progress *progress)
{
    return __atomic_load_n(&progress->cancel, __ATOMIC_RELAXED) != 0;
}

SV_INLINE bool sv_run_seated(sv_block *b, const sv_progress *progress, bool is_across, bool masked)
{
    while (!sv_record(b)) {
        if (sv_is_cancelled(progress))
            return false;
        sv_step(b, is_across, masked);
    }
    return true;
}

/* Returns false when it was cancelled. */
static bool sv_run_block(sv_block *b, const sv_progress *progress)
{
    if (b->is_across)
        return sv_run_seated(b, progress, true, false);
    return b->masked ? sv_run_seated(b, progress, false, true) : sv_run_seated(b, progress, false, false);
}

/* Takes the memory of a block; where there is none, counts it with the help of a byte per site. */
static sv_block *sv_block_in(sv_arena *arena, const sv_batch *batch, const int32_t *order, uint8_t *occupied)
{
    sv_block counted, *b = sv_take(arena, 1, sizeof *b);
    sv_unite_designs(batch, order, occupied);
    sv_block_take(b ? b : &counted, batch, sv_size_of(sv_lattice_of(batch), occupied), sv_is_across(order), arena);
    return b;
}

/* What the largest block of a plan takes, and a byte per site. */
static int64_t sv_kernel_bytes(const sv_batch *batch, const sv_plan *plan, uint8_t *occupied)
{
    size_t most = 0;
    for (int32_t block = 0; block < plan->blocks; block++) {
        sv_arena arena = sv_arena_in(NULL);
        sv_take(&arena, (size_t)sv_sites(sv_lattice_of(batch)), 1);
        sv_block_in(&arena, batch, plan->order + (size_t)block * SV_LANES, occupied);
        most = sv_arena_bytes(&arena) > most ? sv_arena_bytes(&arena) : most;
    }
    return (int64_t)most;
}

/* Runs one block of a plan in the memory of an arena. Returns false when it was cancelled. */
static bool sv_run_row(const sv_batch *batch, const int32_t *order, sv_results *results, const sv_progress *progress,
                       sv_arena arena, uint8_t *occupied)
{
    sv_block *b = sv_block_in(&arena, batch, order, occupied);
    b->batch = batch;
    b->results = results;
    const bool finished = !sv_set_block(b, order, occupied) || sv_run_block(b, progress);
    sv_give_back(&arena);
    return finished;
}

/* Runs blocks that no thread has taken. */
static int32_t sv_kernel_run(const sv_batch *batch, const sv_plan *plan, sv_results *results, sv_progress *progress,
                             void *workspace)
{
    sv_arena arena = sv_arena_in(workspace);
    uint8_t *occupied = sv_take(&arena, (size_t)sv_sites(sv_lattice_of(batch)), 1);
    while (!sv_is_cancelled(progress)) {
        const int32_t next = __atomic_fetch_add(&progress->next_block, 1, __ATOMIC_RELAXED);
        if (next >= plan->blocks)
            return SV_DONE;
        const int32_t *order = plan->order + (size_t)next * SV_LANES;
        if (!sv_run_row(batch, order, results, progress, arena, occupied))
            return SV_CANCELLED;
        int32_t designs = 0;
        for (int lane = 0; lane < SV_LANES; lane++)
            designs += order[lane] >= 0;
        __atomic_fetch_add(&progress->done, designs, __ATOMIC_RELAXED);
    }
    return SV_CANCELLED;
}

const sv_kernel SV_KERNEL = {SV_ISA_NAME, SV_LANES, sv_kernel_bytes, sv_kernel_run};
