/* softvox: a beam-lattice simulator of soft voxel robots, for batches of designs.
 *
 * SI units everywhere: m, kg, s, N, rad. The caller owns all memory. There are no globals, no I/O
 * and no random numbers: the same batch gives the same bits on every machine, instruction set,
 * thread count and grouping. */
#ifndef SOFTVOX_H
#define SOFTVOX_H

#include <stdint.h>

/* What lies between the two marks is read by the Python binding as it stands: plain C, no macros. */
/* [binding */

/* How an active voxel's edge follows its pump, target = L + L strain sin(2 pi (f t + phase)). */
enum {
    SV_HOLD = 0,               /* below L the edge keeps the last value that was above it */
    SV_CLAMP = 1,              /* the edge is max(target, L) */
    SV_EXPAND_AND_CONTRACT = 2 /* the edge is the target */
};

/* What became of a design. */
enum { SV_OK = 0, SV_DIVERGED = 1 };

/* What a call returns: 0, or why it did nothing. */
enum { SV_DONE = 0, SV_CANCELLED = 1, SV_BAD_BATCH = 2, SV_NO_SUCH_ISA = 3 };

/* Instruction sets, narrowest first. */
enum { SV_ISA_PORTABLE = 0, SV_ISA_AVX2 = 1, SV_ISA_AVX512 = 2, SV_ISA_COUNT = 3 };

/* The parameters that each design of a batch has of its own. */
typedef struct {
    double youngs_modulus;   /* Pa */
    double poisson_ratio;    /* 1 */
    double density;          /* kg/m^3 */
    double friction_static;  /* 1 */
    double friction_kinetic; /* 1 */
    double shear_strength;   /* Pa, interfacial; adds shear_strength * edge^2 to both friction limits */
    double gravity[3];       /* m/s^2; a tilted floor is a tilted gravity */
    double damping_link;     /* ratio */
    double damping_ground;   /* ratio */
    double damping_global;   /* ratio */
    double frequency_hz;     /* Hz */
    double time_step;        /* s */
    double duration;         /* s */
} sv_parameters;

/* A batch of designs on one lattice. Site (x, y, z) has index x + nx (y + ny z). */
typedef struct {
    int32_t nx, ny, nz;
    int32_t n;                       /* designs */
    double edge;                     /* m, resting edge of a voxel */
    double pumped_rest;              /* m, edge that an actuated voxel swings about; edge, or edge rounded */
    double settle_time;              /* s, actuation and measuring start here */
    int32_t actuation;               /* SV_HOLD, SV_CLAMP or SV_EXPAND_AND_CONTRACT */
    int32_t cycles;                  /* rows of strain per design, at least 1; the last row holds */
    int32_t track_per_cycle;         /* samples of the centre of mass per cycle */
    int32_t track_samples;           /* rows of the track, 0 for none */
    int32_t frame_every;             /* steps between frames */
    int32_t frame_count;             /* rows of the frames, 0 for none */
    int32_t steered;                 /* 1 where strain and phase may jump at any time */
    int32_t energy;                  /* 1 to measure the pump's work; of runs that don't pause */
    const uint8_t *digits;           /* [n][sites] 0 absent, 1 passive, 2 active */
    const sv_parameters *parameters; /* [n] */
    const double *strain;            /* [n][cycles][sites] amplitude; only active voxels use it */
    const double *phase;             /* [n][sites] cycles, or NULL for zero */
    const int32_t *resumed;          /* [n] steps that designs had taken, -1 where one could not run; NULL at a start */
} sv_batch;

/* Results, written design by design; rows that a design never reaches stay as they were. */
typedef struct {
    int32_t *status; /* [n] SV_OK or SV_DIVERGED */
    int32_t *steps;  /* [n] steps taken */
    double *start;   /* [n][3] m, centre of mass at the first step after settle_time */
    double *end;     /* [n][3] m, centre of mass at the first step after duration */
    double *track;   /* [n][track_samples][3] m from start, or NULL */
    double *energy;  /* [n] J, the pump's work on the links; or NULL */
    double *frames;  /* [n][frame_count][sites][8] m, 1, m: position, quaternion wxyz, edge; or NULL */
} sv_results;

/* How designs are seated, at least two lanes each row. */
enum { SV_BY_TIME = 0, SV_ALL_APART = 1, SV_ALL_ACROSS = 2 };
enum { SV_NO_DESIGN = -1, SV_ACROSS = -2 };

/* Designs that run together, a design per lane: lane l of block b is order[b * lanes + l], or SV_NO_DESIGN. Where
 * the second of a row is SV_ACROSS, the block is the first alone, its voxels across the lanes. */
typedef struct {
    int32_t lanes;
    int32_t blocks;
    int32_t seating; /* SV_BY_TIME, or the one to plan for all that can have it */
    int32_t in_step; /* 1: a block's designs have the same time step, frequency and duration, so that they can pause */
    int32_t *order;  /* [n][lanes] */
} sv_plan;

/* Shared by the threads that work on one batch; start with zeros. */
typedef struct {
    int32_t next_block; /* the next block that no thread has taken */
    int32_t done;       /* designs finished */
    int32_t cancel;     /* set it to 1 and the workers stop soon */
} sv_progress;

/* Whether this machine runs an instruction set, and the name (else "unknown") and lanes (else 0) of one that it runs.
 */
int32_t sv_isa_supported(int32_t isa);
const char *sv_isa_name(int32_t isa);
int32_t sv_isa_lanes(int32_t isa);

/* The compiler that built this engine, and its flags. */
const char *sv_compiler(void);
const char *sv_flags(void);

/* The first thing wrong with a batch, or NULL. */
const char *sv_batch_error(const sv_batch *batch);

/* Seats the designs. order must hold n * lanes entries; scratch, sv_plan_scratch bytes. */
int64_t sv_plan_scratch(const sv_batch *batch);
int32_t sv_plan_batch(const sv_batch *batch, sv_plan *plan, void *scratch);

/* Simulates blocks until none is left. Any number of threads may call this at once on one batch,
 * plan, results and progress, each with a workspace of its own of sv_workspace_bytes, which needs the plan's scratch.
 */
int64_t sv_workspace_bytes(const sv_batch *batch, const sv_plan *plan, int32_t isa, void *scratch);
int32_t sv_run(const sv_batch *batch, const sv_plan *plan, sv_results *results, sv_progress *progress, void *workspace,
               int32_t isa);

/* A run that pauses. Every block of a plan that is in_step lives in memory of its own, of sv_block_bytes, from sv_start
 * until the caller frees it; batch and results stay where they are. sv_advance takes up strain and phases as they are
 * then, and stops each design at the first step whose time exceeds until[design], after so many steps, or at its end.
 * Any number of threads may call it at once with one progress, which starts with zeros each time. */
int64_t sv_block_bytes(const sv_batch *batch, const sv_plan *plan, int32_t block, int32_t isa, void *scratch);
int32_t sv_start(const sv_batch *batch, const sv_plan *plan, sv_results *results, void *const *blocks, int32_t isa);
int32_t sv_advance(const sv_plan *plan, sv_progress *progress, void *const *blocks, const double *until, int32_t steps,
                   int32_t isa);

/* Numbers in a design's clock: time s, step, next sample, measuring, ended, torn, travel 1, start m 3, centre of mass m
 * 3, energy J/kg when measuring began, and what may have been added to it. */
enum { SV_CLOCK = 15 };

/* All that changes in a run, the same whatever the seating; NULL for what is not wanted. Rows of sites without a voxel,
 * of links that are none and of designs that can't run stay as they were. A voxel has its position m 3, edge m,
 * quaternion wxyz, velocity m/s 3, spin rad/s 3; a link, by its first site and its axis, stretch m 3, the bends of both
 * ends rad 3 + 3, regime. The surface is the position and the edge, m, that voxels had when pairs were listed. */
typedef struct {
    double *clock;   /* [n][SV_CLOCK] */
    double *voxel;   /* [n][sites][14] */
    double *link;    /* [n][sites][3][10] */
    double *surface; /* [n][sites][4] */
} sv_state;

int32_t sv_get_state(const sv_plan *plan, void *const *blocks, sv_state *state, int32_t isa);
int32_t sv_set_state(const sv_plan *plan, void *const *blocks, sv_state *state, int32_t isa);

/* How many steps a run takes: the first time that exceeds duration ends it. -1 where they are too many to count. */
int32_t sv_step_count(double time_step, double duration);

/* How many rows the track of a run of so many cycles has, start and end included. */
double sv_track_samples(double cycles, int32_t per_cycle);

/* binding] */

#endif
