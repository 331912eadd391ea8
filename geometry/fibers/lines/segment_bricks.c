#include "geometry/fibers/lines/segment_bricks.h"

#include "base/lanes.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

void segment_bricks_release(struct segment_bricks *s)
{
    if (s == NULL) return;
    free(s->segment);
    free(s->first);
    free(s->index);
    *s = (struct segment_bricks){0};
}

static void brick_range(const struct segment_bricks *s, const struct segment *g, float reach, size_t from[3],
                        size_t to[3])
{
    const float inverse = 1.0f / (float)s->edge;
    for (int a = 0; a < 3; a++) {
        float low = g->a[a] < g->b[a] ? g->a[a] : g->b[a], high = g->a[a] < g->b[a] ? g->b[a] : g->a[a];
        float lo = (low - reach) * inverse, hi = (high + reach) * inverse, last = (float)(s->n_brick[a] - 1);
        from[a] = lo <= 0.0f ? 0 : lo >= last ? s->n_brick[a] - 1 : (size_t)lo;
        to[a] = hi <= 0.0f ? 0 : hi >= last ? s->n_brick[a] - 1 : (size_t)hi;
    }
}

/* Counting pass and filling pass of a compressed row list. */
static void sort_segments(struct segment_bricks *s, const float *reach, bool fill)
{
    for (size_t i = 0; i < s->n_segment; i++) {
        size_t from[3], to[3], b[3];
        brick_range(s, &s->segment[i], reach != NULL ? reach[i] : s->reach, from, to);
        for (b[2] = from[2]; b[2] <= to[2]; b[2]++)
            for (b[1] = from[1]; b[1] <= to[1]; b[1]++)
                for (b[0] = from[0]; b[0] <= to[0]; b[0]++) {
                    size_t brick = (b[2] * s->n_brick[1] + b[1]) * s->n_brick[0] + b[0];
                    if (fill)
                        s->index[s->first[brick + 1]++] = (uint32_t)i;
                    else
                        s->first[brick + 2]++;
                }
    }
}

/* reach: of each segment; NULL: s->reach */
static status sort_all(struct segment_bricks *s, const float *reach, struct error *err)
{
    size_t n = segment_n_brick(s);
    s->first = calloc(n + 2, sizeof *s->first);
    if (s->first == NULL) goto no_memory;
    sort_segments(s, reach, false);
    for (size_t b = 2; b <= n + 1; b++) s->first[b] += s->first[b - 1];
    s->index = malloc((s->first[n + 1] + 1) * sizeof *s->index);
    if (s->index == NULL) goto no_memory;
    sort_segments(s, reach, true);
    return STATUS_OK;
no_memory:
    segment_bricks_release(s);
    return error_set(err, STATUS_NO_MEMORY, "cannot sort fiber segments: out of memory");
}

static status start(struct segment_bricks *s, size_t n_segment, const size_t n_voxel[3], size_t edge, float reach,
                    struct error *err)
{
    *s = (struct segment_bricks){.edge = edge, .reach = reach};
    memcpy(s->n_voxel, n_voxel, sizeof s->n_voxel);
    for (int a = 0; a < 3; a++) s->n_brick[a] = (n_voxel[a] + edge - 1) / edge;
    if (n_segment >= UINT32_MAX) return error_set(err, STATUS_TOO_LARGE, "cannot sort fiber segments: over 2^32");
    s->segment = malloc((n_segment + 1) * sizeof *s->segment);
    if (s->segment == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot sort fiber segments: out of memory");
    return STATUS_OK;
}

/* Writes the segments of the lines, and returns their number. */
static size_t write_segments(const struct polyline_set *lines, struct segment *segment)
{
    size_t n = 0;
    for (size_t l = 0; l < lines->n_line; l++)
        for (size_t i = lines->first[l]; i + 1 < lines->first[l + 1]; i++) {
            struct segment *g = &segment[n++];
            memcpy(g->a, lines->vertex[i], sizeof g->a);
            memcpy(g->b, lines->vertex[i + 1], sizeof g->b);
            g->line = (uint32_t)l;
            g->axis = lines->axis[l];
            g->radius = polyline_segment_radius(lines, l, i);
            g->is_first = i == lines->first[l];
            g->is_last = i + 2 == lines->first[l + 1];
        }
    return n;
}

/* Makes the segments, without the lists of the bricks. */
static status take_lines(struct segment_bricks *s, const struct polyline_set *lines, const size_t n_voxel[3],
                         size_t edge, float reach, struct error *err)
{
    status st = start(s, lines->n_vertex, n_voxel, edge, reach, err);
    if (st == STATUS_OK) s->n_segment = write_segments(lines, s->segment);
    return st;
}

status segment_bricks_move(struct segment_bricks *s, const struct polyline_set *lines, struct segment **first,
                           struct error *err)
{
    struct segment *moved = *first != NULL ? s->segment : malloc((lines->n_vertex + 1) * sizeof *moved);
    if (moved == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot sort fiber segments: out of memory");
    if (*first == NULL) *first = s->segment;
    s->segment = moved;
    write_segments(lines, moved);
    return STATUS_OK;
}

status segment_bricks_init(struct segment_bricks *s, const struct polyline_set *lines, const size_t n_voxel[3],
                           size_t edge, float reach, struct error *err)
{
    status st = take_lines(s, lines, n_voxel, edge, reach, err);
    return st == STATUS_OK ? sort_all(s, NULL, err) : st;
}

status segment_bricks_init_each(struct segment_bricks *s, const struct polyline_set *lines, const size_t n_voxel[3],
                                size_t edge, const float *reach, struct error *err)
{
    status st = take_lines(s, lines, n_voxel, edge, 0.0f, err);
    for (size_t i = 0; st == STATUS_OK && i < s->n_segment; i++) s->reach = fmaxf(s->reach, reach[i]);
    return st == STATUS_OK ? sort_all(s, reach, err) : st;
}

status segment_bricks_from_fibers(struct segment_bricks *s, const struct fiber_set *f, const size_t n_voxel[3],
                                  const double voxel_size_m[3], size_t edge, float reach, struct error *err)
{
    status st = start(s, f->n_vertex, n_voxel, edge, reach, err);
    if (st != STATUS_OK) return st;
    for (size_t l = 0; l < f->n_fiber; l++)
        for (size_t i = f->first_vertex[l]; i + 1 < f->first_vertex[l + 1]; i++) {
            struct segment *g = &s->segment[s->n_segment++];
            for (size_t a = 0; a < 3; a++) {
                g->a[a] = (float)((double)f->position_m[3 * i + a] / voxel_size_m[a]);
                g->b[a] = (float)((double)f->position_m[3 * i + 3 + a] / voxel_size_m[a]);
            }
            g->line = (uint32_t)l;
            g->axis = f->axis_class[l];
            g->radius = (float)(0.5 * ((double)fiber_radius_m(f, l, i) + (double)fiber_radius_m(f, l, i + 1)) /
                                voxel_size_m[0]);
            g->is_first = i == f->first_vertex[l];
            g->is_last = i + 2 == f->first_vertex[l + 1];
        }
    return sort_all(s, NULL, err);
}

void segment_brick_box(const struct segment_bricks *s, size_t i_brick, size_t from[3], size_t n[3])
{
    size_t b[3] = {i_brick % s->n_brick[0], i_brick / s->n_brick[0] % s->n_brick[1],
                   i_brick / (s->n_brick[0] * s->n_brick[1])};
    for (int a = 0; a < 3; a++) {
        from[a] = b[a] * s->edge;
        n[a] = from[a] + s->edge <= s->n_voxel[a] ? s->edge : s->n_voxel[a] - from[a];
    }
}

struct point_lattice segment_brick_lattice(const struct segment_bricks *s, size_t i_brick, size_t factor)
{
    struct point_lattice l = {.spacing = 1.0f / (float)factor};
    size_t from[3], n[3];
    segment_brick_box(s, i_brick, from, n);
    for (int a = 0; a < 3; a++) {
        l.origin[a] = (float)from[a];
        l.n[a] = n[a] * factor;
    }
    return l;
}

/* A segment seen from the lattice: the numbers that the inner loops need. */
struct view {
    float u[3], inverse2;       /* b - a, 1 / |u|^2 */
    float inverse;              /* 1 / |u| */
    float from_voxel, to_voxel; /* slab along u, measured from a in voxels */
    float across[3];            /* distance by which points at `reach` may lie beyond the segment's box on each axis */
};

static struct view view_of(const struct segment *g, float reach)
{
    struct view w = {.u = {g->b[0] - g->a[0], g->b[1] - g->a[1], g->b[2] - g->a[2]}};
    float length2 = w.u[0] * w.u[0] + w.u[1] * w.u[1] + w.u[2] * w.u[2], length = sqrtf(length2);
    w.inverse2 = length2 > 0.0f ? 1.0f / length2 : 0.0f;
    w.inverse = sqrtf(w.inverse2);
    w.from_voxel = g->is_first || !(length2 > 0.0f) ? -reach : -1.0f;
    w.to_voxel = length + (g->is_last || !(length2 > 0.0f) ? reach : 1.0f);
    for (int a = 0; a < 3; a++) {
        float c = length2 > 0.0f ? w.u[a] / length : 0.0f;
        w.across[a] = g->is_first || g->is_last
                          ? reach
                          : fminf(reach, reach * sqrtf(fmaxf(0.0f, 1.0f - c * c)) + fabsf(c) + 0.1f);
    }
    return w;
}

/* Finds the points of the lattice along each axis that the segment may be nearest to. Returns false if there are
 * none. */
static bool lattice_range(const struct point_lattice *l, const struct segment *g, const struct view *w, size_t from[3],
                          size_t to[3])
{
    for (int a = 0; a < 3; a++) {
        float lo = (fminf(g->a[a], g->b[a]) - w->across[a] - l->origin[a]) / l->spacing - 0.5f;
        float hi = (fmaxf(g->a[a], g->b[a]) + w->across[a] - l->origin[a]) / l->spacing - 0.5f;
        if (hi < 0.0f || lo > (float)(l->n[a] - 1)) return false;
        from[a] = lo <= 0.0f ? 0 : (size_t)ceilf(lo);
        to[a] = hi >= (float)(l->n[a] - 1) ? l->n[a] - 1 : (size_t)hi;
        if (from[a] > to[a]) return false;
    }
    return true;
}

/* Points of a lattice that follow each other along x: (x0 + i spacing, y, z) for i < n, relative to the segment's
 * end a. */
struct lattice_row {
    float x0, spacing, y, z;
    size_t n;
};

/* Largest |x| in a row. */
static float reach_of_row(const struct lattice_row *r)
{
    return fmaxf(fabsf(r->x0), fabsf(r->x0 + r->spacing * (float)r->n));
}

/* Finds the part from .. to - 1 of a row that lies in the slab. Returns false if there is none. */
static bool slab_range(const struct view *w, const struct lattice_row *r, size_t *from, size_t *to)
{
    float c = w->u[0] * w->inverse, fixed = (r->y * w->u[1] + r->z * w->u[2]) * w->inverse;
    *from = 0;
    *to = r->n;
    if (fabsf(c) < 0.05f)
        return fixed > w->from_voxel - reach_of_row(r) * 0.05f && fixed < w->to_voxel + reach_of_row(r) * 0.05f;
    float x0 = (w->from_voxel - fixed) / c, x1 = (w->to_voxel - fixed) / c;
    float lo = (fminf(x0, x1) - r->x0) / r->spacing, hi = (fmaxf(x0, x1) - r->x0) / r->spacing;
    if (hi < 0.0f || lo > (float)(r->n - 1)) return false;
    if (lo > 0.0f) *from = (size_t)ceilf(lo);
    if (hi < (float)(r->n - 1)) *to = (size_t)hi + 1;
    return *from < *to;
}

static const lanes STEP = {0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f};

/* Gives the points of a row to the segment where it is the nearest so far. LANES points beyond the row are read too,
 * and written as they are. */
static void stamp_row(const struct view *w, const struct lattice_row *r, uint32_t id, float *distance2,
                      uint32_t *nearest)
{
    const float along_y = r->y * w->u[1], along_z = r->z * w->u[2];
    const lanes zero = {0.0f}, one = zero + 1.0f;
    for (size_t i = 0; i < r->n; i += LANES) {
        const lanes x = r->x0 + (STEP + (float)(int)i) * r->spacing;
        lanes t = (x * w->u[0] + along_y + along_z) * w->inverse2;
        t = lanes_choose(t < zero, zero, t);
        t = lanes_choose(t > one, one, t);
        const lanes dx = x - t * w->u[0], dy = r->y - t * w->u[1], dz = r->z - t * w->u[2];
        const lanes d2 = dx * dx + dy * dy + dz * dz, old = *(const lanes *)(distance2 + i);
        const lane_mask take = (d2 < old) & (STEP < (float)(int)(r->n - i));
        lane_mask *own = (lane_mask *)(nearest + i);
        *(lanes *)(distance2 + i) = lanes_choose(take, d2, old);
        *own = (*own & ~take) | (take & (int32_t)id);
    }
}

void segment_distances(const struct segment_bricks *s, size_t i_brick, const struct point_lattice *l, float *distance2,
                       uint32_t *nearest)
{
    size_t n_point = l->n[0] * l->n[1] * l->n[2];
    for (size_t i = 0; i < n_point; i++) distance2[i] = s->reach * s->reach;
    for (size_t i = 0; i < n_point; i++) nearest[i] = UINT32_MAX;
    for (size_t e = s->first[i_brick]; e < s->first[i_brick + 1]; e++) {
        const struct segment *g = &s->segment[s->index[e]];
        size_t from[3], to[3];
        const struct view w = view_of(g, s->reach);
        if (!lattice_range(l, g, &w, from, to)) continue;
        float px = l->origin[0] + ((float)from[0] + 0.5f) * l->spacing - g->a[0];
        for (size_t k = from[2]; k <= to[2]; k++)
            for (size_t j = from[1]; j <= to[1]; j++) {
                size_t at = (k * l->n[1] + j) * l->n[0] + from[0], i0, i1;
                struct lattice_row r = {.x0 = px,
                                        .spacing = l->spacing,
                                        .y = l->origin[1] + ((float)j + 0.5f) * l->spacing - g->a[1],
                                        .z = l->origin[2] + ((float)k + 0.5f) * l->spacing - g->a[2],
                                        .n = to[0] - from[0] + 1};
                if (!slab_range(&w, &r, &i0, &i1)) continue;
                r.x0 = px + (float)i0 * l->spacing;
                r.n = i1 - i0;
                stamp_row(&w, &r, s->index[e], distance2 + at + i0, nearest + at + i0);
            }
    }
}
