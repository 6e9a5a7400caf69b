/* The body that a block simulates: its voxels, its links and which voxels can collide. */
#pragma once

#include "arena.h"
#include "softvox.h"

typedef struct {
    int32_t nx, ny, nz;
} sv_lattice;

/* A site by its coordinates. */
typedef struct {
    int32_t x, y, z;
} sv_place;

/* A beam along an axis between voxel a, at the lower coordinate, and voxel b. */
typedef struct {
    int32_t a, b, axis;
} sv_link;

/* The links of one voxel, in order of their axes: those that start here follow one another. */
typedef struct {
    int32_t first, starting; /* links first ... first + starting - 1 */
    int32_t ending;
    int32_t end[3]; /* links that end here */
} sv_joints;

/* How much memory a body takes. */
typedef struct {
    int32_t sites, layer; /* of the lattice; sites of one z */
    int32_t voxels, links;
} sv_size;

/* Voxels are numbered 0 ... voxels - 1 in the order of their sites, links in the order of their voxels a. */
typedef struct {
    int32_t voxels, links;
    int32_t *site;     /* [voxels] */
    sv_place *place;   /* [voxels] the same by coordinates */
    sv_link *link;     /* [links] */
    sv_joints *joints; /* [voxels] */
} sv_body;

int32_t sv_sites(sv_lattice lattice);

/* The size of the body of the sites whose occupied byte is not 0. */
sv_size sv_size_of(sv_lattice lattice, const uint8_t *occupied);

/* Takes the memory for a body. */
void sv_body_take(sv_body *body, sv_size size, sv_arena *arena);

/* Fills in the body of the sites whose occupied byte is not 0, with room for a number per site. */
void sv_body_build(sv_body *body, sv_lattice lattice, const uint8_t *occupied, int32_t *voxel_at);

#define SV_NEAR 3 /* links; physics.md 5 */

/* What a voxel of one design can't collide with: what is at most 3 links away. physics.md 5 */
typedef struct {
    uint32_t near; /* a bit for each of the 31 later sites within 3 steps: whether links lead there */
    bool on_surface;
} sv_vicinity;

/* Fills in vicinity[v] for the voxels of the body that a design has. Returns whether any two can collide. */
bool sv_vicinities(sv_lattice lattice, const sv_body *body, const uint8_t *digits, sv_vicinity *vicinity);

/* The bit of sv_vicinity.near for a site this far away, or -1 where it is farther than 3 steps or not later. */
static inline int32_t sv_near_bit(int32_t x, int32_t y, int32_t z)
{
    static const int8_t row[4][7] = {/* of z, y + 3: the bit of x = 0 */
                                     {-1, -1, -1, -1, 5, 9, 11},
                                     {-1, 12, 14, 18, 22, 24, -1},
                                     {-1, -1, 25, 27, 29, -1, -1},
                                     {-1, -1, -1, 30, -1, -1, -1}};
    const int32_t steps = (x < 0 ? -x : x) + (y < 0 ? -y : y) + (z < 0 ? -z : z);
    const bool later = z > 0 || (z == 0 && (y > 0 || (y == 0 && x > 0)));
    return steps <= SV_NEAR && later ? row[z][y + 3] + x : -1;
}

/* Whether links lead from voxel a in at most 3 steps to a later one. */
static inline bool sv_is_near(const sv_body *body, const sv_vicinity *vicinity, int32_t a, int32_t b)
{
    const sv_place p = body->place[a], q = body->place[b];
    const int32_t bit = sv_near_bit(q.x - p.x, q.y - p.y, q.z - p.z);
    return bit >= 0 && vicinity[a].near >> bit & 1;
}
