#include "body.h"

static const int32_t sv_directions[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};

static const int32_t sv_near_reach = 3; /* links; physics.md 5 */

int32_t sv_sites(sv_lattice l)
{
    return l.nx * l.ny * l.nz;
}

int32_t sv_most_links(sv_lattice l)
{
    return (l.nx - 1) * l.ny * l.nz + l.nx * (l.ny - 1) * l.nz + l.nx * l.ny * (l.nz - 1);
}

static void sv_coordinates(sv_lattice l, int32_t site, int32_t place[3])
{
    place[0] = site % l.nx;
    place[1] = site / l.nx % l.ny;
    place[2] = site / l.nx / l.ny;
}

/* The site one step away, or -1 outside the lattice. */
static int32_t sv_neighbour(sv_lattice l, int32_t site, const int32_t step[3])
{
    int32_t at[3];
    sv_coordinates(l, site, at);
    int32_t x = at[0] + step[0], y = at[1] + step[1], z = at[2] + step[2];
    if (x < 0 || y < 0 || z < 0 || x >= l.nx || y >= l.ny || z >= l.nz)
        return -1;
    return x + l.nx * (y + l.ny * z);
}

void sv_body_take(sv_body *body, sv_lattice lattice, sv_arena *arena)
{
    size_t sites = (size_t)sv_sites(lattice), links = (size_t)sv_most_links(lattice);
    body->site = sv_take(arena, sites, sizeof *body->site);
    body->voxel_at = sv_take(arena, sites, sizeof *body->voxel_at);
    body->link = sv_take(arena, links, sizeof *body->link);
    body->joints = sv_take(arena, sites, sizeof *body->joints);
}

static void sv_number_voxels(sv_body *body, int32_t sites, const uint8_t *occupied)
{
    body->voxels = 0;
    for (int32_t site = 0; site < sites; site++) {
        body->voxel_at[site] = -1;
        if (occupied[site]) {
            body->voxel_at[site] = body->voxels;
            body->site[body->voxels++] = site;
        }
    }
}

static void sv_add_links(sv_body *body, sv_lattice lattice, int axis)
{
    body->first_link[axis] = body->links;
    for (int32_t a = 0; a < body->voxels; a++) {
        int32_t site = sv_neighbour(lattice, body->site[a], sv_directions[2 * axis]);
        int32_t b = site < 0 ? -1 : body->voxel_at[site];
        if (b >= 0)
            body->link[body->links++] = (sv_link){a, b};
    }
}

void sv_body_build(sv_body *body, sv_lattice lattice, const uint8_t *occupied)
{
    sv_number_voxels(body, sv_sites(lattice), occupied);
    body->links = 0;
    for (int axis = 0; axis < 3; axis++)
        sv_add_links(body, lattice, axis);
    body->first_link[3] = body->links;
    for (int32_t v = 0; v < body->voxels; v++)
        body->joints[v].as_a = body->joints[v].as_b = 0;
    for (int32_t l = 0; l < body->links; l++) {
        sv_joints *a = &body->joints[body->link[l].a];
        a->link[a->as_a++] = l;
    }
    for (int32_t l = 0; l < body->links; l++) {
        sv_joints *b = &body->joints[body->link[l].b];
        b->link[b->as_a + b->as_b++] = l;
    }
}

static int sv_contains(const int32_t *list, int32_t count, int32_t site)
{
    for (int32_t i = 0; i < count; i++)
        if (list[i] == site)
            return 1;
    return 0;
}

/* All sites within 3 links of `start`, itself first; returns how many. The lattice has at most 63. */
static int32_t sv_sites_within_reach(sv_lattice lattice, const uint8_t *occupied, int32_t start, int32_t reached[63])
{
    int32_t count = 1, ring = 0;
    reached[0] = start;
    for (int32_t links = 0; links < sv_near_reach; links++) {
        int32_t ring_end = count;
        for (; ring < ring_end; ring++) {
            for (int direction = 0; direction < 6; direction++) {
                int32_t site = sv_neighbour(lattice, reached[ring], sv_directions[direction]);
                if (site >= 0 && occupied[site] && !sv_contains(reached, count, site))
                    reached[count++] = site;
            }
        }
    }
    return count;
}

static int32_t sv_link_count(sv_lattice lattice, const uint8_t *occupied, int32_t site)
{
    int32_t links = 0;
    for (int direction = 0; direction < 6; direction++) {
        int32_t next = sv_neighbour(lattice, site, sv_directions[direction]);
        links += next >= 0 && occupied[next];
    }
    return links;
}

void sv_vicinities(sv_lattice lattice, const uint8_t *occupied, sv_vicinity *vicinity)
{
    for (int32_t site = 0; site < sv_sites(lattice); site++) {
        sv_vicinity *here = &vicinity[site];
        here->count = 0;
        here->on_surface = occupied[site] && sv_link_count(lattice, occupied, site) < 6;
        if (!here->on_surface)
            continue;
        int32_t reached[63], count = sv_sites_within_reach(lattice, occupied, site, reached);
        for (int32_t i = 1; i < count; i++)
            if (reached[i] > site)
                here->site[here->count++] = reached[i];
    }
}

int sv_may_collide(const sv_vicinity *vicinity, int32_t a, int32_t b)
{
    return vicinity[a].on_surface && vicinity[b].on_surface && !sv_contains(vicinity[a].site, vicinity[a].count, b);
}
