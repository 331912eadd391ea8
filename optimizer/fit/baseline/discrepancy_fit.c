#include "optimizer/fit/baseline/discrepancy_fit.h"

#include "base/small_matrix.h"
#include "optimizer/fit/baseline/plain_brdf.h"
#include "optimizer/fit/objective/objective.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Radians, and for the third coordinate their square. */
static const double scale[DISCREPANCY_COORDINATES] = {0.75, 0.75, 1.5, 0.75};
/* Radiances below this share of the row's brightness count as so bright: their logarithm would be all noise. */
static const double darkest = 0.02;

bool discrepancy_applies(const struct observation *o)
{
    const struct configuration *c = &o->configuration;
    return o->weight > 0.0 && !o->expected && !observation_is_contrast(o) && plain_brdf_applies(c) &&
           c->light_theta_rad < M_PI_2;
}

void discrepancy_row_of(const struct observation *o, const double rendered_rgb[3], struct discrepancy_row *row)
{
    const struct configuration *c = &o->configuration;
    const double cos_light = cos(c->light_theta_rad), cos_camera = cos(c->camera_theta_rad);
    const double between = cos_light * cos_camera + sin(c->light_theta_rad) * sin(c->camera_theta_rad) *
                                                        cos(c->camera_phi_rad - c->light_phi_rad);
    const double brightness = 1.0 / sqrt(objective_relative_weight(o)), least = darkest * brightness;
    discrepancy_coordinates(cos_light, cos_camera, between, row->place);
    for (size_t k = 0; k < 3; k++) {
        const double rendered = fmax(rendered_rgb[k], least), dark = brightness / rendered;
        row->log_ratio[k] = log(fmax(o->mean_rgb[k], least) / rendered);
        row->rough_var[k] = DISCREPANCY_ROUGH * DISCREPANCY_ROUGH * dark * dark;
    }
}

/* The weights of one channel; matrix: n * n. */
static void fit_channel(const struct discrepancy_row *row, size_t n, size_t n_place, size_t channel, double *matrix,
                        struct discrepancy *d)
{
    double x[DISCREPANCY_MAX_PLACE];
    for (size_t i = 0; i < n_place; i++) {
        const struct discrepancy_row *r = &row[i * n / n_place];
        for (size_t j = 0; j <= i; j++)
            matrix[i * n_place + j] = discrepancy_kernel(d->scale, d->place[i], d->place[j]);
        matrix[i * n_place + i] += r->rough_var[channel];
        x[i] = r->log_ratio[channel];
    }
    if (!small_factor(matrix, n_place, 0.0)) return; /* cannot be: the kernel is positive definite */
    small_solve(matrix, n_place, x, 1);
    for (size_t i = 0; i < n_place; i++) d->weight[i][channel] = x[i];
}

status discrepancy_fit(const struct discrepancy_row *row, size_t n, double share, struct discrepancy *d,
                       struct error *err)
{
    const size_t n_place = n < DISCREPANCY_MAX_PLACE ? n : DISCREPANCY_MAX_PLACE;
    memset(d, 0, sizeof *d);
    memcpy(d->scale, scale, sizeof scale);
    if (n == 0 || !(share > 0.0)) return STATUS_OK;
    double *matrix = malloc(n_place * n_place * sizeof *matrix);
    if (matrix == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit a discrepancy: out of memory");
    d->n = n_place;
    for (size_t i = 0; i < n_place; i++) memcpy(d->place[i], row[i * n / n_place].place, sizeof d->place[i]);
    for (size_t c = 0; c < 3; c++) fit_channel(row, n, n_place, c, matrix, d);
    for (size_t i = 0; i < n_place; i++)
        for (size_t c = 0; c < 3; c++) d->weight[i][c] *= share;
    free(matrix);
    return STATUS_OK;
}

void discrepancy_log_factor(const struct discrepancy *d, const double place[DISCREPANCY_COORDINATES], double log_rgb[3])
{
    memset(log_rgb, 0, 3 * sizeof *log_rgb);
    for (size_t k = 0; k < d->n; k++) {
        const double near = discrepancy_kernel(d->scale, place, d->place[k]);
        for (size_t c = 0; c < 3; c++) log_rgb[c] += near * d->weight[k][c];
    }
}
