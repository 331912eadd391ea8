#include "tests/support/tracer/fake_numbers.h"
#include "base/catalogue/method_catalogue.h"
#include "base/rng.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const struct param_info number_info[FAKE_N_NUMBER] = {
    {"flatness", "flatness", PARAM_SHAPE, PARAM_UNIT_NONE, -1, 1.0, 4.0, 2.0, PARAM_LOG, ""},
    {"packing", "packing", PARAM_SHAPE, PARAM_UNIT_NONE, -1, 0.3, 0.8, 0.5, PARAM_LINEAR, ""},
    {"hairs", "hairs", PARAM_SHAPE, PARAM_UNIT_NONE, -1, 0.0, 10.0, 4.0, PARAM_LINEAR, ""},
};

static double colour_power(const double *number) { return exp(1.2 * (number[1] - 0.55)); }

/* What the numbers multiply the radiance of a configuration with. */
static double factor(const struct configuration *c, const double *number)
{
    double half = c->light_theta_rad * cos(M_PI - c->camera_phi_rad) - c->camera_theta_rad;
    double mirrored = exp(-2.0 * half * half) * sin(0.5 * (c->light_theta_rad + c->camera_theta_rad));
    double turned = 0.1 * cos(c->cloth_rotation_rad);
    return exp((1.2 * mirrored - 0.5 + turned) * log(0.5 * number[0]) +
               (0.6 * sin(c->camera_theta_rad) - 2.0 * turned) * (number[1] - 0.55));
}

static void effective(const double *param, const double *number, double out[FAKE_N_PARAM])
{
    memcpy(out, param, FAKE_N_PARAM * sizeof *out);
    for (size_t p = 3; p < 6; p++) out[p] = pow(param[p], colour_power(number));
}

static status estimate(void *context, const double *number, const struct estimator_call *call,
                       const struct progress *progress, struct estimate *out, double *wall_s, struct error *err)
{
    struct fake_numbers *x = context;
    double param[FAKE_N_PARAM];
    struct estimator_call inner = *call;
    effective(call->param, number, param);
    inner.param = param;
    status s = x->plain.run(x->plain.context, &inner, progress, out, wall_s, err);
    for (size_t i = 0; i < x->plain.n_configuration && s == STATUS_OK; i++) {
        double f = factor(&x->cloth.configuration[i], number);
        for (size_t c = 0; c < 3; c++) {
            out[i].mean[c] *= f;
            out[i].var[c] *= f * f;
            for (size_t p = 0; p < FAKE_N_PARAM; p++) {
                double chain = p >= 3 && p < 6 ? colour_power(number) * param[p] / call->param[p] : 1.0;
                out[i].jac[c * FAKE_N_PARAM + p] *= f * chain;
                out[i].jac_var[c * FAKE_N_PARAM + p] *= f * f * chain * chain;
            }
        }
    }
    return s;
}

void fake_numbers_radiance(const struct fake_numbers *x, size_t i, const double *unknown, double rgb[3])
{
    double param[FAKE_N_PARAM];
    effective(unknown, unknown + FAKE_N_PARAM, param);
    fake_radiance(&x->cloth.configuration[i], param, rgb, NULL);
    for (int c = 0; c < 3; c++) rgb[c] *= factor(&x->cloth.configuration[i], unknown + FAKE_N_PARAM);
}

static void observe(struct fake_numbers *x, uint64_t seed, double rel_noise, double misfit)
{
    struct rng_key key = {.seed = seed ^ 0x6e756du};
    struct rng r;
    rng_start(&r, &key, 0, 0);
    for (size_t i = 0; i < x->observation.n; i++) {
        struct observation *o = &x->observation.item[i];
        fake_numbers_radiance(x, i, x->truth, o->mean_rgb);
        for (int c = 0; c < 3; c++) {
            double z[2];
            rng_normal_pair(&r, z);
            o->se_rgb[c] = rel_noise * o->mean_rgb[c];
            o->mean_rgb[c] *= (1.0 + rel_noise * z[0]) * (1.0 + misfit * (i % 2 == 0 ? 1.0 : -1.0) * (i % 3 == 0));
        }
    }
}

static status on_step(void *context, const struct fit_step *step, struct error *err)
{
    struct fake_numbers *x = context;
    (void)err;
    assert_int_equal(step->step, x->n_reported++);
    assert_int_equal(step->n_param, FAKE_N_UNKNOWN);
    for (size_t p = 0; p < step->n_param; p++)
        assert_true(step->param[p] >= x->info[p].lower && step->param[p] <= x->info[p].upper);
    return STATUS_OK;
}

void fake_numbers_init(struct fake_numbers *x, const double number[FAKE_N_NUMBER], uint64_t seed, double noise,
                       double rel_noise, double misfit)
{
    static const double mid_range[FAKE_N_PARAM] = {0.15, 0.08, 0.05, 0.85, 0.6, 0.4, 5.0, 15.0, 20.0};
    memset(x, 0, sizeof *x);
    fake_cloth_init(&x->cloth, seed, FAKE_N_FIT);
    x->cloth.noise = noise;
    x->plain = fake_estimator(&x->cloth);
    fake_param_set(mid_range, x->truth);
    memcpy(x->truth + FAKE_N_PARAM, number, FAKE_N_NUMBER * sizeof *number);
    memcpy(x->info, fake_param, sizeof fake_param);
    memcpy(x->info + FAKE_N_PARAM, number_info, sizeof number_info);
    for (size_t p = 0; p < FAKE_N_UNKNOWN; p++)
        x->parameter[p] = (struct fit_parameter){x->info[p].lower, x->info[p].upper, x->info[p].start, false};
    observation_set_init(&x->observation);
    assert_int_equal(fake_observe(&x->cloth, x->truth, rel_noise, seed, &x->observation), STATUS_OK);
    observe(x, seed, rel_noise, misfit);
    const struct cloth_source source = {x, FAKE_N_NUMBER, estimate, NULL};
    assert_int_equal(cloth_estimator_init(&x->numbers, &source, FAKE_N_PARAM, FAKE_N_FIT, x->info + FAKE_N_PARAM,
                                          x->parameter + FAKE_N_PARAM, NULL),
                     STATUS_OK);
    x->estimator = cloth_estimator(&x->numbers);
    fit_option_init(&x->option);
    x->problem = (struct fit_problem){.n_param = FAKE_N_UNKNOWN,
                                      .info = x->info,
                                      .parameter = x->parameter,
                                      .observation = &x->observation,
                                      .estimator = &x->estimator,
                                      .path_budget = 2000000,
                                      .report = on_step,
                                      .report_context = x};
    x->search = (struct cloth_search){.method = descent_find(method_gauss_newton.id),
                                      .problem = &x->problem,
                                      .option = &x->option,
                                      .cloth = &x->numbers,
                                      .n_screen = 6,
                                      .screen_budget = 200000,
                                      .final_budget = 1000000,
                                      .screen_share = 0.3,
                                      .final_share = 0.2};
}

void fake_numbers_release(struct fake_numbers *x)
{
    observation_set_release(&x->observation);
    cloth_estimator_release(&x->numbers);
}

void fake_numbers_run(struct fake_numbers *x, struct cloth_search_result *r)
{
    struct error err = {0};
    x->n_reported = 0;
    for (size_t k = 0; k < FAKE_N_NUMBER; k++) x->numbers.fixed[k] = x->parameter[FAKE_N_PARAM + k].fixed;
    if (cloth_search_run(&x->search, r, &err) != STATUS_OK) fail_msg("%s: %s", err.field, err.text);
}
