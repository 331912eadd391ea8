#include "geometry/fibers/shape/section_summary.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double RATIO_FIRST = 1.0, RATIO_LAST = 3.0;

/* A value with the length that has it. */
struct weighted {
    float value, length;
};

struct list {
    struct weighted *item;
    size_t n;
    double length;
};

static int by_value(const void *a, const void *b)
{
    const struct weighted *x = a, *y = b;
    return (x->value > y->value) - (x->value < y->value);
}

static void add(struct list *l, double value, double length)
{
    l->item[l->n++] = (struct weighted){(float)value, (float)length};
    l->length += length;
}

/* Value below which a share of the length lies. The list is sorted. */
static double quantile(const struct list *l, double share)
{
    double sum = 0.0;
    for (size_t i = 0; i < l->n; i++) {
        sum += (double)l->item[i].length;
        if (sum >= share * l->length) return (double)l->item[i].value;
    }
    return l->n > 0 ? (double)l->item[l->n - 1].value : NAN;
}

static double sorted_quantile(struct list *l, double share)
{
    if (l->n > 0) qsort(l->item, l->n, sizeof *l->item, by_value);
    return quantile(l, share);
}

/* Length of fiber that vertex k of fiber i stands for. */
static double length_at(const struct fiber_set *f, size_t i, size_t k)
{
    double sum = 0.0;
    for (size_t end = 0; end < 2; end++) {
        if (end == 0 ? k == f->first_vertex[i] : k + 1 == f->first_vertex[i + 1]) continue;
        const float *p = f->position_m + 3 * (k - (end == 0)), *q = p + 3;
        const double d[3] = {(double)q[0] - (double)p[0], (double)q[1] - (double)p[1], (double)q[2] - (double)p[2]};
        sum += 0.5 * sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    }
    return sum;
}

/* Whether the radius of fiber i varies; *variation: its standard deviation over its mean, by vertices. */
static bool varies(const struct fiber_set *f, size_t i, double *variation)
{
    const size_t first = f->first_vertex[i], end = f->first_vertex[i + 1];
    double sum = 0.0, square = 0.0, n = (double)(end - first);
    bool any = false;
    for (size_t k = first; k < end; k++) {
        const double r = (double)f->shape[k].radius / (double)f->shape[first].radius;
        any = any || f->shape[k].radius != f->shape[first].radius;
        sum += r;
        square += r * r;
    }
    *variation = sqrt(fmax(0.0, square / n - sum * sum / (n * n))) * n / sum;
    return any;
}

struct lists {
    struct list ratio, ratio_se, angle_se, radius_se, lumen, lumen_se;
};

static void add_fiber(const struct fiber_set *f, size_t i, double shared_se_m, struct section_summary *out,
                      struct lists *l, double *all)
{
    double variation;
    const bool varying = varies(f, i, &variation);
    out->n_varying += varying;
    if (varying) out->variation += variation;
    for (size_t k = f->first_vertex[i]; k < f->first_vertex[i + 1]; k++) {
        const struct fiber_shape *s = &f->shape[k];
        const double length = length_at(f, i, k);
        *all += length;
        const double se = (double)s->radius_se, own_se = sqrt(fmax(0.0, se * se - shared_se_m * shared_se_m));
        if (varying && own_se > 0.0) add(&l->radius_se, own_se / (double)s->radius, length);
        if (s->lumen_se > 0.0f) {
            add(&l->lumen, (double)s->lumen, length);
            add(&l->lumen_se, (double)s->lumen_se, length);
        }
        if (!fiber_shape_has_section(s)) continue;
        const double bin = SECTION_N_BIN * ((double)s->ratio - RATIO_FIRST) / (RATIO_LAST - RATIO_FIRST);
        const size_t b = bin < SECTION_N_BIN ? (size_t)bin : SECTION_N_BIN - 1;
        out->bin_share[b] += length;
        add(&l->ratio, (double)s->ratio, length);
        if (s->ratio_se > 0.0f) add(&l->ratio_se, (double)s->ratio_se, length);
        if ((double)s->ratio <= FIBER_RATIO_FLAT) continue;
        out->flat_share += length;
        if (s->angle_se_rad > 0.0f) add(&l->angle_se, (double)s->angle_se_rad, length);
    }
}

static void finish(struct section_summary *out, struct lists *l, double all)
{
    const double measured = l->ratio.length;
    out->measured_share = all > 0.0 ? measured / all : 0.0;
    out->ratio_p10 = sorted_quantile(&l->ratio, 0.1);
    out->ratio_median = quantile(&l->ratio, 0.5);
    out->ratio_p90 = quantile(&l->ratio, 0.9);
    out->ratio_se_median = sorted_quantile(&l->ratio_se, 0.5);
    out->angle_se_median_rad = sorted_quantile(&l->angle_se, 0.5);
    out->flat_share = measured > 0.0 ? out->flat_share / measured : NAN;
    for (int b = 0; b < SECTION_N_BIN; b++) out->bin_share[b] = measured > 0.0 ? out->bin_share[b] / measured : 0.0;
    out->lumen_share = all > 0.0 ? l->lumen.length / all : 0.0;
    out->lumen_p10 = sorted_quantile(&l->lumen, 0.1);
    out->lumen_median = quantile(&l->lumen, 0.5);
    out->lumen_p90 = quantile(&l->lumen, 0.9);
    out->lumen_se_median = sorted_quantile(&l->lumen_se, 0.5);
    out->variation = out->n_varying > 0 ? out->variation / (double)out->n_varying : NAN;
    out->variation_se_median = sorted_quantile(&l->radius_se, 0.5);
}

status section_summary_make(const struct fiber_set *f, double shared_se_m, struct section_summary *out,
                            struct error *err)
{
    struct lists l = {{0}};
    struct list *const list[] = {&l.ratio, &l.ratio_se, &l.angle_se, &l.radius_se, &l.lumen, &l.lumen_se};
    enum { N_LIST = sizeof list / sizeof *list };
    double all = 0.0;
    bool failed = false;
    *out = (struct section_summary){0};
    for (int b = 0; b <= SECTION_N_BIN; b++)
        out->bin_edge[b] = RATIO_FIRST + (RATIO_LAST - RATIO_FIRST) * b / SECTION_N_BIN;
    for (int k = 0; k < N_LIST; k++) {
        list[k]->item = malloc((f->n_vertex + 1) * sizeof *list[k]->item);
        failed = failed || list[k]->item == NULL;
    }
    for (size_t i = 0; i < f->n_fiber && f->shape != NULL && !failed; i++) add_fiber(f, i, shared_se_m, out, &l, &all);
    if (!failed) finish(out, &l, all);
    for (int k = 0; k < N_LIST; k++) free(list[k]->item);
    return failed ? error_set(err, STATUS_NO_MEMORY, "cannot summarize sections of fibers: out of memory") : STATUS_OK;
}
