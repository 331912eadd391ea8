/* Guided shadow paths (path_tracer.h): the density of the guide, and estimates with guided paths against plain ones,
 * which must have the same means and derivatives. Lamps above, grazing, directional and, without the sheet, below;
 * four models. Tolerances are standard errors.
 */
#include "base/angle.h"
#include "base/rng.h"
#include "renderer/estimate/estimate.h"
#include "renderer/transport/light_guide.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/statistics_test.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

/* Compares counts of samples in rings of equal probability, each divided into four quarters. */
static void test_guide(void **state)
{
    (void)state;
    enum { N = 200000, RING = 20, CELL = 4 * RING };
    const float towards[3] = {0.48f, -0.6f, 0.64f};
    double count[CELL] = {0}, expected[CELL], degree, sum = 0;
    struct fiber_frame f;
    struct rng r;
    rng_start(&r, &(struct rng_key){.seed = 3}, 0, 0);
    fiber_frame_from(&f, towards);
    for (int i = 0; i < N; i++) {
        float u[2] = {rng_float(&r), 0}, d[3], local[3];
        u[1] = rng_float(&r);
        light_guide_sample(towards, u, d);
        assert_true(fabsf(fiber_frame_dot(d, d) - 1) < 1e-5f);
        fiber_frame_to_local(&f, d, local);
        double inner = exp(LIGHT_GUIDE_KAPPA * ((double)local[0] - 1)),
               angle = atan2((double)local[2], (double)local[1]);
        int ring = (int)(inner * RING), quarter = (int)((angle + M_PI) / (2 * M_PI) * 4);
        count[4 * (ring < RING ? ring : RING - 1) + (quarter < 4 ? quarter : 3)]++;
    }
    for (int k = 0; k < CELL; k++) expected[k] = (double)N / CELL;
    double statistic = chi_square_statistic(count, expected, CELL, &degree), p = chi_square_tail(statistic, degree);
    if (p < 1e-4) fail_msg("chi-square %.1f with %.0f degrees of freedom: p = %.2g", statistic, degree, p);
    enum { STEP = 20000 }; /* the density, over the sphere */
    for (int i = 0; i < STEP; i++) {
        double c = -1 + 2 * (i + 0.5) / STEP, s = sqrt(1 - c * c);
        float local[3] = {(float)c, (float)s, 0}, d[3];
        fiber_frame_to_world(&f, local, d);
        sum += 2 * M_PI * 2 / STEP * (double)light_guide_pdf(towards, d);
    }
    assert_true(fabs(sum - 1) < 1e-3);
}

struct view {
    const char *model;
    bool black_sheet;
    enum configuration_light light;
    double lamp_theta_deg, lamp_phi_deg, camera_theta_deg, camera_phi_deg;
};

static const struct view view[] = {
    {"two_lobe.v1", true, LIGHT_SQUARE_LAMP, 20, 0, 20, 180},
    {"two_lobe.v1", true, LIGHT_SQUARE_LAMP, 75, 0, 70, 150},
    {"two_lobe.v1", true, LIGHT_DIRECTIONAL, 45, 30, 10, 90},
    {"two_lobe.v1", false, LIGHT_SQUARE_LAMP, 150, 40, 30, 0},
    {"two_lobe_balanced.v1", true, LIGHT_SQUARE_LAMP, 60, 0, 0, 0},
    {"kajiya_kay.v1", true, LIGHT_SQUARE_LAMP, 50, 0, 40, 180},
    {"marschner.v1", true, LIGHT_SQUARE_LAMP, 30, 0, 50, 180},
};

struct comparison {
    size_t n;
    double sum_square, largest;
};

static void compare(struct comparison *c, double a, double var_a, double b, double var_b)
{
    double var = var_a + var_b;
    if (!(var > 0)) {
        assert_true(a == b);
        return;
    }
    double z = (a - b) / sqrt(var);
    c->n++;
    c->sum_square += z * z;
    c->largest = fmax(c->largest, fabs(z));
}

/* Estimates one view with guided paths, or with plain ones. */
static void estimate_view(const struct view *v, const struct scene *scene, int plain, struct thread_pool *pool,
                          struct estimate *e)
{
    const struct scattering_model *m = scattering_find(v->model);
    const size_t n_path = 250000;
    const struct configuration c = {.light_theta_rad = v->lamp_theta_deg * RAD_PER_DEG,
                                    .light_phi_rad = v->lamp_phi_deg * RAD_PER_DEG,
                                    .camera_theta_rad = v->camera_theta_deg * RAD_PER_DEG,
                                    .camera_phi_rad = v->camera_phi_deg * RAD_PER_DEG,
                                    .light_distance_m = 0.61,
                                    .lamp_side_m = 0.1,
                                    .camera_distance_m = 1,
                                    .crop_m = 0.01,
                                    .light = v->light};
    double param[SCATTERING_MAX_PARAM];
    struct error err = {0};
    for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
    struct appearance model;
    struct estimate_request q = {.input = trace_input_surface(scene, m, param, &model),
                                 .configuration = &c,
                                 .n_configuration = 1,
                                 .n_path = &n_path,
                                 .seed = 11,
                                 .iteration = (uint32_t)plain};
    q.input.want_derivative = true;
    q.input.plain_paths = plain == 1;
    if (estimate_run(&q, pool, NULL, e, &err) != STATUS_OK) fail_msg("%s", err.text);
}

static void test_same_means(void **state)
{
    (void)state;
    struct thread_pool *pool;
    struct scene *weave[2];
    struct fiber_set f;
    struct comparison all = {0};
    double gain = 0;
    size_t n_view = sizeof view / sizeof view[0];
    assert_int_equal(thread_pool_new(0, &pool, NULL), STATUS_OK);
    hand_weave_small(&f);
    for (int i = 0; i < 2; i++)
        assert_int_equal(scene_new(&f, &(struct scene_option){.black_sheet = i == 1}, &weave[i], NULL), STATUS_OK);
    for (size_t i = 0; i < n_view; i++) {
        const struct view *v = &view[i];
        const struct scattering_model *m = scattering_find(v->model);
        struct estimate e[2];
        assert_non_null(m);
        for (int plain = 0; plain < 2; plain++) estimate_view(v, weave[v->black_sheet], plain, pool, &e[plain]);
        struct comparison here = {0};
        for (int k = 0; k < 3; k++) compare(&here, e[0].mean[k], e[0].var[k], e[1].mean[k], e[1].var[k]);
        for (size_t k = 0; k < 3 * m->n_param; k++)
            compare(&here, e[0].jac[k], e[0].jac_var[k], e[1].jac[k], e[1].jac_var[k]);
        print_message("%-20s view %zu: %zu numbers, mean square %.2f, largest %.1f standard errors; variance %.2f of "
                      "the plain one\n",
                      m->id, i, here.n, here.sum_square / (double)here.n, here.largest, e[0].var[1] / e[1].var[1]);
        all.n += here.n;
        all.sum_square += here.sum_square;
        all.largest = fmax(all.largest, here.largest);
        gain += log(e[1].var[1] / e[0].var[1]) / (double)n_view;
        /* the means are known to 4 %, so that light that is counted twice or left out would be detected */
        assert_true(sqrt(e[0].var[1] + e[1].var[1]) < 0.04 * e[0].mean[1]);
    }
    print_message("%zu numbers: mean square %.2f, largest %.1f; variance %.2f of the plain one\n", all.n,
                  all.sum_square / (double)all.n, all.largest, exp(-gain));
    assert_true(all.largest < 4.5); /* of some 200 numbers, which are correlated in each view */
    assert_true(all.sum_square / (double)all.n < 2.0);
    assert_true(gain > log(1.2));
    for (int i = 0; i < 2; i++) scene_free(weave[i]);
    fiber_set_release(&f);
    thread_pool_free(pool);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_guide), cmocka_unit_test(test_same_means)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
