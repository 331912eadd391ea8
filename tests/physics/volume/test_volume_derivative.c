/* Derivatives of volume estimates by every parameter and by d, against differences of independent runs. Also tests that
 * estimates have the same bits for any number of threads, and the storage of voxels in the tracer. */
#include "base/angle.h"
#include "renderer/estimate/estimate.h"
#include "renderer/transport/volume/volume_tracer.h"
#include "tests/support/scan/hand_volume.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_CONFIGURATION = 2 };

struct cloth {
    struct direction_volume v;
    struct volume_scene scene;
    struct thread_pool *pool;
    struct configuration c[N_CONFIGURATION];
};

static void cloth_init(struct cloth *k, size_t n_thread)
{
    const size_t n[3] = {32, 32, 14};
    memset(k, 0, sizeof *k);
    hand_volume_weave(&k->v, n, 10e-6, 0.4);
    assert_int_equal(volume_scene_init(&k->scene, &k->v, &(struct volume_scene_option){.black_sheet = true}, NULL),
                     STATUS_OK);
    assert_int_equal(thread_pool_new(n_thread, &k->pool, NULL), STATUS_OK);
    for (int i = 0; i < N_CONFIGURATION; i++)
        k->c[i] = (struct configuration){.light_theta_rad = (i ? 78 : 20) * RAD_PER_DEG, /* one at grazing angles */
                                         .light_phi_rad = i ? M_PI : 0.3,
                                         .camera_theta_rad = (i ? 70 : 10) * RAD_PER_DEG,
                                         .cloth_rotation_rad = 0.4,
                                         .light_distance_m = 0.61,
                                         .lamp_side_m = 0.1,
                                         .camera_distance_m = 1,
                                         .crop_m = 0.01};
}

static void cloth_release(struct cloth *k)
{
    thread_pool_free(k->pool);
    volume_scene_release(&k->scene);
    direction_volume_release(&k->v);
}

static void run(const struct cloth *k, const struct phase_model *m, const double *param, double d, size_t n_path,
                uint32_t iteration, bool want_jacobian, struct estimate *e)
{
    const size_t n[N_CONFIGURATION] = {n_path, n_path};
    struct error err = {0};
    struct trace_volume volume_model;
    struct estimate_request q = {.input = trace_input_volume(&k->scene, m, param, d, &volume_model),
                                 .configuration = k->c,
                                 .n_configuration = N_CONFIGURATION,
                                 .n_path = n,
                                 .seed = 61,
                                 .iteration = iteration};
    q.input.want_derivative = want_jacobian;
    if (estimate_run(&q, k->pool, NULL, e, &err) != STATUS_OK) fail_msg("%s", err.text);
}

/* Compares the derivative with a difference, both summed over the channels. The standard error of a sum is at most
 * the sum of the channels' standard errors. Steps are wide, so that 3 % of the difference is allowed for curvature
 * besides the noise. */
static void compare(const char *model, const char *name, size_t p, size_t n_param, int channel, double step,
                    const struct estimate *low, const struct estimate *high, const struct estimate *at, size_t *n,
                    size_t *n_beyond)
{
    double jac = 0, jac_se = 0, fd = 0, fd_se = 0;
    for (int c = 0; c < 3; c++) {
        if (channel >= 0 && c != channel) continue;
        jac += at->jac[(size_t)c * n_param + p];
        jac_se += sqrt(at->jac_var[(size_t)c * n_param + p]);
        fd += (high->mean[c] - low->mean[c]) / step;
        fd_se += sqrt(high->var[c] + low->var[c]) / step;
    }
    double se = hypot(jac_se, fd_se), off = fabs(jac - fd) / (se + 0.03 * fabs(fd) / 2.5);
    print_message("%s %-9s: %9.4g +- %.2g, difference %9.4g +- %.2g%s\n", model, name, jac, jac_se, fd, fd_se,
                  off > 2.5 ? "  *" : "");
    (*n)++;
    *n_beyond += off > 2.5;
    if (off > 4.5) fail_msg("%s, %s", model, name);
}

static void traced_again(void **state)
{
    (void)state;
    struct cloth k;
    size_t n = 0, n_beyond = 0;
    cloth_init(&k, 0);
    const double d = 4e4;
    for (size_t i = 0; phase_registry()[i] != NULL; i++) {
        const struct phase_model *m = phase_registry()[i];
        struct estimate at[N_CONFIGURATION], low[N_CONFIGURATION], high[N_CONFIGURATION];
        double param[SCATTERING_MAX_PARAM], moved[SCATTERING_MAX_PARAM];
        for (size_t p = 0; p < m->n_param; p++) {
            const struct param_info *info = &m->param[p];
            param[p] = info->channel < 0 ? info->start * 1.5 : info->start + 0.1 * (1 - info->start) * info->channel;
        }
        uint32_t iteration = 0;
        run(&k, m, param, d, 200000, iteration++, true, at);
        for (size_t p = 0; p <= m->n_param; p++) {
            /* a colour moves in all three channels with one run, each channel with its own */
            int channel = p < m->n_param ? m->param[p].channel : -1;
            if (channel > 0) continue;
            double h = p == m->n_param ? 0.15 * d : channel == 0 ? 0.05 : 0.15 * param[p];
            for (int side = 0; side < 2; side++) {
                memcpy(moved, param, sizeof moved);
                for (size_t q = p; q < m->n_param && q < p + (channel == 0 ? 3 : 1); q++) moved[q] += side ? h : -h;
                double d_moved = p == m->n_param ? d + (side ? h : -h) : d;
                run(&k, m, moved, d_moved, 100000, iteration++, false, side ? high : low);
            }
            for (int j = 0; j < N_CONFIGURATION; j++)
                for (size_t q = p; q < (p == m->n_param ? p + 1 : p + (channel == 0 ? 3 : 1)); q++)
                    compare(m->id, q == m->n_param ? "d" : m->param[q].name, q, m->n_param + 1,
                            q == m->n_param ? -1 : m->param[q].channel, 2 * h, &low[j], &high[j], &at[j], &n,
                            &n_beyond);
        }
    }
    cloth_release(&k);
    print_message("%zu of %zu comparisons beyond 2.5 standard errors\n", n_beyond, n);
    assert_true(n_beyond <= 1 + n / 20); /* 1.2 % are expected */
}

static void same_bits_for_any_thread_count(void **state)
{
    (void)state;
    struct estimate e[3][N_CONFIGURATION];
    const struct phase_model *m = phase_find("phase_two_lobe.v1");
    double param[SCATTERING_MAX_PARAM];
    for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
    for (size_t i = 0; i < 3; i++) {
        struct cloth k;
        memset(e[i], 0, sizeof e[i]);
        cloth_init(&k, i + 1);
        run(&k, m, param, 4e4, 5000, 7, true, e[i]);
        cloth_release(&k);
        assert_memory_equal(e[i], e[0], sizeof e[0]);
    }
    assert_true(e[0][0].mean[0] > 0 && e[0][0].n_path == 5120);
}

static void nonsense_is_refused(void **state)
{
    (void)state;
    struct cloth k;
    struct error err = {0};
    struct estimate e[N_CONFIGURATION];
    cloth_init(&k, 1);
    const size_t n[N_CONFIGURATION] = {256, 256};
    const struct phase_model *m = phase_find("microflake.v1");
    const double param[4] = {0.5, 0.5, 0.5, 0.3}, bad[4] = {0.5, 0.5, 0.5, NAN};
    struct trace_volume volume_model;
    struct estimate_request q = {.input = trace_input_volume(&k.scene, m, param, NAN, &volume_model),
                                 .configuration = k.c,
                                 .n_configuration = N_CONFIGURATION,
                                 .n_path = n,
                                 .seed = 1};
    q.input.want_derivative = true;
    assert_int_equal(estimate_run(&q, k.pool, NULL, e, &err), STATUS_INVALID);
    assert_string_equal(err.field, MODEL_DENSITY_MULTIPLIER);
    q.input = trace_input_volume(&k.scene, m, bad, 1e4, &volume_model);
    q.input.want_derivative = true;
    assert_int_equal(estimate_run(&q, k.pool, NULL, e, &err), STATUS_INVALID);
    assert_string_equal(err.field, "gamma");
    volume_scene_release(&k.scene);
    memset(k.v.density, 0, volume_n_voxel(k.v.n));
    assert_int_equal(volume_scene_init(&k.scene, &k.v, &(struct volume_scene_option){.black_sheet = true}, &err),
                     STATUS_INVALID);
    cloth_release(&k);
}

/* The tracer stores the volume correctly: densities exactly, directions within their 12 bits, and empty voxels as
 * empty. No distance that rays may skip contains an occupied voxel. */
static void stored_voxels_are_the_volume(void **state)
{
    (void)state;
    struct cloth k;
    cloth_init(&k, 1);
    volume_scene_release(&k.scene);
    for (size_t i = 0; i < volume_n_voxel(k.v.n); i++) {
        float w[3];
        double z = 2 * ((double)i + 0.5) / (double)volume_n_voxel(k.v.n) - 1, phi = 2.399963 * (double)i;
        w[0] = (float)(sqrt(1 - z * z) * cos(phi));
        w[1] = (float)(sqrt(1 - z * z) * sin(phi));
        w[2] = (float)z;
        direction_volume_set(&k.v, i, w);
        k.v.density[i] = (uint8_t)(k.v.density[i] != 0 ? 1 + i % 255 : 0);
    }
    assert_int_equal(volume_scene_init(&k.scene, &k.v, &(struct volume_scene_option){.black_sheet = true}, NULL),
                     STATUS_OK);
    double worst = 1;
    for (size_t z = 0; z < k.v.n[2]; z++)
        for (size_t y = 0; y < k.v.n[1]; y++)
            for (size_t x = 0; x < k.v.n[0]; x++) {
                size_t i = volume_index(k.v.n, x, y, z);
                uint32_t voxel = volume_scene_voxel(&k.scene, x, y, z);
                assert_int_equal(voxel >> 24, k.v.density[i]);
                if (k.v.density[i] == 0) continue;
                float a[3], b[3];
                direction_volume_get(&k.v, i, a);
                volume_voxel_direction(voxel, b);
                double cross[3] = {(double)(a[1] * b[2] - a[2] * b[1]), (double)(a[2] * b[0] - a[0] * b[2]),
                                   (double)(a[0] * b[1] - a[1] * b[0])};
                worst = fmin(worst, 0.035 * RAD_PER_DEG -
                                        sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]));
            }
    assert_true(worst > 0);
    cloth_release(&k);
}

/* One voxel in a large empty volume whose edges are no multiples of a brick. The distances that rays may skip are
 * compared with a search over all bricks. */
static void empty_distances(void **state)
{
    (void)state;
    const size_t n[3] = {75, 38, 61};
    const float along[3] = {1, 0, 0};
    struct direction_volume v;
    struct volume_scene s;
    hand_volume_uniform(&v, n, 1e-6, 0, along);
    const size_t at[2][3] = {{70, 3, 9}, {2, 30, 58}};
    for (int i = 0; i < 2; i++) v.density[volume_index(n, at[i][0], at[i][1], at[i][2])] = 200;
    assert_int_equal(volume_scene_init(&s, &v, &(struct volume_scene_option){.black_sheet = true}, NULL), STATUS_OK);
    for (int z = 0; z < s.n_brick[2]; z++)
        for (int y = 0; y < s.n_brick[1]; y++)
            for (int x = 0; x < s.n_brick[0]; x++) {
                int nearest = VOLUME_EMPTY_MAX;
                for (int i = 0; i < 2; i++) {
                    int d[3] = {abs(x - (int)at[i][0] / 4), abs(y - (int)at[i][1] / 4), abs(z - (int)at[i][2] / 4)};
                    int most = d[0] > d[1] ? d[0] : d[1];
                    most = d[2] > most ? d[2] : most;
                    nearest = most < nearest ? most : nearest;
                }
                int got = s.brick[(z * s.n_brick[1] + y) * s.n_brick[0] + x];
                if (nearest == 0)
                    assert_true(got >= 0);
                else
                    assert_int_equal(got, -nearest);
            }
    assert_int_equal(s.n_stored, 2);
    volume_scene_release(&s);
    direction_volume_release(&v);
}

/* Paths that are traced together are equal to paths that are traced one by one, and recording does not change them. */
static void interleaved_paths_are_the_same(void **state)
{
    (void)state;
    enum { N = 500 };
    static struct volume_ray ray[N];
    static struct rng rng[N];
    static struct volume_result one[N], many[N];
    static struct volume_event event[100];
    struct cloth k;
    struct phase_state *ps;
    struct volume_setting setting;
    cloth_init(&k, 1);
    const struct phase_model *m = phase_find("phase_two_lobe.v1");
    double param[SCATTERING_MAX_PARAM];
    for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
    assert_int_equal(m->prepare(param, &ps, NULL), STATUS_OK);
    const struct volume_parameters parameters = {m, ps, 4e4};
    volume_setting_init(&setting, &k.scene, &parameters, &k.c[0], true);
    for (uint32_t i = 0; i < N; i++) {
        rng_start(&rng[i], &(struct rng_key){62, 0, 0, 0}, 0, i);
        const double from[3] = {rng_double(&rng[i]), rng_double(&rng[i]), 1}, down[3] = {0.6, 0, -0.8};
        assert_true(volume_ray_enter(&k.scene, from, down, &ray[i]));
    }
    memset(one, 0, sizeof one);
    memset(many, 0, sizeof many);
    volume_trace_many(&setting, N, ray, rng, many);
    for (uint32_t i = 0; i < N; i++) {
        struct volume_record record = {0, sizeof event / sizeof event[0], event};
        volume_trace(&setting, &ray[i], &rng[i], &one[i], i % 2 ? &record : NULL);
        if (i % 2) assert_true(record.n_event > 0 || one[i].n_bounce == 0);
    }
    assert_memory_equal(one, many, sizeof one);
    m->release(ps);
    cloth_release(&k);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(nonsense_is_refused),
                                       cmocka_unit_test(same_bits_for_any_thread_count),
                                       cmocka_unit_test(stored_voxels_are_the_volume),
                                       cmocka_unit_test(empty_distances),
                                       cmocka_unit_test(interleaved_paths_are_the_same),
                                       cmocka_unit_test(traced_again)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
