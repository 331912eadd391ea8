#include "geometry/fibers/lines/segment_bricks.h"

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
