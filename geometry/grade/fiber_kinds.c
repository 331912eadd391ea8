#include "geometry/grade/fiber_kinds.h"

#include "geometry/volume/voxel_runs.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

/* Least distance of the means of two groups of radii in their standard deviations (halves of an even distribution have
 * 3.5), their least ratio, and the least share of the length of each. */
static const double LEAST_GAP = 4.5, LEAST_RATIO = 1.3, LEAST_SHARE = 0.05;

static bool is_light(const struct volume *v, const struct fiber_set *f, size_t i_fiber)
{
    const size_t first = f->first_vertex[i_fiber], end = f->first_vertex[i_fiber + 1];
    size_t n_light = 0;
    for (size_t k = first; k < end && v->light.n > 0; k++) {
        size_t at[3];
        for (size_t a = 0; a < 3; a++) {
            const double x = (double)f->position_m[3 * k + a] / v->voxel_size_m[a];
            at[a] = (size_t)fmin(fmax(x, 0.0), (double)v->n[a] - 1.0);
        }
        n_light += voxel_runs_hold(v->light.run, v->light.n, volume_index(v->n, at[0], at[1], at[2]));
    }
    return 2 * n_light > end - first;
}

static double length_of(const struct fiber_set *f, size_t i_fiber)
{
    double length = 0.0;
    for (size_t k = f->first_vertex[i_fiber]; k + 1 < f->first_vertex[i_fiber + 1]; k++) {
        const float *a = f->position_m + 3 * k;
        const double d[3] = {(double)a[3] - (double)a[0], (double)a[4] - (double)a[1], (double)a[5] - (double)a[2]};
        length += sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    }
    return length;
}

static int thicker_first(const void *a, const void *b)
{
    const struct fiber_row *x = a, *y = b;
    return (x->radius < y->radius) - (x->radius > y->radius);
}

/* Mean radius by length, its variance between fibers, and the length of all. */
struct group {
    double mean, variance, length;
};

/* Sums over rows: of lengths, and of lengths times the radius and its square. */
struct row_sum {
    double length, radius, square;
};

static void add_row(struct row_sum *s, const struct fiber_row *row, double sign)
{
    s->length += sign * row->length;
    s->radius += sign * row->length * row->radius;
    s->square += sign * row->length * row->radius * row->radius;
}

static struct group group_of(const struct row_sum *s)
{
    if (!(s->length > 0.0)) return (struct group){0.0, 0.0, 0.0};
    const double mean = s->radius / s->length;
    return (struct group){mean, fmax(0.0, s->square / s->length - mean * mean), s->length};
}

static struct group measure(const struct fiber_row *row, size_t n)
{
    struct row_sum s = {0};
    for (size_t i = 0; i < n; i++) add_row(&s, row + i, 1.0);
    return group_of(&s);
}

size_t fiber_rows_split(struct fiber_row *row, size_t n)
{
    struct row_sum before = {0}, after = {0};
    qsort(row, n, sizeof *row, thicker_first);
    for (size_t i = 0; i < n; i++) add_row(&after, row + i, 1.0);
    const double all = after.length;
    double least = INFINITY;
    size_t best = n;
    for (size_t i = 1; i < n; i++) {
        add_row(&before, row + i - 1, 1.0);
        add_row(&after, row + i - 1, -1.0);
        const struct group thick = group_of(&before), thin = group_of(&after);
        const double within = thick.length * thick.variance + thin.length * thin.variance;
        const double sd = sqrt(0.5 * (thick.variance + thin.variance));
        if (within >= least) continue;
        least = within;
        const bool are_two = thick.mean - thin.mean >= LEAST_GAP * sd && thick.mean >= LEAST_RATIO * thin.mean &&
                             fmin(thick.length, thin.length) >= LEAST_SHARE * all;
        best = are_two ? i : n;
    }
    return best;
}

static void add_kind(struct fiber_kinds *kinds, const struct fiber_row *row, size_t n, double density,
                     double single_se_m, double shared_se_m)
{
    const struct group g = measure(row, n);
    const double mean_se_m = isfinite(single_se_m) ? single_se_m / sqrt((double)n) : 0.0;
    if (n == 0 || !(g.length > 0.0)) return;
    kinds->kind[kinds->n++] = (struct fiber_kind){.density = density,
                                                  .share = g.length,
                                                  .radius_m = g.mean,
                                                  .radius_se_m = hypot(mean_se_m, shared_se_m),
                                                  .n_fiber = n};
}

status fiber_kinds_measure(const struct volume *v, const struct fiber_set *f, double single_se_m, double shared_se_m,
                           struct fiber_kinds *kinds, struct error *err)
{
    struct fiber_row *row = malloc((f->n_fiber + 1) * sizeof *row);
    bool *light = malloc((f->n_fiber + 1) * sizeof *light);
    double length = 0.0;
    *kinds = (struct fiber_kinds){0};
    const bool fits = row != NULL && light != NULL;
    for (size_t i = 0; i < f->n_fiber && fits; i++) light[i] = is_light(v, f, i);
    for (int k = 0; k < 2 && fits; k++) {
        const double density = k == 0 ? 1.0 : v->light.density;
        size_t n = 0;
        for (size_t i = 0; i < f->n_fiber; i++)
            if (light[i] == (k == 1)) row[n++] = (struct fiber_row){(double)f->radius_m[i], length_of(f, i)};
        const size_t n_thick = fiber_rows_split(row, n);
        add_kind(kinds, row, n_thick, density, single_se_m, shared_se_m);
        add_kind(kinds, row + n_thick, n - n_thick, density, single_se_m, shared_se_m);
    }
    for (size_t k = 0; k < kinds->n; k++) length += kinds->kind[k].share;
    for (size_t k = 0; k < kinds->n; k++) kinds->kind[k].share /= length;
    free(row);
    free(light);
    return fits ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot sort fibers into kinds: out of memory");
}
