/* Recorded volume paths, evaluated again for other parameters while the paths stay the same. The recorded value must
 * be the traced one, and its differences must be the traced derivatives to 1e-3, for every parameter and the density
 * multiplier. Also tests white cloth with and without roulette. */
#include "base/angle.h"
#include "renderer/transport/volume/volume_tracer.h"
#include "tests/support/scan/hand_volume.h"
#include "tests/support/statistics_test.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_EVENT = 4000, N_PATH = 3000, N_VALUE = 3 + VOLUME_N_DERIVATIVE };

static struct direction_volume volume;
static struct volume_scene scene;
static struct environment *sky;

static int set_up(void **state)
{
    (void)state;
    const size_t n[3] = {30, 26, 11};
    struct image im;
    hand_volume_weave(&volume, n, 10e-6, 0.5);
    if (volume_scene_init(&scene, &volume, &(struct volume_scene_option){false}, NULL) != STATUS_OK) return 1;
    if (image_init(&im, 8, 4, 3, NULL) != STATUS_OK) return 1;
    for (size_t i = 0; i < 96; i++) im.pixel[i] = 0.2f + 0.1f * (float)(i % 7);
    if (environment_new(&im, 1, &sky, NULL) != STATUS_OK) return 1;
    image_release(&im);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    environment_free(sky);
    volume_scene_release(&scene);
    direction_volume_release(&volume);
    return 0;
}

/* The sky and a lamp, which is at a grazing angle in every other configuration. */
static struct configuration configuration(int i)
{
    return (struct configuration){.light_theta_rad = (i % 2 ? 78 : 25) * RAD_PER_DEG,
                                  .light_phi_rad = 0.4,
                                  .light_distance_m = 0.61,
                                  .lamp_side_m = 0.2,
                                  .camera_distance_m = 1,
                                  .crop_m = 0.01,
                                  .environment = i % 3 == 2 ? NULL : sky};
}

static void start_ray(const struct volume_scene *s, uint32_t i, struct rng *rng, struct volume_ray *ray)
{
    const double direction[3] = {0.6, 0, -0.8};
    rng_start(rng, &(struct rng_key){71, 0, 0, 0}, 0, i);
    const double origin[3] = {rng_double(rng), rng_double(rng), 1};
    assert_true(volume_ray_enter(s, origin, direction, ray));
}

/* The phase function and the density multiplier of the evaluation; setting: those with which the record was made. */
struct now {
    const struct phase_state *state;
    double d_per_m;
};

static double ratio(const struct volume_setting *s, const struct phase_extinction *e, double d_per_m,
                    const struct volume_event *v)
{
    float unused;
    return d_per_m / (double)s->multiplier_per_m * (double)v->density *
           (double)phase_extinction_at(e, v->sine, &unused) / (double)s->majorant_density;
}

static void replay(const struct volume_setting *s, const struct now *now, const struct volume_record *r,
                   double value[3])
{
    const struct phase_extinction *e = s->model->extinction(now->state);
    double t[3] = {1, 1, 1}, light[3] = {0};
    for (size_t i = 0; i < r->n_event; i++) {
        const struct volume_event *v = &r->event[i];
        double then = ratio(s, s->extinction, (double)s->multiplier_per_m, v), r_now = ratio(s, e, now->d_per_m, v);
        float f[3] = {0};
        if (v->kind == VOLUME_SCATTER || v->kind == VOLUME_CONNECT)
            s->model->eval_pdf(now->state, v->wi, v->wo, NULL, f, NULL);
        for (int c = 0; c < 3; c++) switch (v->kind) {
            case VOLUME_NULL:
                t[c] *= (1 - r_now) / (1 - then);
                break;
            case VOLUME_REAL:
                t[c] *= r_now / then;
                break;
            case VOLUME_SCATTER:
                t[c] *= (double)f[c] * (double)v->weight[0];
                break;
            case VOLUME_CONNECT:
                light[c] = t[c] * (double)f[c] * (double)v->weight[c];
                break;
            case VOLUME_PASSED:
                light[c] *= 1 - r_now;
                break;
            case VOLUME_ARRIVE:
                value[c] += light[c] * (double)v->weight[0];
                break;
            case VOLUME_BEYOND:
                value[c] += t[c] * (double)v->weight[c];
                break;
            }
    }
}

/* Fills sum[j][c] with the recorded paths' values for parameters moved by (j - 2) h, jac with the traced derivative. */
static void differences_of(const struct phase_model *m, const struct configuration *c, const double *param,
                           double d_per_m, size_t p, double h, double sum[5][3], double jac[3], double radiance[3])
{
    static struct volume_event event[N_EVENT];
    struct phase_state *base = NULL, *moved[5] = {NULL};
    struct volume_setting s;
    struct now now[5];
    assert_int_equal(m->prepare(param, &base, NULL), STATUS_OK);
    const struct volume_parameters parameters = {m, base, d_per_m};
    volume_setting_init(&s, &scene, &parameters, c, true);
    for (int j = 0; j < 5; j++) {
        double x[SCATTERING_MAX_PARAM];
        memcpy(x, param, m->n_param * sizeof *x);
        if (p < m->n_param) x[p] += (j - 2) * h;
        assert_int_equal(m->prepare(x, &moved[j], NULL), STATUS_OK);
        now[j] = (struct now){moved[j], d_per_m + (p == m->n_param ? (j - 2) * h : 0)};
    }
    memset(sum, 0, 5 * sizeof *sum);
    memset(jac, 0, 3 * sizeof *jac);
    memset(radiance, 0, 3 * sizeof *radiance);
    for (uint32_t i = 0; i < N_PATH; i++) {
        struct volume_record record = {0, N_EVENT, event};
        struct volume_result path;
        struct volume_ray ray;
        struct rng rng;
        start_ray(&scene, i, &rng, &ray);
        volume_trace(&s, &ray, &rng, &path, &record);
        assert_true(record.n_event <= N_EVENT);
        for (int j = 0; j < 5; j++) replay(&s, &now[j], &record, sum[j]);
        for (size_t k = 0; k < 3; k++) {
            radiance[k] += (double)path.radiance[k];
            jac[k] += (double)path.jac[k * (m->n_param + 1) + p];
        }
    }
    for (int j = 0; j < 5; j++) m->release(moved[j]);
    m->release(base);
}

/* Central differences of fourth order. The error is relative to the derivative, or to value / parameter where the
 * derivative is much smaller, because f has single precision. */
static void derivatives_of_recorded_paths(void **state)
{
    (void)state;
    double worst = 0;
    for (int k = 0; phase_registry()[k] != NULL; k++) {
        const struct phase_model *m = phase_registry()[k];
        double param[SCATTERING_MAX_PARAM], d_per_m = 3e4;
        for (size_t p = 0; p < m->n_param; p++) {
            const struct param_info *info = &m->param[p];
            param[p] = info->channel < 0 ? info->start * 1.5 : info->start - 0.04 * info->channel;
        }
        for (size_t p = 0; p <= m->n_param; p++) {
            const struct configuration c = configuration((int)p);
            double x = p < m->n_param ? param[p] : d_per_m, h = 2e-3 * x, sum[5][3], jac[3], radiance[3];
            differences_of(m, &c, param, d_per_m, p, h, sum, jac, radiance);
            for (int c3 = 0; c3 < 3; c3++) {
                double fd = (sum[0][c3] - 8 * sum[1][c3] + 8 * sum[3][c3] - sum[4][c3]) / (12 * h);
                double off = fabs(fd - jac[c3]) / fmax(fabs(jac[c3]), 0.2 * radiance[c3] / x);
                assert_true(fabs(sum[2][c3] / radiance[c3] - 1) < 1e-4);
                worst = fmax(worst, off);
                if (!(off < 1e-3))
                    fail_msg("%s, %s, channel %d: derivative %g, difference %g", m->id,
                             p < m->n_param ? m->param[p].name : "d", c3, jac[c3], fd);
            }
        }
    }
    print_message("largest relative difference %.1e\n", worst);
}

/* With an albedo of 0.999, radiance and derivatives must be the same with roulette and without it. */
static void white_without_roulette(void **state)
{
    (void)state;
    const struct phase_model *m = phase_find("phase_two_lobe.v1");
    const struct configuration c = configuration(2);
    struct phase_state *ps = NULL;
    static struct sample_mean value[2][N_VALUE];
    double param[SCATTERING_MAX_PARAM];
    size_t n_value = 3 + 3 * (m->n_param + 1), n_beyond = 0;
    for (size_t p = 0; p < m->n_param; p++) param[p] = p < 9 ? m->param[p].start : 0.999;
    assert_int_equal(m->prepare(param, &ps, NULL), STATUS_OK);
    for (int brute = 0; brute < 2; brute++) {
        struct volume_setting s;
        const struct volume_parameters parameters = {m, ps, 1e5};
        volume_setting_init(&s, &scene, &parameters, &c, true);
        if (brute) s.roulette_below = s.shadow_below = 0;
        for (uint32_t i = 0; i < 400000; i++) {
            struct volume_result path;
            struct volume_ray ray;
            struct rng rng;
            start_ray(&scene, i + (brute ? 1000000 : 0), &rng, &ray);
            volume_trace(&s, &ray, &rng, &path, NULL);
            for (size_t k = 0; k < n_value; k++)
                sample_mean_add(&value[brute][k], (double)(k < 3 ? path.radiance[k] : path.jac[k - 3]));
        }
    }
    for (size_t k = 0; k < n_value; k++) {
        double off = fabs(value[0][k].mean - value[1][k].mean);
        double se = hypot(sample_mean_se(&value[0][k]), sample_mean_se(&value[1][k]));
        if (k < 3 && !(off <= 3.5 * se && se < 0.02 * value[1][k].mean))
            fail_msg("channel %zu: %g and %g without roulette, standard error %g", k, value[0][k].mean,
                     value[1][k].mean, se);
        n_beyond += off > 2.5 * se;
        if (off > 4.5 * se)
            fail_msg("value %zu: %g and %g, standard error %g", k, value[0][k].mean, value[1][k].mean, se);
    }
    assert_true(n_beyond <= 4); /* of 42, where the three channels of each are correlated */
    m->release(ps);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(derivatives_of_recorded_paths),
                                       cmocka_unit_test(white_without_roulette)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
