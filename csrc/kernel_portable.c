#include "kernels.h"

#define SV_LANES SV_LANES_PORTABLE
#define SV_KERNEL portable
#include "kernel.h"
