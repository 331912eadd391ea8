/* Tables that threads of a pool make together are those that the caller makes alone, bit for bit, of every model. */
#include "renderer/scattering/scattering.h"
#include "tests/support/model/model_stream.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/model/prepared_model.h"

enum { N_PAIR = 400, N_THREAD = 3 };

static void draw_direction(struct rng *r, float w[3])
{
    const double theta = M_PI * (rng_double(r) - 0.5), phi = 2 * M_PI * rng_double(r);
    w[0] = (float)sin(theta);
    w[1] = (float)(cos(theta) * cos(phi));
    w[2] = (float)(cos(theta) * sin(phi));
}

static void check_pair(const struct scattering_model *m, struct scattering_state *const *s, struct rng *r)
{
    float wi[3], wo[3], u[3], value[2][3], score[2][3 * SCATTERING_MAX_PARAM], pdf[2], drawn[2][3];
    memset(score, 0, sizeof score);
    draw_direction(r, wi);
    draw_direction(r, wo);
    for (int k = 0; k < 3; k++) u[k] = (float)rng_double(r) * 0.999f;
    for (int k = 0; k < 2; k++) {
        pdf[k] = m->eval_pdf(s[k], wi, wo, NULL, value[k], score[k]);
        m->sample(s[k], wo, NULL, u, drawn[k]);
    }
    assert_memory_equal(value[0], value[1], sizeof value[0]);
    assert_memory_equal(score[0], score[1], sizeof score[0]);
    assert_memory_equal(&pdf[0], &pdf[1], sizeof pdf[0]);
    assert_memory_equal(drawn[0], drawn[1], sizeof drawn[0]);
}

static void threads_make_the_same_tables(void **state)
{
    struct thread_pool *pool = NULL;
    struct error err = {0};
    int n_shared = 0;
    (void)state;
    assert_int_equal(thread_pool_new(N_THREAD, &pool, &err), STATUS_OK);
    for (size_t k = 0; scattering_registry()[k] != NULL; k++) {
        const struct scattering_model *m = scattering_registry()[k];
        double param[SCATTERING_MAX_PARAM];
        struct rng r;
        if (m->prepare_shared == NULL) continue;
        n_shared++;
        model_stream_start(&r, 11, m->id);
        for (size_t p = 0; p < m->n_param; p++) /* three colors of their own, and nothing at a bound */
            param[p] = m->param[p].lower + (0.25 + 0.5 * rng_double(&r)) * (m->param[p].upper - m->param[p].lower);
        struct scattering_state *s[2] = {prepare(m, param), NULL};
        if (scattering_prepare(m, param, pool, &s[1], &err) != STATUS_OK) fail_msg("%s: %s", m->id, err.text);
        for (int i = 0; i < N_PAIR; i++) check_pair(m, s, &r);
        for (int i = 0; i < 2; i++) m->release(s[i]);
        param[0] = NAN;
        assert_int_equal(scattering_prepare(m, param, pool, &s[1], &err), STATUS_INVALID);
        assert_non_null(strstr(err.text, m->param[0].name));
    }
    assert_true(n_shared > 0);
    thread_pool_free(pool);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(threads_make_the_same_tables)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
