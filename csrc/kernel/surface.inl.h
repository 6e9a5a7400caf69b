/* Which voxels of a design are near each other: its surface, sorted into cells of space. physics.md 5 */
#pragma once

#include "block.inl.h"

#include <math.h>
#include <stdlib.h>

#define SV_LIST_REACH 3.0     /* voxel widths */
#define SV_ONE_CELL 32        /* points up to which sorting them does not pay */
#define SV_POINTS_PER_CELL 8  /* or more */
#define SV_FAR_CELL (1 << 30) /* where cells end; beyond, all is one */

static int32_t sv_cell_of(double place, double edge)
{
    const double cell = floor(place / edge);
    return cell > -SV_FAR_CELL ? (cell < SV_FAR_CELL ? (int32_t)cell : SV_FAR_CELL) : -SV_FAR_CELL;
}

static uint32_t sv_hash(const sv_surface *s, int32_t x, int32_t y, int32_t z)
{
    return ((uint32_t)x * 0x8da6b343u ^ (uint32_t)y * 0xd8163841u ^ (uint32_t)z * 0xcb1ab31fu) >> 4 & (s->cells - 1);
}

static uint32_t sv_most_cells(int32_t points)
{
    uint32_t cells = 1;
    while (points > SV_ONE_CELL && cells * SV_POINTS_PER_CELL < (uint32_t)points)
        cells *= 2;
    return cells;
}

/* Puts the points into rows, cell by cell, each cell's in order. Cells are as wide as any point reaches, and a little
 * more for the rounding of their numbers. */
static void sv_sort_into_cells(sv_surface *s)
{
    s->cells = sv_most_cells(s->count);
    for (uint32_t c = 0; c <= s->cells; c++)
        s->first[c] = 0;
    for (int32_t p = 0; p < s->count; p++) {
        sv_point *point = &s->point[p];
        for (int i = 0; i < 3; i++)
            point->cell[i] = sv_cell_of(point->place[i], s->cell_edge);
        point->bucket = sv_hash(s, point->cell[0], point->cell[1], point->cell[2]);
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
        row->point[lane] = p;
    }
}

/* Takes the surface of a lane's design as it is now. */
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
        const sv_pose *pose = &b->voxels[seat.row].pose;
        s->point[s->count++] =
            (sv_point){.place = {pose->place.x[seat.lane], pose->place.y[seat.lane], pose->place.z[seat.lane]},
                       .edge = pose->edge[seat.lane],
                       .voxel = v};
        s->cell_edge = fmax(s->cell_edge, fmin(SV_LIST_REACH * b->batch->edge, 2.0 * fabs(pose->edge[seat.lane])));
    }
    s->cell_edge *= 1 + 1e-6;
    sv_sort_into_cells(s);
}

/* Adds those of a cell's points that belong on the list with point p, and come after it. */
SV_INLINE int32_t sv_search_cell(const sv_block *b, const sv_vicinity *vicinity, int32_t p, uint32_t cell,
                                 int32_t count)
{
    const sv_surface *s = &b->contacts.surface;
    const sv_point *a = &s->point[p];
    const sv_vec3 place = {sv_splat(a->place[0]), sv_splat(a->place[1]), sv_splat(a->place[2])};
    const sv_wide reach = sv_splat(SV_LIST_REACH * b->batch->edge), twice_edge = sv_splat(2.0 * a->edge);
    for (int32_t row = s->first[cell]; row < s->first[cell + 1]; row++) {
        const sv_vec3 r = sv_sub3(s->row[row].place, place);
        const sv_wide square = sv_dot3(r, r);
        uint32_t near = sv_bits(sv_lt(square, reach * reach) & sv_lt(square, twice_edge * twice_edge));
        for (; near; near &= near - 1) {
            const int32_t other = s->row[row].point[__builtin_ctz(near)];
            if (other > p && sv_may_collide(&b->body, vicinity, a->voxel, s->point[other].voxel))
                s->found[count++] = s->point[other].voxel;
        }
    }
    return count;
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

/* Finds the voxels that belong on the list with point p and come after it, in order. Returns how many there are. */
static int32_t sv_find_partners(const sv_block *b, int lane, int32_t p)
{
    const sv_surface *s = &b->contacts.surface;
    const sv_vicinity *vicinity = sv_vicinity_of(b, lane);
    if (s->cells == 1)
        return sv_search_cell(b, vicinity, p, 0, 0);
    const int32_t *cell = s->point[p].cell;
    uint32_t searched[27];
    int32_t count = 0, cells = 0;
    for (int32_t way = 0; way < 27; way++) {
        const uint32_t next = sv_hash(s, cell[0] + way % 3 - 1, cell[1] + way / 3 % 3 - 1, cell[2] + way / 9 - 1);
        bool is_new = true;
        for (int32_t i = 0; i < cells; i++)
            is_new = is_new && searched[i] != next;
        if (is_new)
            count = sv_search_cell(b, vicinity, p, searched[cells++] = next, count);
    }
    sv_sort(s->found, count);
    return count;
}
