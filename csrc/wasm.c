/* The way into the engine for a browser's thread: a batch of designs that share one physics. */
#if defined __wasm__

#include "kernels.h"

#include <math.h>
#include <stdlib.h>

#define SV_EXPORT(name) __attribute__((export_name(#name)))
#define SV_HEAD 2         /* rows of each track, frames of each design */
#define SV_FACTS 8        /* per design: status, steps, start 3, end 3 */
#define SV_MOST_BYTES 1e9 /* of results */

/* What the designs share. */
typedef struct {
    double edge, pumped_rest, settle_time;
    sv_parameters parameters;
} sv_physics;

SV_EXPORT(take) void *sv_take_memory(int32_t bytes)
{
    return malloc((size_t)bytes);
}

SV_EXPORT(give_back) void sv_give_memory_back(void *memory)
{
    free(memory);
}

/* Plans a batch and runs it. Returns whether there was memory for it. */
static bool sv_run_alone(const sv_batch *batch, sv_results *results)
{
    sv_plan plan = {.lanes = sv_isa_lanes(SV_ISA_PORTABLE)};
    sv_progress progress = {.cancel = 0};
    void *scratch = malloc((size_t)sv_plan_scratch(batch)), *workspace = NULL;
    plan.order = malloc((size_t)batch->n * (size_t)plan.lanes * sizeof *plan.order);
    if (scratch && plan.order && sv_plan_batch(batch, &plan, scratch) == SV_DONE)
        workspace = malloc((size_t)sv_workspace_bytes(batch, &plan, SV_ISA_PORTABLE, scratch));
    const bool done = workspace && sv_run(batch, &plan, results, &progress, workspace, SV_ISA_PORTABLE) == SV_DONE;
    free(workspace);
    free(plan.order);
    free(scratch);
    return done;
}

/* The numbers of all designs at `out`, which has room for them. */
static bool sv_fill(sv_batch *batch, const sv_parameters *shared, double *out)
{
    const size_t count = (size_t)batch->n, samples = (size_t)batch->track_samples;
    sv_parameters *parameters = malloc(count * sizeof *parameters);
    int32_t *counts = calloc(count * 2, sizeof *counts);
    double *ends = malloc(count * 6 * sizeof *ends), *track = out + count * SV_FACTS;
    bool done = parameters && counts && ends;
    if (done) {
        for (size_t i = 0; i < count; i++)
            parameters[i] = *shared;
        for (size_t i = 0; i < count * 6; i++)
            ends[i] = NAN;
        batch->parameters = parameters;
        sv_results results = {.status = counts,
                              .steps = counts + count,
                              .start = ends,
                              .end = ends + count * 3,
                              .track = track,
                              .frames = track + count * samples * 3};
        done = !sv_batch_error(batch) && sv_run_alone(batch, &results);
        for (size_t i = 0; i < count; i++, out += SV_FACTS) {
            out[0] = results.status[i], out[1] = results.steps[i];
            for (size_t k = 0; k < 3; k++)
                out[2 + k] = results.start[i * 3 + k], out[5 + k] = results.end[i * 3 + k];
        }
    }
    free(ends);
    free(counts);
    free(parameters);
    return done;
}

/* Simulates n designs; strain and phase are of every site, phase perhaps NULL. Returns doubles to give back, or NULL
 * for a batch that can't be: SV_HEAD, then [n][SV_FACTS], then the track and the frames as sv_results has them. */
SV_EXPORT(simulate)
double *sv_simulate(const sv_physics *physics, int32_t actuation, int32_t nx, int32_t ny, int32_t nz, int32_t n,
                    const uint8_t *digits, const double *strain, const double *phase, int32_t track_per_cycle,
                    int32_t frame_every)
{
    const sv_parameters *p = &physics->parameters;
    const double cycles = (p->duration - physics->settle_time) * p->frequency_hz;
    const double samples = track_per_cycle ? sv_track_samples(cycles, track_per_cycle) : 0;
    const double frames = frame_every ? sv_step_count(p->time_step, p->duration) / frame_every + 1 : 0;
    const double numbers = SV_HEAD + (double)n * (SV_FACTS + 3 * samples + 8 * frames * nx * ny * nz);
    double *out = numbers * sizeof *out < SV_MOST_BYTES ? malloc((size_t)numbers * sizeof *out) : NULL;
    if (!out)
        return NULL;
    for (size_t i = 0; i < (size_t)numbers; i++)
        out[i] = NAN;
    out[0] = samples, out[1] = frames;
    sv_batch batch = {.nx = nx,
                      .ny = ny,
                      .nz = nz,
                      .n = n,
                      .edge = physics->edge,
                      .pumped_rest = physics->pumped_rest,
                      .settle_time = physics->settle_time,
                      .actuation = actuation,
                      .cycles = 1,
                      .track_per_cycle = track_per_cycle,
                      .track_samples = (int32_t)samples,
                      .frame_every = frame_every,
                      .frame_count = (int32_t)frames,
                      .digits = digits,
                      .strain = strain,
                      .phase = phase};
    if (sv_fill(&batch, p, out + SV_HEAD))
        return out;
    free(out);
    return NULL;
}

#endif
