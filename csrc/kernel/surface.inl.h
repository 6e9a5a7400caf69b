/* Which voxels of a design are near each other: its surface, sorted into cells of space. physics.md 5 */
#pragma once

#include "block.inl.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SV_LIST_REACH 3.0     /* voxel widths */
#define SV_ONE_CELL 32        /* points up to which sorting them does not pay */
#define SV_POINTS_PER_CELL 8  /* or more */
#define SV_FAR_CELL (1 << 30) /* where cells end; beyond, all is one */

static int32_t sv_cell_of(double place, double edge)
{
    const double cell = floor(place / edge);
    return cell > -SV_FAR_CELL ? (cell < SV_FAR_CELL ? (int32_t)cell : SV_FAR_CELL) : -SV_FAR_CELL;
}

/* The cell of a place: space is folded into a box of cells, at least four each way, so that neighbours differ. */
static uint32_t sv_fold(const sv_surface *s, int32_t x, int32_t y, int32_t z)
{
    const uint32_t along_x = (uint32_t)x & ((1u << s->bits[0]) - 1), along_y = (uint32_t)y & ((1u << s->bits[1]) - 1),
                   along_z = (uint32_t)z & ((1u << s->bits[2]) - 1);
    return along_x | (along_y | along_z << s->bits[1]) << s->bits[0];
}

/* How many times to halve space each way for so many points. Returns the cells. */
static uint32_t sv_set_bits(int32_t points, uint8_t bits[3])
{
    uint32_t all = 0;
    if (points > SV_ONE_CELL)
        for (all = 6; (SV_POINTS_PER_CELL << all) < points;)
            all++;
    for (uint32_t i = 0; i < 3; i++)
        bits[i] = (uint8_t)((all + 2 - i) / 3);
    return 1u << all;
}

/* Puts the points into rows, cell by cell, each cell's in order. Cells are as wide as any point reaches, and a little
 * more for the rounding of their numbers. */
static void sv_sort_into_cells(sv_surface *s)
{
    s->cells = sv_set_bits(s->count, s->bits);
    for (uint32_t c = 0; c <= s->cells; c++)
        s->first[c] = 0;
    for (int32_t p = 0; p < s->count; p++) {
        sv_point *point = &s->point[p];
        for (int i = 0; i < 3; i++)
            point->cell[i] = sv_cell_of(point->place[i], s->cell_edge);
        point->bucket = sv_fold(s, point->cell[0], point->cell[1], point->cell[2]);
        s->first[point->bucket + 1]++;
    }
    for (uint32_t c = 0; c < s->cells; c++) {
        const int32_t rows = (s->first[c + 1] + SV_LANES - 1) / SV_LANES;
        s->filled[c] = s->first[c] * SV_LANES;
        s->first[c + 1] = s->first[c] + rows;
    }
    for (int32_t row = 0; row < s->first[s->cells]; row++)
        s->row[row].place.x = sv_splat(NAN);
    for (int32_t p = 0; p < s->count; p++) {
        const sv_point *point = &s->point[p];
        const int32_t at = s->filled[point->bucket]++, lane = at % SV_LANES;
        sv_cell_row *row = &s->row[at / SV_LANES];
        row->place.x[lane] = point->place[0];
        row->place.y[lane] = point->place[1];
        row->place.z[lane] = point->place[2];
        row->point[lane] = row->last = p;
    }
}

/* Remembers where the voxels of a lane's design are now. */
static void sv_mark_spots(sv_block *b, int lane)
{
    for (int32_t row = 0; row < b->rows; row++) {
        const sv_spot now = {b->voxels[row].pose.place, b->voxels[row].pose.edge};
        const sv_mask all = sv_mask_of(~0u), here = b->is_across ? all : sv_mask_of(1u << lane);
        sv_spot *spot = &b->contacts.spot[row];
        spot->place = sv_select3(here, now.place, spot->place);
        spot->edge = sv_select(here, now.edge, spot->edge);
    }
}

/* Takes the surface of a lane's design from where its voxels were. */
static void sv_take_surface(sv_block *b, int lane)
{
    sv_surface *s = &b->contacts.surface;
    const sv_vicinity *vicinity = sv_vicinity_of(b, lane);
    s->count = 0;
    s->cell_edge = b->batch->edge;
    for (int32_t v = 0; v < b->body.voxels; v++) {
        if (!vicinity[v].on_surface)
            continue;
        const sv_seat seat = sv_seat_of(b, lane, v);
        const sv_spot *spot = &b->contacts.spot[seat.row];
        const double edge = spot->edge[seat.lane];
        s->point[s->count++] =
            (sv_point){.place = {spot->place.x[seat.lane], spot->place.y[seat.lane], spot->place.z[seat.lane]},
                       .edge = edge,
                       .voxel = v};
        s->cell_edge = fmax(s->cell_edge, fmin(SV_LIST_REACH * b->batch->edge, 2.0 * fabs(edge)));
    }
    s->cell_edge *= 1 + 1e-6;
    sv_sort_into_cells(s);
}

static int sv_by_number(const void *left, const void *right)
{
    const int32_t a = *(const int32_t *)left, b = *(const int32_t *)right;
    return (a > b) - (a < b);
}

static void sv_sort(int32_t *number, int32_t count)
{
    if (count > SV_ONE_CELL) {
        qsort(number, (size_t)count, sizeof *number, sv_by_number);
        return;
    }
    for (int32_t i = 1; i < count; i++) {
        const int32_t next = number[i];
        int32_t at = i;
        for (; at > 0 && number[at - 1] > next; at--)
            number[at] = number[at - 1];
        number[at] = next;
    }
}

/* Gathers the rows of the cells around point p that have later points, if the point before was not in the same cell. */
static void sv_gather_rows(sv_surface *s, int32_t p)
{
    const sv_point *point = &s->point[p];
    if (s->gathered && memcmp(point->cell, s->gathered->cell, sizeof point->cell) == 0)
        return;
    s->gathered = point;
    s->around_count = 0;
    for (int32_t way = 0; way < (s->cells > 1 ? 27 : 1); way++) {
        const int32_t *at = point->cell;
        const uint32_t cell = sv_fold(s, at[0] + way % 3 - 1, at[1] + way / 3 % 3 - 1, at[2] + way / 9 - 1);
        for (int32_t row = s->first[cell]; row < s->first[cell + 1]; row++)
            if (s->row[row].last > p)
                s->around[s->around_count++] = row;
    }
}

/* Finds the voxels that belong on the list with point p and come after it, in order. Returns how many there are. */
static int32_t sv_find_partners(sv_block *b, int lane, int32_t p)
{
    sv_surface *s = &b->contacts.surface;
    const sv_vicinity *vicinity = sv_vicinity_of(b, lane);
    const sv_point *a = &s->point[p];
    const sv_vec3 place = {sv_splat(a->place[0]), sv_splat(a->place[1]), sv_splat(a->place[2])};
    const double reach = SV_LIST_REACH * b->batch->edge, twice_edge = 2.0 * a->edge;
    const sv_wide reach_squared = sv_splat(reach * reach), edge_squared = sv_splat(twice_edge * twice_edge);
    const int32_t *around = s->around;
    sv_gather_rows(s, p);
    int32_t count = 0;
    for (int32_t i = 0; i < s->around_count; i++) {
        const sv_cell_row *row = &s->row[around[i]];
        const sv_vec3 r = sv_sub3(row->place, place);
        const sv_wide square = sv_dot3(r, r);
        uint32_t near = sv_bits(sv_lt(square, reach_squared) & sv_lt(square, edge_squared));
        for (; near; near &= near - 1) {
            const int32_t other = row->point[__builtin_ctz(near)];
            if (other > p && !sv_is_near(&b->body, vicinity, a->voxel, s->point[other].voxel))
                s->found[count++] = s->point[other].voxel;
        }
    }
    sv_sort(s->found, count);
    return count;
}
