#include "geometry/fibers/lines/growing.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { END_FIT = 7, NEAR_END = 4, MAX_WALK = 256, MAX_NEAR = 64 };
static const float FLOOR = 0.15f;

/* A grid of vertices to which more can be added: one linked list per cell. */
struct live_grid {
    float cell;
    size_t n[3];
    uint32_t *head; /* per cell: number of its first entry + 1 */
    struct live_entry {
        float x[3], radius2; /* radius2: square of the radius of its fiber */
        uint32_t line, next;
        bool is_end; /* within a few vertices of an end of its line */
    } * entry;
    size_t n_entry, capacity;
};

struct walk {
    const struct volume *v;
    const struct grow_option *o;
    struct live_grid grid;
};

static size_t cell_of(const struct live_grid *g, const float x[3])
{
    size_t c[3];
    for (int a = 0; a < 3; a++) {
        float f = x[a] / g->cell;
        c[a] = f <= 0.0f ? 0 : f >= (float)(g->n[a] - 1) ? g->n[a] - 1 : (size_t)f;
    }
    return (c[2] * g->n[1] + c[1]) * g->n[0] + c[0];
}

static bool grid_add(struct live_grid *g, const float x[3], float radius, uint32_t line, bool is_end)
{
    if (g->n_entry == g->capacity) {
        size_t n = g->capacity == 0 ? 4096 : 2 * g->capacity;
        struct live_entry *bigger = realloc(g->entry, n * sizeof *bigger);
        if (bigger == NULL) return false;
        g->entry = bigger;
        g->capacity = n;
    }
    struct live_entry *e = &g->entry[g->n_entry];
    size_t c = cell_of(g, x);
    memcpy(e->x, x, sizeof e->x);
    e->radius2 = radius * radius;
    e->line = line;
    e->is_end = is_end;
    e->next = g->head[c];
    g->head[c] = (uint32_t)++g->n_entry;
    return true;
}

/* Vertices of other lines near a point. */
struct near_vertices {
    float at[MAX_NEAR][3], radius2[MAX_NEAR]; /* some of them, n */
    size_t n;
    uint32_t nearest; /* index of its entry; UINT32_MAX: there is none */
    float least2;     /* squared distance of the nearest; infinite without one */
};

/* Finds the vertices of other lines than `line` within `reach` of x. */
static void find_near(const struct live_grid *g, const float x[3], uint32_t line, float reach,
                      struct near_vertices *near)
{
    size_t from[3], to[3], c[3];
    near->n = 0;
    near->least2 = INFINITY;
    near->nearest = UINT32_MAX;
    for (int a = 0; a < 3; a++) {
        float lo = (x[a] - reach) / g->cell, hi = (x[a] + reach) / g->cell, last = (float)(g->n[a] - 1);
        from[a] = (size_t)fminf(fmaxf(lo, 0.0f), last);
        to[a] = (size_t)fminf(fmaxf(hi, 0.0f), last);
    }
    for (c[2] = from[2]; c[2] <= to[2]; c[2]++)
        for (c[1] = from[1]; c[1] <= to[1]; c[1]++)
            for (c[0] = from[0]; c[0] <= to[0]; c[0]++)
                for (uint32_t i = g->head[(c[2] * g->n[1] + c[1]) * g->n[0] + c[0]]; i != 0; i = g->entry[i - 1].next) {
                    const struct live_entry *e = &g->entry[i - 1];
                    if (e->line == line) continue;
                    float d2 = 0.0f;
                    for (int a = 0; a < 3; a++) d2 += (x[a] - e->x[a]) * (x[a] - e->x[a]);
                    if (d2 > reach * reach) continue;
                    if (d2 < near->least2) {
                        near->least2 = d2;
                        near->nearest = i - 1;
                    }
                    if (near->n == MAX_NEAR) continue;
                    near->radius2[near->n] = e->radius2;
                    memcpy(near->at[near->n++], e->x, sizeof *near->at);
                }
}

/* Finds the material in the disk of radius r and thickness 1.5 around x, perpendicular to t, that is nearer to x
 * than to the neighbours: its mean perpendicular offset, and the mean density within half of r of x. The squared radius
 * of a fiber is taken off its squared distances, so that the border between touching fibers of different thickness is
 * where they touch. Near a face
 * only voxels whose mirror image through x lies in the volume count, or the walk would turn along the face. */
static bool disk_centroid(const struct walk *w, const float x[3], const float t[3], float r,
                          const struct near_vertices *near, float offset[3], float *core)
{
    const size_t *n = w->v->n;
    float sum = 0.0f, core_sum = 0.0f, core_n = 0.0f;
    ptrdiff_t from[3], to[3], i[3];
    for (int a = 0; a < 3; a++) {
        offset[a] = 0.0f;
        from[a] = (ptrdiff_t)fmaxf(0.0f, floorf(x[a] - r));
        to[a] = (ptrdiff_t)fminf((float)n[a] - 1.0f, floorf(x[a] + r));
    }
    for (i[2] = from[2]; i[2] <= to[2]; i[2]++)
        for (i[1] = from[1]; i[1] <= to[1]; i[1]++)
            for (i[0] = from[0]; i[0] <= to[0]; i[0]++) {
                float p[3], along = 0.0f, d2 = 0.0f;
                for (int a = 0; a < 3; a++) {
                    p[a] = (float)i[a] + 0.5f - x[a];
                    along += p[a] * t[a];
                    d2 += p[a] * p[a];
                }
                float across2 = d2 - along * along;
                bool mirrored = true;
                for (int a = 0; a < 3; a++) mirrored = mirrored && x[a] - p[a] >= 0.0f && x[a] - p[a] <= (float)n[a];
                if (!mirrored || fabsf(along) > 0.75f || across2 > r * r) continue;
                bool mine = true;
                for (size_t k = 0; k < near->n && mine; k++) {
                    float e2 = 0.0f;
                    for (int a = 0; a < 3; a++) {
                        float e = p[a] + x[a] - near->at[k][a];
                        e2 += e * e;
                    }
                    mine = e2 - near->radius2[k] > across2 - r * r;
                }
                float density = w->v->density[volume_index(n, (size_t)i[0], (size_t)i[1], (size_t)i[2])];
                if (across2 <= 0.25f * r * r) {
                    core_sum += density;
                    core_n += 1.0f;
                }
                if (!mine || density <= FLOOR) continue;
                float weight = (density - FLOOR);
                sum += weight;
                for (int a = 0; a < 3; a++) offset[a] += weight * (p[a] - along * t[a]);
            }
    if (!(sum > 0.0f) || !(core_n > 0.0f)) return false;
    for (int a = 0; a < 3; a++) offset[a] /= sum;
    *core = core_sum / core_n;
    return true;
}

static float fiber_radius(const struct walk *w, const struct polyline_set *lines, size_t l)
{
    return lines->radius[l] > 0.0f ? lines->radius[l] : 0.5f * w->o->diameter_voxel;
}

static float normalise(float t[3])
{
    float norm = sqrtf(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
    for (int a = 0; a < 3 && norm > 0.0f; a++) t[a] /= norm;
    return norm;
}

/* Walks from position x with unit tangent t along a fiber of radius r and writes at most max_step positions. A walk
 * that reaches the middle of another line did not follow a fiber of its own, so all of it is discarded. */
static int walk_on(const struct walk *w, uint32_t line, float r, float x[3], float t[3], float (*path)[3])
{
    struct near_vertices near;
    int n = 0;
    while (n < w->o->max_step && n < MAX_WALK) {
        float y[3], offset[3], core;
        bool outside = false;
        for (int a = 0; a < 3; a++) {
            y[a] = x[a] + t[a];
            outside = outside || y[a] < 0.0f || y[a] > (float)w->v->n[a];
        }
        if (outside) break;
        find_near(&w->grid, y, line, r + w->o->diameter_voxel, &near);
        if (near.least2 < r * r) return w->grid.entry[near.nearest].is_end ? n : 0;
        if (!disk_centroid(w, y, t, r, &near, offset, &core) || core < w->o->eps_d) break;
        float u[3], cosine = 0.0f, length;
        for (int a = 0; a < 3; a++) {
            y[a] += fminf(0.5f, fmaxf(-0.5f, offset[a]));
            u[a] = y[a] - x[a];
        }
        length = normalise(u);
        for (int a = 0; a < 3; a++) cosine += u[a] * t[a];
        if (!(length > 0.3f) || cosine < 0.85f) break;
        for (int a = 0; a < 3; a++) t[a] = 0.75f * t[a] + 0.25f * u[a];
        normalise(t);
        memcpy(path[n++], y, sizeof *path);
        memcpy(x, y, sizeof y);
    }
    return n;
}

/* Outward tangent of an end, from its last vertices. */
static void end_tangent(const struct polyline_set *p, size_t line, bool last, float x[3], float t[3])
{
    size_t n = polyline_length(p, line), back = n - 1 < END_FIT ? n - 1 : END_FIT;
    const float *end = p->vertex[last ? p->first[line + 1] - 1 : p->first[line]];
    const float *before = p->vertex[last ? p->first[line + 1] - 1 - back : p->first[line] + back];
    for (int a = 0; a < 3; a++) {
        x[a] = end[a];
        t[a] = end[a] - before[a];
    }
    normalise(t);
}

static status grow_line(struct walk *w, const struct polyline_set *lines, size_t l, struct polyline_set *result,
                        size_t *n_grown, struct error *err)
{
    float path[2][MAX_WALK][3], x[3], t[3], radius = fiber_radius(w, lines, l);
    int n[2];
    status s = STATUS_OK;
    scratch_keep_within(w->v->space);
    for (int e = 0; e < 2; e++) {
        end_tangent(lines, l, e == 1, x, t);
        n[e] = walk_on(w, (uint32_t)l, radius, x, t, path[e]);
        for (int i = 0; i < n[e]; i++)
            if (!grid_add(&w->grid, path[e][i], radius, (uint32_t)l, i + NEAR_END >= n[e])) s = STATUS_NO_MEMORY;
        *n_grown += (size_t)n[e];
    }
    if (s != STATUS_OK) return error_set(err, s, "cannot grow fibers: out of memory");
    s = polyline_begin_like(result, lines, l, err);
    for (int i = n[0] - 1; i >= 0 && s == STATUS_OK; i--) s = polyline_add(result, path[0][i], err);
    for (size_t i = lines->first[l]; i < lines->first[l + 1] && s == STATUS_OK; i++)
        s = polyline_add(result, lines->vertex[i], err);
    for (int i = 0; i < n[1] && s == STATUS_OK; i++) s = polyline_add(result, path[1][i], err);
    return s;
}

status polylines_grow(const struct polyline_set *lines, const struct volume *v, const struct grow_option *o,
                      struct polyline_set *result, size_t *n_grown, struct error *err)
{
    struct walk w = {.v = v, .o = o, .grid = {.cell = fmaxf(4.0f, o->diameter_voxel)}};
    status s = STATUS_OK;
    *n_grown = 0;
    for (int a = 0; a < 3; a++) w.grid.n[a] = (size_t)ceilf((float)v->n[a] / w.grid.cell) + 1;
    w.grid.head = calloc(w.grid.n[0] * w.grid.n[1] * w.grid.n[2], sizeof *w.grid.head);
    bool failed = w.grid.head == NULL;
    for (size_t l = 0; l < lines->n_line && !failed; l++)
        for (size_t i = lines->first[l]; i < lines->first[l + 1] && !failed; i++)
            failed = !grid_add(&w.grid, lines->vertex[i], fiber_radius(&w, lines, l), (uint32_t)l,
                               i < lines->first[l] + NEAR_END || i + NEAR_END >= lines->first[l + 1]);
    if (failed) s = error_set(err, STATUS_NO_MEMORY, "cannot grow fibers: out of memory");
    for (size_t l = 0; l < lines->n_line && s == STATUS_OK; l++) s = grow_line(&w, lines, l, result, n_grown, err);
    free(w.grid.head);
    free(w.grid.entry);
    return s;
}
