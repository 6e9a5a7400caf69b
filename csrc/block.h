/* A block: up to SV_LANES designs that run together, and all that changes while they run. */
#ifndef SV_BLOCK_H
#define SV_BLOCK_H

#include "body.h"
#include "lanes.h"
#include "rotation.h"

/* One voxel of every lane. SI. physics.md 3 */
typedef struct {
    v3 place, velocity, spin; /* m, m/s, rad/s */
    quat turn;
    m3 axes;   /* the matrix of turn */
    vf edge;   /* m */
    vf strain; /* amplitude in this cycle; 0 where the voxel is passive */
} voxel;

/* What a link remembers of the step before. physics.md 4 */
typedef struct {
    v3 stretch, bend_a, bend_b; /* d, phi_1, phi_2 */
    vm large;                   /* regime */
} link_memory;

/* What a link does to its two voxels, in the world's frame. */
typedef struct {
    v3 force;              /* on a; b gets the opposite */
    v3 moment_a, moment_b; /* to be subtracted */
} link_effect;

/* Coefficients of every lane, from its parameters. physics.md 2 */
typedef struct {
    vf a1, a2, b1, b2, b3;                       /* stiffness */
    vf damp_a1, damp_b1, damp_b2;                /* of forces: zeta_link c / 2 dt */
    vf turn_damp_a2, turn_damp_b2, turn_damp_b3; /* of moments: zeta_link c / 4 dt */
    vf drag, spin_keep;                          /* N s/m; share of the spin that outlives a step */
    v3 weight;                                   /* N */
    vf floor_stiffness, floor_damper;            /* N/m, N s/m */
    vf friction_static, friction_kinetic;        /* 1 */
    vf shear_strength;                           /* Pa */
    vf dt, half_dt, dt_over_mass, dt_over_inertia;
    vf mass_over_dt;
} coefficients;

/* The sine that drives voxels of one phase. */
typedef struct {
    vf phase;      /* cycles */
    vf first_turn; /* the turn that the pump was in when actuation began */
    vf cycle;      /* cycles since then */
    vf sine;
} pump;

/* Two voxels that are close enough to be looked at, and in which lanes. physics.md 5 */
typedef struct {
    int32_t a, b;
    uint32_t lanes; /* a bit per lane */
} candidate;

typedef struct {
    candidate *pair, *spare; /* the list, and room to rewrite it */
    int32_t count;
    uint32_t lanes;        /* lanes in which any two voxels can collide */
    vf travel;             /* voxel widths since the list was made */
    v3 *push;              /* [voxels] N */
    sv_vicinity *vicinity; /* [sites] for all lanes, or where the block is masked for each */
} collisions;

/* The moment of a lane's next event: start of the measurement, sample of the track, end. */
typedef struct {
    int32_t sample; /* of the track, next to take */
    bool measuring, ended;
    double start[3]; /* m, centre of mass when measuring began */
} lane_clock;

typedef struct {
    const sv_batch *batch;
    sv_results *results;
    int32_t design[SV_LANES]; /* or -1: a lane that only keeps the others company */
    sv_body body;
    bool masked;   /* lanes differ in which voxels they have */
    vm *has_voxel; /* [voxels] */
    vm *has_link;  /* [links] */
    int32_t voxel_count[SV_LANES];
    voxel *voxels;
    link_memory *memory;
    link_effect *effect;
    coefficients k;
    pump *pumps;        /* [pump_count] */
    int32_t pump_count; /* 1, or one per voxel */
    vf frequency, settle_time, duration;
    collisions hits;
    vf time, next_event; /* s */
    lane_clock clock[SV_LANES];
    int32_t step;
    vm diverged;
} block;

SV_INLINE sv_lattice lattice_of(const sv_batch *batch)
{
    return (sv_lattice){batch->nx, batch->ny, batch->nz};
}

SV_INLINE bool lane_has(const block *b, int lane, int32_t v)
{
    return !b->masked || lane_of(b->has_voxel[v], lane);
}

SV_INLINE sv_vicinity *vicinity_of(const block *b, int lane)
{
    return b->hits.vicinity + (b->masked ? lane * sv_sites(lattice_of(b->batch)) : 0);
}

#endif
