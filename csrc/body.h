/* The body that the lanes of a block share: its voxels, its links and which voxels can collide. */
#pragma once

#include "arena.h"
#include "softvox.h"

typedef struct {
    int32_t nx, ny, nz;
} sv_lattice;

/* A beam between voxel a, at the lower coordinate, and voxel b. */
typedef struct {
    int32_t a, b;
} sv_link;

/* The links of one voxel: first `as_a` of them start here, the other `as_b` end here. */
typedef struct {
    int32_t link[6];
    int32_t as_a, as_b;
} sv_joints;

/* Voxels are numbered 0 ... voxels - 1 in the order of their sites. */
typedef struct {
    int32_t voxels, links;
    int32_t first_link[4]; /* links of axis k: first_link[k] ... first_link[k + 1] - 1 */
    int32_t *site;         /* [voxels] */
    int32_t *voxel_at;     /* [sites] or -1 */
    sv_link *link;         /* [links] */
    sv_joints *joints;     /* [voxels] */
} sv_body;

int32_t sv_sites(sv_lattice lattice);
int32_t sv_most_links(sv_lattice lattice);

/* Takes the memory for the largest body of a lattice. */
void sv_body_take(sv_body *body, sv_lattice lattice, sv_arena *arena);

/* Fills in the body of the sites whose occupied byte is not 0. */
void sv_body_build(sv_body *body, sv_lattice lattice, const uint8_t *occupied);

/* The voxels that a voxel of one design can't collide with. physics.md 5 */
typedef struct {
    int32_t count, on_surface;
    int32_t site[31]; /* sites after its own that are at most 3 links away */
} sv_vicinity;

/* Fills in vicinity[site] for every site of the lattice. */
void sv_vicinities(sv_lattice lattice, const uint8_t *occupied, sv_vicinity *vicinity);

/* Whether the voxels at sites a < b can collide at all: both on the surface and more than 3 links apart. */
int sv_may_collide(const sv_vicinity *vicinity, int32_t a, int32_t b);
