/* Scattering models: golden values, the registry, agreement with a double-precision reference, scores against central
 * differences. */
#include "renderer/scattering/models/two_lobe/gauss_polynomial.h"
#include "renderer/scattering/scattering.h"
#include "renderer/scattering/von_mises.h"
#include "tests/support/agreement.h"
#include "tests/support/model/compared_range.h"
#include "tests/support/model/model_stream.h"
#include "tests/support/tracer/reference_two_lobe.h"

#include "base/angle.h"
#include "base/rng.h"

#include <malloc.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/model/dear_tables.h"
#include "tests/support/model/prepared_model.h"

static void random_direction(struct rng *r, float w[3])
{
    float z = 2 * rng_float(r) - 1, phi = (float)(2 * M_PI) * rng_float(r), c = sqrtf(fmaxf(0, 1 - z * z));
    w[0] = z;
    w[1] = c * cosf(phi);
    w[2] = c * sinf(phi);
}

/* Point k of the compared ranges: the lower bounds, the upper bounds, the start, combinations, then random points. */
static void box_point(const struct scattering_model *m, unsigned k, struct rng *r, double *param)
{
    for (size_t p = 0; p < m->n_param; p++) {
        const struct param_info *i = &m->param[p];
        double t = k == 0 ? 0 : k == 1 ? 1 : k < 10 ? (double)(k >> (p % 4) & 1) : (double)rng_float(r);
        double lower = compared_range_lower(m->id, i);
        param[p] = lower + t * (i->upper - lower);
        if (k == 2) param[p] = i->start;
    }
}

static void golden_values(void **state)
{
    (void)state;
    double d_s;
    assert_true(fabs(lobe_normaliser(0, 5 * RAD_PER_DEG, NULL, &d_s) - 0.992544020) < 5e-10);
    double x = -12 * RAD_PER_DEG, m = -15 * RAD_PER_DEG, s = 8 * RAD_PER_DEG;
    double g = exp(-(x - m) * (x - m) / (2 * s * s)) / (sqrt(2 * M_PI) * s);
    assert_true(fabs(g / lobe_normaliser(m, s, NULL, NULL) - 2.905650400) < 5e-9);
    assert_true(fabs(reference_gbar(x, m, s) - 2.905650400) < 5e-7);
}

static void normaliser_against_quadrature(void **state)
{
    (void)state;
    for (double s = 1; s <= 45; s *= 1.5)
        for (double m = -90; m <= 90; m += 7.5) {
            double d_m, d_s, h = 1e-5, sr = s * RAD_PER_DEG, mr = m * RAD_PER_DEG;
            double g = lobe_normaliser(mr, sr, &d_m, &d_s);
            assert_true(fabs(g / reference_normaliser(mr, sr) - 1) < 1e-6);
            double fd_s = (lobe_normaliser(mr, sr + h, NULL, NULL) - lobe_normaliser(mr, sr - h, NULL, NULL)) / (2 * h);
            double fd_m = (lobe_normaliser(mr + h, sr, NULL, NULL) - lobe_normaliser(mr - h, sr, NULL, NULL)) / (2 * h);
            assert_true(fabs(fd_s - d_s) < 1e-5 + 1e-5 * fabs(d_s));
            assert_true(fabs(fd_m - d_m) < 1e-5 + 1e-5 * fabs(d_m));
        }
}

static void bessel_values(void **state)
{
    (void)state;
    assert_true(fabs(bessel_i0_scaled(0) - 1) < 1e-15);
    assert_true(fabs(bessel_i0_scaled(1) * M_E - 1.2660658777520083356) < 1e-14);
    for (double x = 0.5; x < 4000; x *= 1.3) {
        double i0 = 0, i1 = 0;
        enum { N = 2048 };
        for (int i = 0; i < N; i++) {
            double c = cos(2 * M_PI * i / N), e = exp(x * (c - 1)) / N;
            i0 += e;
            i1 += e * c;
        }
        assert_true(fabs(bessel_i0_scaled(x) / i0 - 1) < 1e-12);
        assert_true(fabs(bessel_i1_over_i0_deficit(x) - (1 - i1 / i0)) < 1e-12);
    }
}

static void erf_inverse_is_inverse(void **state)
{
    (void)state;
    for (float x = -0.99999f; x < 1; x += 0.00137f) assert_true(fabs(erf((double)erf_inverse(x)) - (double)x) < 2e-6);
    assert_true(isfinite(erf_inverse(1)) && isfinite(erf_inverse(-1)));
}

static void registry_is_sound(void **state)
{
    (void)state;
    assert_null(scattering_find("no_such_model.v1"));
    for (size_t k = 0; scattering_registry()[k] != NULL; k++) {
        const struct scattering_model *m = scattering_registry()[k];
        assert_ptr_equal(scattering_find(m->id), m);
        assert_true(m->n_param > 0 && m->n_param <= SCATTERING_MAX_PARAM);
        for (size_t p = 0; p < m->n_param; p++) {
            const struct param_info *i = &m->param[p];
            assert_int_equal(scattering_param_index(m, i->name), p);
            assert_true(i->lower <= i->start && i->start <= i->upper && i->lower < i->upper && i->channel >= -1 &&
                        i->channel <= 2);
            assert_true(fabs(param_from_file_unit(i, param_to_file_unit(i, i->start)) - i->start) < 1e-15);
            double param[SCATTERING_MAX_PARAM];
            const double bad[3] = {NAN, i->upper * 1.01, i->lower * 0.99};
            for (int b = 0; b < 3; b++) {
                struct scattering_state *s = NULL;
                struct error err = {0};
                for (size_t o = 0; o < m->n_param; o++) param[o] = m->param[o].start;
                param[p] = bad[b];
                assert_int_equal(m->prepare(param, &s, &err), STATUS_INVALID);
                assert_string_equal(err.field, i->name);
            }
        }
    }
    assert_int_equal(scattering_param_index(scattering_registry()[0], "nonsense"), -1);
}

static void agrees_with_reference(void **state)
{
    (void)state;
    const struct scattering_model *m = scattering_find("two_lobe.v1");
    struct rng r;
    rng_start(&r, &(struct rng_key){1, 0, 0, 0}, 0, 0);
    for (unsigned k = 0; k < 24; k++) {
        double param[9];
        box_point(m, k, &r, param);
        struct scattering_state *s = prepare(m, param);
        for (int i = 0; i < 100; i++) {
            float wo[3], wi[3], u[3] = {rng_float(&r), rng_float(&r), rng_float(&r)}, rgb[3];
            random_direction(&r, wo);
            m->sample(s, wo, NULL, u, wi);
            m->eval(s, wi, wo, rgb, NULL);
            double di[3] = {(double)wi[0], (double)wi[1], (double)wi[2]},
                   dout[3] = {(double)wo[0], (double)wo[1], (double)wo[2]};
            for (int c = 0; c < 3; c++) {
                double want = reference_s(param, di, dout, c);
                /* Angles have a rounding error of 1e-7, which a lobe of 1 degree amplifies to 6 * 1e-7 / 0.0175. The
                 * table of G has an error of 2e-3 at the poles. */
                double tolerance = fabs(asin(di[0])) > 80 * RAD_PER_DEG ? 3e-3 : 3e-4;
                if (fabs((double)rgb[c] - want) > tolerance * want + 1e-12)
                    fail_msg("set %u: S = %.8g, reference %.8g", k, (double)rgb[c], want);
            }
        }
        m->release(s);
    }
}

/* Estimates the truncation h^2 f''' / 3 of a three-point difference, with f''' about f''^2 / f'. It matters where a
 * narrow lobe fades so fast that its share of S changes within the step. */
static double truncation(const double ln_s[3], double h, double slope)
{
    double bend = fabs(ln_s[0] - 2 * ln_s[1] + ln_s[2]) / h;
    return fmin(bend, bend * bend / fmax(3 * fabs(slope), 1e-30));
}

/* Step of a difference over the room that a parameter has. The tables of elliptical models are sums over rays, some
 * of which begin to be reflected totally within a larger step; in those of elliptical_oriented.v1 fewer rays share an
 * azimuth. Azimuths of fur_near.v1 and hair_mixture.v1 follow the index of refraction, and their narrowest lobes are of
 * a degree. Tables of microfacet_ellipse.v1 are linear between nodes of a grid of its parameters, and a larger step
 * reaches beyond the next nodes. Tilts of up to ten degrees move lobes of one degree. */
static double difference_step(const struct scattering_model *m, const struct param_info *info)
{
    if (strcmp(m->id, "elliptical.v1") == 0 && info->kind == PARAM_SHAPE) return 3e-4;
    if (strcmp(m->id, "elliptical_oriented.v1") == 0 && info->kind == PARAM_SHAPE) return 1e-4;
    if (strcmp(info->symbol, "alpha") == 0) return 2e-3;
    bool small = strcmp(m->id, "fur_near.v1") == 0 || strcmp(m->id, "microfacet_ellipse.v1") == 0 ||
                 strcmp(m->id, "hair_mixture.v1") == 0;
    return small && info->kind == PARAM_SHAPE ? 1e-3 : 5e-3;
}

/* ln S by each parameter: three-point differences, one-sided where a bound is near. */
static void check_scores(const struct scattering_model *m, const double *param, size_t turn, struct rng *r)
{
    enum { N_DIRECTION = 12 };
    float wi[N_DIRECTION][3], wo[N_DIRECTION][3], score[N_DIRECTION][3 * SCATTERING_MAX_PARAM], rgb[3][N_DIRECTION][3],
        unmoved[N_DIRECTION][3];
    struct scattering_state *s = prepare(m, param);
    for (int i = 0; i < N_DIRECTION; i++) {
        float u[3] = {rng_float(r), rng_float(r), rng_float(r)};
        random_direction(r, wo[i]);
        m->sample(s, wo[i], NULL, u, wi[i]);
        m->eval(s, wi[i], wo[i], unmoved[i], score[i]);
    }
    m->release(s);
    for (size_t p = 0; p < m->n_param; p++) {
        const struct param_info *info = &m->param[p];
        if (is_other_channel(m->id, info, turn)) continue;
        double room =
            info->channel >= 0 ? fmin(param[p], fmax(1 - param[p], 1e-3)) : param[p]; /* ln S has poles at 0 and 1 */
        double h = difference_step(m, info) * fmin(room, 0.2), at[3] = {param[p] - h, param[p], param[p] + h},
               weight[3] = {-0.5, 0, 0.5};
        double coordinate_shift = param[p] - h < info->lower ? 1 : param[p] + h > info->upper ? -1 : 0;
        if (coordinate_shift != 0) {
            const double one_sided[2][3] = {{-1.5, 2, -0.5}, {0.5, -2, 1.5}};
            for (int j = 0; j < 3; j++) at[j] += coordinate_shift * h;
            memcpy(weight, one_sided[coordinate_shift > 0 ? 0 : 1], sizeof weight);
        }
        /* Of ln S. In a lobe as narrow as the roughness r it is that of angles over its width, as above. */
        const double rounding = strcmp(info->symbol, "r") == 0 ? fmax(1e-6, 6e-7 / param[p]) : 1e-6;
        const int here = 1 - (int)coordinate_shift; /* of the three points, where the parameter is not moved */
        memcpy(rgb[here], unmoved, sizeof unmoved);
        for (int j = 0; j < 3; j++) {
            double moved[SCATTERING_MAX_PARAM];
            if (j == here) continue;
            memcpy(moved, param, m->n_param * sizeof *param);
            moved[p] = at[j];
            s = prepare(m, moved);
            for (int i = 0; i < N_DIRECTION; i++) m->eval(s, wi[i], wo[i], rgb[j][i], NULL);
            m->release(s);
        }
        for (int i = 0; i < N_DIRECTION; i++)
            for (int c = 0; c < 3; c++) {
                double ln_s[3], fd = 0, got = (double)score[i][(size_t)c * m->n_param + p];
                if (rgb[1][i][c] < 1e-25f) continue; /* no weight at all */
                for (int j = 0; j < 3; j++) {
                    ln_s[j] = log((double)rgb[j][i][c]);
                    fd += weight[j] * ln_s[j] / h;
                }
                double tolerance = rounding / h + 2e-3 * fabs(got) + truncation(ln_s, h, got);
                if (!(fabs(fd - got) <= tolerance))
                    fail_msg("%s, %s, channel %d: score %g, difference %g", m->id, info->name, c, got, fd);
                if (info->channel >= 0 && info->channel != c) assert_true(got == 0);
            }
    }
}

static void scores_against_differences(void **state)
{
    (void)state;
    for (size_t k = 0; scattering_registry()[k] != NULL; k++) {
        const struct scattering_model *m = scattering_registry()[k];
        struct rng r;
        model_stream_start(&r, 2, m->id);
        /* Tables of elliptical_oriented.v1 take 0.4 s each time: one set of parameters stands for all but at night. */
        const bool slow = strcmp(m->id, "elliptical_oriented.v1") == 0 && !is_long_variant();
        const unsigned step = k == 0 ? 1 : slow ? 16 : has_dear_tables(m->id) ? 8 : 4;
        for (unsigned b = slow ? 2 : 0; b < 16; b += step) {
            double param[SCATTERING_MAX_PARAM];
            box_point(m, b, &r, param);
            check_scores(m, param, b / step, &r);
        }
    }
}

static void check_finite(const struct scattering_model *m, const struct scattering_state *s, const float wo[3],
                         const float wi[3])
{
    float rgb[3], score[3 * SCATTERING_MAX_PARAM], pdf = m->eval_pdf(s, wi, wo, NULL, rgb, score);
    assert_true(isfinite(pdf) && pdf >= 0);
    assert_true(pdf == m->pdf(s, wi, wo, NULL));
    for (int c = 0; c < 3; c++) assert_true(isfinite(rgb[c]) && rgb[c] >= 0);
    for (size_t p = 0; p < 3 * m->n_param; p++) assert_true(isfinite(score[p]));
}

static void nothing_is_nan(void **state)
{
    (void)state;
    static const float special[][3] = {{1, 0, 0},           {-1, 0, 0},
                                       {1, 1e-7f, 0},       {-1, 0, 1e-7f},
                                       {1, 1e-20f, 1e-20f}, {0.9999999f, 3e-4f, 0},
                                       {0, 1, 0},           {0, 0, -1},
                                       {0, -1, 0},          {0, 0.70710678f, 0.70710678f}};
    const float corner[3] = {0, 0.5f, 0.99999994f};
    for (size_t k = 0; scattering_registry()[k] != NULL; k++) {
        const struct scattering_model *m = scattering_registry()[k];
        struct rng r;
        model_stream_start(&r, 3, m->id);
        const unsigned n_point = has_dear_tables(m->id) ? 3 : 6;
        for (unsigned b = 0; b < n_point; b++) {
            double param[SCATTERING_MAX_PARAM];
            box_point(m, b, &r, param);
            struct scattering_state *s = prepare(m, param);
            for (size_t i = 0; i < sizeof special / sizeof special[0]; i++) {
                for (size_t j = 0; j < sizeof special / sizeof special[0]; j++)
                    check_finite(m, s, special[i], special[j]);
                for (int u = 0; u < 27; u++) {
                    float uu[3] = {corner[u % 3], corner[u / 3 % 3], corner[u / 9]}, wi[3];
                    m->sample(s, special[i], NULL, uu, wi);
                    float pdf = m->pdf(s, wi, special[i], NULL);
                    assert_true(isfinite(pdf) && pdf > 0);
                    assert_true(fabsf(wi[0] * wi[0] + wi[1] * wi[1] + wi[2] * wi[2] - 1) < 1e-5f);
                    check_finite(m, s, special[i], wi);
                }
            }
            m->release(s);
        }
    }
}

static void reciprocal_models_are(void **state)
{
    (void)state;
    static const char *const id[] = {"two_lobe_balanced.v1", "isotropic.v1",     "kajiya_kay.v1",
                                     "marschner.v1",         "textile.v3",       "dielectric.v1",
                                     "elliptical.v1",        "fur.v1",           "dielectric_diffraction.v1",
                                     "wave_silk.v2",         "wave_trilobal.v2", "wave_cotton.v2",
                                     "microfacet_ellipse.v1"};
    for (size_t k = 0; k < sizeof id / sizeof id[0]; k++) {
        const struct scattering_model *m = scattering_find(id[k]);
        struct rng r;
        model_stream_start(&r, 4, m->id);
        double param[SCATTERING_MAX_PARAM];
        const unsigned n_point = has_dear_tables(m->id) ? 4 : 12;
        for (unsigned b = 0; b < n_point; b++) {
            box_point(m, b, &r, param);
            struct scattering_state *s = prepare(m, param);
            for (int i = 0; i < 200; i++) {
                float wo[3], wi[3], u[3] = {rng_float(&r), rng_float(&r), rng_float(&r)}, there[3], back[3];
                random_direction(&r, wo);
                m->sample(s, wo, NULL, u, wi);
                m->eval(s, wi, wo, there, NULL);
                m->eval(s, wo, wi, back, NULL);
                for (int c = 0; c < 3; c++) assert_true(fabsf(there[c] - back[c]) <= 1e-5f * there[c]);
            }
            m->release(s);
        }
    }
}

/* two_lobe_diffuse.v1 in closed form: S is linear in w, w = 0 is two_lobe.v1, and at w = 1 only R and a uniform term
 * are left. Float arithmetic keeps each S to a few parts in 10^6 of its largest term. */
static void diffuse_share_in_closed_form(void **unused)
{
    (void)unused;
    const struct scattering_model *lobes = scattering_find("two_lobe.v1"),
                                  *mixed = scattering_find("two_lobe_diffuse.v1");
    double param[SCATTERING_MAX_PARAM];
    struct rng r;
    rng_start(&r, &(struct rng_key){42, 0, 0, 0}, 0, 0);
    assert_int_equal(mixed->n_param, lobes->n_param + 1);
    for (unsigned k = 0; k < 40; k++) {
        float wi[3], wo[3], two_lobe[3], rgb[3], score[3 * SCATTERING_MAX_PARAM];
        box_point(mixed, k, &r, param);
        random_direction(&r, wi);
        random_direction(&r, wo);
        double w = param[lobes->n_param], cos_i = sqrt((double)(wi[1] * wi[1] + wi[2] * wi[2]));
        struct scattering_state *a = prepare(lobes, param), *b = prepare(mixed, param);
        lobes->eval(a, wi, wo, two_lobe, score);
        mixed->eval(b, wi, wo, rgb, NULL);
        for (size_t c = 0; c < 3; c++) {
            double c_tt = param[3 + c], not_fresnel = (1 - param[c]) * (1 - pow(1 - cos_i, 5));
            double tt = (double)two_lobe[c] * (double)score[c * lobes->n_param + 3 + c] * c_tt; /* C_TT dS / dC_TT */
            double uniform = c_tt * not_fresnel / (M_PI * M_PI);
            double expected = (double)two_lobe[c] + w * (uniform - tt);
            assert_true(fabs((double)rgb[c] - expected) < 1e-5 * ((double)two_lobe[c] + uniform));
        }
        lobes->release(a);
        mixed->release(b);
    }
}

/* With new memory full of NaN (every byte 0xff) a model is what it is otherwise. */
static void memory_is_not_read_before_it_is_set(void **state)
{
    enum { NO_BYTES = 0, BYTES_FF = 0x100 }; /* glibc fills with the complement of the low byte */
    const float wi[3] = {0.3f, 0.9f, -0.3f}, wo[3] = {-0.4f, 0.2f, 0.9f};
    (void)state;
    for (size_t i = 0; scattering_registry()[i] != NULL; i++) {
        const struct scattering_model *m = scattering_registry()[i];
        double param[SCATTERING_MAX_PARAM];
        float rgb[2][3], score[2][3 * SCATTERING_MAX_PARAM] = {{0}};
        for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
        for (int k = 0; k < 2; k++) {
            mallopt(M_PERTURB, k == 0 ? NO_BYTES : BYTES_FF);
            struct scattering_state *s = prepare(m, param);
            mallopt(M_PERTURB, NO_BYTES);
            m->eval(s, wi, wo, rgb[k], score[k]);
            m->release(s);
        }
        if (!(rgb[1][0] > 0) || memcmp(rgb[0], rgb[1], sizeof rgb[0]) != 0 ||
            memcmp(score[0], score[1], sizeof score[0]) != 0)
            fail_msg("%s: S = %g with clean memory, %g without", m->id, (double)rgb[0][0], (double)rgb[1][0]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(golden_values),
        cmocka_unit_test(diffuse_share_in_closed_form),
        cmocka_unit_test(normaliser_against_quadrature),
        cmocka_unit_test(bessel_values),
        cmocka_unit_test(erf_inverse_is_inverse),
        cmocka_unit_test(registry_is_sound),
        cmocka_unit_test(agrees_with_reference),
        cmocka_unit_test(scores_against_differences),
        cmocka_unit_test(nothing_is_nan),
        cmocka_unit_test(memory_is_not_read_before_it_is_set),
        cmocka_unit_test(reciprocal_models_are),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
