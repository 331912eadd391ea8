#include "geometry/fibers/polyline.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void polyline_set_init(struct polyline_set *p) { *p = (struct polyline_set){0}; }

void polyline_set_release(struct polyline_set *p)
{
    if (p == NULL) return;
    free(p->first);
    free(p->vertex);
    free(p->axis);
    free(p->radius);
    free(p->shape);
    *p = (struct polyline_set){0};
}

static status no_memory(struct error *err)
{
    return error_set(err, STATUS_NO_MEMORY, "cannot trace fibers: out of memory");
}

status polyline_begin(struct polyline_set *p, uint8_t axis, struct error *err)
{
    if (p->n_line + 1 >= p->line_capacity) {
        size_t n = p->line_capacity == 0 ? 256 : 2 * p->line_capacity;
        size_t *first = realloc(p->first, (n + 1) * sizeof *first);
        if (first != NULL) p->first = first;
        uint8_t *axes = realloc(p->axis, n);
        if (axes != NULL) p->axis = axes;
        float *radius = realloc(p->radius, n * sizeof *radius);
        if (radius != NULL) p->radius = radius;
        if (first == NULL || axes == NULL || radius == NULL) return no_memory(err);
        p->line_capacity = n;
    }
    p->axis[p->n_line] = axis;
    p->radius[p->n_line] = 0.0f;
    p->first[p->n_line] = p->first[p->n_line + 1] = p->n_vertex;
    p->n_line++;
    return STATUS_OK;
}

status polyline_begin_like(struct polyline_set *p, const struct polyline_set *from, size_t line, struct error *err)
{
    status s = polyline_begin(p, from->axis[line], err);
    if (s == STATUS_OK) p->radius[p->n_line - 1] = from->radius[line];
    return s;
}

status polyline_add(struct polyline_set *p, const float x[3], struct error *err)
{
    if (p->n_vertex == UINT32_MAX) return error_set(err, STATUS_TOO_LARGE, "cannot trace fibers: over 2^32 vertices");
    if (p->n_vertex == p->vertex_capacity) {
        size_t n = p->vertex_capacity == 0 ? 4096 : 2 * p->vertex_capacity;
        float(*vertex)[3] = realloc(p->vertex, n * sizeof *vertex);
        if (vertex == NULL) return no_memory(err);
        p->vertex = vertex;
        if (p->shape != NULL) {
            struct fiber_shape *shape = realloc(p->shape, n * sizeof *shape);
            if (shape == NULL) return no_memory(err);
            p->shape = shape;
        }
        p->vertex_capacity = n;
    }
    if (p->shape != NULL) p->shape[p->n_vertex] = fiber_shape_disc(0.0f);
    memcpy(p->vertex[p->n_vertex++], x, sizeof *p->vertex);
    p->first[p->n_line] = p->n_vertex;
    return STATUS_OK;
}

status polyline_shapes_init(struct polyline_set *p, struct error *err)
{
    free(p->shape);
    p->shape = malloc((p->vertex_capacity + 1) * sizeof *p->shape);
    if (p->shape == NULL) return no_memory(err);
    for (size_t l = 0; l < p->n_line; l++)
        for (size_t i = p->first[l]; i < p->first[l + 1]; i++) p->shape[i] = fiber_shape_disc(p->radius[l]);
    return STATUS_OK;
}

static float mean_shape_radius(const struct polyline_set *p, size_t line)
{
    double sum = 0.0;
    for (size_t i = p->first[line]; i < p->first[line + 1]; i++) sum += (double)p->shape[i].radius;
    return (float)(sum / (double)polyline_length(p, line));
}

void polyline_shapes_follow(struct polyline_set *p, bool scale)
{
    for (size_t l = 0; l < p->n_line && p->shape != NULL; l++) {
        const float mean = mean_shape_radius(p, l), shift = p->radius[l] - mean, factor = p->radius[l] / mean;
        for (size_t i = p->first[l]; i < p->first[l + 1]; i++) {
            struct fiber_shape *s = &p->shape[i];
            s->radius = scale ? s->radius * factor : s->radius + shift;
            if (scale) s->radius_se *= factor;
        }
    }
}

status polyline_add_part(struct polyline_set *p, const struct polyline_set *from, size_t line, size_t i, size_t end,
                         struct error *err)
{
    status s = from->shape != NULL && p->shape == NULL ? polyline_shapes_init(p, err) : STATUS_OK;
    if (s == STATUS_OK) s = polyline_begin_like(p, from, line, err);
    for (; i < end && s == STATUS_OK; i++) {
        s = polyline_add(p, from->vertex[i], err);
        if (s == STATUS_OK && from->shape != NULL) p->shape[p->n_vertex - 1] = from->shape[i];
    }
    if (s == STATUS_OK && from->shape != NULL) p->radius[p->n_line - 1] = mean_shape_radius(p, p->n_line - 1);
    return s;
}

status polylines_without(const struct polyline_set *from, const bool *mark, size_t min_vertex, struct polyline_set *p,
                         size_t *origin, struct error *err)
{
    status s = STATUS_OK;
    size_t n = 0;
    for (size_t l = 0; l < from->n_line && s == STATUS_OK; l++) {
        size_t run = from->first[l], end = from->first[l + 1];
        for (size_t i = run; i <= end && s == STATUS_OK; i++) {
            if (i < end && !mark[i]) continue;
            if (i - run >= min_vertex) {
                s = polyline_add_part(p, from, l, run, i, err);
                for (size_t k = run; origin != NULL && k < i; k++) origin[n++] = k;
            }
            run = i + 1;
        }
    }
    return s;
}

void polyline_tangent(const struct polyline_set *p, size_t line, size_t i, size_t reach, float t[3])
{
    size_t a = i > p->first[line] + reach ? i - reach : p->first[line],
           b = i + reach < p->first[line + 1] ? i + reach : p->first[line + 1] - 1;
    float norm = 0.0f;
    for (int c = 0; c < 3; c++) {
        t[c] = p->vertex[b][c] - p->vertex[a][c];
        norm += t[c] * t[c];
    }
    norm = norm > 0.0f ? 1.0f / sqrtf(norm) : 0.0f;
    for (int c = 0; c < 3; c++) t[c] *= norm;
}

static size_t cell_index(const struct vertex_grid *g, const float x[3])
{
    size_t c[3];
    for (int a = 0; a < 3; a++) {
        float f = floorf(x[a] / g->cell);
        c[a] = f <= 0.0f ? 0 : f >= (float)(g->n[a] - 1) ? g->n[a] - 1 : (size_t)f;
    }
    return (c[2] * g->n[1] + c[1]) * g->n[0] + c[0];
}

status vertex_grid_init(struct vertex_grid *g, const struct polyline_set *p, const size_t n_voxel[3], float cell,
                        struct error *err)
{
    *g = (struct vertex_grid){.cell = cell};
    for (int a = 0; a < 3; a++) g->n[a] = (size_t)ceilf((float)n_voxel[a] / cell) + 1;
    size_t n_cell = g->n[0] * g->n[1] * g->n[2];
    g->first = calloc(n_cell + 2, sizeof *g->first);
    g->vertex = malloc((p->n_vertex + 1) * sizeof *g->vertex);
    g->line_of = malloc((p->n_vertex + 1) * sizeof *g->line_of);
    if (g->first == NULL || g->vertex == NULL || g->line_of == NULL) {
        vertex_grid_release(g);
        return no_memory(err);
    }
    for (size_t i = 0; i < p->n_vertex; i++) g->first[cell_index(g, p->vertex[i]) + 2]++;
    for (size_t c = 2; c <= n_cell; c++) g->first[c] += g->first[c - 1];
    for (size_t i = 0; i < p->n_vertex; i++) g->vertex[g->first[cell_index(g, p->vertex[i]) + 1]++] = (uint32_t)i;
    for (size_t l = 0; l < p->n_line; l++)
        for (size_t i = p->first[l]; i < p->first[l + 1]; i++) g->line_of[i] = (uint32_t)l;
    return STATUS_OK;
}

void vertex_grid_release(struct vertex_grid *g)
{
    if (g == NULL) return;
    free(g->first);
    free(g->vertex);
    free(g->line_of);
    *g = (struct vertex_grid){0};
}

void vertex_grid_range(const struct vertex_grid *g, const float x[3], float r, size_t from[3], size_t to[3])
{
    for (int a = 0; a < 3; a++) {
        float lo = floorf((x[a] - r) / g->cell), hi = floorf((x[a] + r) / g->cell), last = (float)(g->n[a] - 1);
        from[a] = (size_t)fminf(fmaxf(lo, 0.0f), last);
        to[a] = (size_t)fminf(fmaxf(hi, 0.0f), last);
    }
}
