/* Checks a batch and hands it to the kernel of an instruction set. */
#include "body.h"
#include "kernels.h"

#include <math.h>
#include <stddef.h>

static const int32_t sv_most_sites = 1 << 20;

const char *sv_batch_error(const sv_batch *b)
{
    if (b->n < 0)
        return "n is negative";
    if (b->nx < 1 || b->ny < 1 || b->nz < 1)
        return "the lattice has no sites";
    if ((int64_t)b->nx * b->ny > sv_most_sites || (int64_t)b->nx * b->ny * b->nz > sv_most_sites)
        return "the lattice has more than 2^20 sites";
    if (!isfinite(b->edge) || b->edge <= 0)
        return "edge is not a positive number";
    if (!isfinite(b->pumped_rest) || b->pumped_rest <= 0)
        return "pumped_rest is not a positive number";
    if (!isfinite(b->settle_time) || b->settle_time < 0)
        return "settle_time is negative or not finite";
    if (b->actuation < SV_HOLD || b->actuation > SV_EXPAND_AND_CONTRACT)
        return "actuation is none of the three modes";
    if (b->cycles < 1)
        return "strain has no cycles";
    if (b->track_samples < 0 || (b->track_samples && b->track_per_cycle < 1))
        return "the track has a negative number of samples, or none per cycle";
    if (b->frame_count < 0 || (b->frame_count && b->frame_every < 1))
        return "there is a negative number of frames, or of steps between them";
    if (!b->digits || !b->parameters || !b->strain)
        return "digits, parameters or strain is missing";
    return NULL;
}

static const int32_t *sv_row_of(const sv_plan *plan, int32_t block)
{
    return plan->order + (size_t)block * (size_t)plan->lanes;
}

static bool sv_is_cancelled(const sv_progress *progress)
{
    return __atomic_load_n(&progress->cancel, __ATOMIC_RELAXED) != 0;
}

/* Takes a block that no thread has taken. Returns false where there is none, or the work was cancelled. */
static bool sv_take_block(const sv_plan *plan, sv_progress *progress, int32_t *block)
{
    if (sv_is_cancelled(progress))
        return false;
    *block = __atomic_fetch_add(&progress->next_block, 1, __ATOMIC_RELAXED);
    return *block < plan->blocks;
}

static void sv_count_done(const sv_plan *plan, int32_t block, sv_progress *progress)
{
    int32_t designs = 0;
    for (int32_t lane = 0; lane < plan->lanes; lane++)
        designs += sv_row_of(plan, block)[lane] >= 0;
    __atomic_fetch_add(&progress->done, designs, __ATOMIC_RELAXED);
}

int64_t sv_block_bytes(const sv_batch *batch, const sv_plan *plan, int32_t block, int32_t isa, void *scratch)
{
    const sv_kernel *kernel = sv_kernel_of(isa);
    return kernel && kernel->lanes == plan->lanes ? kernel->bytes(batch, sv_row_of(plan, block), scratch) : 0;
}

int64_t sv_workspace_bytes(const sv_batch *batch, const sv_plan *plan, int32_t isa, void *scratch)
{
    int64_t most = 0;
    for (int32_t block = 0; block < plan->blocks; block++) {
        const int64_t bytes = sv_block_bytes(batch, plan, block, isa, scratch);
        most = bytes > most ? bytes : most;
    }
    return most;
}

int32_t sv_run(const sv_batch *batch, const sv_plan *plan, sv_results *results, sv_progress *progress, void *workspace,
               int32_t isa)
{
    const sv_kernel *kernel = sv_kernel_of(isa);
    if (!kernel || plan->lanes != kernel->lanes)
        return SV_NO_SUCH_ISA;
    if (sv_batch_error(batch))
        return SV_BAD_BATCH;
    for (int32_t block; sv_take_block(plan, progress, &block);) {
        kernel->open(batch, sv_row_of(plan, block), results, workspace);
        kernel->actuate(workspace);
        if (kernel->advance(workspace, progress, NULL, INT32_MAX))
            sv_count_done(plan, block, progress);
        kernel->close(workspace);
    }
    return sv_is_cancelled(progress) ? SV_CANCELLED : SV_DONE;
}

int32_t sv_start(const sv_batch *batch, const sv_plan *plan, sv_results *results, void *const *blocks, int32_t isa)
{
    const sv_kernel *kernel = sv_kernel_of(isa);
    if (!kernel || plan->lanes != kernel->lanes)
        return SV_NO_SUCH_ISA;
    if (sv_batch_error(batch) || !plan->in_step || batch->energy)
        return SV_BAD_BATCH;
    for (int32_t block = 0; block < plan->blocks; block++)
        kernel->open(batch, sv_row_of(plan, block), results, blocks[block]);
    return SV_DONE;
}

int32_t sv_advance(const sv_plan *plan, sv_progress *progress, void *const *blocks, const double *until, int32_t steps,
                   int32_t isa)
{
    const sv_kernel *kernel = sv_kernel_of(isa);
    if (!kernel || plan->lanes != kernel->lanes)
        return SV_NO_SUCH_ISA;
    for (int32_t block; sv_take_block(plan, progress, &block);) {
        kernel->actuate(blocks[block]);
        if (kernel->advance(blocks[block], progress, until, steps))
            sv_count_done(plan, block, progress);
    }
    return sv_is_cancelled(progress) ? SV_CANCELLED : SV_DONE;
}

static int32_t sv_copy_state(const sv_plan *plan, void *const *blocks, sv_state *state, int32_t isa, bool out)
{
    const sv_kernel *kernel = sv_kernel_of(isa);
    if (!kernel || plan->lanes != kernel->lanes)
        return SV_NO_SUCH_ISA;
    for (int32_t block = 0; block < plan->blocks; block++)
        kernel->copy(blocks[block], state, out);
    return SV_DONE;
}

int32_t sv_get_state(const sv_plan *plan, void *const *blocks, sv_state *state, int32_t isa)
{
    return sv_copy_state(plan, blocks, state, isa, true);
}

int32_t sv_set_state(const sv_plan *plan, void *const *blocks, sv_state *state, int32_t isa)
{
    return sv_copy_state(plan, blocks, state, isa, false);
}

int32_t sv_step_count(double time_step, double duration)
{
    if (!(time_step > 0 && duration / time_step < INT32_MAX))
        return -1;
    int32_t steps = 0;
    for (double time = 0; time <= duration; time += time_step)
        steps++;
    return steps;
}

double sv_track_samples(double cycles, int32_t per_cycle)
{
    return floor((cycles + SV_SAMPLE_SLACK) * per_cycle) + 1;
}
