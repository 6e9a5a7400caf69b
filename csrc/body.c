#include "body.h"

static const sv_place sv_axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

static const int32_t sv_near_reach = 3; /* links; physics.md 5 */

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

/* Adds to the vicinity of `start` all later sites that are at most `links` further links away from `here`. */
static void sv_walk(sv_lattice l, const uint8_t *digits, sv_place start, sv_place here, int32_t links, uint32_t *near)
{
    for (int32_t way = 0; way < 6; way++) {
        const int32_t site = sv_neighbour(l, here, way / 2, way % 2 ? -1 : 1);
        if (site < 0 || !digits[site])
            continue;
        sv_place next = here;
        *(way < 2 ? &next.x : way < 4 ? &next.y : &next.z) += way % 2 ? -1 : 1;
        const int32_t bit = sv_near_bit(next.x - start.x, next.y - start.y, next.z - start.z);
        if (bit >= 0)
            *near |= 1u << bit;
        if (links > 1)
            sv_walk(l, digits, start, next, links - 1, near);
    }
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
            sv_walk(lattice, digits, here, here, sv_near_reach, &vicinity[v].near);
    }
    for (int32_t a = 0; a < body->voxels; a++) /* found at once, but in the smallest bodies */
        for (int32_t b = body->voxels - 1; b > a; b--)
            if (vicinity[a].on_surface && vicinity[b].on_surface && !sv_is_near(body, vicinity, a, b))
                return true;
    return false;
}
