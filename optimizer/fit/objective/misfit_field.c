#include "optimizer/fit/objective/misfit_field.h"
#include "base/small_matrix.h"
#include "optimizer/fit/objective/objective.h"

#include <math.h>
#include <string.h>

enum { MAX_ROW = MISFIT_FIELD_MAX_ROW, LEAST_ROW = 6 };

/* The values that are tried. A chord of 0.3 is an angle of 17 degrees. */
static const double length_tried[] = {0.15, 0.3, 0.6, 1.2}, share_tried[] = {0.3, 0.6, 0.9};

static void unit_vector(double theta, double phi, double v[3])
{
    v[0] = sin(theta) * cos(phi);
    v[1] = sin(theta) * sin(phi);
    v[2] = cos(theta);
}

static void set_coordinates(const struct misfit_field *f, const struct configuration *c,
                            double place[MISFIT_FIELD_PLACE])
{
    double light = c->light_phi_rad - c->cloth_rotation_rad, camera = c->camera_phi_rad - c->cloth_rotation_rad;
    if (f->all_rotations) {
        camera = acos(fmin(fmax(cos(camera - light), -1.0), 1.0));
        light = 0.0;
    }
    unit_vector(c->light_theta_rad, light, place);
    unit_vector(c->camera_theta_rad, camera, place + 3);
}

static double smooth_covariance(const struct misfit_field *f, const double *x, const double *y)
{
    double square = 0.0;
    for (size_t k = 0; k < MISFIT_FIELD_PLACE; k++) square += (x[k] - y[k]) * (x[k] - y[k]);
    return f->misfit_var * f->smooth_share * exp(-0.5 * square / (f->length * f->length));
}

/* The rows' covariance, factored. Returns false when it is not positive definite. */
static bool factor_rows(struct misfit_field *f, const double *noise)
{
    for (size_t i = 0; i < f->n; i++) {
        for (size_t j = 0; j <= i; j++) f->factor[i * f->n + j] = smooth_covariance(f, f->place[i], f->place[j]);
        f->factor[i * f->n + i] += f->misfit_var * (1.0 - f->smooth_share) + noise[i];
    }
    return small_factor(f->factor, f->n, 0.0);
}

static double log_likelihood(struct misfit_field *f, const double *residual, const double *noise)
{
    double x[MAX_ROW], sum = 0.0;
    if (!factor_rows(f, noise)) return -INFINITY;
    memcpy(x, residual, f->n * sizeof *x);
    small_solve(f->factor, f->n, x, 1);
    for (size_t i = 0; i < f->n; i++) sum -= 0.5 * residual[i] * x[i] + log(f->factor[i * f->n + i]);
    return sum;
}

/* Mean over the channels of the relative residual, and the variance of its noise. */
static double residual_of(const struct observation *o, const struct estimate *a, const struct estimate *b,
                          double *noise)
{
    const double unit = sqrt(objective_relative_weight(o));
    double residual = 0.0, sd = 0.0, photograph = 0.0;
    for (int c = 0; c < 3; c++) {
        residual += unit * (0.5 * (a->mean[c] + b->mean[c]) - o->mean_rgb[c]) / 3.0;
        sd += unit * 0.5 * sqrt(a->var[c] + b->var[c]) / 3.0;
        photograph += unit * unit * o->se_rgb[c] * o->se_rgb[c] / 3.0;
    }
    *noise = sd * sd + photograph;
    return residual;
}

/* Finds share and length of the largest likelihood; a share of 0 when no smooth field beats independent misfits. */
static void fit_field(struct misfit_field *f, const double *residual, const double *noise)
{
    double best_share = 0.0, best_length = length_tried[0], best;
    f->smooth_share = best_share;
    f->length = best_length;
    best = log_likelihood(f, residual, noise);
    for (size_t i = 0; i < sizeof length_tried / sizeof length_tried[0]; i++)
        for (size_t j = 0; j < sizeof share_tried / sizeof share_tried[0]; j++) {
            f->length = length_tried[i];
            f->smooth_share = share_tried[j];
            double likelihood = log_likelihood(f, residual, noise);
            if (!(likelihood > best)) continue;
            best = likelihood;
            best_length = f->length;
            best_share = f->smooth_share;
        }
    f->length = best_length;
    f->smooth_share = best_share;
    if (!(best_share > 0.0) || !factor_rows(f, noise)) f->n = 0;
}

void misfit_field_init(struct misfit_field *f, const struct observation_set *o, const struct estimate *a,
                       const struct estimate *b, double misfit_var)
{
    double residual[MAX_ROW], noise[MAX_ROW];
    *f = (struct misfit_field){.n = o->n < MAX_ROW ? o->n : MAX_ROW, .misfit_var = misfit_var};
    for (size_t i = 0; i < o->n; i++) f->all_rotations = f->all_rotations || o->item[i].configuration.n_rotation > 1;
    for (size_t k = 0; k < f->n; k++) {
        const size_t i = k * o->n / f->n;
        set_coordinates(f, &o->item[i].configuration, f->place[k]);
        residual[k] = residual_of(&o->item[i], &a[i], &b[i], &noise[k]);
    }
    if (f->n < LEAST_ROW || !(misfit_var > 0.0))
        f->n = 0;
    else
        fit_field(f, residual, noise);
    if (f->n == 0) f->smooth_share = 0.0;
}

void misfit_field_predict(const struct misfit_field *f, const struct configuration *c, struct misfit_prediction *out)
{
    double place[MISFIT_FIELD_PLACE], k[MAX_ROW], x[MAX_ROW], known = 0.0;
    out->rest_var = f->misfit_var * (1.0 - f->smooth_share);
    set_coordinates(f, c, place);
    for (size_t i = 0; i < f->n; i++) k[i] = x[i] = smooth_covariance(f, place, f->place[i]);
    if (f->n > 0) small_solve(f->factor, f->n, x, 1);
    for (size_t i = 0; i < f->n; i++) known += k[i] * x[i];
    out->smooth_var = fmax(0.0, f->misfit_var * f->smooth_share - known);
}
