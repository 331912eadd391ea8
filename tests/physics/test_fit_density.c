/* The density multiplier of a volume model as a fitted parameter. With the lamp behind the cloth the fit finds it
 * within its standard error. A density that no photograph depends on is reported as not determined. */
#include "base/angle.h"
#include "base/catalogue/method_catalogue.h"
#include "base/rng.h"
#include "optimizer/fit/descent/descent.h"
#include "optimizer/fit/descent/trace_estimator.h"
#include "renderer/transport/volume/volume_scene.h"
#include "tests/support/scan/hand_volume.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_FRONT = 5, N_BACK = 3, N = N_FRONT + N_BACK, TRUTH_PATHS = 100000, TRUE_PER_CM = 900 };
static const double deg = RAD_PER_DEG, photograph_noise = 0.005;

static struct configuration view(double light_deg, double camera_deg, double rotation_deg)
{
    return (struct configuration){.light_theta_rad = light_deg * deg,
                                  .camera_theta_rad = camera_deg * deg,
                                  .camera_phi_rad = M_PI,
                                  .cloth_rotation_rad = rotation_deg * deg,
                                  .light_distance_m = 0.61,
                                  .lamp_side_m = 0.1,
                                  .camera_distance_m = 1.0,
                                  .crop_m = 0.01};
}

static void set_views(struct configuration c[N])
{
    c[0] = view(20, 20, 0);
    c[1] = view(45, 45, 0);
    c[2] = view(60, 0, 90);
    c[3] = view(45, 20, 90);
    c[4] = view(65, 60, 0);
    c[5] = view(180, 30, 0); /* from behind; the camera does not see the lamp itself */
    c[6] = view(150, 0, 0);
    c[7] = view(135, 20, 90);
}

/* Photographs at the true parameters. Each number has an error of its own. */
static void observe(struct trace_estimator *t, const double *truth, struct observation_set *o)
{
    struct estimate e[N];
    size_t n_path[N];
    double wall_s;
    const struct rng_key key = {.seed = 11};
    struct rng rng;
    struct estimator estimator = trace_estimator(t);
    for (size_t i = 0; i < t->request.n_configuration; i++) n_path[i] = TRUTH_PATHS;
    const struct estimator_call call = {truth, n_path, 0, REPLICA_FINAL_A, false};
    assert_int_equal(estimator.run(estimator.context, &call, NULL, e, &wall_s, NULL), STATUS_OK);
    rng_start(&rng, &key, 0, 0);
    for (size_t i = 0; i < t->request.n_configuration; i++) {
        struct observation item = {.set = JOB_SET_FIT, .configuration = t->request.configuration[i], .weight = 1.0};
        for (int k = 0; k < 3; k++) {
            double normal[2];
            rng_normal_pair(&rng, normal);
            item.mean_rgb[k] = e[i].mean[k] * (1.0 + photograph_noise * normal[0]);
            item.se_rgb[k] = sqrt(e[i].var[k] + photograph_noise * photograph_noise * e[i].mean[k] * e[i].mean[k]);
        }
        assert_int_equal(observation_set_append(o, &item, NULL), STATUS_OK);
    }
}

static void fit(const struct volume_scene *scene, size_t n, uint64_t budget, struct fit_result *r)
{
    struct configuration c[N];
    struct appearance model;
    struct thread_pool *pool = NULL;
    struct observation_set o;
    struct fit_parameter parameter[FIT_MAX_PARAM];
    double truth[FIT_MAX_PARAM] = {0.9, 0.7, 0.5, 0.2};
    set_views(c);
    observation_set_init(&o);
    assert_true(appearance_find("microflake.v1", &model));
    const struct param_info *d = &model.param[model.n_param - 1];
    truth[model.n_param - 1] = param_from_file_unit(d, TRUE_PER_CM);
    assert_int_equal(thread_pool_new(2, &pool, NULL), STATUS_OK);
    struct trace_estimator t = {.request = {.input = {.scene = {.volume = scene}, .model = &model},
                                            .configuration = c,
                                            .n_configuration = n,
                                            .seed = 77},
                                .pool = pool};
    observe(&t, truth, &o);
    for (size_t p = 0; p < model.n_param; p++)
        parameter[p] = (struct fit_parameter){model.param[p].lower, model.param[p].upper, model.param[p].start, false};
    t.request.seed = 1;
    struct estimator e = trace_estimator(&t);
    const struct fit_problem problem = {.n_param = model.n_param,
                                        .info = model.param,
                                        .parameter = parameter,
                                        .observation = &o,
                                        .estimator = &e,
                                        .path_budget = budget};
    struct error err = {0};
    if (descent_find(method_gauss_newton.id)->run(&problem, r, &err) != STATUS_OK) fail_msg("%s", err.text);
    for (size_t p = 0; p < model.n_param; p++)
        print_message("%-18s true %9.4g  fitted %9.4g +- %.3g %s%s\n", model.param[p].name,
                      param_to_file_unit(&model.param[p], truth[p]), param_to_file_unit(&model.param[p], r->param[p]),
                      param_to_file_unit(&model.param[p], r->uncertainty.se_param[p]),
                      param_unit_name(model.param[p].unit), r->uncertainty.determined[p] ? "" : " not determined");
    observation_set_release(&o);
    thread_pool_free(pool);
}

static void slab(struct direction_volume *v, struct volume_scene *scene, size_t n_layer)
{
    const size_t n[3] = {8, 8, n_layer};
    const float x[3] = {1, 0, 0};
    const struct volume_scene_option option = {.black_sheet = false};
    hand_volume_uniform(v, n, 5e-6, 128, x);
    assert_int_equal(volume_scene_init(scene, v, &option, NULL), STATUS_OK);
}

/* 80 um at half density: an optical depth of 3.6 across the fibers at 900 per cm. The fit starts at 4000. */
static void test_recovered_with_light_from_behind(void **unused)
{
    (void)unused;
    struct direction_volume v;
    struct volume_scene scene;
    struct fit_result r;
    slab(&v, &scene, 16);
    fit(&scene, N, 800000, &r);
    const int d = 4;
    double se = r.uncertainty.se_param[d];
    assert_true(r.uncertainty.determined[d]);
    assert_true(fabs(r.param[d] - 9e4) < 2.0 * se);
    assert_true(se < 0.1 * 9e4); /* and the standard error is small */
    volume_scene_release(&scene);
    direction_volume_release(&v);
}

/* The cloth is so thick that no light passes through it. Brightness does not depend on d, and the fit must report it as
 * not determined. */
static void test_not_determined_from_the_front(void **unused)
{
    (void)unused;
    struct direction_volume v;
    struct volume_scene scene;
    struct fit_result r;
    slab(&v, &scene, 128);
    fit(&scene, N_FRONT, 200000, &r);
    assert_false(r.uncertainty.determined[4]);
    volume_scene_release(&scene);
    direction_volume_release(&v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_recovered_with_light_from_behind),
        cmocka_unit_test(test_not_determined_from_the_front),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
