/* The kernel of each instruction set: one source, kernel/kernel.inl.h, compiled by one .c file each. */
#pragma once

#include "softvox.h"

#define SV_MOST_LANES 8

#define SV_MOST_APART                                                                                                  \
    512 /* voxels of a block whose designs have a lane each: the room for its pairs is their square                    \
         */

#define SV_SAMPLE_SLACK 1e-3 /* cycles by which the last sample of a track may lie past the end of the run */

typedef struct {
    const char *name;
    int32_t lanes;
    int64_t (*workspace_bytes)(const sv_batch *batch, const sv_plan *plan, uint8_t *scratch);
    int32_t (*run)(const sv_batch *batch, const sv_plan *plan, sv_results *results, sv_progress *progress,
                   void *workspace);
} sv_kernel;

extern const sv_kernel sv_kernel_portable, sv_kernel_avx2, sv_kernel_avx512;

/* The kernel of an instruction set, or NULL where this machine does not run it. */
const sv_kernel *sv_kernel_of(int32_t isa);
