#include "geometry/fibers/lines/linking.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#define NONE UINT32_MAX

struct edge {
    float distance2; /* ascending distance is descending weight */
    uint32_t a, b;
};

struct edge_list {
    struct edge *edge;
    size_t n, capacity;
};

static int nearer_first(const void *p, const void *q)
{
    const struct edge *x = p, *y = q;
    if (x->distance2 != y->distance2) return x->distance2 < y->distance2 ? -1 : 1;
    if (x->a != y->a) return x->a < y->a ? -1 : 1;
    return (x->b > y->b) - (x->b < y->b);
}

static bool edge_push(struct edge_list *l, struct edge e)
{
    if (l->n == l->capacity) {
        size_t n = l->capacity == 0 ? 1024 : 2 * l->capacity;
        struct edge *bigger = realloc(l->edge, n * sizeof *bigger);
        if (bigger == NULL) return false;
        l->edge = bigger;
        l->capacity = n;
    }
    l->edge[l->n++] = e;
    return true;
}

/* Finds candidates between slices k and k + 1. Centers of a slice are sorted by v, so a window slides over them. */
static bool candidate_edges(const struct center_list *list, size_t k, float reach, struct edge_list *edges)
{
    size_t a_end = list->first[k + 1], b_begin = list->first[k + 1], b_end = list->first[k + 2];
    const float max_slope = 1.5f, window = reach + max_slope;
    edges->n = 0;
    for (size_t a = list->first[k]; a < a_end; a++) {
        const struct center *p = &list->center[a];
        while (b_begin < b_end && list->center[b_begin].v < p->v - window) b_begin++;
        for (size_t b = b_begin; b < b_end && list->center[b].v <= p->v + window; b++) {
            const struct center *q = &list->center[b];
            float su = 0.5f * (p->slope_u + q->slope_u), sv = 0.5f * (p->slope_v + q->slope_v);
            float du = q->u - p->u - su, dv = q->v - p->v - sv, d2 = du * du + dv * dv;
            if (d2 <= reach * reach && !edge_push(edges, (struct edge){d2, (uint32_t)a, (uint32_t)b})) return false;
        }
    }
    return true;
}

static void match(struct edge_list *edges, uint32_t *next, uint32_t *previous)
{
    if (edges->n > 0) qsort(edges->edge, edges->n, sizeof *edges->edge, nearer_first);
    for (size_t e = 0; e < edges->n; e++) {
        uint32_t a = edges->edge[e].a, b = edges->edge[e].b;
        if (next[a] != NONE || previous[b] != NONE) continue;
        next[a] = b;
        previous[b] = a;
    }
}

static float mean_radius(const struct center_list *list, const uint32_t *next, uint32_t first)
{
    double sum = 0.0, n = 0.0;
    for (uint32_t c = first; c != NONE; c = next[c], n += 1.0) sum += (double)list->center[c].radius;
    return (float)(sum / n);
}

static status emit_chains(const struct center_list *list, const struct slice_frame *frame, size_t min_vertex,
                          const uint32_t *next, const uint32_t *previous, struct polyline_set *lines, size_t *n_chain,
                          struct error *err)
{
    status s = STATUS_OK;
    for (size_t k = 0; k < list->n_slice; k++)
        for (size_t i = list->first[k]; i < list->first[k + 1] && s == STATUS_OK; i++) {
            if (previous[i] != NONE) continue;
            size_t length = 0, slice = k;
            for (uint32_t c = (uint32_t)i; c != NONE; c = next[c]) length++;
            *n_chain += length > 1;
            if (length < min_vertex) continue;
            s = polyline_begin(lines, (uint8_t)frame->index, err);
            if (s == STATUS_OK) lines->radius[lines->n_line - 1] = mean_radius(list, next, (uint32_t)i);
            for (uint32_t c = (uint32_t)i; c != NONE && s == STATUS_OK; c = next[c], slice++) {
                float x[3];
                slice_frame_point(frame, list->center[c].u, list->center[c].v, (float)slice + 0.5f, x);
                s = polyline_add(lines, x, err);
            }
        }
    return s;
}

status centers_link(const struct center_list *list, const struct slice_frame *frame, double sigma_voxel,
                    double diameter_voxel, size_t min_vertex, struct polyline_set *lines, size_t *n_chain,
                    struct error *err)
{
    size_t n = list->first[list->n_slice];
    float reach = (float)fmin(sigma_voxel, fmax(1.5, LINK_REACH * diameter_voxel));
    struct edge_list edges = {0};
    uint32_t *next = malloc((n + 1) * sizeof *next), *previous = malloc((n + 1) * sizeof *previous);
    status s = STATUS_OK;
    *n_chain = 0;
    if (next == NULL || previous == NULL || n >= NONE) goto no_memory;
    for (size_t i = 0; i < n; i++) next[i] = previous[i] = NONE;
    for (size_t k = 0; k + 1 < list->n_slice; k++) {
        if (!candidate_edges(list, k, reach, &edges)) goto no_memory;
        match(&edges, next, previous);
    }
    s = emit_chains(list, frame, min_vertex, next, previous, lines, n_chain, err);
    goto out;
no_memory:
    s = error_set(err, STATUS_NO_MEMORY, "cannot link fiber centers: out of memory");
out:
    free(edges.edge);
    free(next);
    free(previous);
    return s;
}
