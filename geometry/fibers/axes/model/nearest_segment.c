#include "geometry/fibers/axes/model/nearest_segment.h"

#include "base/lanes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BRICK = AXIS_BRICK, SHIFT = 5, BOUND = BRICK - 1, OFF_LINE = -1 };
static const float ROUNDING = 0.05f; /* voxels by which slabs of neighbours overlap, so that no voxel is lost */

void nearest_segments_init(struct nearest_segments *c)
{
    memset(c, 0, sizeof *c);
    for (size_t i = 0; i < AXIS_N_CELL + LANES; i++) {
        c->own2[i] = INFINITY;
        c->own[i] = OFF_LINE;
    }
}

void nearest_segments_release(struct nearest_segments *c)
{
    free(c->cell);
    free(c->first);
}

/* A brick, and a line in it. Rows of voxels run along the axis that the line is least parallel to, so that few of them
 * are near a segment, and follow each other across the axis that it is most parallel to, so that LANES of them are near
 * it at a time: coordinates are in the order of `axis`. */
struct line_view {
    const struct segment_bricks *bricks;
    const struct section_view *section;
    float tail;
    float from[3]; /* corner of the brick */
    size_t n[3];
    int axis[3];
};

/* A segment in the coordinates of its line's view, with the values that all its rows share. */
struct stamp {
    int32_t id;
    float a[3], u[3], length2, inverse_length2; /* a: begin from the corner of the brick; u: from begin to end */
    float reach2, least_t, most_t;              /* t beyond least and most lies beyond an end of the line */
    float slab, slab_u;       /* voxels beyond the ends in which it is the nearest of its line; that times |u| */
    float inverse_flat, lean; /* 1 / (1 - u0^2 / u^2), 0 if rows are along the segment; u0 / u^2 times that */
    float span_x;             /* largest |x u0| of points in reach */
    size_t lo[3], hi[3];      /* voxels of the brick in reach */
};

/* Voxels beyond the end of a segment in which it is the nearest of its line: those in the wedge of the bend to the next
 * one, up to `reach` away. */
static float wedge(const struct segment *g, const struct segment *next, float reach)
{
    float dot = 0.0f, g2 = 0.0f, next2 = 0.0f;
    for (int a = 0; a < 3; a++) {
        float u = g->b[a] - g->a[a], w = next->b[a] - next->a[a];
        dot += u * w;
        g2 += u * u;
        next2 += w * w;
    }
    if (!(dot > 0.0f)) return reach;
    float cosine2 = dot * dot / (g2 * next2);
    return cosine2 < 1.0f ? reach * sqrtf(1.0f - cosine2) : 0.0f;
}

/* An end of the line keeps the voxels beyond it from other segments. */
static float slab_of(const struct segment *g, float reach)
{
    float before = g->is_first ? reach : wedge(g, g - 1, reach), after = g->is_last ? reach : wedge(g, g + 1, reach);
    return (before > after ? before : after) + ROUNDING;
}

/* Finds the voxels of the brick within `reach` of the segment whose nearest point lies at most w->slab beyond its ends.
 * Returns false if there are none. */
static bool stamp_box(const struct line_view *v, float reach, struct stamp *w)
{
    for (int a = 0; a < 3; a++) {
        const size_t n = v->n[v->axis[a]];
        float along2 = w->u[a] * w->u[a] * w->inverse_length2;
        float wide = reach * sqrtf(along2 < 1.0f ? 1.0f - along2 : 0.0f) + w->slab * sqrtf(along2) + ROUNDING;
        float end = w->a[a] + w->u[a], low = w->a[a] < end ? w->a[a] : end, high = w->a[a] < end ? end : w->a[a];
        float l = ceilf(low - wide - 0.5f), h = floorf(high + wide - 0.5f) + 1.0f;
        if (h <= 0.0f || l >= (float)n) return false;
        w->lo[a] = l <= 0.0f ? 0 : (size_t)l;
        w->hi[a] = h >= (float)n ? n : (size_t)h;
    }
    return true;
}

/* Returns false if the segment reaches no voxel of the brick. */
static bool stamp_init(const struct line_view *v, uint32_t i_segment, int32_t id, struct stamp *w)
{
    const struct segment *g = &v->bricks->segment[i_segment];
    const float reach = (v->section != NULL ? v->section[i_segment].stretch : 1.0f) * g->radius + v->tail;
    w->id = id;
    w->length2 = 0.0f;
    for (int a = 0; a < 3; a++) {
        const int from = v->axis[a];
        w->a[a] = g->a[from] - v->from[from];
        w->u[a] = g->b[from] - g->a[from];
        w->length2 += w->u[a] * w->u[a];
    }
    w->inverse_length2 = w->length2 > 0.0f ? 1.0f / w->length2 : 0.0f;
    w->reach2 = reach * reach;
    w->slab = slab_of(g, reach);
    w->slab_u = w->slab * sqrtf(w->length2);
    w->least_t = g->is_first ? 0.0f : -INFINITY;
    w->most_t = g->is_last ? 1.0f : INFINITY;
    const float lean = w->u[0] * w->inverse_length2, flat = 1.0f - w->u[0] * lean;
    w->inverse_flat = flat < 0.1f ? 0.0f : 1.0f / flat;
    w->lean = lean * w->inverse_flat;
    w->span_x = fabsf(w->u[0]) * (reach + fabsf(w->u[0]));
    return stamp_box(v, reach, w);
}

/* The rows of a plane z from the segment's begin that its slab meets. */
static void plane_range(const struct stamp *w, float z, size_t *from, size_t *to)
{
    *from = w->lo[1];
    *to = w->hi[1];
    if (w->u[1] * w->u[1] < 0.04f * w->length2) return;
    const float inverse = 1.0f / w->u[1];
    float y0 = (-w->slab_u - w->span_x - z * w->u[2]) * inverse;
    float y1 = (w->length2 + w->slab_u + w->span_x - z * w->u[2]) * inverse;
    float lo = ceilf((y0 < y1 ? y0 : y1) + w->a[1] - 0.5f), hi = floorf((y0 < y1 ? y1 : y0) + w->a[1] - 0.5f) + 1.0f;
    if (lo > (float)*from) *from = lo < (float)*to ? (size_t)lo : *to;
    if (hi < (float)*to) *to = hi > (float)*from ? (size_t)hi : *from;
}

static const lanes STEP = {0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f};

/* The voxels in reach of LANES rows that follow each other, the first at y, z from the segment's begin. The squared
 * distance from the segment's line is x^2 / inverse_flat - 2 x u0 fixed / u^2 + y^2 + z^2 - fixed^2 / u^2. */
static void row_ranges(const struct stamp *w, float y0, float z, lane_mask *from, lane_mask *to)
{
    const lanes zero = {0.0f}, least = zero + (float)w->lo[0], most = zero + (float)w->hi[0];
    const lanes y = STEP + y0, fixed = y * w->u[1] + z * w->u[2], middle = fixed * w->lean;
    const lanes half2 =
        (w->reach2 - z * z - y * y + fixed * fixed * w->inverse_length2) * w->inverse_flat + middle * middle;
    const lanes half = lanes_sqrt(lanes_choose(half2 > zero, half2, zero)) + 1e-3f;
    const lanes along = fixed + w->u[0] * middle, span = fabsf(w->u[0]) * half;
    const lane_mask reached = (half2 > zero) & (along + span >= -w->slab_u) & (along - span <= w->length2 + w->slab_u);
    lanes lo = middle - half + (w->a[0] + 0.499f), hi = middle + half + (w->a[0] + 0.5f);
    lo = lanes_choose(lo > least, lanes_choose(lo < most, lo, most), least);
    hi = lanes_choose(hi < most, lanes_choose(hi > least, hi, least), most);
    if (w->inverse_flat == 0.0f) {
        *from = __builtin_convertvector(least, lane_mask);
        *to = __builtin_convertvector(most, lane_mask);
    } else {
        *from = __builtin_convertvector(lo, lane_mask);
        *to = __builtin_convertvector(hi, lane_mask) & reached;
    }
}

/* Gives LANES voxels of a row that follow each other to the segment where it is the nearest so far. p: of the first
 * from the segment's begin; n: of the voxels that are in the row. */
static void stamp_lanes(struct nearest_segments *c, const struct stamp *w, const float p[3], size_t at, int n)
{
    const lanes x = STEP + p[0], zero = {0.0f}, one = zero + 1.0f;
    lanes t = (x * w->u[0] + (p[1] * w->u[1] + p[2] * w->u[2])) * w->inverse_length2;
    const lane_mask beside = (t >= w->least_t) & (t <= w->most_t);
    t = lanes_choose(t < zero, zero, t);
    t = lanes_choose(t > one, one, t);
    const lanes dx = x - t * w->u[0], dy = p[1] - t * w->u[1], dz = p[2] - t * w->u[2];
    const lanes distance2 = dx * dx + dy * dy + dz * dz, old = *(const lanes *)(c->own2 + at);
    const lane_mask take = (STEP < (float)n) & (distance2 < lanes_choose(old == INFINITY, zero + w->reach2, old));
    *(lanes *)(c->own2 + at) = lanes_choose(take, distance2, old);
    lane_mask *own = (lane_mask *)(c->own + at);
    *own = (*own & ~take) | (take & ((beside & w->id) | (~beside & OFF_LINE)));
}

static void note_row(struct nearest_segments *c, size_t row, int from, int to)
{
    if (c->row_end[row] == 0) {
        c->row[c->n_row++] = (uint16_t)row;
        c->row_begin[row] = (uint8_t)from;
        c->row_end[row] = (uint8_t)to;
        return;
    }
    if (from < c->row_begin[row]) c->row_begin[row] = (uint8_t)from;
    if (to > c->row_end[row]) c->row_end[row] = (uint8_t)to;
}

/* Gives the voxels of the brick to the segment for which it is the nearest of its line so far. */
static void stamp(struct nearest_segments *c, const struct stamp *w)
{
    for (size_t k = w->lo[2]; k < w->hi[2]; k++) {
        const float z = (float)k + 0.5f - w->a[2];
        size_t j, j_end;
        lane_mask from, to;
        for (plane_range(w, z, &j, &j_end); j < j_end; j += LANES) {
            const float y = (float)j + 0.5f - w->a[1];
            row_ranges(w, y, z, &from, &to);
            for (size_t l = 0; l < LANES && j + l < j_end; l++) {
                if (from[l] >= to[l]) continue;
                const size_t row = k * BRICK + j + l;
                note_row(c, row, from[l], to[l]);
                for (int i = from[l]; i < to[l]; i += LANES) {
                    const float p[3] = {(float)i + 0.5f - w->a[0], y + (float)l, z};
                    stamp_lanes(c, w, p, row * BRICK + (size_t)i, to[l] - i);
                }
            }
        }
    }
}

/* Chooses the order of the axes for a line of the brick: n segments of its list. */
static void choose_axes(struct line_view *v, const uint32_t *index, size_t n)
{
    float along[3] = {0.0f, 0.0f, 0.0f};
    for (size_t e = 0; e < n; e++)
        for (int a = 0; a < 3; a++)
            along[a] += fabsf(v->bricks->segment[index[e]].b[a] - v->bricks->segment[index[e]].a[a]);
    v->axis[0] = along[0] <= along[1] && along[0] <= along[2] ? 0 : along[1] <= along[2] ? 1 : 2;
    const int a = v->axis[0] == 0 ? 1 : 0, b = 3 - v->axis[0] - a;
    v->axis[1] = along[a] <= along[b] ? a : b;
    v->axis[2] = along[a] <= along[b] ? b : a;
}

static bool make_room(struct nearest_segments *c, size_t n_voxel)
{
    if (n_voxel + LANES <= c->capacity) return true;
    size_t n = 2 * n_voxel + AXIS_N_CELL;
    uint16_t *bigger = realloc(c->cell, n * sizeof *bigger);
    if (bigger == NULL) return false;
    c->cell = bigger;
    c->capacity = n;
    return true;
}

/* Counts the voxels of the line's segments, and returns the number of voxels in the ranges of its rows. place: by
 * number in the brick's list; OFF_LINE counts the others, so that no branch depends on a voxel. */
static uint32_t count_voxels(const struct nearest_segments *c, uint32_t *place)
{
    uint32_t n = 0;
    for (size_t r = 0; r < c->n_row; r++) {
        const size_t row = c->row[r], begin = row * BRICK + c->row_begin[row], end = row * BRICK + c->row_end[row];
        for (size_t at = begin; at < end; at++) place[c->own[at]]++;
        n += (uint32_t)(end - begin);
    }
    return n;
}

/* Writes the voxels to their places, and makes the work ready for the next line. */
static void place_voxels(struct nearest_segments *c, const int axis[3], uint32_t *place)
{
    for (size_t r = 0; r < c->n_row; r++) {
        const uint32_t row = c->row[r];
        const uint32_t start = (row & BOUND) << SHIFT * axis[1] | row >> SHIFT << SHIFT * axis[2];
        for (uint32_t i = c->row_begin[row]; i < c->row_end[row]; i++) {
            const uint32_t at = row * BRICK + i;
            c->cell[place[c->own[at]]++] = (uint16_t)(start | i << SHIFT * axis[0]);
            c->own2[at] = INFINITY;
            c->own[at] = OFF_LINE;
        }
        c->row_end[row] = 0;
    }
    c->n_row = 0;
}

/* Sorts the voxels of a line by their nearest segment: the voxels of segments first .. end - 1 of the brick's list
 * follow the voxels of the lines before. Voxels without a nearest segment go behind them, where the next line
 * writes. */
static bool store_voxels(struct nearest_segments *c, const int axis[3], size_t first, size_t end)
{
    uint32_t *place = c->first + 1; /* of segment e in place[e]: number of its voxels, then begin, then end */
    memset(place + first, 0, (end - first) * sizeof *place);
    uint32_t begin = c->first[first];
    if (!make_room(c, begin + count_voxels(c, place))) return false;
    for (size_t e = first; e < end; e++) {
        const uint32_t n = place[e];
        place[e] = begin;
        begin += n;
    }
    place[OFF_LINE] = begin;
    place_voxels(c, axis, place);
    place[OFF_LINE] = 0; /* the begin of the first segment's voxels */
    return true;
}

/* Makes room for n_segment segments. */
static bool start(struct nearest_segments *c, size_t n_segment)
{
    if (n_segment + 1 > c->first_capacity) {
        free(c->first);
        c->first_capacity = 2 * n_segment + 1;
        c->first = malloc(c->first_capacity * sizeof *c->first);
    }
    if (c->first == NULL) c->first_capacity = 0;
    if (c->first == NULL || !make_room(c, 0)) return false;
    c->first[0] = 0;
    return true;
}

bool nearest_segments_find(struct nearest_segments *c, const struct segment_bricks *bricks,
                           const struct section_view *section, float tail, size_t i_brick)
{
    const uint32_t *index = bricks->index + bricks->first[i_brick];
    const size_t n_segment = bricks->first[i_brick + 1] - bricks->first[i_brick];
    struct line_view v = {.bricks = bricks, .section = section, .tail = tail};
    size_t from[3];
    if (!start(c, n_segment)) return false;
    segment_brick_box(bricks, i_brick, from, v.n);
    for (int a = 0; a < 3; a++) v.from[a] = (float)from[a];
    for (size_t e = 0, end; e < n_segment; e = end) {
        const uint32_t line = bricks->segment[index[e]].line;
        for (end = e; end < n_segment && bricks->segment[index[end]].line == line; end++) continue;
        choose_axes(&v, index + e, end - e);
        for (size_t i = e; i < end; i++) {
            struct stamp w;
            if (stamp_init(&v, index[i], (int32_t)i, &w)) stamp(c, &w);
        }
        if (!store_voxels(c, v.axis, e, end)) return false;
    }
    memset(c->cell + c->first[n_segment], 0, LANES * sizeof *c->cell);
    return true;
}
