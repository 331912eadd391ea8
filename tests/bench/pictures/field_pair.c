#include "tests/bench/pictures/field_pair.h"

#include "base/clock.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { FIRST_SAMPLES = 64 };

struct pair {
    const struct field_pair_request *q;
    size_t n_side, n_sample; /* fields along each side; samples of each field so far */
    struct field_sum *sum[2];
    double second[2]; /* of the processor */
    struct field_comparison result;
};

/* Doubles the samples. */
static status refine(struct pair *p, struct thread_pool *pool, struct error *err)
{
    const size_t n = p->n_sample > 0 ? p->n_sample : FIRST_SAMPLES;
    for (uint32_t i = 0; i < 2; i++) {
        const struct field_request q = {.input = p->q->input[i],
                                        .configuration = p->q->configuration,
                                        .share = p->q->share,
                                        .n_side = p->n_side,
                                        .first_sample = p->n_sample,
                                        .n_sample = n,
                                        .seed = 5,
                                        .stream = i};
        double start = clock_process_s();
        status st = field_samples_add(&q, pool, p->sum[i], err);
        if (st != STATUS_OK) return st;
        p->second[i] += clock_process_s() - start;
    }
    p->n_sample += n;
    p->result = field_comparison_of(p->sum[0], p->sum[1], p->n_side * p->n_side);
    return STATUS_OK;
}

/* Time of the first over that of the second when both have the same noise. */
static double at_equal_noise(const struct pair *p)
{
    return p->second[0] * p->result.noise2[0] / (p->second[1] * p->result.noise2[1]);
}

static void report(const struct pair *p, const struct field_speedup *s)
{
    static const char *const verdict[] = {"shown to be below", "shown to be above", "not shown to be above or below"};
    const struct field_comparison *r = &p->result;
    double square = field_comparison_square(r), edge_mm = 1e3 * p->q->share * p->q->configuration->crop_m;
    fprintf(stderr, "%s, %.0f lit fields of %.2f mm, %zu samples each: mean %.4f, second above it by %.2f %%; ",
            p->q->name, r->n / 3.0, edge_mm, p->n_sample, r->mean / r->n, 100.0 * r->difference / r->mean);
    fprintf(stderr, "%.1f s with noise %.2f %% and %.1f s with noise %.2f %%, %.2f times at equal noise; ",
            p->second[0], 100.0 * field_comparison_noise(r, 0), p->second[1], 100.0 * field_comparison_noise(r, 1),
            at_equal_noise(p));
    fprintf(stderr, "stays %.2f %% (square %.2f +- %.2f %%^2), %s %.3g %%: speedup %.2f, at least %.2f\n",
            100.0 * sqrt(fmax(0.0, square)), 1e4 * square, 1e4 * field_comparison_square_se(r), verdict[s->verdict],
            100.0 * p->q->error, s->value, s->least);
    fflush(stderr);
}

/* Refines until the part that stays is settled or the time is over. */
static status refine_all(struct pair *p, struct thread_pool *pool, struct field_speedup *s, struct error *err)
{
    for (;;) {
        status st = refine(p, pool, err);
        if (st != STATUS_OK) return st;
        double square = field_comparison_square(&p->result), se = field_comparison_square_se(&p->result);
        *s = field_speedup_of(at_equal_noise(p), square, se, p->q->error);
        report(p, s);
        /* the next step takes as long as all before */
        if (field_speedup_is_settled(square, se, p->q->error) || 2.0 * (p->second[0] + p->second[1]) > p->q->most_s)
            return STATUS_OK;
    }
}

status field_pair_compare(const struct field_pair_request *q, struct thread_pool *pool, struct field_speedup *speedup,
                          struct error *err)
{
    struct pair p = {.q = q, .n_side = q->n_side};
    if ((double)p.n_side * q->share > 1.0) p.n_side = (size_t)(1.0 / q->share);
    for (size_t i = 0; i < 2; i++) p.sum[i] = calloc(p.n_side * p.n_side + 1, sizeof *p.sum[i]);
    status st = p.sum[0] != NULL && p.sum[1] != NULL
                    ? refine_all(&p, pool, speedup, err)
                    : error_set(err, STATUS_NO_MEMORY, "cannot compare pictures: out of memory");
    for (size_t i = 0; i < 2; i++) free(p.sum[i]);
    return st;
}
