/* Tables of the fast renderer: the file and what is refused of it, what segments see against rays, the transfer of a
 * lossless cloth against the directions that are blocked, and pictures by tables against path tracing. */
#include "base/files/durable.h"
#include "base/rng.h"
#include "renderer/estimate/estimate.h"
#include "renderer/fast/fast_tables.h"
#include "renderer/fast/precompute/fast_precompute.h"
#include "renderer/fast/precompute/seen_places.h"
#include "renderer/fast/sphere_harmonics.h"
#include "renderer/scene/scene_place.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* A small weave with its tables, made once for all tests. */
static struct cloth {
    struct scene *scene;
    const struct scattering_model *model;
    double param[SCATTERING_MAX_PARAM];
    struct fast_tables tables;
} white, colored;

static void make_cloth(struct cloth *c, const char *model, bool black_sheet, bool no_visibility)
{
    struct fiber_set f;
    struct error err = {0};
    hand_weave_small(&f);
    if (scene_new(&f, &(struct scene_option){black_sheet}, &c->scene, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(&f);
    c->model = scattering_find(model);
    for (size_t p = 0; p < c->model->n_param; p++) c->param[p] = c->model->param[p].start;
    if (strcmp(model, "two_lobe.v1") == 0) { /* lobes that are wide enough for the order of the harmonics */
        static const double wide[] = {0.2, 0.1, 0.05, 0.9, 0.6, 0.4, 10, 30, 40};
        for (size_t p = 0; p < 9; p++) c->param[p] = param_from_file_unit(&c->model->param[p], wide[p]);
    }
    if (strcmp(model, "isotropic.v1") == 0) c->param[0] = c->param[1] = c->param[2] = 1.0;
    const struct fast_precompute_request q = {.scene = c->scene,
                                              .model = c->model,
                                              .param = c->param,
                                              .n_path = 12000,
                                              .cell_paths = 3,
                                              .no_visibility = no_visibility,
                                              .deep_traced = black_sheet ? 1 : 0,
                                              .deep_edge = 3,
                                              .deep_paths = 2000};
    if (fast_precompute(&q, NULL, NULL, &c->tables, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_true(c->tables.checksum == fast_tables_checksum(&q));
}

static int set_up(void **state)
{
    (void)state;
    make_cloth(&white, "isotropic.v1", false, true);
    make_cloth(&colored, "two_lobe.v1", true, false);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    fast_tables_release(&white.tables);
    fast_tables_release(&colored.tables);
    scene_free(white.scene);
    scene_free(colored.scene);
    return 0;
}

static void random_direction(struct rng *r, float d[3])
{
    double z = 2 * rng_double(r) - 1, phi = 2 * M_PI * rng_double(r), s = sqrt(1 - z * z);
    d[0] = (float)(s * cos(phi));
    d[1] = (float)(s * sin(phi));
    d[2] = (float)z;
}

/* In a lossless cloth under a uniform sky of radiance 1, radiance 1 arrives from every direction that is blocked by a
 * fiber and nothing of it from the others. The mean over all that is seen therefore has the harmonics of the share of
 * blocked directions. The standard errors follow from single paths and rays, whose values are Y(j) times 0 or a number
 * near 4 pi. */
static void transfer_of_a_lossless_cloth(void **state)
{
    (void)state;
    const struct fast_tables *t = &white.tables;
    size_t n = fast_n_harmonic(t), n_ray = 0;
    struct seen_places seen;
    double blocked[SPHERE_MAX_COUNT] = {0}, arriving[SPHERE_MAX_COUNT] = {0};
    assert_int_equal(seen_places_find(white.scene, NULL, NULL, &seen, NULL), STATUS_OK);
    for (size_t i = 0; i < seen.n; i++) {
        uint32_t row = fast_tables_cell_at(t, seen.place[i].position_mm);
        assert_int_not_equal(row, FAST_NO_ROW);
        for (size_t k = 0; k < n; k++)
            arriving[k] += (double)t->transfer[(size_t)row * 3 * n * n + k * n] * sqrt(4 * M_PI) / (double)seen.n;
    }
    for (size_t i = 0; i < seen.n; i += 4, n_ray++) {
        static const double no_offset[2] = {0, 0};
        struct rng rng;
        struct scene_ray ray;
        float d[3], y[SPHERE_MAX_COUNT];
        rng_start(&rng, &(struct rng_key){.seed = 3}, (uint32_t)i, 0);
        random_direction(&rng, d);
        scene_ray_leave(&seen.place[i].hit, no_offset, d, &ray);
        if (!scene_occluded(white.scene, &ray)) continue;
        sphere_harmonics(t->order, d, y);
        for (size_t k = 0; k < n; k++) blocked[k] += 4 * M_PI * (double)y[k];
    }
    double n_walk = 12000.0 * t->n_transfer / 2, tolerance = 4 * sqrt(4 * M_PI * (1 / (double)n_ray + 1 / n_walk));
    for (size_t k = 0; k < n; k++) assert_true(fabs(arriving[k] - blocked[k] / (double)n_ray) < tolerance);
    assert_true(arriving[0] > 0.3 * sqrt(4 * M_PI)); /* much is blocked */
    seen_places_release(&seen);
}

static void estimate_of(const struct cloth *c, const struct configuration *view, const struct fast_option *fast,
                        size_t n_path, struct estimate *e)
{
    struct appearance model;
    struct error err = {0};
    struct estimate_request q = {.input = trace_input_surface(c->scene, c->model, c->param, &model),
                                 .configuration = view,
                                 .n_configuration = 1,
                                 .n_path = &n_path,
                                 .seed = 11,
                                 .replica = fast != NULL};
    q.input.fast = fast;
    if (estimate_run(&q, NULL, NULL, e, &err) != STATUS_OK) fail_msg("%s", err.text);
}

/* The white furnace: a lossless cloth under a uniform sky is as bright as the sky. A cell is the mean of all directions
 * that it is seen from, of which one sees deeper, darker places than another: here up to 3 %. */
static void furnace(void **state)
{
    (void)state;
    struct configuration c[16];
    const struct fast_option fast = {.tables = &white.tables};
    orbit_configurations_16(c);
    for (int i = 0; i < 16; i += 5) {
        struct estimate e;
        c[i].light = LIGHT_NO_LAMP;
        for (int k = 0; k < 3; k++) c[i].environment_rgb[k] = 1;
        estimate_of(&white, &c[i], &fast, 8192, &e);
        assert_true(fabs(e.mean[0] - 1) < 0.05 + 4 * sqrt(e.var[0]));
    }
}

/* Means by tables are near those of path tracing. */
static void means(void **state)
{
    (void)state;
    struct configuration c[16];
    orbit_configurations_16(c);
    double error2 = 0, noise2 = 0, mean = 0;
    for (int i = 0; i < 16; i += 2) {
        struct estimate path, fast;
        const struct fast_option plain = {.tables = &colored.tables, .n_traced = 2};
        estimate_of(&colored, &c[i], NULL, 8192, &path);
        estimate_of(&colored, &c[i], &plain, 8192, &fast);
        for (int k = 0; k < 3; k++) {
            double d = fast.mean[k] - path.mean[k];
            error2 += d * d;
            noise2 += path.var[k] + fast.var[k];
            mean += path.mean[k];
        }
    }
    mean /= 24;
    double rms = sqrt(fmax(0, error2 - noise2) / 24) / mean;
    print_message("by tables: %.2f %% rms, noise %.2f %%\n", 100 * rms, 100 * sqrt(noise2 / 24) / mean);
    assert_true(rms < 0.06);
}

/* Random directions from segments that see something: the sign of the signed distance against a shadow ray. */
static void visibility(void **state)
{
    (void)state;
    const struct fast_tables *t = &colored.tables;
    struct rng rng;
    size_t n = 0, n_wrong = 0, n_open = 0, n_open_table = 0;
    rng_start(&rng, &(struct rng_key){.seed = 5}, 0, 0);
    for (uint32_t i = 0; i < t->n_segment; i += 3) {
        struct scene_segment segment;
        struct scene_ray ray = {.inside = true}; /* it starts on the axis */
        scene_segment_at(colored.scene, i, &segment);
        memcpy(ray.origin_mm, segment.middle_mm, sizeof ray.origin_mm);
        for (int k = 0; k < 8; k++, n++) {
            random_direction(&rng, ray.direction);
            ray.direction[2] = fabsf(ray.direction[2]);
            bool open = !scene_occluded(colored.scene, &ray);
            uint32_t row = t->segment_row[i];
            bool table = row != FAST_NO_ROW && fast_tables_distance(t, row, ray.direction) > 0;
            n_wrong += open != table;
            n_open += open;
            n_open_table += table;
        }
    }
    print_message("visibility: %.2f %% of directions differ, open %.2f %% and by tables %.2f %%\n",
                  100.0 * (double)n_wrong / (double)n, 100.0 * (double)n_open / (double)n,
                  100.0 * (double)n_open_table / (double)n);
    assert_true((double)n_open > 0.05 * (double)n);
    assert_true((double)n_wrong < 0.03 * (double)n);
}

/* The weights of the Gaussians together are the open share of the half sphere. */
static void gaussian_weights(void **state)
{
    (void)state;
    const struct fast_tables *t = &colored.tables;
    double open = 0, weights = 0, n = 0;
    for (uint32_t i = 0; i < t->n_segment; i++) {
        struct scene_segment segment;
        struct scene_ray ray = {.inside = true}; /* it starts on the axis */
        struct rng rng;
        uint32_t row = t->segment_row[i];
        if (row == FAST_NO_ROW) continue;
        scene_segment_at(colored.scene, i, &segment);
        memcpy(ray.origin_mm, segment.middle_mm, sizeof ray.origin_mm);
        rng_start(&rng, &(struct rng_key){.seed = 6}, i, 0);
        for (int k = 0; k < 16; k++, n += 1) {
            random_direction(&rng, ray.direction);
            ray.direction[2] = fabsf(ray.direction[2]);
            open += !scene_occluded(colored.scene, &ray);
        }
        for (size_t q = 0; q < FAST_N_GAUSSIAN; q++)
            weights += t->gaussian[(size_t)row * 2 * FAST_N_GAUSSIAN + q] / (255.0 * FAST_N_GAUSSIAN) * 16;
    }
    print_message("open share: rays %.4f, weights %.4f\n", open / n, weights / n);
    assert_true(fabs(open - weights) / n < 0.01);
}

static void read_back(const char *path, status expected)
{
    struct fast_tables t;
    struct error err = {0};
    status s = fast_tables_read(&t, path, &err);
    if (s != expected) fail_msg("%s instead of %s: %s", status_name(s), status_name(expected), err.text);
    assert_true(strlen(err.text) > 20);
}

static void file_round_trip(void **state)
{
    const struct fast_tables *t = &colored.tables;
    struct fast_tables back;
    char *bytes = NULL;
    const char *path = scratch_path(state, "tables");
    struct error err = {0};
    size_t n, n_number = (size_t)t->n_transfer * 3 * fast_n_harmonic(t) * fast_n_harmonic(t);
    assert_int_equal(fast_tables_write(t, path, &err), STATUS_OK);
    if (fast_tables_read(&back, path, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_true(back.checksum == t->checksum && back.n_row == t->n_row && back.spread_mm == t->spread_mm);
    assert_memory_equal(back.segment_row, t->segment_row, t->n_segment * sizeof *t->segment_row);
    assert_memory_equal(back.component, t->component, (size_t)t->n_row * FAST_N_COMPONENT);
    assert_memory_equal(back.scatter, t->scatter, FAST_N_THETA * 3 * fast_n_harmonic(t) * sizeof *t->scatter);
    assert_true(back.deep.n_traced == 1 && back.deep.edge == 3 && back.deep.n_side == 1);
    assert_true(back.deep.error > 0 && back.deep.error == t->deep.error);
    assert_memory_equal(back.deep.value, t->deep.value, deep_light_n_value(&t->deep) * sizeof *t->deep.value);
    assert_true(back.deep.spread_mm > 0 && back.deep.spread_mm == t->deep.spread_mm);
    assert_memory_equal(back.deep.shift, t->deep.shift, deep_light_n_shift(&t->deep) * sizeof *t->deep.shift);
    for (size_t i = 0; i < n_number; i++) {
        float most = fabsf(t->transfer[i - i % (n_number / t->n_transfer)]);
        assert_true(fabsf(back.transfer[i] - t->transfer[i]) < 1e-3f * most + 1e-3f);
    }
    fast_tables_release(&back);

    assert_int_equal(file_read_all(path, 1 << 30, &bytes, &n, &err), STATUS_OK);
    bytes[n / 2] ^= 1;
    assert_int_equal(durable_replace_volatile(path, bytes, n, &err), STATUS_OK);
    read_back(path, STATUS_CHECKSUM);
    assert_int_equal(durable_replace_volatile(path, bytes, n - 1, &err), STATUS_OK);
    read_back(path, STATUS_FORMAT);
    assert_int_equal(durable_replace_volatile(path, bytes, 40, &err), STATUS_OK);
    read_back(path, STATUS_FORMAT);
    bytes[8] = 9; /* version */
    assert_int_equal(durable_replace_volatile(path, bytes, n, &err), STATUS_OK);
    read_back(path, STATUS_FORMAT);
    bytes[0] = 'X';
    assert_int_equal(durable_replace_volatile(path, bytes, n, &err), STATUS_OK);
    read_back(path, STATUS_FORMAT);
    free(bytes);
    read_back(scratch_path(state, "missing"), STATUS_NOT_FOUND);
}

/* The same tables for any number of threads. */
static void threads(void **state)
{
    (void)state;
    struct thread_pool *pool = NULL;
    struct fast_tables a, b;
    const struct fast_precompute_request q = {.scene = colored.scene,
                                              .model = colored.model,
                                              .param = colored.param,
                                              .n_path = 1000,
                                              .cell_paths = 6,
                                              .no_visibility = true};
    assert_int_equal(thread_pool_new(3, &pool, NULL), STATUS_OK);
    assert_int_equal(fast_precompute(&q, NULL, NULL, &a, NULL), STATUS_OK);
    assert_int_equal(fast_precompute(&q, pool, NULL, &b, NULL), STATUS_OK);
    assert_memory_equal(a.transfer, b.transfer,
                        (size_t)a.n_transfer * 3 * fast_n_harmonic(&a) * fast_n_harmonic(&a) * sizeof *a.transfer);
    fast_tables_release(&a);
    fast_tables_release(&b);
    thread_pool_free(pool);
}

/* Kept tables are taken for the request that they were made for, and refused for every other one. */
static void kept(void **state)
{
    const char *path = scratch_path(state, "tables");
    struct fast_tables t;
    struct error err = {0};
    double param[SCATTERING_MAX_PARAM];
    memcpy(param, colored.param, sizeof param);
    const struct fast_precompute_request made = {.scene = colored.scene,
                                                 .model = colored.model,
                                                 .param = param,
                                                 .n_path = 200,
                                                 .cell_paths = 6,
                                                 .no_visibility = true};
    assert_int_equal(fast_precompute(&made, NULL, NULL, &t, &err), STATUS_OK);
    assert_int_equal(fast_tables_write(&t, path, &err), STATUS_OK);
    fast_tables_release(&t);
    if (fast_precompute_kept(&made, path, &t, &err) != STATUS_OK) fail_msg("%s", err.text);
    fast_tables_release(&t);
    struct fast_precompute_request other[4];
    for (size_t i = 0; i < 4; i++) other[i] = made;
    other[0].scene = white.scene;
    other[1].n_path = 201;
    other[2].deep_traced = 3;
    other[3].cell_paths = 5;
    for (size_t i = 0; i < 4; i++) {
        assert_int_equal(fast_precompute_kept(other + i, path, &t, &err), STATUS_CONFLICT);
        assert_non_null(strstr(err.text, "'tables'"));
    }
    param[0] = nextafter(param[0], 0.0);
    assert_int_equal(fast_precompute_kept(&made, path, &t, &err), STATUS_CONFLICT);
    assert_int_equal(fast_precompute_kept(&made, scratch_path(state, "missing"), &t, &err), STATUS_NOT_FOUND);
}

static void refusals(void **state)
{
    (void)state;
    struct fast_tables t;
    struct error err = {0};
    size_t n_refused = 0;
    for (size_t i = 0; scattering_registry()[i] != NULL; i++) {
        const struct scattering_model *m = scattering_registry()[i];
        double param[SCATTERING_MAX_PARAM];
        if (scattering_frame_reason(m) == NULL) continue;
        for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
        const struct fast_precompute_request q = {.scene = colored.scene, .model = m, .param = param};
        err = (struct error){0};
        assert_int_equal(fast_precompute(&q, NULL, NULL, &t, &err), STATUS_INVALID);
        assert_string_equal(err.field, "model");
        assert_non_null(strstr(err.text, scattering_frame_reason(m)));
        n_refused++;
    }
    assert_true(n_refused >= 4); /* flat fibers and near fields */
    /* tables of a cloth with a black sheet, for a cloth without */
    struct estimate e;
    struct appearance model;
    struct configuration c[16];
    size_t n_path = 256;
    const struct fast_option fast = {.tables = &colored.tables};
    orbit_configurations_16(c);
    struct estimate_request r = {.input = trace_input_surface(white.scene, colored.model, colored.param, &model),
                                 .configuration = c,
                                 .n_configuration = 1,
                                 .n_path = &n_path};
    r.input.fast = &fast;
    assert_int_equal(estimate_run(&r, NULL, NULL, &e, &err), STATUS_INVALID);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(transfer_of_a_lossless_cloth),
        cmocka_unit_test(furnace),
        cmocka_unit_test(means),
        cmocka_unit_test(visibility),
        cmocka_unit_test(gaussian_weights),
        cmocka_unit_test_setup_teardown(file_round_trip, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test(threads),
        cmocka_unit_test_setup_teardown(kept, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
