#include "tests/bench/pictures/field_samples.h"
#include "renderer/estimate/radiance_source.h"

#include <string.h>

/* apart from estimates and pictures; places of fields have a stream of their own */
enum { CHUNK_SAMPLES = 64, FIELD_ITERATION = 65535, FIELD_REPLICA = 14, PLACE_REPLICA = 13 };

struct run {
    const struct field_request *q;
    const struct radiance_source *source;
    struct field_sum *sum;
};

/* Adds n samples from number `first` of a field whose corner is at `corner`. */
static void add_samples(const struct run *r, size_t i_field, const double corner[2], size_t first, size_t n)
{
    const struct field_request *q = r->q;
    const struct rng_key key = {q->seed, FIELD_ITERATION, FIELD_REPLICA, q->stream};
    const size_t configuration = 0;
    struct rng rng[CHUNK_SAMPLES];
    double xy[CHUNK_SAMPLES][2];
    float value[3 * CHUNK_SAMPLES] = {0};
    struct field_sum *sum = r->sum + i_field;
    const struct radiance_block block = {.member = &configuration, .n_member = 1, .n_path = n, .xy = xy, .rng = rng};
    for (size_t i = 0; i < n; i++) {
        rng_start(&rng[i], &key, (uint32_t)i_field, (uint32_t)(first + i));
        for (int a = 0; a < 2; a++) xy[i][a] = corner[a] + q->share * rng_double(&rng[i]);
    }
    r->source->tracer->trace(r->source->state, &block, value);
    sum->n += (double)n;
    for (size_t i = 0; i < 3 * n; i++) {
        double v = (double)value[i];
        sum->x[i % 3] += v;
        sum->x2[i % 3] += v * v;
    }
}

static void run_field(void *context, size_t i_field, size_t i_thread)
{
    (void)i_thread;
    const struct run *r = context;
    const struct field_request *q = r->q;
    const struct rng_key key = {q->seed, FIELD_ITERATION, PLACE_REPLICA, 0};
    const size_t square[2] = {i_field % q->n_side, i_field / q->n_side};
    double corner[2];
    struct rng rng;
    rng_start(&rng, &key, (uint32_t)i_field, 0);
    for (int a = 0; a < 2; a++) {
        double edge = 1.0 / (double)q->n_side;
        corner[a] = (double)square[a] * edge + rng_double(&rng) * (edge - q->share);
    }
    for (size_t i = 0; i < q->n_sample; i += CHUNK_SAMPLES)
        add_samples(r, i_field, corner, q->first_sample + i,
                    q->n_sample - i < CHUNK_SAMPLES ? q->n_sample - i : CHUNK_SAMPLES);
}

status field_samples_add(const struct field_request *q, struct thread_pool *pool, struct field_sum *sum,
                         struct error *err)
{
    struct radiance_source source;
    struct run r = {.q = q, .source = &source, .sum = sum};
    status st = radiance_source_init(&source, &q->input, q->configuration, 1, err);
    if (st != STATUS_OK) return st;
    st = thread_pool_run(pool, q->n_side * q->n_side, run_field, &r, NULL);
    radiance_source_release(&source);
    return st;
}
