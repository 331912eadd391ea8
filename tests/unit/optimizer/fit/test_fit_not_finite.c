/* A scattering model that returns NaN, in a fit with the real tracers of surfaces and of volumes. Whenever the first
 * NaN occurs, the fit ends with an error that names model, parameter and configuration. */
#include "optimizer/fit/descent/fit_run.h"
#include "optimizer/fit/descent/trace_estimator.h"
#include "renderer/transport/volume/volume_scene.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/general_methods.h"
#include "tests/support/scan/hand_volume.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_ROW = 3 };

static atomic_long n_good; /* evaluations before the first that is not a number */

static bool spoilt(void) { return atomic_fetch_sub(&n_good, 1) <= 0; }

static float surface_eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3],
                              const float *weight, float rgb[3], float *score)
{
    const struct scattering_model *m = scattering_find("two_lobe.v1");
    float pdf = m->eval_pdf(s, wi, wo, weight, rgb, score);
    if (score != NULL && spoilt()) score[m->n_param + 6] = NAN; /* green, by beta_R */
    return pdf;
}

static float volume_eval_pdf(const struct phase_state *s, const float wi[3], const float wo[3], const float *weight,
                             float rgb[3], float *score)
{
    float pdf = phase_find("microflake.v1")->eval_pdf(s, wi, wo, weight, rgb, score);
    if (spoilt()) rgb[2] = NAN;
    return pdf;
}

static void fit(struct trace_estimator *t, long n_before, const char *model, const char *field)
{
    struct observation_set o;
    struct fit_parameter parameter[FIT_MAX_PARAM];
    struct fit_result r;
    observation_set_init(&o);
    for (size_t i = 0; i < N_ROW; i++) {
        const struct observation item = {
            .mean_rgb = {0.2, 0.2, 0.2}, .weight = 1.0, .configuration = t->request.configuration[i]};
        assert_int_equal(observation_set_append(&o, &item, NULL), STATUS_OK);
    }
    for (size_t p = 0; p < t->request.input.model->n_param; p++) {
        const struct param_info *info = &t->request.input.model->param[p];
        parameter[p] = (struct fit_parameter){info->lower, info->upper, info->start, false};
    }
    struct estimator e = trace_estimator(t);
    const struct fit_problem problem = {.n_param = t->request.input.model->n_param,
                                        .info = t->request.input.model->param,
                                        .parameter = parameter,
                                        .observation = &o,
                                        .estimator = &e,
                                        .path_budget = 200000,
                                        .max_iteration = 3};
    for (const struct descent_method *const *m = general_methods(); *m != NULL; m++) {
        struct error err = {0};
        atomic_store(&n_good, n_before);
        if (fit_run(*m, &problem, NULL, &r, &err) != STATUS_NUMERIC) fail_msg("%s: %s", (*m)->info->id, err.text);
        if (strstr(err.text, model) == NULL || strstr(err.text, "not finite") == NULL)
            fail_msg("%s: %s", (*m)->info->id, err.text);
        bool named = false;
        for (size_t i = 0; i < N_ROW; i++) {
            char view[CONFIGURATION_TEXT];
            configuration_describe(&t->request.configuration[i], view);
            named = named || strstr(err.text, view) != NULL;
        }
        if (!named) fail_msg("%s names no configuration: %s", (*m)->info->id, err.text);
        if (field != NULL) assert_string_equal(err.field, field);
    }
    observation_set_release(&o);
}

static struct configuration view(double light_rad)
{
    return (struct configuration){.light_theta_rad = light_rad,
                                  .camera_theta_rad = 0.2,
                                  .camera_phi_rad = M_PI,
                                  .light_distance_m = 0.61,
                                  .lamp_side_m = 0.1,
                                  .camera_distance_m = 1.0,
                                  .crop_m = 0.01};
}

static void test_surface(void **state)
{
    (void)state;
    const struct configuration c[N_ROW] = {view(0.3), view(0.7), view(1.1)};
    struct scattering_model broken = *scattering_find("two_lobe.v1");
    struct appearance a;
    struct fiber_set f;
    struct scene *scene = NULL;
    broken.id = "broken.v1";
    broken.eval_pdf = surface_eval_pdf;
    broken.view_of = NULL;
    appearance_from_surface(&broken, &a);
    assert_string_equal(a.param[6].name, "beta_R");
    hand_weave_small(&f);
    assert_int_equal(scene_new(&f, &(struct scene_option){true}, &scene, NULL), STATUS_OK);
    fiber_set_release(&f);
    struct trace_estimator t = {.request = {.input = {.scene = {.fibers = scene}, .model = &a},
                                            .configuration = c,
                                            .n_configuration = N_ROW,
                                            .seed = 3}};
    fit(&t, 0, "broken.v1", "beta_R");
    fit(&t, 60000, "broken.v1", "beta_R"); /* during the fit */
    scene_free(scene);
}

static void test_volume(void **state)
{
    (void)state;
    const struct configuration c[N_ROW] = {view(0.3), view(0.7), view(1.1)};
    struct phase_model broken = *phase_find("microflake.v1");
    struct appearance a;
    struct direction_volume v;
    struct volume_scene scene;
    broken.id = "broken_flake.v1";
    broken.eval_pdf = volume_eval_pdf;
    appearance_from_volume(&broken, &a);
    hand_volume_weave(&v, (const size_t[3]){16, 16, 8}, 10e-6, 0.4);
    assert_int_equal(volume_scene_init(&scene, &v, &(struct volume_scene_option){.black_sheet = true}, NULL),
                     STATUS_OK);
    struct trace_estimator t = {.request = {.input = {.scene = {.volume = &scene}, .model = &a},
                                            .configuration = c,
                                            .n_configuration = N_ROW,
                                            .seed = 3}};
    fit(&t, 0, "broken_flake.v1", NULL);
    fit(&t, 40000, "broken_flake.v1", NULL);
    volume_scene_release(&scene);
    direction_volume_release(&v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_surface), cmocka_unit_test(test_volume)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
