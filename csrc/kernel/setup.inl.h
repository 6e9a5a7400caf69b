/* Fills a block with its designs at rest. */
#pragma once

#include "across.inl.h"
#include "contact.inl.h"
#include "record.inl.h"

#include <string.h>

#define SV_PAIRS_PER_VOXEL 8 /* of one body across the lanes that are listed at once */

/* A row of the plan whose second place says so has one design, across the lanes. */
static bool sv_is_across(const int32_t *order)
{
    return order[1] == SV_ACROSS;
}

/* Marks the sites that any design of a row of the plan occupies. */
static void sv_unite_designs(const sv_batch *batch, const int32_t *order, uint8_t *occupied)
{
    const size_t sites = (size_t)sv_sites(sv_lattice_of(batch));
    memset(occupied, 0, sites);
    for (int lane = 0; lane < SV_LANES; lane++)
        for (size_t s = 0; order[lane] >= 0 && s < sites; s++)
            occupied[s] |= batch->digits[(size_t)order[lane] * sites + s];
}

static void sv_surface_take(sv_surface *s, int32_t voxels, sv_arena *arena)
{
    const size_t cells = sv_set_bits(voxels, s->bits), points = (size_t)voxels;
    s->point = sv_take(arena, points, sizeof *s->point);
    s->first = sv_take(arena, cells + 1, sizeof *s->first);
    s->filled = sv_take(arena, cells, sizeof *s->filled);
    s->row = sv_take(arena, points / SV_LANES + cells, sizeof *s->row);
    s->around = sv_take(arena, points / SV_LANES + cells, sizeof *s->around);
    s->found = sv_take(arena, points, sizeof *s->found);
}

static void sv_contacts_take(sv_contacts *c, int32_t rows, int32_t voxels, bool is_across, sv_arena *arena)
{
    c->room = is_across ? SV_PAIRS_PER_VOXEL * voxels : voxels * (voxels - 1) / 2;
    c->pair = sv_take(arena, (size_t)c->room, sizeof *c->pair);
    c->spare = is_across ? c->pair : sv_take(arena, (size_t)c->room, sizeof *c->pair);
    c->push = sv_take(arena, (size_t)rows, sizeof *c->push);
    c->pushed = sv_take(arena, (size_t)rows, sizeof *c->pushed);
    c->spot = sv_take(arena, (size_t)rows, sizeof *c->spot);
    c->vicinity = sv_take(arena, (size_t)voxels * (is_across ? 1 : SV_LANES), sizeof *c->vicinity);
    sv_surface_take(&c->surface, voxels, arena);
}

static void sv_across_take(sv_across *x, int32_t rows, sv_size size, sv_arena *arena)
{
    const size_t seats = (size_t)rows * SV_LANES;
    x->link_rows = (size.links + SV_LANES - 1) / SV_LANES;
    /* From the first link that ends at a row of voxels to the last that is computed together with those starting there.
     */
    const int32_t span = 3 * (size.layer + 2 * SV_TOGETHER) + 2 * SV_LANES;
    for (x->lines = SV_LANES; x->lines < span && x->lines < x->link_rows * SV_LANES;)
        x->lines *= 2;
    x->link = sv_take(arena, (size_t)x->link_rows, sizeof *x->link);
    x->slot = sv_take(arena, (size_t)size.links, sizeof *x->slot);
    x->links_end = sv_take(arena, (size_t)rows, sizeof *x->links_end);
    x->pose = sv_take(arena, seats, sizeof *x->pose);
    x->effect = sv_take(arena, 2 * (size_t)x->lines + 1, sizeof *x->effect);
    x->adds = sv_take(arena, seats, sizeof *x->adds);
}

/* The memory of a block, `size` being that of all its designs together. */
static void sv_block_take(sv_block *b, const sv_batch *batch, sv_size size, bool is_across, sv_arena *arena)
{
    const int32_t rows = is_across ? (size.voxels + SV_LANES - 1) / SV_LANES : size.voxels;
    const size_t links = (size_t)size.links, pumps = batch->phase ? (size_t)rows : 1;
    sv_body_take(&b->body, size, arena);
    b->rows = rows;
    b->is_across = is_across;
    b->voxel_at = sv_take(arena, (size_t)size.sites, sizeof *b->voxel_at);
    b->has_voxel = sv_take(arena, (size_t)rows, sizeof *b->has_voxel);
    b->voxels = sv_take(arena, (size_t)rows, sizeof *b->voxels);
    b->pumps = sv_take(arena, pumps > SV_FEW_PUMPS ? pumps : SV_FEW_PUMPS, sizeof *b->pumps);
    sv_contacts_take(&b->contacts, rows, size.voxels, is_across, arena);
    b->meter = (sv_meter){NULL, NULL};
    if (batch->energy) {
        b->meter.edge_before = sv_take(arena, (size_t)rows, sizeof *b->meter.edge_before);
        b->meter.work = sv_take(arena, (size_t)rows, sizeof *b->meter.work);
    }
    if (is_across) {
        sv_across_take(&b->across, rows, size, arena);
        b->memory = sv_take(arena, (size_t)b->across.link_rows, sizeof *b->memory);
    } else {
        b->memory = sv_take(arena, links, sizeof *b->memory);
        b->effect = sv_take(arena, links, sizeof *b->effect);
        b->has_link = sv_take(arena, links, sizeof *b->has_link);
        b->can_use = sv_take(arena, batch->phase ? (size_t)rows * SV_FEW_PUMPS : 0, sizeof *b->can_use);
    }
}

static const uint8_t *sv_digits_of(const sv_block *b, int lane)
{
    return b->batch->digits + (size_t)b->design[lane] * (size_t)sv_sites(sv_lattice_of(b->batch));
}

/* Whether every number that a design brings is one that a run can end with; of a run that goes on, as it was then. */
static bool sv_is_runnable(const sv_batch *batch, int32_t design)
{
    if (batch->resumed)
        return batch->resumed[design] >= 0;
    size_t sites = (size_t)sv_sites(sv_lattice_of(batch)), rows = (size_t)batch->cycles, at = (size_t)design * sites;
    const sv_parameters *p = &batch->parameters[design];
    const double *number = (const double *)p;
    double sum = 0;
    for (size_t i = 0; i < sizeof *p / sizeof *number; i++)
        sum += 0.0 * number[i];
    for (size_t i = 0; batch->phase && i < sites; i++)
        if (batch->digits[at + i] == 2 && !(fabs(batch->phase[at + i]) < SV_MOST_TURNS))
            return false;
    for (size_t i = 0; i < sites * rows; i++)
        sum += batch->digits[at + i % sites] == 2 ? 0.0 * batch->strain[at * rows + i] : 0.0;
    return sum == 0.0 && p->time_step > 0 && p->duration / p->time_step < INT32_MAX &&
           p->frequency_hz * p->duration < SV_MOST_TURNS;
}

/* Takes the block's designs from the plan. A lane without one, or whose design can't run, stays
 * unused and repeats another's work. Returns a lane whose design does run, or -1. */
static int sv_assign_designs(sv_block *b, const int32_t *order)
{
    int valid = -1;
    for (int lane = 0; lane < SV_LANES; lane++) {
        b->design[lane] = order[lane] >= 0 ? order[lane] : -1;
        if (order[lane] >= 0 && !sv_is_runnable(b->batch, order[lane])) {
            b->results->status[order[lane]] = SV_DIVERGED;
            b->design[lane] = -1;
        }
        if (b->design[lane] >= 0 && valid < 0)
            valid = lane;
    }
    return valid;
}

/* The coefficients of one lane. physics.md 2 */
static void sv_set_coefficients(sv_block *b, int lane, const sv_parameters *p)
{
    sv_coefficients *k = &b->k;
    const double L = b->batch->edge, E = p->youngs_modulus, G = E / (2 * (1 + p->poisson_ratio));
    const double mass = p->density * L * L * L, inertia = mass * L * L / 6, first_moment = mass * L / 2;
    const double a1 = E * L, a2 = G * L * L * L / 6, b1 = E * L, b2 = E * L * L / 2, b3 = E * L * L * L / 6;
    const double half = p->damping_link / (2 * p->time_step), quarter = p->damping_link / (4 * p->time_step);
    const double c_a2 = 2 * __builtin_sqrt(a2 * inertia), c_b2 = 2 * __builtin_sqrt(b2 * first_moment);
    const double c_b3 = 2 * __builtin_sqrt(b3 * inertia), c_a1 = 2 * __builtin_sqrt(a1 * mass);
    const double c_b1 = 2 * __builtin_sqrt(b1 * mass), c_v = 2 * __builtin_sqrt(mass * E * L);
    const double c_w = 2 * __builtin_sqrt(inertia * E * L * L * L);
    k->a1[lane] = a1, k->a2[lane] = a2, k->b1[lane] = b1, k->b2[lane] = b2, k->b3[lane] = b3;
    k->damp_a1[lane] = half * c_a1, k->damp_b1[lane] = half * c_b1, k->damp_b2[lane] = half * c_b2;
    k->turn_damp_a2[lane] = quarter * c_a2;
    k->turn_damp_b2[lane] = quarter * c_b2, k->turn_damp_b3[lane] = quarter * c_b3;
    k->drag[lane] = p->damping_global * c_v;
    k->spin_keep[lane] = 1 - 10 * p->damping_global * c_w * p->time_step / inertia;
    k->weight.x[lane] = mass * p->gravity[0];
    k->weight.y[lane] = mass * p->gravity[1];
    k->weight.z[lane] = mass * p->gravity[2];
    k->floor_stiffness[lane] = 2 * E * L, k->floor_damper[lane] = p->damping_ground * c_v;
    k->friction_static[lane] = p->friction_static, k->friction_kinetic[lane] = p->friction_kinetic;
    k->shear_strength[lane] = p->shear_strength;
    k->dt[lane] = p->time_step, k->half_dt[lane] = 0.5 * p->time_step;
    k->dt_over_mass[lane] = p->time_step / mass, k->dt_over_inertia[lane] = p->time_step / inertia;
    k->mass_over_dt[lane] = mass / p->time_step;
}

static void sv_build_bodies(sv_block *b, const uint8_t *digits[SV_LANES], uint8_t *occupied)
{
    sv_lattice lattice = sv_lattice_of(b->batch);
    const int32_t sites = sv_sites(lattice);
    b->masked = false;
    for (int32_t s = 0; s < sites; s++) {
        occupied[s] = 0;
        for (int lane = 0; lane < SV_LANES; lane++) {
            b->masked = b->masked || !digits[lane][s] != !digits[0][s];
            occupied[s] |= digits[lane][s];
        }
    }
    sv_body_build(&b->body, lattice, occupied, b->voxel_at);
    for (int32_t row = 0; row < b->rows; row++) {
        uint32_t bits = 0;
        for (int lane = 0; lane < SV_LANES; lane++) {
            const int32_t v = b->is_across ? row * SV_LANES + lane : row;
            bits |= (uint32_t)(v < b->body.voxels && digits[lane][b->body.site[v]] != 0) << lane;
        }
        b->has_voxel[row] = sv_mask_of(bits);
    }
    for (int32_t l = 0; !b->is_across && l < b->body.links; l++)
        b->has_link[l] = b->has_voxel[b->body.link[l].a] & b->has_voxel[b->body.link[l].b];
}

/* Gives the links of one body their places, and says which are done before a row of voxels moves. */
static void sv_set_slots(sv_block *b)
{
    sv_across *x = &b->across;
    const sv_body *body = &b->body;
    int32_t taken = 0;
    for (int32_t from = 0; from < b->rows * SV_LANES; from += SV_TOGETHER) {
        const int32_t last = (from + SV_TOGETHER < body->voxels ? from + SV_TOGETHER : body->voxels) - 1;
        const int32_t end = body->joints[last].first + body->joints[last].starting;
        for (int32_t axis = 0; axis < 3; axis++)
            for (int32_t l = body->joints[from].first; l < end; l++)
                if (body->link[l].axis == axis)
                    x->slot[l] = taken++;
        for (int32_t row = from / SV_LANES; row < b->rows && row < (from + SV_TOGETHER) / SV_LANES; row++)
            x->links_end[row] = (taken + SV_LANES - 1) / SV_LANES;
    }
}

/* Lays the links of one body across the lanes. */
static void sv_set_link_rows(sv_block *b)
{
    sv_across *x = &b->across;
    const sv_body *body = &b->body;
    for (int32_t row = 0; row < x->link_rows; row++)
        x->link[row].axis = (sv_axis){-1, sv_mask_of(0), sv_mask_of(0)};
    for (int32_t l = 0; l < body->links; l++) {
        const sv_link *link = &body->link[l];
        const int32_t last = x->slot[l] == body->links - 1 ? x->link_rows * SV_LANES - 1 : x->slot[l];
        for (int32_t slot = x->slot[l]; slot <= last; slot++) { /* one, but of the last link */
            sv_link_row *row = &x->link[slot / SV_LANES];
            const sv_mask lane = sv_mask_of(1u << slot % SV_LANES);
            row->a[slot % SV_LANES] = link->a, row->b[slot % SV_LANES] = link->b;
            row->axis.all = row->axis.all == -1 || row->axis.all == link->axis ? link->axis : SV_MIXED;
            row->axis.y |= link->axis == 1 ? lane : sv_mask_of(0);
            row->axis.z |= link->axis == 2 ? lane : sv_mask_of(0);
        }
    }
}

/* Says which lines each voxel of one body adds up. */
static void sv_set_across(sv_block *b)
{
    sv_across *x = &b->across;
    const sv_body *body = &b->body;
    sv_set_slots(b);
    sv_set_link_rows(b);
    for (int32_t v = 0; v < b->rows * SV_LANES; v++) {
        const sv_joints joints = v < body->voxels ? body->joints[v] : (sv_joints){.starting = 0};
        for (int32_t i = 0; i < 6; i++)
            x->adds[v][i] = 2 * x->lines;
        for (int32_t i = 0; i < joints.starting; i++)
            x->adds[v][i] = x->slot[joints.first + i] & (x->lines - 1);
        for (int32_t i = 0; i < joints.ending; i++)
            x->adds[v][3 + i] = x->lines + (x->slot[joints.end[i]] & (x->lines - 1));
    }
    memset(&x->effect[2 * x->lines], 0, sizeof *x->effect);
}

static void sv_set_contacts(sv_block *b, const uint8_t *digits[SV_LANES])
{
    sv_contacts *contacts = &b->contacts;
    contacts->count = contacts->listed = contacts->surface.count = 0;
    contacts->is_whole = true;
    contacts->lanes = 0;
    contacts->travel = sv_splat(0);
    for (int32_t row = 0; row < b->rows; row++)
        contacts->push[row] = sv_zero3(), contacts->pushed[row] = 0;
    bool described = false, can_collide = false;
    for (int lane = 0; lane < SV_LANES; lane++) {
        if (b->design[lane] < 0)
            continue;
        if (b->masked || !described)
            can_collide = sv_vicinities(sv_lattice_of(b->batch), &b->body, digits[lane], sv_vicinity_of(b, lane));
        described = true;
        contacts->lanes |= (uint32_t)can_collide << lane;
    }
}

static void sv_set_voxels(sv_block *b)
{
    const double L = b->batch->edge;
    for (int32_t row = 0; row < b->rows; row++) {
        sv_voxel *x = &b->voxels[row];
        for (int lane = 0; lane < SV_LANES; lane++) {
            const int32_t v = b->is_across ? row * SV_LANES + lane : row, last = b->body.voxels - 1;
            const sv_place place = b->body.place[v < last ? v : last];
            x->pose.place.x[lane] = (place.x + 0.5) * L;
            x->pose.place.y[lane] = (place.y + 0.5) * L;
            x->pose.place.z[lane] = (place.z + 0.5) * L;
        }
        x->velocity = x->spin = sv_zero3();
        x->pose.turn = (sv_quat){sv_splat(1), sv_zero3()};
        x->pose.edge = sv_splat(L);
        x->strain = sv_splat(0);
        b->contacts.spot[row] = (sv_spot){x->pose.place, x->pose.edge};
        if (b->meter.work)
            b->meter.edge_before[row] = x->pose.edge, b->meter.work[row] = sv_splat(0);
        if (b->is_across)
            sv_write_pose(b, row);
    }
    const int32_t link_rows = b->is_across ? b->across.link_rows : b->body.links;
    for (int32_t row = 0; row < link_rows; row++)
        b->memory[row] = (sv_link_memory){sv_zero3(), sv_zero3(), sv_zero3(), sv_mask_of(0)};
}

/* The phase of the voxel that a lane of a row has; 0 where nothing actuates it. */
static double sv_phase_of(const sv_block *b, int32_t row, int lane, bool *active)
{
    size_t design, sites = (size_t)sv_sites(sv_lattice_of(b->batch));
    int32_t voxel;
    *active = false;
    if (!b->batch->phase || !sv_resident(b, row, lane, &design, &voxel))
        return 0;
    const size_t at = design * sites + (size_t)b->body.site[voxel];
    *active = b->batch->digits[at] == 2;
    return *active ? b->batch->phase[at] : 0;
}

/* Gives each lane the pumps of its own different phases. Returns how many there are; none where a lane has too many. */
static int32_t sv_share_pumps(sv_block *b)
{
    int32_t most = 1;
    for (int lane = 0; lane < SV_LANES; lane++) {
        int32_t count = 0;
        for (int32_t row = 0; row < b->rows; row++) {
            bool active, known = false;
            const double phase = sv_phase_of(b, row, lane, &active);
            for (int32_t p = 0; p < count; p++)
                known = known || b->pumps[p].phase[lane] == phase;
            if (!active || known)
                continue;
            if (count == SV_FEW_PUMPS)
                return 0;
            b->pumps[count++].phase[lane] = phase;
        }
        for (int32_t p = count; p < SV_FEW_PUMPS; p++)
            b->pumps[p].phase[lane] = count ? b->pumps[0].phase[lane] : 0;
        most = count > most ? count : most;
    }
    return most;
}

/* Which lanes of a row the pumps drive, as they are shared. */
static void sv_choose_pumps(sv_block *b, int32_t row)
{
    for (int32_t p = 0; p < b->pump_count; p++) {
        uint32_t lanes = 0;
        for (int lane = 0; lane < SV_LANES; lane++) {
            bool active;
            const double phase = sv_phase_of(b, row, lane, &active);
            lanes |= (uint32_t)(active && phase == b->pumps[p].phase[lane]) << lane;
        }
        b->uses[row * b->pump_count + p] = sv_mask_of(lanes);
    }
}

/* One pump for all where no lane has two phases; a few that rows choose from; or one per row, as across the lanes. */
static void sv_set_pumps(sv_block *b)
{
    bool active;
    b->uses = NULL;
    b->pump_count = sv_share_pumps(b);
    if (b->pump_count > 1 && !b->is_across) {
        b->uses = b->can_use;
        for (int32_t row = 0; row < b->rows; row++)
            sv_choose_pumps(b, row);
    } else if (b->pump_count != 1) {
        b->pump_count = b->rows;
        for (int32_t row = 0; row < b->rows; row++)
            for (int lane = 0; lane < SV_LANES; lane++)
                b->pumps[row].phase[lane] = sv_phase_of(b, row, lane, &active);
    }
}

static void sv_set_clocks(sv_block *b)
{
    b->time = sv_splat(0);
    b->step = 0;
    b->diverged = sv_mask_of(0);
    b->first_energy = sv_splat(INFINITY);
    b->gain = sv_splat(0);
    for (int lane = 0; lane < SV_LANES; lane++) {
        b->clock[lane] = (sv_clock){.ended = b->design[lane] < 0};
    }
}

/* Sets up the designs of a row of the plan, in memory that sv_block_take has taken; all have ended where none of them
 * can run. */
static void sv_set_block(sv_block *b, const int32_t *order, uint8_t *occupied)
{
    b->first = sv_assign_designs(b, order);
    sv_set_clocks(b);
    if (b->first < 0)
        return;
    const uint8_t *digits[SV_LANES];
    for (int lane = 0; lane < SV_LANES; lane++) {
        int source = b->design[lane] >= 0 ? lane : b->first;
        const sv_parameters *p = &b->batch->parameters[b->design[source]];
        digits[lane] = sv_digits_of(b, source);
        sv_set_coefficients(b, lane, p);
        b->frequency[lane] = p->frequency_hz;
        b->settle_time[lane] = b->batch->settle_time;
        b->duration[lane] = p->duration;
    }
    sv_build_bodies(b, digits, occupied);
    for (int lane = 0; lane < SV_LANES; lane++) {
        b->voxel_count[lane] = 0;
        for (int32_t v = 0; v < b->body.voxels; v++)
            b->voxel_count[lane] += sv_lane_has(b, lane, v);
    }
    if (b->is_across)
        sv_set_across(b);
    sv_set_contacts(b, digits);
    sv_set_voxels(b);
    for (int lane = 0; lane < SV_LANES; lane++)
        b->next_event[lane] = sv_next_event(b, lane);
}

/* Takes the memory of a block: itself, a byte per site, and all else. Where there is none, counts it. */
static sv_block *sv_block_in(sv_arena *arena, const sv_batch *batch, const int32_t *order, uint8_t **occupied)
{
    sv_block counted, *b = sv_take(arena, 1, sizeof *b);
    uint8_t *taken = sv_take(arena, (size_t)sv_sites(sv_lattice_of(batch)), 1);
    *occupied = taken ? taken : *occupied;
    sv_unite_designs(batch, order, *occupied);
    sv_block_take(b ? b : &counted, batch, sv_size_of(sv_lattice_of(batch), *occupied), sv_is_across(order), arena);
    return b;
}

static sv_block *sv_block_at(void *memory)
{
    return (sv_block *)sv_arena_in(memory).base;
}

static int64_t sv_kernel_bytes(const sv_batch *batch, const int32_t *order, uint8_t *scratch)
{
    sv_arena arena = sv_arena_in(NULL);
    sv_block_in(&arena, batch, order, &scratch);
    return (int64_t)sv_arena_bytes(&arena);
}

static void sv_kernel_open(const sv_batch *batch, const int32_t *order, sv_results *results, void *memory)
{
    sv_arena arena = sv_arena_in(memory);
    uint8_t *occupied;
    sv_block *b = sv_block_in(&arena, batch, order, &occupied);
    b->arena = arena;
    b->batch = batch;
    b->results = results;
    sv_set_block(b, order, occupied);
}

/* Gives voxels the strain and the phases that the batch has, in the cycle that it is. */
static void sv_kernel_actuate(void *memory)
{
    sv_block *b = sv_block_at(memory);
    if (b->first < 0)
        return;
    sv_set_pumps(b);
    for (int32_t i = 0; i < b->pump_count; i++) {
        sv_pump *p = &b->pumps[i];
        p->first_turn = sv_floor(b->frequency * b->settle_time + p->phase + SV_CYCLE_SLACK);
        p->cycle = sv_floor(b->frequency * b->time + p->phase) - p->first_turn;
    }
    for (int32_t row = 0; row < b->rows; row++)
        sv_load_strain(b, row, sv_driven(b, row, true));
    sv_allow_energy(b);
}

static void sv_kernel_close(void *memory)
{
    const sv_arena arena = sv_block_at(memory)->arena;
    sv_give_back(&arena);
}
