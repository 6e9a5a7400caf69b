/* Seats the designs of a batch: many to a block, a lane each, or one across the lanes. A block costs what its union of
 * bodies costs, so designs of one body plan go together, and those left over join the ones they resemble most. The
 * seating changes the speed, never a result. */
#include "body.h"
#include "kernels.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const uint8_t *digits;        /* [sites] */
    const sv_parameters *pace;    /* of a design that has to keep step with those of its block, or NULL */
    int32_t sites, design, taken; /* taken: steps before */
} sv_entry;

/* Designs entry[first] ... entry[first + count - 1], all of one body plan: what a block of them costs, and one alone.
 */
typedef struct {
    int32_t first, count, voxels;
    int64_t cost, across;
} sv_group;

/* Designs that may share a block: what it would cost, and what each would across the lanes. */
typedef struct {
    int32_t design[SV_MOST_LANES], count, voxels;
    int64_t cost, across[SV_MOST_LANES];
} sv_row;

typedef struct {
    int64_t cost;
    int32_t row;
} sv_ranked_row;

typedef struct {
    const sv_batch *batch;
    sv_lattice lattice;
    int32_t sites;
    sv_entry *entries;
    sv_group *groups;
    int32_t group_count;
    uint8_t *joined, *trial; /* [sites] unions of occupied sites */
    sv_ranked_row *ranks;
    int32_t *rows; /* copy of the plan's order, to sort it */
} sv_planner;

/* Time per step, in one unit for all: of a row of voxels or links, a design per lane; of a masked link; and of a body
 * across the lanes. */
static const int64_t sv_voxel_cost = 9, sv_link_cost = 27, sv_masked_link_cost = 30;
static const int64_t sv_across_cost = 10, sv_across_voxel_cost = 20, sv_across_link_cost = 45;

static const int32_t sv_most_candidates = 256; /* groups tried to fill a block */

static void sv_planner_take(sv_planner *p, const sv_batch *batch, sv_arena *arena)
{
    size_t n = (size_t)batch->n;
    p->batch = batch;
    p->lattice = (sv_lattice){batch->nx, batch->ny, batch->nz};
    p->sites = sv_sites(p->lattice);
    p->entries = sv_take(arena, n, sizeof *p->entries);
    p->groups = sv_take(arena, n, sizeof *p->groups);
    p->joined = sv_take(arena, (size_t)p->sites, 1);
    p->trial = sv_take(arena, (size_t)p->sites, 1);
    p->ranks = sv_take(arena, n, sizeof *p->ranks);
    p->rows = sv_take(arena, n * SV_MOST_LANES, sizeof *p->rows);
}

static int sv_compare_numbers(double a, double b)
{
    return (a > b) - (a < b);
}

/* Orders designs that have to keep step by what that takes; 0 where they can. */
static int sv_compare_paces(const sv_entry *a, const sv_entry *b)
{
    const sv_parameters *p = a->pace, *q = b->pace;
    if (!p)
        return 0;
    int order = sv_compare_numbers(p->time_step, q->time_step);
    order = order ? order : sv_compare_numbers(p->frequency_hz, q->frequency_hz);
    order = order ? order : sv_compare_numbers(p->duration, q->duration);
    return order ? order : sv_compare_numbers(a->taken, b->taken);
}

/* Orders designs by pace, then by body plan. */
static int sv_compare_plans(const sv_entry *a, const sv_entry *b)
{
    const int order = sv_compare_paces(a, b);
    for (int32_t s = 0; s < a->sites && !order; s++)
        if (!a->digits[s] != !b->digits[s])
            return a->digits[s] ? 1 : -1;
    return order;
}

static int sv_by_plan(const void *left, const void *right)
{
    const sv_entry *a = left, *b = right;
    int order = sv_compare_plans(a, b);
    return order ? order : (a->design > b->design) - (a->design < b->design);
}

static int sv_by_cost(const void *left, const void *right)
{
    const sv_group *a = left, *b = right;
    if (a->cost != b->cost)
        return a->cost < b->cost ? 1 : -1;
    return (a->first > b->first) - (a->first < b->first);
}

static int sv_by_rank(const void *left, const void *right)
{
    const sv_ranked_row *a = left, *b = right;
    if (a->cost != b->cost)
        return a->cost < b->cost ? 1 : -1;
    return (a->row > b->row) - (a->row < b->row);
}

/* Of a block whose designs have a lane each. */
static int64_t sv_cost(sv_size size, int64_t cost_per_link)
{
    return size.voxels * sv_voxel_cost + size.links * cost_per_link;
}

/* The group of a design, so far of it alone. */
static sv_group sv_group_of(const sv_planner *p, int32_t first, int32_t lanes)
{
    const sv_size size = sv_size_of(p->lattice, p->entries[first].digits);
    const int64_t voxel_rows = (size.voxels + lanes - 1) / lanes, link_rows = (size.links + lanes - 1) / lanes;
    return (sv_group){.first = first,
                      .count = 1,
                      .voxels = size.voxels,
                      .cost = sv_cost(size, sv_link_cost),
                      .across = sv_across_cost + voxel_rows * sv_across_voxel_cost + link_rows * sv_across_link_cost};
}

static bool sv_is_empty(const uint8_t *digits, int32_t sites)
{
    for (int32_t s = 0; s < sites; s++)
        if (digits[s])
            return false;
    return true;
}

/* Sorts the designs by body plan; those without a voxel are not simulated. */
static void sv_find_groups(sv_planner *p, const sv_plan *plan)
{
    int32_t count = 0;
    for (int32_t design = 0; design < p->batch->n; design++) {
        const uint8_t *digits = p->batch->digits + (size_t)design * (size_t)p->sites;
        if (!sv_is_empty(digits, p->sites))
            p->entries[count++] = (sv_entry){digits, plan->in_step ? &p->batch->parameters[design] : NULL, p->sites,
                                             design, p->batch->resumed ? p->batch->resumed[design] : 0};
    }
    qsort(p->entries, (size_t)count, sizeof *p->entries, sv_by_plan);
    p->group_count = 0;
    for (int32_t i = 0; i < count; i++) {
        if (i > 0 && sv_compare_plans(&p->entries[i], &p->entries[i - 1]) == 0)
            p->groups[p->group_count - 1].count++;
        else
            p->groups[p->group_count++] = sv_group_of(p, i, plan->lanes);
    }
    qsort(p->groups, (size_t)p->group_count, sizeof *p->groups, sv_by_cost);
}

/* Moves designs of a group into free lanes of a row. */
static void sv_assign(const sv_planner *p, sv_group *g, sv_row *row, int32_t lanes)
{
    for (; g->count > 0 && row->count < lanes; g->count--) {
        row->across[row->count] = g->across;
        row->design[row->count++] = p->entries[g->first++].design;
    }
}

/* Adds a row of designs to the plan, with `filler` in its other lanes. */
static void sv_add_row(sv_planner *p, sv_plan *plan, const int32_t *design, int32_t count, int32_t filler, int64_t cost)
{
    int32_t *row = plan->order + (size_t)plan->blocks * (size_t)plan->lanes;
    for (int32_t lane = 0; lane < plan->lanes; lane++)
        row[lane] = lane < count ? design[lane] : filler;
    p->ranks[plan->blocks] = (sv_ranked_row){cost, plan->blocks};
    plan->blocks++;
}

/* Seats the designs of a row as is faster: each across the lanes, or a lane each where that is possible. */
static void sv_seat_row(sv_planner *p, sv_plan *plan, const sv_row *row)
{
    int64_t across = 0;
    for (int32_t i = 0; i < row->count; i++)
        across += row->across[i];
    const bool apart = plan->seating == SV_ALL_APART || (plan->seating == SV_BY_TIME && row->cost < across);
    if (apart && row->voxels <= SV_MOST_APART)
        sv_add_row(p, plan, row->design, row->count, SV_NO_DESIGN, row->cost);
    else
        for (int32_t i = 0; i < row->count; i++)
            sv_add_row(p, plan, &row->design[i], 1, SV_ACROSS, row->across[i]);
}

static void sv_unite(uint8_t *joined, const uint8_t *more, int32_t sites)
{
    for (int32_t s = 0; s < sites; s++)
        joined[s] |= more[s];
}

/* The group that saves most against a block of its own, or -1 where none saves anything. */
static int32_t sv_best_partner(const sv_planner *p, int32_t after, int32_t room, sv_row *row)
{
    int32_t best = -1, tried = 0;
    int64_t best_saving = 0, cost = row->cost;
    for (int32_t g = after + 1; g < p->group_count && tried < sv_most_candidates; g++) {
        const sv_group *candidate = &p->groups[g];
        if (candidate->count == 0)
            continue;
        tried++;
        if (candidate->count > room ||
            sv_compare_paces(&p->entries[p->groups[after].first - 1], &p->entries[candidate->first]) != 0)
            continue;
        memcpy(p->trial, p->joined, (size_t)p->sites);
        sv_unite(p->trial, p->entries[candidate->first].digits, p->sites);
        const sv_size joint = sv_size_of(p->lattice, p->trial);
        const int64_t joint_cost = sv_cost(joint, sv_masked_link_cost), saving = cost + candidate->cost - joint_cost;
        if (saving > best_saving && joint.voxels <= SV_MOST_APART) {
            best_saving = saving;
            best = g;
            row->voxels = joint.voxels;
            row->cost = joint_cost;
        }
    }
    return best;
}

/* A row of what is left of group g, filled up with others while that saves work. */
static sv_row sv_fill_row(sv_planner *p, int32_t g, int32_t lanes)
{
    sv_row row = {.voxels = p->groups[g].voxels, .cost = p->groups[g].cost};
    memcpy(p->joined, p->entries[p->groups[g].first].digits, (size_t)p->sites);
    sv_assign(p, &p->groups[g], &row, lanes);
    while (row.count < lanes && row.voxels <= SV_MOST_APART) {
        int32_t partner = sv_best_partner(p, g, lanes - row.count, &row);
        if (partner < 0)
            break;
        sv_unite(p->joined, p->entries[p->groups[partner].first].digits, p->sites);
        sv_assign(p, &p->groups[partner], &row, lanes);
    }
    return row;
}

/* Costly blocks first, so that threads finish together. */
static void sv_sort_rows(sv_planner *p, sv_plan *plan)
{
    size_t lanes = (size_t)plan->lanes, blocks = (size_t)plan->blocks;
    if (blocks == 0)
        return;
    memcpy(p->rows, plan->order, blocks * lanes * sizeof *p->rows);
    qsort(p->ranks, blocks, sizeof *p->ranks, sv_by_rank);
    for (size_t i = 0; i < blocks; i++)
        memcpy(plan->order + i * lanes, p->rows + (size_t)p->ranks[i].row * lanes, lanes * sizeof *p->rows);
}

int64_t sv_plan_scratch(const sv_batch *batch)
{
    sv_arena arena = sv_arena_in(NULL);
    sv_planner p;
    sv_planner_take(&p, batch, &arena);
    return (int64_t)sv_arena_bytes(&arena);
}

int32_t sv_plan_batch(const sv_batch *batch, sv_plan *plan, void *scratch)
{
    if (sv_batch_error(batch) || plan->lanes < 2 || plan->lanes > SV_MOST_LANES)
        return SV_BAD_BATCH;
    sv_arena arena = sv_arena_in(scratch);
    sv_planner p;
    sv_planner_take(&p, batch, &arena);
    plan->blocks = 0;
    sv_find_groups(&p, plan);
    for (int32_t g = 0; g < p.group_count; g++) {
        while (p.groups[g].count >= plan->lanes) {
            sv_row row = {.voxels = p.groups[g].voxels, .cost = p.groups[g].cost};
            sv_assign(&p, &p.groups[g], &row, plan->lanes);
            sv_seat_row(&p, plan, &row);
        }
    }
    for (int32_t g = 0; g < p.group_count; g++) {
        if (p.groups[g].count > 0) {
            const sv_row row = sv_fill_row(&p, g, plan->lanes);
            sv_seat_row(&p, plan, &row);
        }
    }
    sv_sort_rows(&p, plan);
    sv_give_back(&arena);
    return SV_DONE;
}
