/* The factor on deep light that is fitted to paths of a view: it finds again what the table lacks, whole or by depth,
 * leaves a good table alone, and does not depend on the number of threads. */
#include "renderer/estimate/estimate.h"
#include "renderer/fast/deep_fit.h"
#include "renderer/fast/fast_tables.h"
#include "renderer/fast/precompute/fast_precompute.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { TRACED = 2, PATHS = 40000 };

static struct scene *scene;
static const struct scattering_model *model;
static double param[SCATTERING_MAX_PARAM];
static struct fast_tables tables;
static struct configuration view[16];

static int set_up(void **state)
{
    static const double gabardine[] = {0.185, 0.047, 0.069, 0.999, 0.330, 0.354, 2.141, 10, 23.548};
    struct fiber_set f;
    struct error err = {0};
    (void)state;
    hand_weave_small(&f);
    if (scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(&f);
    model = scattering_find("two_lobe.v1");
    for (size_t p = 0; p < model->n_param; p++) param[p] = param_from_file_unit(&model->param[p], gabardine[p]);
    const struct fast_precompute_request q = {.scene = scene,
                                              .model = model,
                                              .param = param,
                                              .n_path = 100,
                                              .cell_paths = 3,
                                              .no_visibility = true,
                                              .deep_traced = TRACED,
                                              .deep_edge = 10,
                                              .deep_paths = 300000};
    if (fast_precompute(&q, NULL, NULL, &tables, &err) != STATUS_OK) fail_msg("%s", err.text);
    orbit_configurations_16(view);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    fast_tables_release(&tables);
    scene_free(scene);
    return 0;
}

static void fit(struct thread_pool *pool, struct deep_fit *out)
{
    struct error err = {0};
    struct appearance appearance;
    const struct fast_option fast = {.tables = &tables, .n_traced = TRACED, .deep = true};
    struct radiance_input in = trace_input_surface(scene, model, param, &appearance);
    in.fast = &fast;
    if (deep_fit_make(&in, &view[1], PATHS, 7, pool, NULL, out, &err) != STATUS_OK) fail_msg("%s", err.text);
}

/* Mean red radiance; by tables with a factor, or NULL: path by path. */
static struct estimate mean_of(const struct deep_factor *factor, bool by_tables)
{
    struct error err = {0};
    struct appearance appearance;
    struct estimate e;
    const size_t n_path = 65536;
    const struct fast_option fast = {.tables = &tables, .n_traced = TRACED, .deep = true, .factor = factor};
    struct estimate_request r = {.input = trace_input_surface(scene, model, param, &appearance),
                                 .configuration = &view[1],
                                 .n_configuration = 1,
                                 .n_path = &n_path,
                                 .seed = 11,
                                 .replica = by_tables};
    r.input.fast = by_tables ? &fast : NULL;
    if (estimate_run(&r, NULL, NULL, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
    return e;
}

static void scale_tables(float factor)
{
    for (size_t i = 0; i < deep_light_n_value(&tables.deep); i++) tables.deep.value[i] *= factor;
}

/* With half of the light in the table, the factor brings back the mean of path tracing. */
static void finds_what_the_table_lacks(void **state)
{
    (void)state;
    struct deep_fit half;
    scale_tables(0.5f);
    fit(NULL, &half);
    const struct estimate dark = mean_of(NULL, true), whole = mean_of(&half.factor, true),
                          traced = mean_of(NULL, false);
    scale_tables(2);
    const double se = sqrt(whole.var[0] + traced.var[0]) + half.error * traced.mean[0];
    print_message("half a table: %.4f, fitted %.4f, path tracing %.4f +- %.4f; difference %.3f +- %.3f\n", dark.mean[0],
                  whole.mean[0], traced.mean[0], se, half.difference, half.error);
    assert_true(half.used && fabs(half.difference - 1) < 4 * half.error + 0.1);
    assert_true(fabs(whole.mean[0] - traced.mean[0]) < 4 * se && dark.mean[0] < traced.mean[0] - 4 * se);
}

/* The factor moves the mean of a picture by a good table by no more than its error. */
static void leaves_a_good_table(void **state)
{
    (void)state;
    struct deep_fit f;
    fit(NULL, &f);
    const struct estimate plain = mean_of(NULL, true), fitted = mean_of(f.used ? &f.factor : NULL, true);
    print_message("%.4f becomes %.4f; difference %.3f +- %.3f\n", plain.mean[0], fitted.mean[0], f.difference, f.error);
    assert_true(fabs(f.difference) < 4 * f.error + 0.05);
    assert_true(fabs(fitted.mean[0] / plain.mean[0] - 1) < 4 * f.error + 0.05);
}

static void threads_change_nothing(void **state)
{
    (void)state;
    struct thread_pool *pool;
    struct error err = {0};
    struct deep_fit one, three;
    assert_int_equal(thread_pool_new(3, &pool, &err), STATUS_OK);
    fit(NULL, &one);
    fit(pool, &three);
    thread_pool_free(pool);
    assert_memory_equal(&one.factor, &three.factor, sizeof one.factor);
    assert_true(one.difference == three.difference);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(finds_what_the_table_lacks),
        cmocka_unit_test(leaves_a_good_table),
        cmocka_unit_test(threads_change_nothing),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
