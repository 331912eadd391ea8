#include "tests/bench/verdict/line_pulls.h"
#include "geometry/phantom/segment_grid.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

static const double NORMAL_MEDIAN = 0.6745;

struct pull_list {
    double *value; /* absolute */
    size_t n;
};

struct pull_work {
    const struct fiber_set *truth, *found;
    const struct reconstruct_report *report;
    const struct segment_grid *grid;
    double margin_m, reach_m;
    struct pull_list position, radius, point_radius;
};

static void add(struct pull_list *l, double error, double se)
{
    if (se > 0.0 && isfinite(se)) l->value[l->n++] = fabs(error) / se;
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static struct pull sum_up(struct pull_list *l)
{
    double square = 0.0;
    size_t n_covered = 0;
    if (l->n == 0) return (struct pull){NAN, NAN, NAN};
    qsort(l->value, l->n, sizeof *l->value, by_value);
    for (size_t i = 0; i < l->n; i++) {
        square += l->value[i] * l->value[i];
        n_covered += l->value[i] < 2.0;
    }
    return (struct pull){l->value[l->n / 2] / NORMAL_MEDIAN, sqrt(square / (double)l->n),
                         (double)n_covered / (double)l->n};
}

/* Whether a hit is beyond the first or the last vertex of its fiber. */
static bool beyond_end(const struct fiber_set *f, const struct segment_hit *hit)
{
    return (hit->i_vertex == f->first_vertex[hit->i_fiber] && hit->t <= 0.0) ||
           (hit->i_vertex + 2 == f->first_vertex[hit->i_fiber + 1] && hit->t >= 1.0);
}

/* Finds the place on a true fiber for a vertex, if it is one that counts. */
static bool find_place(const struct pull_work *w, size_t vertex, struct segment_hit *hit)
{
    double p[3];
    for (size_t a = 0; a < 3; a++) {
        p[a] = (double)w->found->position_m[3 * vertex + a];
        if (a < 2 && (p[a] < w->margin_m || p[a] > w->truth->tile_size_m[a] - w->margin_m)) return false;
    }
    return segment_grid_nearest(w->grid, p, w->reach_m, hit) &&
           hit->distance_m <= (double)w->truth->radius_m[hit->i_fiber] && !beyond_end(w->truth, hit);
}

/* Adds the offset of a vertex from its true fiber, sideways and across. */
static void add_position(struct pull_work *w, size_t vertex, const struct segment_hit *hit)
{
    const double *t = hit->direction, steep = hypot(t[0], t[1]);
    const double side[3] = {steep > 0.0 ? t[1] / steep : 1.0, steep > 0.0 ? -t[0] / steep : 0.0, 0.0},
                 across[3] = {t[1] * side[2] - t[2] * side[1], t[2] * side[0] - t[0] * side[2],
                              t[0] * side[1] - t[1] * side[0]};
    double sideways = 0.0, other = 0.0;
    for (size_t a = 0; a < 3; a++) {
        const size_t at = 3 * hit->i_vertex + a;
        const double from = (double)w->truth->position_m[at], to = (double)w->truth->position_m[at + 3];
        double offset = (double)w->found->position_m[3 * vertex + a] - from - hit->t * (to - from);
        if (a < 2) offset -= w->truth->tile_size_m[a] * round(offset / w->truth->tile_size_m[a]);
        sideways += offset * side[a];
        other += offset * across[a];
    }
    add(&w->position, sideways, w->report->axis_position_se_m);
    add(&w->position, other, w->report->axis_position_se_m);
}

static void walk_fiber(struct pull_work *w, size_t i)
{
    const struct fiber_set *f = w->found;
    const size_t first = f->first_vertex[i], end = f->first_vertex[i + 1];
    double true_radius = 0.0;
    size_t n = 0;
    for (size_t k = first; k < end; k++) {
        struct segment_hit hit;
        if (!find_place(w, k, &hit)) continue;
        add_position(w, k, &hit);
        const double radius = (double)w->truth->radius_m[hit.i_fiber];
        if (f->shape != NULL) add(&w->point_radius, (double)f->shape[k].radius - radius, (double)f->shape[k].radius_se);
        true_radius += radius;
        n++;
    }
    if (2 * n > end - first)
        add(&w->radius, (double)f->radius_m[i] - true_radius / (double)n, w->report->single_radius_se_m);
}

status line_pulls_measure(const struct fiber_set *truth, const struct fiber_set *found,
                          const struct reconstruct_report *report, double margin_m, struct line_pulls *out,
                          struct error *err)
{
    struct segment_grid *grid = NULL;
    struct pull_work w = {.truth = truth, .found = found, .report = report, .margin_m = margin_m};
    const size_t n = found->n_vertex + 1;
    w.position.value = malloc(2 * n * sizeof *w.position.value);
    w.radius.value = malloc(n * sizeof *w.radius.value);
    w.point_radius.value = malloc(n * sizeof *w.point_radius.value);
    for (size_t i = 0; i < truth->n_fiber; i++) w.reach_m = fmax(w.reach_m, (double)truth->radius_m[i]);
    status s = w.position.value != NULL && w.radius.value != NULL && w.point_radius.value != NULL
                   ? segment_grid_new(truth, truth->tile_size_m, w.reach_m, &grid, err)
                   : error_set(err, STATUS_NO_MEMORY, "cannot compare errors: out of memory");
    w.grid = grid;
    for (size_t i = 0; i < found->n_fiber && s == STATUS_OK; i++) walk_fiber(&w, i);
    if (s == STATUS_OK) *out = (struct line_pulls){sum_up(&w.position), sum_up(&w.radius), sum_up(&w.point_radius)};
    segment_grid_free(grid);
    free(w.position.value);
    free(w.radius.value);
    free(w.point_radius.value);
    return s;
}
