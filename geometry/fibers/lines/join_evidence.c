#include "geometry/fibers/lines/join_evidence.h"

#include "base/lanes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PATH = 128, MAX_NEAR_LINE = 24, MAX_NEAR = 2048, TANGENT = 6 };
static const float AHEAD_DIAMETERS = 0.75f; /* by which both fibers go on, beside half of the gap */
static const float RIM = 1.5f;              /* voxels beyond the radius that are compared */
static const float STEP = 0.5f;             /* voxels between points of curves */
static const float SAME = 1e-3f;            /* difference of densities that is none */

struct path {
    float x[MAX_PATH][3];
    int n;
};

/* The two ends and their possible continuations. */
struct gap_view {
    struct path side[2], on[2], way; /* last vertices of both lines, straight on from there, and the curve between */
    float radius[2], most2;          /* most2: squared distance within which voxels are compared */
};

/* Vertices first .. end - 1 of the list belong to another line. */
struct near_line {
    float radius;
    int first, end;
};

struct near_lines {
    float x[MAX_NEAR][3];
    struct near_line line[MAX_NEAR_LINE];
    int n;
};

static void path_add(struct path *p, const float x[3])
{
    if (p->n < MAX_PATH) memcpy(p->x[p->n++], x, sizeof *p->x);
}

static const lanes PLACE = {0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f}; /* voxels from the first of a row */

/* LANES voxels of a row that follow each other. x: of the first one. */
struct row_part {
    float x[3];
    lane_mask within; /* those that are in the box */
};

/* Smallest squared distances of points i .. end - 1 from the voxels. */
static lanes nearest2(const float (*x)[3], int i, int end, const struct row_part *at)
{
    const lanes along = PLACE + at->x[0];
    lanes least = PLACE - PLACE + INFINITY;
    for (; i < end; i++) {
        const float d1 = x[i][1] - at->x[1], d2 = x[i][2] - at->x[2];
        const lanes d0 = along - x[i][0], distance2 = d0 * d0 + d1 * d1 + d2 * d2;
        least = lanes_choose(distance2 < least, distance2, least);
    }
    return least;
}

static lanes nearest2_path(const struct path *p, const struct row_part *at) { return nearest2(p->x, 0, p->n, at); }

static lanes lesser(lanes a, lanes b) { return lanes_choose(a < b, a, b); }

static float radius_of(const struct join_scene *s, size_t line)
{
    return s->lines->radius[line] > 0.0f ? s->lines->radius[line] : (float)(0.5 * s->diameter);
}

/* Density of a fiber at a squared distance from its axis. */
static float fiber_at(const struct join_scene *s, float distance2, float radius)
{
    const float d = sqrtf(distance2) - radius;
    return d < 4.0f * (float)s->blur ? 0.5f * erfcf(d / (float)(M_SQRT2 * s->blur)) : 0.0f;
}

/* Takes the last vertices of a line, and goes straight on from there. */
static void take_end(const struct join_scene *s, uint32_t end, size_t trim, float ahead, struct path *side,
                     struct path *on)
{
    const size_t length = polyline_length(s->lines, end / 2), n = (size_t)ceilf(ahead) + 2;
    float t[3], norm = 0.0f;
    side->n = on->n = 0;
    for (size_t k = trim; k < length && k < trim + n; k++) path_add(side, line_end_vertex(s->lines, end, k));
    const float *from = side->x[0], *before = side->x[side->n > TANGENT ? TANGENT : side->n - 1];
    for (int a = 0; a < 3; a++) {
        t[a] = from[a] - before[a];
        norm += t[a] * t[a];
    }
    for (float w = STEP; w <= ahead && norm > 0.0f; w += STEP) {
        float x[3];
        for (int a = 0; a < 3; a++) x[a] = from[a] + w * t[a] / sqrtf(norm);
        path_add(on, x);
    }
}

static void take_way(const struct join_curve *j, struct path *way)
{
    const int n_step = 2 + (int)(j->gap / (double)STEP);
    way->n = 0;
    for (int i = 0; i <= n_step; i++) {
        double y[3];
        join_curve_at(j, j->from + (j->to - j->from) * i / n_step, y);
        path_add(way, (const float[3]){(float)y[0], (float)y[1], (float)y[2]});
    }
}

/* Computes the box around the compared paths. */
static void bound(const struct gap_view *g, float lo[3], float hi[3])
{
    const struct path *path[3] = {&g->way, &g->on[0], &g->on[1]};
    const float most = sqrtf(g->most2);
    for (int a = 0; a < 3; a++) {
        lo[a] = INFINITY;
        hi[a] = -INFINITY;
        for (int p = 0; p < 3; p++)
            for (int i = 0; i < path[p]->n; i++) {
                lo[a] = fminf(lo[a], path[p]->x[i][a] - most);
                hi[a] = fmaxf(hi[a], path[p]->x[i][a] + most);
            }
    }
}

static int ascending(const void *p, const void *q)
{
    const uint32_t *a = p, *b = q;
    return (*a > *b) - (*a < *b);
}

/* Finds the vertices whose fibers reach into a box, without the lines of ends a and b. Beyond MAX_NEAR vertices or
 * MAX_NEAR_LINE lines the rest is left out. */
static void take_others(const struct join_scene *s, const float lo[3], const float hi[3], uint32_t a, uint32_t b,
                        struct near_lines *near)
{
    const struct vertex_grid *g = s->grid;
    const float margin = s->largest_radius + RIM;
    uint32_t found[MAX_NEAR];
    size_t from[3], to[3], c[3], n = 0;
    float middle[3], reach = 0.0f;
    for (int k = 0; k < 3; k++) {
        middle[k] = 0.5f * (lo[k] + hi[k]);
        reach = fmaxf(reach, 0.5f * (hi[k] - lo[k]) + margin);
    }
    vertex_grid_range(g, middle, reach, from, to);
    for (c[2] = from[2]; c[2] <= to[2]; c[2]++)
        for (c[1] = from[1]; c[1] <= to[1]; c[1]++)
            for (c[0] = from[0]; c[0] <= to[0]; c[0]++) {
                const size_t cell = (c[2] * g->n[1] + c[1]) * g->n[0] + c[0];
                for (size_t k = g->first[cell]; k < g->first[cell + 1] && n < MAX_NEAR; k++) {
                    const uint32_t line = g->line_of[g->vertex[k]];
                    const float *y = s->lines->vertex[g->vertex[k]];
                    bool inside = line != a / 2 && line != b / 2;
                    for (int e = 0; e < 3; e++) inside = inside && y[e] >= lo[e] - margin && y[e] <= hi[e] + margin;
                    if (inside) found[n++] = g->vertex[k];
                }
            }
    qsort(found, n, sizeof *found, ascending); /* by line, as the vertices of the set are */
    near->n = 0;
    for (size_t i = 0; i < n; i++) {
        const uint32_t line = g->line_of[found[i]];
        if (i == 0 || line != g->line_of[found[i - 1]]) {
            if (near->n == MAX_NEAR_LINE) break;
            near->line[near->n++] = (struct near_line){radius_of(s, line), (int)i, (int)i};
        }
        memcpy(near->x[i], s->lines->vertex[found[i]], sizeof *near->x);
        near->line[near->n - 1].end = (int)i + 1;
    }
}

/* The densities at the voxels of a row with one fiber through the gap, and with two that end. */
struct row_model {
    lanes one, two;
};

/* Returns the voxels whose densities differ between the two. */
static lane_mask model_row(const struct join_scene *s, const struct gap_view *g, const struct row_part *at,
                           struct row_model *m)
{
    const lanes way = nearest2_path(&g->way, at);
    const lanes on[2] = {nearest2_path(&g->on[0], at), nearest2_path(&g->on[1], at)};
    lane_mask differs = at->within & (lesser(way, lesser(on[0], on[1])) <= g->most2);
    if (!lanes_any(differs)) return differs;
    const lanes side[2] = {nearest2_path(&g->side[0], at), nearest2_path(&g->side[1], at)};
    const lanes own = lesser(way, lesser(side[0], side[1])), end[2] = {lesser(side[0], on[0]), lesser(side[1], on[1])};
    for (int l = 0; l < LANES; l++) {
        if (!differs[l]) continue;
        const float radius = own[l] == way[l]       ? 0.5f * (g->radius[0] + g->radius[1])
                             : own[l] == side[0][l] ? g->radius[0]
                                                    : g->radius[1];
        m->one[l] = fiber_at(s, own[l], radius);
        m->two[l] = fiber_at(s, end[0][l], g->radius[0]) + fiber_at(s, end[1][l], g->radius[1]);
        if (fabsf(m->two[l] - m->one[l]) < SAME) differs[l] = 0;
    }
    return differs;
}

/* Adds voxels of a row to the sums of join_evidence. density: of the first one. */
static void compare_row(const struct join_scene *s, const struct gap_view *g, const struct near_lines *near,
                        const struct row_part *at, const float *density, double sum[2])
{
    struct row_model m;
    const lane_mask differs = model_row(s, g, at, &m);
    if (!lanes_any(differs)) return;
    lanes rest = {0.0f};
    for (int l = 0; l < LANES; l++)
        if (differs[l]) rest[l] = density[l];
    for (int i = 0; i < near->n; i++) {
        const struct near_line *n = &near->line[i];
        const lanes distance2 = nearest2(near->x, n->first, n->end, at);
        for (int l = 0; l < LANES; l++)
            if (differs[l]) rest[l] -= fiber_at(s, distance2[l], n->radius);
    }
    for (int l = 0; l < LANES; l++) {
        if (!differs[l]) continue;
        const float one = m.one[l], two = m.two[l];
        sum[0] += (double)((rest[l] - two) * (rest[l] - two) - (rest[l] - one) * (rest[l] - one));
        sum[1] += (double)((two - one) * (two - one));
    }
}

double join_evidence(const struct join_scene *s, const struct join_curve *j, uint32_t a, uint32_t b)
{
    struct gap_view g;
    struct near_lines near;
    const uint32_t end[2] = {a, b};
    const float ahead = AHEAD_DIAMETERS * (float)s->diameter + 0.5f * (float)j->gap;
    float lo[3], hi[3];
    size_t from[3], to[3], c[3];
    double sum[2] = {0.0, 0.0};
    for (int e = 0; e < 2; e++) {
        g.radius[e] = radius_of(s, end[e] / 2);
        take_end(s, end[e], j->trim[e], ahead, &g.side[e], &g.on[e]);
    }
    g.most2 = powf(fmaxf(g.radius[0], g.radius[1]) + RIM, 2.0f);
    take_way(j, &g.way);
    bound(&g, lo, hi);
    take_others(s, lo, hi, a, b, &near);
    for (int k = 0; k < 3; k++) {
        from[k] = (size_t)fmaxf(0.0f, floorf(lo[k]));
        to[k] = (size_t)fminf((float)s->v->n[k], fmaxf(0.0f, ceilf(hi[k])));
    }
    for (c[2] = from[2]; c[2] < to[2]; c[2]++)
        for (c[1] = from[1]; c[1] < to[1]; c[1]++)
            for (c[0] = from[0]; c[0] < to[0]; c[0] += LANES) {
                const struct row_part at = {{(float)c[0] + 0.5f, (float)c[1] + 0.5f, (float)c[2] + 0.5f},
                                            PLACE < (float)(to[0] - c[0])};
                compare_row(s, &g, &near, &at, s->v->density + volume_index(s->v->n, c[0], c[1], c[2]), sum);
            }
    return sum[1] > 0.0 ? sum[0] / sum[1] : 0.0;
}
