#include "geometry/fibers/lines/disagreement.h"
#include "geometry/fibers/lines/joining.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

enum { REACH = 4, LINES = 32 };    /* LINES: lines in a task */
static const double OVERLAP = 0.9; /* share of the sum of the radii where the option has none */

/* Squared sine of the angle at vertex i; negative if the voxel is empty. */
static float sine2(const struct polyline_set *p, size_t line, size_t i, const struct direction_volume *d)
{
    size_t a = i >= p->first[line] + 2 ? i - 2 : p->first[line],
           b = i + 2 < p->first[line + 1] ? i + 2 : p->first[line + 1] - 1;
    size_t at[3];
    float t[3], e[3], norm = 0.0f, cosine = 0.0f;
    for (int c = 0; c < 3; c++) {
        float x = floorf(p->vertex[i][c]), last = (float)(d->n[c] - 1);
        at[c] = (size_t)fminf(fmaxf(x, 0.0f), last);
        t[c] = p->vertex[b][c] - p->vertex[a][c];
        norm += t[c] * t[c];
    }
    size_t voxel = volume_index(d->n, at[0], at[1], at[2]);
    if (!direction_volume_is_kept(d, voxel) || !(norm > 0.0f)) return -1.0f;
    direction_volume_get(d, voxel, e);
    for (int c = 0; c < 3; c++) cosine += t[c] * e[c];
    return fmaxf(0.0f, 1.0f - cosine * cosine / norm);
}

/* Data that all cuts of one set of lines share. */
struct disagreement {
    const struct polyline_set *lines;
    const struct direction_volume *d;
    struct vertex_grid grid;
    float limit, most; /* squared sine; largest radius */
    float overlap;     /* of the option */
    float *value;      /* squared sine of every vertex; negative where it is not known */
    bool *wrong;       /* of every vertex within reach of an end of its line */
    size_t reach;      /* vertices from the ends */
};

static status disagreement_init(struct disagreement *w, const struct polyline_set *lines,
                                const struct direction_volume *d, const struct disagreement_option *o, size_t reach,
                                struct error *err)
{
    *w = (struct disagreement){.lines = lines,
                               .d = d,
                               .limit = (float)(sin(o->max_angle_rad) * sin(o->max_angle_rad)),
                               .overlap = (float)(o->overlap > 0.0 ? o->overlap : OVERLAP),
                               .reach = reach};
    w->value = malloc((lines->n_vertex + 1) * sizeof *w->value);
    w->wrong = malloc((lines->n_vertex + 1) * sizeof *w->wrong);
    if (w->value == NULL || w->wrong == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot check fibers: out of memory");
    for (size_t l = 0; l < lines->n_line; l++) w->most = fmaxf(w->most, lines->radius[l]);
    return vertex_grid_init(&w->grid, lines, d->n, fmaxf(3.0f, 2.0f * w->most), err);
}

static void disagreement_release(struct disagreement *w)
{
    vertex_grid_release(&w->grid);
    free(w->value);
    free(w->wrong);
}

/* Whether vertex i of a line, counted from its first one, disagrees and lies in another fiber. */
static bool is_wrong(const struct disagreement *w, size_t line, size_t i)
{
    const size_t n = polyline_length(w->lines, line);
    const float *value = w->value + w->lines->first[line];
    float sum = 0.0f, weight = 0.0f;
    for (size_t k = i >= REACH ? i - REACH : 0; k <= i + REACH && k < n; k++)
        if (value[k] >= 0.0f) {
            sum += value[k];
            weight += 1.0f;
        }
    return weight > 0.0f && sum > w->limit * weight &&
           polyline_is_overlapped(w->lines, &w->grid, line, w->lines->first[line] + i, w->overlap, w->most);
}

static void check_lines(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct disagreement *w = context;
    scratch_keep_within(w->d->space);
    for (size_t l = i_task * LINES; l < w->lines->n_line && l < (i_task + 1) * LINES; l++) {
        const size_t first = w->lines->first[l], n = polyline_length(w->lines, l);
        for (size_t i = 0; i < n; i++) w->value[first + i] = sine2(w->lines, l, first + i, w->d);
        for (size_t i = 0; i < n; i++)
            if (i < w->reach || n - 1 - i < w->reach) w->wrong[first + i] = is_wrong(w, l, i);
    }
}

/* Finds the wrong vertices of all lines. */
static status check_all(struct disagreement *w, struct thread_pool *pool)
{
    return thread_pool_run(pool, (w->lines->n_line + LINES - 1) / LINES, check_lines, w, NULL);
}

status polylines_cut_disagreeing(const struct polyline_set *lines, const struct direction_volume *d,
                                 const struct disagreement_option *o, struct polyline_set *result, size_t *n_cut,
                                 struct error *err)
{
    struct disagreement w;
    status s = disagreement_init(&w, lines, d, o, SIZE_MAX, err);
    *n_cut = 0;
    if (s == STATUS_OK) s = check_all(&w, o->pool);
    for (size_t l = 0; l < lines->n_line && s == STATUS_OK; l++) {
        size_t n = polyline_length(lines, l), run = 0;
        for (size_t i = 0; i <= n && s == STATUS_OK; i++) {
            if (i < n && !w.wrong[lines->first[l] + i]) continue;
            if (i - run >= o->min_vertex)
                s = polyline_add_part(result, lines, l, lines->first[l] + run, lines->first[l] + i, err);
            *n_cut += i < n;
            run = i + 1;
        }
    }
    disagreement_release(&w);
    return s;
}

status polylines_trim_disagreeing(const struct polyline_set *lines, const struct direction_volume *d,
                                  const struct disagreement_option *o, struct polyline_set *result, struct error *err)
{
    struct disagreement w;
    status s = disagreement_init(&w, lines, d, o, o->reach, err);
    if (s == STATUS_OK) s = check_all(&w, o->pool);
    for (size_t l = 0; l < lines->n_line && s == STATUS_OK; l++) {
        size_t n = polyline_length(lines, l), begin = lines->first[l], from = 0, to = n;
        for (size_t i = 0; i < n && i < o->reach; i++) {
            size_t k = n - 1 - i;
            if (w.wrong[begin + i]) from = i + 1;
            if (w.wrong[begin + k]) to = k;
        }
        if (to >= from + o->min_vertex) s = polyline_add_part(result, lines, l, begin + from, begin + to, err);
    }
    disagreement_release(&w);
    return s;
}
