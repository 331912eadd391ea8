/* The two steps in which a model evaluates and samples a bounce give the same bits as the one. */
#include "renderer/scattering/scattering.h"

#include "base/rng.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

static void direction(struct rng *r, float w[3])
{
    double z = 2 * rng_double(r) - 1, phi = 2 * M_PI * rng_double(r), s = sqrt(1 - z * z);
    w[0] = (float)z;
    w[1] = (float)(s * cos(phi));
    w[2] = (float)(s * sin(phi));
}

static void check(const struct scattering_model *m, const struct scattering_state *s, struct rng *r)
{
    float wo[3], wi[3], weight[3], u[3], rgb[3][3], score[3][3 * SCATTERING_MAX_PARAM], drawn[2][3];
    const size_t score_bytes = 3 * m->n_param * sizeof(float);
    struct scattering_view view;
    direction(r, wo);
    for (int a = 0; a < 3; a++) weight[a] = rng_float(r);
    for (int a = 0; a < 3; a++) u[a] = rng_float(r);
    m->sample(s, wo, weight, u, drawn[0]);
    for (int k = 0; k < 2; k++) { /* a direction that light takes, and any other */
        for (int a = 0; a < 3; a++) wi[a] = drawn[0][a];
        if (k == 1) direction(r, wi);
        const float pdf = m->eval_pdf(s, wi, wo, weight, rgb[0], score[0]);
        m->eval(s, wi, wo, rgb[1], score[1]); /* connections take their scores from here */
        assert_memory_equal(rgb[0], rgb[1], sizeof rgb[0]);
        assert_memory_equal(score[0], score[1], score_bytes);
        if (m->view_of == NULL) continue;
        m->view_of(s, wo, weight, &view);
        assert_true(pdf == m->eval_pdf_view(s, wi, &view, rgb[2], score[2]));
        assert_memory_equal(rgb[0], rgb[2], sizeof rgb[0]);
        assert_memory_equal(score[0], score[2], score_bytes);
        m->sample_view(s, &view, u, drawn[1]);
        assert_memory_equal(drawn[0], drawn[1], sizeof drawn[0]);
    }
}

static void two_steps_are_one(void **unused)
{
    size_t n_view = 0;
    (void)unused;
    for (size_t k = 0; scattering_registry()[k] != NULL; k++) {
        const struct scattering_model *m = scattering_registry()[k];
        struct scattering_state *s = NULL;
        double param[SCATTERING_MAX_PARAM];
        struct rng r;
        if (m->view_of == NULL) continue;
        n_view++;
        rng_start(&r, &(struct rng_key){.seed = 5}, 0, 0);
        for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
        assert_int_equal(m->prepare(param, &s, NULL), STATUS_OK);
        for (int i = 0; i < 2000; i++) check(m, s, &r);
        m->release(s);
    }
    assert_true(n_view > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(two_steps_are_one)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
