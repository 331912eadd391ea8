#include "geometry/grade/compare_sections.h"
#include "base/angle.h"
#include "geometry/phantom/segment_grid.h"

#include <math.h>
#include <stdlib.h>

static const double FLAT_TRUTH = 1.3; /* ratio of axes from which on a section has a direction */
static const double NORMAL_MEDIAN = 0.6745;

/* One vertex: errors, NaN where there are none, and standard errors, 0 where they are not known. */
struct vertex_error {
    float radius, radius_se, ratio, ratio_se, turn, turn_se, lumen, lumen_se;
};

struct errors {
    struct vertex_error *item;
    float *work;
    size_t n;
};

/* The true section at a place of a fiber. */
static struct fiber_shape shape_at(const struct fiber_set *f, const struct segment_hit *hit)
{
    if (f->shape == NULL) return fiber_shape_disc(f->radius_m[hit->i_fiber]);
    const struct fiber_shape *a = &f->shape[hit->i_vertex], *b = a + 1;
    struct fiber_shape s = *(hit->t < 0.5 ? a : b);
    const float t = (float)hit->t;
    s.radius = a->radius + t * (b->radius - a->radius);
    s.ratio = a->ratio + t * (b->ratio - a->ratio);
    return s;
}

/* Errors of radius and ratio are relative, with their standard errors. */
static struct vertex_error error_of(const struct fiber_shape *truth, const struct fiber_shape *found)
{
    struct vertex_error e = {.radius = found->radius / truth->radius - 1.0f,
                             .radius_se = found->radius_se / truth->radius,
                             .ratio = found->ratio / truth->ratio - 1.0f,
                             .ratio_se = found->ratio_se / truth->ratio,
                             .turn = NAN,
                             .turn_se = found->angle_se_rad,
                             .lumen = found->lumen_se > 0.0f ? found->lumen - truth->lumen : NAN,
                             .lumen_se = found->lumen_se};
    if (!((double)truth->ratio > FLAT_TRUTH) || !fiber_shape_has_section(found)) return e;
    float cosine = 0.0f;
    for (int a = 0; a < 3; a++) cosine += truth->long_axis[a] * found->long_axis[a];
    e.turn = acosf(fminf(1.0f, fabsf(cosine)));
    return e;
}

static int by_value(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Median of |value - shift|, over |se| if se_offset is given, of the fields at these offsets. */
static double median(struct errors *e, size_t offset, const size_t *se_offset, float shift)
{
    size_t n = 0;
    for (size_t i = 0; i < e->n; i++) {
        const char *item = (const char *)&e->item[i];
        const float value = *(const float *)(const void *)(item + offset) - shift,
                    se = se_offset != NULL ? *(const float *)(const void *)(item + *se_offset) : 1.0f;
        if (isfinite(value) && se > 0.0f) e->work[n++] = fabsf(value) / se;
    }
    if (n > 0) qsort(e->work, n, sizeof *e->work, by_value);
    return n > 0 ? (double)e->work[n / 2] : NAN;
}

#define MEDIAN(e, field, shift) median(e, offsetof(struct vertex_error, field), NULL, shift)
#define PULL(e, field, shift)                                                                                          \
    (median(e, offsetof(struct vertex_error, field), &(size_t){offsetof(struct vertex_error, field##_se)}, shift) /    \
     NORMAL_MEDIAN)

static void sum_up(struct errors *e, double mean_radius2, struct section_compare *out)
{
    double radius = 0.0, radius2 = 0.0, ratio = 0.0, ratio2 = 0.0, n = (double)e->n;
    double lumen = 0.0, lumen2 = 0.0, n_lumen = 0.0;
    for (size_t i = 0; i < e->n; i++) {
        radius += (double)e->item[i].radius / n;
        radius2 += (double)e->item[i].radius * (double)e->item[i].radius / n;
        ratio += (double)e->item[i].ratio / n;
        ratio2 += (double)e->item[i].ratio * (double)e->item[i].ratio / n;
        if (!isfinite(e->item[i].lumen)) continue;
        lumen += (double)e->item[i].lumen;
        lumen2 += (double)e->item[i].lumen * (double)e->item[i].lumen;
        n_lumen += 1.0;
    }
    *out = (struct section_compare){.n = e->n,
                                    .radius_rms = e->n > 0 ? sqrt(radius2) : NAN,
                                    .mean_radius_rms = e->n > 0 ? sqrt(mean_radius2 / n) : NAN,
                                    .radius_bias = e->n > 0 ? radius : NAN,
                                    .radius_pull = PULL(e, radius, 0.0f),
                                    .ratio_bias = e->n > 0 ? ratio : NAN,
                                    .ratio_rms = e->n > 0 ? sqrt(ratio2) : NAN,
                                    .ratio_median = MEDIAN(e, ratio, 0.0f),
                                    .ratio_pull = PULL(e, ratio, 0.0f),
                                    .turn_median_deg = angle_to_deg(MEDIAN(e, turn, 0.0f)),
                                    .turn_pull = PULL(e, turn, 0.0f),
                                    .lumen_rms = n_lumen > 0.0 ? sqrt(lumen2 / n_lumen) : NAN,
                                    .lumen_bias = n_lumen > 0.0 ? lumen / n_lumen : NAN,
                                    .lumen_pull = PULL(e, lumen, 0.0f),
                                    .lumen_share = e->n > 0 ? n_lumen / n : NAN};
}

status compare_sections(const struct fiber_set *truth, const struct fiber_set *found, struct section_compare *out,
                        struct error *err)
{
    struct segment_grid *grid = NULL;
    struct errors e = {.item = malloc((found->n_vertex + 1) * sizeof *e.item),
                       .work = malloc((found->n_vertex + 1) * sizeof *e.work)};
    double reach_m = 0.0, mean_radius2 = 0.0;
    for (size_t i = 0; i < truth->n_fiber; i++) reach_m = fmax(reach_m, (double)truth->radius_m[i]);
    status st = e.item != NULL && e.work != NULL
                    ? segment_grid_new(truth, truth->tile_size_m, reach_m, &grid, err)
                    : error_set(err, STATUS_NO_MEMORY, "cannot compare sections: out of memory");
    for (size_t i = 0; i < found->n_fiber && found->shape != NULL && st == STATUS_OK; i++)
        for (size_t k = found->first_vertex[i]; k < found->first_vertex[i + 1]; k++) {
            const float *p = found->position_m + 3 * k;
            const double at[3] = {(double)p[0], (double)p[1], (double)p[2]};
            struct segment_hit hit;
            if (!segment_grid_nearest(grid, at, reach_m, &hit) || hit.distance_m > (double)truth->radius_m[hit.i_fiber])
                continue;
            const struct fiber_shape shape = shape_at(truth, &hit);
            e.item[e.n++] = error_of(&shape, &found->shape[k]);
            mean_radius2 += pow((double)(found->radius_m[i] / shape.radius) - 1.0, 2.0);
        }
    segment_grid_free(grid);
    if (st == STATUS_OK) sum_up(&e, mean_radius2, out);
    free(e.item);
    free(e.work);
    return st;
}
