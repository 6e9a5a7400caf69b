#include "body.h"

#include <stdlib.h>

static const sv_place sv_axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

int32_t sv_sites(sv_lattice l)
{
    return l.nx * l.ny * l.nz;
}

static sv_place sv_place_of(sv_lattice l, int32_t site)
{
    return (sv_place){site % l.nx, site / l.nx % l.ny, site / l.nx / l.ny};
}

/* The site `sign` steps along an axis, or -1 outside the lattice. */
static int32_t sv_neighbour(sv_lattice l, sv_place p, int axis, int32_t sign)
{
    const int32_t x = p.x + sign * sv_axes[axis].x, y = p.y + sign * sv_axes[axis].y, z = p.z + sign * sv_axes[axis].z;
    return x < 0 || y < 0 || z < 0 || x >= l.nx || y >= l.ny || z >= l.nz ? -1 : x + l.nx * (y + l.ny * z);
}

sv_size sv_size_of(sv_lattice l, const uint8_t *occupied)
{
    sv_size size = {.sites = sv_sites(l), .layer = l.nx * l.ny};
    int32_t site = 0;
    for (int32_t z = 0; z < l.nz; z++) {
        for (int32_t y = 0; y < l.ny; y++) {
            for (int32_t x = 0; x < l.nx; x++, site++) {
                if (!occupied[site])
                    continue;
                size.voxels++;
                size.links += x + 1 < l.nx && occupied[site + 1];
                size.links += y + 1 < l.ny && occupied[site + l.nx];
                size.links += z + 1 < l.nz && occupied[site + size.layer];
            }
        }
    }
    return size;
}

void sv_body_take(sv_body *body, sv_size size, sv_arena *arena)
{
    body->site = sv_take(arena, (size_t)size.voxels, sizeof *body->site);
    body->place = sv_take(arena, (size_t)size.voxels, sizeof *body->place);
    body->link = sv_take(arena, (size_t)size.links, sizeof *body->link);
    body->joints = sv_take(arena, (size_t)size.voxels, sizeof *body->joints);
}

static void sv_add_links(sv_body *body, sv_lattice lattice, int32_t a, const int32_t *voxel_at)
{
    body->joints[a].first = body->links;
    for (int axis = 0; axis < 3; axis++) {
        const int32_t site = sv_neighbour(lattice, body->place[a], axis, 1), b = site < 0 ? -1 : voxel_at[site];
        if (b >= 0)
            body->link[body->links++] = (sv_link){a, b, axis};
    }
    body->joints[a].starting = body->links - body->joints[a].first;
}

void sv_body_build(sv_body *body, sv_lattice lattice, const uint8_t *occupied, int32_t *voxel_at)
{
    body->voxels = body->links = 0;
    for (int32_t site = 0; site < sv_sites(lattice); site++) {
        voxel_at[site] = occupied[site] ? body->voxels : -1;
        if (occupied[site]) {
            body->place[body->voxels] = sv_place_of(lattice, site);
            body->site[body->voxels++] = site;
        }
    }
    for (int32_t v = 0; v < body->voxels; v++) {
        body->joints[v].ending = 0;
        sv_add_links(body, lattice, v, voxel_at);
    }
    for (int axis = 0; axis < 3; axis++) {
        for (int32_t l = 0; l < body->links; l++) {
            sv_joints *b = &body->joints[body->link[l].b];
            if (body->link[l].axis == axis)
                b->end[b->ending++] = l;
        }
    }
}

/* Whether links lead to a site from the one that is so many steps before it, by a shortest way. A way of at most three
 * links between sites is always a shortest one. */
static bool sv_leads(const uint8_t *digits, const int32_t step[3], int32_t site, int32_t x, int32_t y, int32_t z)
{
    if (!digits[site])
        return false;
    if (abs(x) + abs(y) + abs(z) <= 1)
        return true;
    const int32_t to_x = (x > 0) - (x < 0), to_y = (y > 0) - (y < 0), to_z = (z > 0) - (z < 0);
    return (x && sv_leads(digits, step, site - to_x * step[0], x - to_x, y, z)) ||
           (y && sv_leads(digits, step, site - to_y * step[1], x, y - to_y, z)) ||
           (z && sv_leads(digits, step, site - to_z * step[2], x, y, z - to_z));
}

/* The bits of sv_vicinity.near for a voxel. */
static uint32_t sv_near_bits(sv_lattice l, const uint8_t *digits, sv_place here)
{
    const int32_t step[3] = {1, l.nx, l.nx * l.ny}, site = here.x + l.nx * (here.y + l.ny * here.z);
    uint32_t bits = 0;
    for (int32_t z = 0; z <= SV_NEAR && here.z + z < l.nz; z++) {
        for (int32_t y = z - SV_NEAR; y <= SV_NEAR - z; y++) {
            const int32_t reach = SV_NEAR - z - abs(y);
            for (int32_t x = -reach; x <= reach && here.y + y >= 0 && here.y + y < l.ny; x++) {
                const int32_t bit = sv_near_bit(x, y, z);
                if (bit >= 0 && here.x + x >= 0 && here.x + x < l.nx &&
                    sv_leads(digits, step, site + x + l.nx * (y + l.ny * z), x, y, z))
                    bits |= 1u << bit;
            }
        }
    }
    return bits;
}

static bool sv_is_on_surface(sv_lattice l, const uint8_t *digits, sv_place here)
{
    for (int32_t way = 0; way < 6; way++) {
        const int32_t site = sv_neighbour(l, here, way / 2, way % 2 ? -1 : 1);
        if (site < 0 || !digits[site])
            return true;
    }
    return false;
}

bool sv_vicinities(sv_lattice lattice, const sv_body *body, const uint8_t *digits, sv_vicinity *vicinity)
{
    for (int32_t v = 0; v < body->voxels; v++) {
        const sv_place here = body->place[v];
        vicinity[v] = (sv_vicinity){0, digits[body->site[v]] && sv_is_on_surface(lattice, digits, here)};
        if (vicinity[v].on_surface)
            vicinity[v].near = sv_near_bits(lattice, digits, here);
    }
    for (int32_t a = 0; a < body->voxels; a++) /* found at once, but in the smallest bodies */
        for (int32_t b = body->voxels - 1; b > a; b--)
            if (vicinity[a].on_surface && vicinity[b].on_surface && !sv_is_near(body, vicinity, a, b))
                return true;
    return false;
}
