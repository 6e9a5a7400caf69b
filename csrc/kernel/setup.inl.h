/* Fills a block with its designs at rest. */
#pragma once

#include "block.inl.h"
#include "pump.inl.h"
#include "record.inl.h"

/* All memory that any block of the batch needs. */
static void sv_block_take(sv_block *b, const sv_batch *batch, sv_arena *arena)
{
    sv_lattice lattice = sv_lattice_of(batch);
    size_t sites = (size_t)sv_sites(lattice), links = (size_t)sv_most_links(lattice), pairs = sites * (sites - 1) / 2;
    sv_body_take(&b->body, lattice, arena);
    b->has_voxel = sv_take(arena, sites, sizeof *b->has_voxel);
    b->has_link = sv_take(arena, links, sizeof *b->has_link);
    b->voxels = sv_take(arena, sites, sizeof *b->voxels);
    b->memory = sv_take(arena, links, sizeof *b->memory);
    b->effect = sv_take(arena, links, sizeof *b->effect);
    b->pumps = sv_take(arena, sites, sizeof *b->pumps);
    b->contacts.pair = sv_take(arena, pairs, sizeof *b->contacts.pair);
    b->contacts.spare = sv_take(arena, pairs, sizeof *b->contacts.spare);
    b->contacts.push = sv_take(arena, sites, sizeof *b->contacts.push);
    b->contacts.vicinity = sv_take(arena, SV_LANES * sites, sizeof *b->contacts.vicinity);
}

static const uint8_t *sv_digits_of(const sv_block *b, int lane)
{
    return b->batch->digits + (size_t)b->design[lane] * (size_t)sv_sites(sv_lattice_of(b->batch));
}

/* Whether every number that a design brings is one that a run can end with. */
static bool sv_is_runnable(const sv_batch *batch, int32_t design)
{
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
        b->design[lane] = order[lane];
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
    sv_body_build(&b->body, lattice, occupied);
    for (int32_t v = 0; v < b->body.voxels; v++) {
        uint32_t bits = 0;
        for (int lane = 0; lane < SV_LANES; lane++)
            bits |= (uint32_t)(digits[lane][b->body.site[v]] != 0) << lane;
        b->has_voxel[v] = sv_mask_of(bits);
    }
    for (int32_t l = 0; l < b->body.links; l++)
        b->has_link[l] = b->has_voxel[b->body.link[l].a] & b->has_voxel[b->body.link[l].b];
}

static bool sv_any_may_collide(const sv_block *b, int lane)
{
    const sv_vicinity *vicinity = sv_vicinity_of(b, lane);
    for (int32_t i = 0; i < b->body.voxels; i++)
        for (int32_t j = i + 1; j < b->body.voxels; j++)
            if (sv_may_collide(vicinity, b->body.site[i], b->body.site[j]))
                return true;
    return false;
}

static void sv_set_contacts(sv_block *b, const uint8_t *digits[SV_LANES])
{
    b->contacts.count = 0;
    b->contacts.lanes = 0;
    b->contacts.travel = sv_splat(0);
    bool described = false;
    for (int lane = 0; lane < SV_LANES; lane++) {
        if (b->design[lane] < 0)
            continue;
        if (b->masked || !described)
            sv_vicinities(sv_lattice_of(b->batch), digits[lane], sv_vicinity_of(b, lane));
        described = true;
        b->contacts.lanes |= (uint32_t)sv_any_may_collide(b, lane) << lane;
    }
}

static void sv_set_voxels(sv_block *b)
{
    const double L = b->batch->edge;
    const int32_t nx = b->batch->nx, ny = b->batch->ny;
    for (int32_t v = 0; v < b->body.voxels; v++) {
        const int32_t site = b->body.site[v];
        sv_voxel *x = &b->voxels[v];
        x->place = (sv_vec3){sv_splat((site % nx + 0.5) * L), sv_splat((site / nx % ny + 0.5) * L),
                             sv_splat((site / nx / ny + 0.5) * L)};
        x->velocity = x->spin = sv_zero3();
        x->turn = (sv_quat){sv_splat(1), sv_zero3()};
        x->axes = sv_matrix(x->turn);
        x->edge = sv_splat(L);
        x->strain = sv_splat(0);
        sv_load_strain(b, v, sv_splat(0));
    }
    for (int32_t l = 0; l < b->body.links; l++)
        b->memory[l] = (sv_link_memory){sv_zero3(), sv_zero3(), sv_zero3(), sv_mask_of(0)};
}

static double sv_phase_of(const sv_block *b, int lane, int32_t v)
{
    const size_t site = (size_t)b->body.site[v];
    if (!b->batch->phase || b->design[lane] < 0 || sv_digits_of(b, lane)[site] != 2)
        return 0;
    return b->batch->phase[(size_t)b->design[lane] * (size_t)sv_sites(sv_lattice_of(b->batch)) + site];
}

/* Whether all active voxels of a lane have one phase, and which. */
static bool sv_has_one_phase(const sv_block *b, int lane, double *phase)
{
    bool found = false;
    *phase = 0;
    for (int32_t v = 0; v < b->body.voxels && b->design[lane] >= 0; v++) {
        if (sv_digits_of(b, lane)[b->body.site[v]] != 2)
            continue;
        if (found && sv_phase_of(b, lane, v) != *phase)
            return false;
        *phase = sv_phase_of(b, lane, v);
        found = true;
    }
    return true;
}

/* One pump for all voxels where no lane has two phases, else one for each voxel. */
static void sv_set_pumps(sv_block *b)
{
    double phase[SV_LANES];
    bool shared = true;
    for (int lane = 0; lane < SV_LANES; lane++)
        shared = sv_has_one_phase(b, lane, &phase[lane]) && shared;
    b->pump_count = shared ? 1 : b->body.voxels;
    for (int32_t i = 0; i < b->pump_count; i++) {
        sv_pump *p = &b->pumps[i];
        for (int lane = 0; lane < SV_LANES; lane++)
            p->phase[lane] = shared ? phase[lane] : sv_phase_of(b, lane, i);
        p->first_turn = sv_floor(b->frequency * b->settle_time + p->phase + SV_CYCLE_SLACK);
        p->cycle = sv_splat(0);
    }
}

static void sv_set_clocks(sv_block *b)
{
    b->time = sv_splat(0);
    b->step = 0;
    b->diverged = sv_mask_of(0);
    b->most_energy = sv_splat(INFINITY);
    for (int lane = 0; lane < SV_LANES; lane++) {
        b->clock[lane] = (sv_clock){.ended = b->design[lane] < 0};
        b->next_event[lane] = sv_next_event(b, lane);
    }
}

/* Sets up the designs of one row of the plan. Returns false where none of them can run. */
static bool sv_set_block(sv_block *b, const int32_t *order, uint8_t *occupied)
{
    int valid = sv_assign_designs(b, order);
    if (valid < 0)
        return false;
    const uint8_t *digits[SV_LANES];
    for (int lane = 0; lane < SV_LANES; lane++) {
        int source = b->design[lane] >= 0 ? lane : valid;
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
    sv_set_contacts(b, digits);
    sv_set_voxels(b);
    sv_set_pumps(b);
    sv_set_clocks(b);
    return true;
}
