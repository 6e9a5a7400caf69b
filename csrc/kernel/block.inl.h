/* A block: what runs together, and all that changes while it runs. Its designs are seated in one of two ways:
 * a design per lane, so that a row of voxels is the same voxel of every design; or one body across the lanes, so
 * that a row is SV_LANES voxels of it. The laws are the same, and so are the bits. */
#pragma once

#include "body.h"
#include "kernels.h"
#include "lanes.inl.h"
#include "rotation.inl.h"

/* Where voxels are and how large, in every lane. */
typedef struct {
    sv_vec3 place; /* m */
    sv_wide edge;  /* m */
    sv_quat turn;
} sv_pose;

/* A row of voxels. SI. physics.md 3 */
typedef struct {
    sv_pose pose;
    sv_vec3 velocity, spin; /* m/s, rad/s */
    sv_wide strain;         /* amplitude in this cycle; 0 where the voxel is passive */
} sv_voxel;

/* What links remember of the step before. physics.md 4 */
typedef struct {
    sv_vec3 stretch, bend_a, bend_b; /* d, phi_1, phi_2 */
    sv_mask large;                   /* regime */
} sv_link_memory;

/* What links do to their voxels, in the world's frame. */
typedef struct {
    sv_vec3 force;              /* on a; b gets the opposite */
    sv_vec3 moment_a, moment_b; /* to be subtracted */
    sv_wide tension;            /* N, the force along the link */
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

#define SV_FEW_PUMPS 8 /* that rows of voxels choose from; a pump per row is faster where there are more */

/* The sine that drives voxels of one phase. */
typedef struct {
    sv_wide phase;      /* cycles */
    sv_wide first_turn; /* the turn that the pump was in when actuation began */
    sv_wide cycle;      /* cycles since then */
    sv_wide sine;
} sv_pump;

/* The voxels of one body on a surface, as they were when the list of pairs was made: in the order of the voxels,
 * and sorted into cells for the search. */
typedef struct {
    double place[3], edge; /* m */
    int32_t voxel;
    int32_t cell[3];
    uint32_t bucket; /* of that cell */
} sv_point;

/* SV_LANES points of one cell, or fewer, in order. */
typedef struct {
    sv_vec3 place; /* NaN where there is no point */
    int32_t point[SV_LANES], last;
} sv_cell_row;

typedef struct {
    sv_point *point;
    int32_t count;
    double cell_edge; /* m */
    uint8_t bits[3];  /* cells each way are powers of two */
    uint32_t cells;
    int32_t *first;  /* [cells + 1] rows of each */
    int32_t *filled; /* [cells] places taken */
    sv_cell_row *row;
    const sv_point *gathered; /* the point whose cell, and those around it, have these rows; or NULL */
    int32_t *around, around_count;
    int32_t *found; /* [voxels] the partners of one point */
} sv_surface;

typedef struct {
    sv_vec3 place;
    sv_wide edge;
} sv_spot;

/* Two voxels that are close enough to be tested for contact, and in which lanes. physics.md 5 */
typedef struct {
    int32_t a, b;
    uint32_t lanes; /* a bit per lane */
} sv_pair;

typedef struct {
    sv_pair *pair, *spare; /* the list, and room to make another */
    int32_t count, room;
    int32_t listed;  /* points whose pairs have been listed */
    bool is_whole;   /* the list has them all; else, one body crushed, it is made piece by piece at every step */
    uint32_t lanes;  /* lanes in which any two voxels can collide */
    sv_wide travel;  /* voxel widths since the list was made */
    sv_vec3 *push;   /* [rows] N, zero where not pushed */
    uint8_t *pushed; /* [rows] */
    sv_surface surface;
    sv_spot *spot;         /* [rows] where the voxels were when the list was made */
    sv_vicinity *vicinity; /* [voxels] for all lanes, or where the block is masked for each */
} sv_contacts;

/* The moment of a lane's next event: start of the measurement, sample of the track, end. */
typedef struct {
    int32_t sample; /* of the track, next to take */
    bool measuring, ended;
    double start[3]; /* m, centre of mass when measuring began */
} sv_clock;

/* What is kept to measure the pump's work on the links; NULL where it is not asked for. physics.md 12 */
typedef struct {
    sv_wide *edge_before; /* [rows] m, one step ago */
    sv_wide *work;        /* [rows] J, times 4 */
} sv_meter;

#define SV_MIXED 3

/* The axis of the links in all lanes, or SV_MIXED: y and z are the lanes in which it is that. */
typedef struct {
    int32_t all;
    sv_mask y, z;
} sv_axis;

/* SV_LANES links of one body. The last row repeats its last link. */
typedef struct {
    int32_t a[SV_LANES], b[SV_LANES];
    sv_axis axis;
} sv_link_row;

#define SV_TOGETHER (4 * SV_LANES) /* voxels whose links are computed together; so most rows have one axis */

/* One body across the lanes. Voxels are read by lines, and what links do to a voxel is written by lines; the
 * latter are used again, as links reach no farther than one layer of the lattice. */
typedef struct {
    int32_t link_rows;
    sv_link_row *link;  /* [link_rows] */
    int32_t *slot;      /* [links] where a link lies, row by row: those of SV_TOGETHER voxels by their axes */
    int32_t *links_end; /* [rows] link rows to be done before a row of voxels moves */
    sv_line *pose;      /* [rows * SV_LANES] */
    sv_line *effect;    /* [2 * lines + 1] force and moment on a, then on b, then zeros */
    int32_t lines;      /* a power of two */
    int32_t (*adds)[6]; /* [rows * SV_LANES] the lines that a voxel adds up, in order */
} sv_across;

typedef struct {
    sv_arena arena; /* all memory of the block */
    const sv_batch *batch;
    sv_results *results;
    bool is_across;
    int32_t first;            /* lane that has a design */
    int32_t design[SV_LANES]; /* or -1: an unused lane, which repeats the work of another */
    sv_body body;
    int32_t *voxel_at;  /* [sites] or -1, while the body is built */
    int32_t rows;       /* of voxels */
    bool masked;        /* lanes differ in which voxels they have */
    sv_mask *has_voxel; /* [rows] */
    sv_mask *has_link;  /* [links], a design per lane */
    int32_t voxel_count[SV_LANES];
    sv_voxel *voxels;       /* [rows] */
    sv_link_memory *memory; /* [links], or rows of them */
    sv_link_effect *effect; /* [links], a design per lane */
    sv_across across;
    sv_coefficients k;
    sv_pump *pumps;     /* [pump_count] */
    int32_t pump_count; /* 1, a few that rows choose from, or one per row */
    sv_mask *uses;      /* [rows][pump_count] the lanes that a pump drives, or NULL where rows don't choose */
    sv_mask *can_use;   /* the memory of it */
    sv_wide frequency, settle_time, duration;
    sv_contacts contacts;
    sv_meter meter;
    sv_wide time, next_event;   /* s */
    sv_wide first_energy, gain; /* J/kg, when measuring began, and what a body can come by after that */
    sv_clock clock[SV_LANES];
    int32_t step;
    sv_mask diverged;
} sv_block;

SV_INLINE sv_lattice sv_lattice_of(const sv_batch *batch)
{
    return (sv_lattice){batch->nx, batch->ny, batch->nz};
}

/* The row and the lane of a voxel of the design that a lane has; across the lanes, there is only the first's. */
typedef struct {
    int32_t row;
    int lane;
} sv_seat;

SV_INLINE sv_seat sv_seat_of(const sv_block *b, int lane, int32_t v)
{
    return b->is_across ? (sv_seat){v / SV_LANES, v % SV_LANES} : (sv_seat){v, lane};
}

SV_INLINE bool sv_lane_has(const sv_block *b, int lane, int32_t v)
{
    return !b->masked || sv_lane(b->has_voxel[v], lane);
}

SV_INLINE sv_vicinity *sv_vicinity_of(const sv_block *b, int lane)
{
    return b->contacts.vicinity + (b->masked ? lane * b->body.voxels : 0);
}
