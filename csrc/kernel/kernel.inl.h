/* The run of one block. The .c file of each instruction set includes
 * this once, after it has chosen its intrinsics, SV_LANES, SV_ISA_NAME and SV_KERNEL, the name of its kernel. */
#include "apart.inl.h"
#include "setup.inl.h"
#include "state.inl.h"

/* One step: collisions, links, voxels, each from the end of the step before. physics.md 3 */
SV_INLINE void sv_step(sv_block *b, bool is_across)
{
    const sv_wide broken = sv_splat(SV_DIVERGED_STRETCH * b->batch->edge);
    sv_contact_step(b);
    sv_pump_step(b);
    if (is_across)
        sv_move_across(b, broken);
    else
        sv_move_apart(b, broken);
    b->time = b->time + b->k.dt;
    b->step++;
}

typedef struct {
    const sv_progress *progress;
    double until; /* s */
    int32_t steps;
} sv_goal;

SV_INLINE bool sv_run_seated(sv_block *b, const sv_goal *goal, bool is_across)
{
    const int32_t last = goal->steps < INT32_MAX - b->step ? b->step + goal->steps : INT32_MAX;
    const int lane = b->first;
    while (!sv_record(b) && b->step < last && !(b->time[lane] > goal->until)) {
        if (__atomic_load_n(&goal->progress->cancel, __ATOMIC_RELAXED))
            return false;
        sv_step(b, is_across);
    }
    return true;
}

static bool sv_kernel_advance(void *memory, const sv_progress *progress, const double *until, int32_t steps)
{
    sv_block *b = sv_block_at(memory);
    if (sv_has_ended(b))
        return true;
    const sv_goal goal = {progress, until ? until[b->design[b->first]] : INFINITY, steps};
    return b->is_across ? sv_run_seated(b, &goal, true) : sv_run_seated(b, &goal, false);
}

const sv_kernel SV_KERNEL = {SV_ISA_NAME,     SV_LANES,          sv_kernel_bytes,   sv_kernel_open,
                             sv_kernel_close, sv_kernel_actuate, sv_kernel_advance, sv_kernel_copy};
