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

int64_t sv_workspace_bytes(const sv_batch *batch, const sv_plan *plan, int32_t isa, void *scratch)
{
    const sv_kernel *kernel = sv_kernel_of(isa);
    return kernel ? kernel->workspace_bytes(batch, plan, scratch) : 0;
}

int32_t sv_run(const sv_batch *batch, const sv_plan *plan, sv_results *results, sv_progress *progress, void *workspace,
               int32_t isa)
{
    const sv_kernel *kernel = sv_kernel_of(isa);
    if (!kernel || plan->lanes != kernel->lanes)
        return SV_NO_SUCH_ISA;
    if (sv_batch_error(batch))
        return SV_BAD_BATCH;
    return kernel->run(batch, plan, results, progress, workspace);
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
