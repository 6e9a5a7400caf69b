#define SV_LANES 2
#define SV_ISA_NAME "portable"
#define SV_KERNEL sv_kernel_portable
#include "kernel.inl.h"
