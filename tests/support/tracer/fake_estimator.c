#include "tests/support/tracer/fake_estimator.h"
#include "base/angle.h"
#include "base/rng.h"
#include "optimizer/fit/objective/objective.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const struct param_info fake_param[FAKE_N_PARAM] = {
    {"C_R.r", "C_R", PARAM_COLOUR, PARAM_UNIT_NONE, 0, 0.001, 0.999, 0.1, PARAM_LOGIT, ""},
    {"C_R.g", "C_R", PARAM_COLOUR, PARAM_UNIT_NONE, 1, 0.001, 0.999, 0.1, PARAM_LOGIT, ""},
    {"C_R.b", "C_R", PARAM_COLOUR, PARAM_UNIT_NONE, 2, 0.001, 0.999, 0.1, PARAM_LOGIT, ""},
    {"C_TT.r", "C_TT", PARAM_COLOUR, PARAM_UNIT_NONE, 0, 0.001, 0.999, 0.85, PARAM_LOGIT, ""},
    {"C_TT.g", "C_TT", PARAM_COLOUR, PARAM_UNIT_NONE, 1, 0.001, 0.999, 0.85, PARAM_LOGIT, ""},
    {"C_TT.b", "C_TT", PARAM_COLOUR, PARAM_UNIT_NONE, 2, 0.001, 0.999, 0.85, PARAM_LOGIT, ""},
    {"beta_R", "beta_R", PARAM_LOBE_WIDTH, PARAM_UNIT_DEG, -1, 1.0 * RAD_PER_DEG, 10.0 * RAD_PER_DEG, 5.0 * RAD_PER_DEG,
     PARAM_LOG, ""},
    {"beta_TT", "beta_TT", PARAM_LOBE_WIDTH, PARAM_UNIT_DEG, -1, 10.0 * RAD_PER_DEG, 45.0 * RAD_PER_DEG,
     10.0 * RAD_PER_DEG, PARAM_LOG, ""},
    {"gamma_TT", "gamma_TT", PARAM_LOBE_WIDTH, PARAM_UNIT_DEG, -1, 1.0 * RAD_PER_DEG, 45.0 * RAD_PER_DEG,
     10.0 * RAD_PER_DEG, PARAM_LOG, ""},
};

/* Theta of the light, theta and phi of the camera; phi of the light is 0. Every row is used twice, with the cloth
 * turned by 0 and by 90 degrees. */
static const double fit_row[8][3] = {{20, 20, 180}, {45, 45, 180}, {75, 75, 180}, {60, 0, 180},
                                     {20, 20, 90},  {45, 45, 90},  {64, 64, 90},  {60, 0, 90}};
static const double held_row[12][3] = {{10, 30, 180}, {30, 50, 180}, {50, 70, 180}, {70, 50, 180},
                                       {30, 30, 135}, {60, 60, 135}, {45, 20, 90},  {70, 30, 90},
                                       {40, 40, 45},  {60, 30, 20},  {70, 70, 150}, {0, 60, 0}};

static struct configuration make_configuration(const double row[3], double rotation_deg)
{
    struct configuration c = {.light_theta_rad = row[0] * RAD_PER_DEG,
                              .camera_theta_rad = row[1] * RAD_PER_DEG,
                              .camera_phi_rad = row[2] * RAD_PER_DEG,
                              .cloth_rotation_rad = rotation_deg * RAD_PER_DEG,
                              .light_distance_m = 0.61,
                              .lamp_side_m = 0.1,
                              .camera_distance_m = 1.0,
                              .crop_m = 0.01};
    return c;
}

void fake_cloth_init(struct fake_cloth *f, uint64_t seed, size_t n)
{
    memset(f, 0, sizeof *f);
    f->seed = seed;
    f->noise = 1.0;
    f->n_configuration = n;
    for (size_t i = 0; i < FAKE_N_FIT; i++)
        f->configuration[i] = make_configuration(fit_row[i % 8], i < 8 ? 0.0 : 90.0);
    for (size_t i = 0; i < FAKE_N_HELD_OUT; i++)
        f->configuration[FAKE_N_FIT + i] = make_configuration(held_row[i % 12], i < 12 ? 0.0 : 90.0);
}

void fake_param_set(const double file_unit[FAKE_N_PARAM], double param[FAKE_N_PARAM])
{
    for (size_t p = 0; p < FAKE_N_PARAM; p++) param[p] = param_from_file_unit(&fake_param[p], file_unit[p]);
}

/* ---- the mean ---- */

static double radiance(const struct configuration *c, double c_r, double c_tt, double beta_r, double beta_tt,
                       double gamma)
{
    double tl = c->light_theta_rad, tc = c->camera_theta_rad, phi = c->camera_phi_rad,
           turn = cos(c->cloth_rotation_rad);
    double half = tl * cos(M_PI - phi) - tc;          /* 0 at the mirror direction */
    double across = (phi - M_PI) * sin(fmin(tl, tc)); /* distance from the plane of incidence */
    double grazing = pow(sin(0.5 * (tl + tc)), 4.0);
    double fresnel = c_r + (1.0 - c_r) * pow(1.0 - cos(0.5 * (tl + tc)), 5.0);
    double wide_r = beta_r + 0.12 + 0.03 * turn, wide_tt = beta_tt + 0.1;
    double surface =
        0.5 * fresnel * exp(-0.5 * half * half / (wide_r * wide_r)) * (0.2 / wide_r) * exp(-across * across);
    double through = c_tt * (1.0 - fresnel) * grazing * (1.0 + 0.2 * turn) *
                     exp(-0.5 * half * half / (wide_tt * wide_tt) - 0.5 * across * across / (gamma * gamma + 0.2)) *
                     1.5;
    double many = 0.25 * c_tt * c_tt / (1.0 - 0.85 * c_tt * (1.0 - 0.3 * fresnel)) * cos(tl) / (0.4 + 0.6 * cos(tl)) *
                  (0.6 + 0.4 * tanh(2.0 * gamma)) * (1.0 - 0.4 * tanh(beta_tt) * sin(tc));
    return surface + through + many;
}

void fake_radiance(const struct configuration *c, const double *param, double rgb[3], double *jac)
{
    for (size_t k = 0; k < 3; k++) {
        size_t slot[5] = {k, 3 + k, 6, 7, 8};
        double v[5];
        for (int i = 0; i < 5; i++) v[i] = param[slot[i]];
        rgb[k] = radiance(c, v[0], v[1], v[2], v[3], v[4]);
        if (jac == NULL) continue;
        for (size_t p = 0; p < FAKE_N_PARAM; p++) jac[k * FAKE_N_PARAM + p] = 0.0;
        for (int i = 0; i < 5; i++) {
            double keep = v[i], h = 1e-6;
            v[i] = keep + h;
            double up = radiance(c, v[0], v[1], v[2], v[3], v[4]);
            v[i] = keep - h;
            jac[k * FAKE_N_PARAM + slot[i]] = (up - radiance(c, v[0], v[1], v[2], v[3], v[4])) / (2.0 * h);
            v[i] = keep;
        }
    }
}

/* ---- the noise: three kinds of rare paths carry the light ---- */

static const double kind_share[3] = {0.5, 0.35, 0.15}, kind_probability[3] = {0.2, 0.03, 0.003};

/* Sum of n exponential deviates of mean 1. */
static double exponential_sum(struct rng *r, uint64_t n)
{
    double sum = 0.0, z[2];
    if (n > 64) {
        rng_normal_pair(r, z);
        return (double)n + z[0] * sqrt((double)n);
    }
    for (uint64_t i = 0; i < n; i++) sum -= log(1.0 - rng_double(r));
    return sum;
}

static size_t paths_of(const struct fake_cloth *f, const struct estimator_call *call, size_t i)
{
    size_t other = i ^ 1;
    if (!f->share_paths || other >= f->n_configuration || call->n_path[i] > call->n_path[other]) return call->n_path[i];
    return call->n_path[other];
}

static void sample_configuration(const struct fake_cloth *f, const struct estimator_call *call, size_t i,
                                 struct estimate *e)
{
    const size_t n_path = paths_of(f, call, i), first = f->share_paths ? i & ~(size_t)1 : i;
    double rgb[3], jac[3 * FAKE_N_PARAM], n = (double)n_path, factor = 0.0, var = 0.0, score[FAKE_N_PARAM] = {0},
                                          score_var = 0.0, width[FAKE_N_PARAM] = {0}, z[2];
    struct rng_key key = {
        .seed = f->seed, .iteration = call->iteration, .replica = call->replica, .configuration = (uint32_t)first};
    struct rng r;
    rng_start(&r, &key, 0, 0);
    fake_radiance(&f->configuration[i], call->param, rgb, jac);
    for (int k = 0; k < 3; k++) {
        double q = kind_probability[k], part = exponential_sum(&r, rng_poisson(&r, n * q)) / (n * q);
        factor += kind_share[k] * part;
        var += kind_share[k] * kind_share[k] * 2.0 / (n * q);
        for (size_t p = 0; p < FAKE_N_PARAM; p++) { /* derivatives scatter from path to path by twice their mean */
            rng_normal_pair(&r, z);
            score[p] += kind_share[k] * (part + 2.0 * z[0] / sqrt(n * q));
            if (p >= 6)
                width[p] += kind_share[k] * 2.0 * z[1] /
                            sqrt(n * q); /* those of widths have both signs, independent of their mean */
        }
        score_var += kind_share[k] * kind_share[k] * 6.0 / (n * q);
    }
    if (f->noise == 0.0) {
        factor = 1.0;
        var = score_var = 0.0;
        for (size_t p = 0; p < FAKE_N_PARAM; p++) {
            score[p] = 1.0;
            width[p] = 0.0;
        }
    }
    for (size_t c = 0; c < 3; c++) {
        double part = 0.3 + 0.7 * call->param[3 + c]; /* a dark channel has short paths and less noise */
        e->mean[c] = rgb[c] * (1.0 + part * (factor - 1.0));
        e->var[c] = rgb[c] * rgb[c] * var * part * part;
        for (size_t p = 0; p < FAKE_N_PARAM; p++) {
            double own = jac[c * FAKE_N_PARAM + p], per_unit = p >= 6 ? rgb[c] / call->param[p] : 0.0;
            e->jac[c * FAKE_N_PARAM + p] = own * (1.0 + part * (score[p] - 1.0)) + per_unit * part * width[p];
            e->jac_var[c * FAKE_N_PARAM + p] = part * part * score_var * (own * own + per_unit * per_unit * 4.0 / 6.0);
        }
    }
    e->n_path = n_path;
    e->n_bounce = 10 * e->n_path;
    if (first == i) return;
    e->n_partner = 1;
    e->partner[0] = (struct estimate_partner){(uint32_t)first, 1.0f};
}

static status run(void *context, const struct estimator_call *call, const struct progress *progress,
                  struct estimate *out, double *wall_s, struct error *err)
{
    struct fake_cloth *f = context;
    if (progress_cancelled(progress) || (f->fail_after > 0 && f->n_call >= f->fail_after))
        return error_set(err, STATUS_CANCELLED, "cancelled");
    f->n_call++;
    *wall_s = 0.25;
    for (size_t i = 0; i < f->n_configuration; i++) {
        memset(&out[i], 0, sizeof out[i]);
        if (call->n_path[i] > 0) sample_configuration(f, call, i, &out[i]);
    }
    return STATUS_OK;
}

struct estimator fake_estimator(struct fake_cloth *f)
{
    return (struct estimator){.context = f, .n_configuration = f->n_configuration, .n_param = FAKE_N_PARAM, .run = run};
}

status fake_observe(const struct fake_cloth *f, const double *param, double rel_noise, uint64_t seed,
                    struct observation_set *o)
{
    struct rng_key key = {.seed = seed ^ 0x6f6273u};
    struct rng r;
    rng_start(&r, &key, 0, 0);
    for (size_t i = 0; i < f->n_configuration; i++) {
        struct observation item = {.set = i < FAKE_N_FIT ? JOB_SET_FIT : JOB_SET_HELD_OUT,
                                   .weight = 1.0,
                                   .configuration = f->configuration[i]};
        double rgb[3];
        snprintf(item.name, sizeof item.name, "row-%zu", i);
        fake_radiance(&f->configuration[i], param, rgb, NULL);
        for (int c = 0; c < 3; c++) {
            double z[2];
            rng_normal_pair(&r, z);
            item.mean_rgb[c] = fmax(0.0, rgb[c] * (1.0 + rel_noise * z[0]));
            item.se_rgb[c] = rgb[c] * rel_noise;
        }
        status s = observation_set_append(o, &item, NULL);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

double fake_rel_rms(const struct fake_cloth *f, size_t first, size_t n, const double *param, const double *truth)
{
    double sum = 0.0;
    for (size_t i = first; i < first + n; i++) {
        double x[3], m[3];
        fake_radiance(&f->configuration[i], param, x, NULL);
        fake_radiance(&f->configuration[i], truth, m, NULL);
        double a = fmax((m[0] + m[1] + m[2]) / 3.0, OBJECTIVE_TAU);
        sum += objective_image_difference(x, m) / (a * a);
    }
    return sqrt(sum / (3.0 * (double)n));
}
