/* The kernel of each instruction set: one source, kernel.h, compiled once per file kernel_*.c. */
#ifndef SV_KERNELS_H
#define SV_KERNELS_H

#include "softvox.h"

#define SV_DECLARE_KERNEL(name)                                                                                        \
    int64_t sv_kernel_bytes_##name(const sv_batch *batch);                                                             \
    int32_t sv_kernel_run_##name(const sv_batch *batch, const sv_plan *plan, sv_results *results,                      \
                                 sv_progress *progress, void *workspace);

#define SV_LANES_PORTABLE 2
#define SV_LANES_AVX2 4
#define SV_LANES_AVX512 8
#define SV_MOST_LANES 8

#define SV_SAMPLE_SLACK 1e-3 /* cycles by which the last sample of a track may lie past the end of the run */

SV_DECLARE_KERNEL(portable)
#if defined __x86_64__
SV_DECLARE_KERNEL(avx2)
SV_DECLARE_KERNEL(avx512)
#endif

#endif
