/* The kernel of each instruction set: one source, kernel/kernel.inl.h, compiled by one .c file each. */
#pragma once

#include "softvox.h"

#include <stdbool.h>

#define SV_MOST_LANES 8

/* Voxels of a block whose designs have a lane each, at most: the room for its pairs grows with their square. */
#define SV_MOST_APART 2048

#define SV_SAMPLE_SLACK 1e-3 /* cycles by which the last sample of a track may lie past the end of the run */

typedef struct {
    const char *name;
    int32_t lanes;
    /* What a block of a plan's row takes, with the help of a byte per site. */
    int64_t (*bytes)(const sv_batch *batch, const int32_t *order, uint8_t *scratch);
    /* Sets a block up in so much memory. */
    void (*open)(const sv_batch *batch, const int32_t *order, sv_results *results, void *memory);
    void (*close)(void *memory);
    /* Gives voxels the strain and the phases that the batch has now. */
    void (*actuate)(void *memory);
    /* Runs on, at most so many steps and to the first time past until[design]. Returns false when it was cancelled. */
    bool (*advance)(void *memory, const sv_progress *progress, const double *until, int32_t steps);
    /* Copies what changes to where it is asked for, or from there. */
    void (*copy)(void *memory, sv_state *state, bool out);
} sv_kernel;

extern const sv_kernel sv_kernel_portable, sv_kernel_avx2, sv_kernel_avx512;

/* The kernel of an instruction set, or NULL where this machine does not run it. */
const sv_kernel *sv_kernel_of(int32_t isa);
