/* A block: up to SV_LANES designs that run together, and all that changes while they run. */
#pragma once

#include "body.h"
#include "lanes.inl.h"
#include "rotation.inl.h"

/* One voxel of every lane. SI. physics.md 3 */
typedef struct {
    sv_vec3 place, velocity, spin; /* m, m/s, rad/s */
    sv_quat turn;
    sv_mat3 axes;   /* the matrix of turn */
    sv_wide edge;   /* m */
    sv_wide strain; /* amplitude in this cycle; 0 where the voxel is passive */
} sv_voxel;

/* What a link remembers of the step before. physics.md 4 */
typedef struct {
    sv_vec3 stretch, bend_a, bend_b; /* d, phi_1, phi_2 */
    sv_mask large;                   /* regime */
} sv_link_memory;

/* What a link does to its two voxels, in the world's frame. */
typedef struct {
    sv_vec3 force;              /* on a; b gets the opposite */
    sv_vec3 moment_a, moment_b; /* to be subtracted */
} sv_link_effect;

/* Coefficients of every lane, from its parameters. physics.md 2 */
typedef struct {
    sv_wide a1, a2, b1, b2, b3;                       /* stiffness */
    sv_wide damp_a1, damp_b1, damp_b2;                /* of forces: zeta_link c / 2 dt */
    sv_wide turn_damp_a2, turn_damp_b2, turn_damp_b3; /* of moments: zeta_link c / 4 dt */
    sv_wide drag, spin_keep;                          /* N s/m; share of the spin that outlives a step */
    sv_vec3 weight;                                   /* N */
    sv_wide floor_stiffness, floor_damper;            /* N/m, N s/m */
    sv_wide friction_static, friction_kinetic;        /* 1 */
    sv_wide shear_strength;                           /* Pa */
    sv_wide dt, half_dt, dt_over_mass, dt_over_inertia;
    sv_wide mass_over_dt;
} sv_coefficients;

/* The sine that drives voxels of one phase. */
typedef struct {
    sv_wide phase;      /* cycles */
    sv_wide first_turn; /* the turn that the pump was in when actuation began */
    sv_wide cycle;      /* cycles since then */
    sv_wide sine;
} sv_pump;

/* Two voxels that are close enough to be tested for contact, and in which lanes. physics.md 5 */
typedef struct {
    int32_t a, b;
    uint32_t lanes; /* a bit per lane */
} sv_pair;

typedef struct {
    sv_pair *pair, *spare; /* the list, and room to rewrite it */
    int32_t count;
    uint32_t lanes;        /* lanes in which any two voxels can collide */
    sv_wide travel;        /* voxel widths since the list was made */
    sv_vec3 *push;         /* [voxels] N */
    sv_vicinity *vicinity; /* [sites] for all lanes, or where the block is masked for each */
} sv_contacts;

/* The moment of a lane's next event: start of the measurement, sample of the track, end. */
typedef struct {
    int32_t sample; /* of the track, next to take */
    bool measuring, ended;
    double start[3]; /* m, centre of mass when measuring began */
} sv_clock;

typedef struct {
    const sv_batch *batch;
    sv_results *results;
    int32_t design[SV_LANES]; /* or -1: an unused lane, which repeats the work of another */
    sv_body body;
    bool masked;        /* lanes differ in which voxels they have */
    sv_mask *has_voxel; /* [voxels] */
    sv_mask *has_link;  /* [links] */
    int32_t voxel_count[SV_LANES];
    sv_voxel *voxels;
    sv_link_memory *memory;
    sv_link_effect *effect;
    sv_coefficients k;
    sv_pump *pumps;     /* [pump_count] */
    int32_t pump_count; /* 1, or one per voxel */
    sv_wide frequency, settle_time, duration;
    sv_contacts contacts;
    sv_wide time, next_event; /* s */
    sv_wide most_energy;      /* J/kg, more than which a run has diverged */
    sv_clock clock[SV_LANES];
    int32_t step;
    sv_mask diverged;
} sv_block;

SV_INLINE sv_lattice sv_lattice_of(const sv_batch *batch)
{
    return (sv_lattice){batch->nx, batch->ny, batch->nz};
}

SV_INLINE bool sv_lane_has(const sv_block *b, int lane, int32_t v)
{
    return !b->masked || sv_lane(b->has_voxel[v], lane);
}

SV_INLINE sv_vicinity *sv_vicinity_of(const sv_block *b, int lane)
{
    return b->contacts.vicinity + (b->masked ? lane * sv_sites(sv_lattice_of(b->batch)) : 0);
}
