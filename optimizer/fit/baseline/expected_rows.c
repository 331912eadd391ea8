#include "optimizer/fit/baseline/expected_rows.h"
#include "optimizer/fit/baseline/plain_brdf.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* All rows together weigh as much as one residual of this relative size. */
static const double unit_error = 0.2;
enum { BRDF_NUMBERS = 12 };

/* The BRDF of all rows, and of the rows outside each fold. */
struct brdfs {
    size_t n_fold;
    struct plain_brdf all, without[FOLDS_MAX];
    double misfit_var;
};

static bool from_front(const struct observation *o) { return o->configuration.light_theta_rad < M_PI_2; }

/* Whether a BRDF can say anything about these rows. */
static bool applies(const struct observation_set *rows)
{
    size_t n_front = 0;
    for (size_t i = 0; i < rows->n; i++) {
        if (!plain_brdf_applies(&rows->item[i].configuration)) return false;
        n_front += from_front(&rows->item[i]);
    }
    return n_front > 0;
}

static status fit_brdfs(const struct observation_set *rows, struct brdfs *b, struct error *err)
{
    size_t *fold = malloc((rows->n + 1) * sizeof *fold);
    if (fold == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit the plain BRDF: out of memory");
    b->n_fold = folds_deal(rows, fold);
    status s = STATUS_OK;
    if (b->n_fold >= FOLDS_LEAST) s = plain_brdf_fit(rows, &b->all, err);
    for (size_t k = 0; b->n_fold >= FOLDS_LEAST && k < b->n_fold && s == STATUS_OK; k++)
        s = plain_brdf_fit_without(rows, fold, k, &b->without[k], err);
    free(fold);
    if (s != STATUS_OK || b->n_fold < FOLDS_LEAST) return s;
    const double n = 3.0 * (double)rows->n, rel_rms = plain_brdf_rel_rms(&b->all, rows, JOB_SET_FIT);
    b->misfit_var = rel_rms * rel_rms * n / fmax(1.0, n - BRDF_NUMBERS);
    return STATUS_OK;
}

/* The largest angle from the normal on the front side, of lamps or cameras. */
static double widest_rad(const struct observation_set *rows, bool camera)
{
    double widest = 0.0;
    for (size_t i = 0; i < rows->n; i++) {
        const struct configuration *c = &rows->item[i].configuration;
        if (from_front(&rows->item[i])) widest = fmax(widest, camera ? c->camera_theta_rad : c->light_theta_rad);
    }
    return widest;
}

/* Angle from the normal at a share of the solid angle within `widest_rad`. */
static double theta_at(double share, double widest) { return acos(1.0 - share * (1.0 - cos(widest))); }

/* Row k of a sequence that fills the three angles evenly: additive recurrence by powers of the root of g^4 = g + 1
 * (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences"). Lamp, distances and rotation come from the
 * measured rows in turn. */
static struct observation place(const struct observation_set *rows, size_t k)
{
    static const double step[3] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
    double share[3];
    for (size_t a = 0; a < 3; a++) share[a] = fmod(0.5 + (double)(k + 1) * step[a], 1.0);
    size_t i = k % rows->n;
    while (!from_front(&rows->item[i])) i = (i + 1) % rows->n;
    struct observation o = {.set = JOB_SET_FIT, .expected = true, .configuration = rows->item[i].configuration};
    snprintf(o.name, sizeof o.name, "expected-%02zu", k);
    o.configuration.light_theta_rad = theta_at(share[0], widest_rad(rows, false));
    o.configuration.camera_theta_rad = theta_at(share[1], widest_rad(rows, true));
    o.configuration.camera_phi_rad = o.configuration.light_phi_rad + 2.0 * M_PI * share[2];
    return o;
}

/* Variance of the radiance between the folds, relative to its brightness. left_out: of each fold, rgb. */
static double jackknife_var(const double *left_out, size_t n_fold, double brightness)
{
    double sum = 0.0;
    for (size_t c = 0; c < 3; c++) {
        double mean = 0.0;
        for (size_t k = 0; k < n_fold; k++) mean += left_out[3 * k + c] / (double)n_fold;
        for (size_t k = 0; k < n_fold; k++) sum += (left_out[3 * k + c] - mean) * (left_out[3 * k + c] - mean);
    }
    return sum / 3.0 * (double)(n_fold - 1) / (double)n_fold / (brightness * brightness);
}

static void expect(const struct brdfs *b, double strength, double *left_out, struct observation *o)
{
    plain_brdf_radiance(&b->all, &o->configuration, o->mean_rgb);
    for (size_t k = 0; k < b->n_fold; k++) plain_brdf_radiance(&b->without[k], &o->configuration, left_out + 3 * k);
    double brightness = fmax((o->mean_rgb[0] + o->mean_rgb[1] + o->mean_rgb[2]) / 3.0, 1e-6);
    double var = b->misfit_var + jackknife_var(left_out, b->n_fold, brightness);
    o->weight = fmin(1.0, strength * unit_error * unit_error / (EXPECTED_ROWS * fmax(var, 1e-6)));
    o->left_out_rgb = left_out;
}

status expected_rows_append(const struct observation_set *fitted, double strength, struct expected_rows *e,
                            struct observation_set *to, struct error *err)
{
    memset(e, 0, sizeof *e);
    if (!(strength > 0.0) || !applies(fitted)) return STATUS_OK;
    struct brdfs *b = calloc(1, sizeof *b);
    if (b == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit the plain BRDF: out of memory");
    status s = fit_brdfs(fitted, b, err);
    for (size_t k = 0; k < EXPECTED_ROWS && b->n_fold >= FOLDS_LEAST && s == STATUS_OK; k++) {
        struct observation o = place(fitted, k);
        expect(b, strength, e->left_out_rgb[k], &o);
        e->count += o.weight;
        e->n++;
        s = observation_set_append(to, &o, err);
    }
    free(b);
    return s;
}
