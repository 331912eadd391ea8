#include "optimizer/fit/linear/linear_gain.h"
#include "optimizer/fit/objective/objective.h"

#include <math.h>

static double dot3(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Writes the unit vector along m and returns the share of a row along it that is removed:
 * 1 - 1 / sqrt(1 + sd^2 |m|^2 / v). */
static double gain_share(const struct linear_model *m, const struct observation *o, size_t i, double misfit,
                         double unit[3])
{
    double noise = 0.0, root_w = sqrt(objective_weight(o)), length2;
    for (size_t c = 0; c < 3; c++) {
        unit[c] = root_w * o->mean_rgb[c];
        noise += linear_model_row_noise(m, 3 * i + c) / 3.0;
    }
    length2 = dot3(unit, unit);
    if (!(length2 > 0.0) || observation_is_contrast(o)) return 0.0; /* a gain leaves a contrast as it is */
    for (size_t c = 0; c < 3; c++) unit[c] /= sqrt(length2);
    return 1.0 - 1.0 / sqrt(1.0 + m->gain_sd * m->gain_sd * length2 / (misfit + noise));
}

/* Mean square of the residuals of means after the gains are removed. Contrasts are left out: no gain changes them,
 * and their misfits are of another size. */
static double absorbed_misfit(const struct linear_model *m, const struct observation_set *o, double misfit, bool absorb)
{
    double sum = 0.0, n = 0.0;
    for (size_t i = 0; i < o->n; i++) {
        double unit[3], share = absorb ? gain_share(m, &o->item[i], i, misfit, unit) : 0.0;
        const double *a = m->r[0] + 3 * i, *b = m->r[1] + 3 * i;
        if (observation_is_contrast(&o->item[i])) continue;
        sum += dot3(a, b);
        if (share > 0.0) sum += (share * share - 2.0 * share) * dot3(a, unit) * dot3(b, unit);
        n += 3.0;
    }
    return fmax(sum / fmax(n, 1.0), 1e-8);
}

/* v <- v - share unit (unit . v), for three values `stride` apart. */
static void take_out(double *v, size_t stride, const double unit[3], double share)
{
    double along = share * (unit[0] * v[0] + unit[1] * v[stride] + unit[2] * v[2 * stride]);
    for (size_t c = 0; c < 3; c++) v[c * stride] -= along * unit[c];
}

/* The same for variances. Takes the larger result of independent and of fully correlated channels. */
static void take_out_var(double *v, size_t stride, const double unit[3], double share)
{
    double old[3] = {v[0], v[stride], v[2 * stride]};
    for (size_t c = 0; c < 3; c++) {
        double apart = 0.0, together = 0.0;
        for (size_t k = 0; k < 3; k++) {
            double factor = (c == k ? 1.0 : 0.0) - share * unit[c] * unit[k];
            apart += factor * factor * old[k];
            together += factor * sqrt(old[k]);
        }
        v[c * stride] = fmax(apart, together * together);
    }
}

void linear_gain_absorb(struct linear_model *m, const struct observation_set *o)
{
    enum { ROUND = 6 };
    double misfit = absorbed_misfit(m, o, 0.0, false);
    for (int round = 0; round < ROUND; round++) misfit = absorbed_misfit(m, o, misfit, true);
    for (size_t i = 0; i < o->n; i++) {
        double unit[3], share = gain_share(m, &o->item[i], i, misfit, unit);
        for (size_t k = 0; k < LINEAR_COLOR_CAUSES; k++)
            take_out(m->color + 3 * i * LINEAR_COLOR_CAUSES + k, LINEAR_COLOR_CAUSES, unit, share);
        for (int q = 0; q < 2; q++) {
            take_out(m->r[q] + 3 * i, 1, unit, share);
            take_out_var(m->r_var[q] + 3 * i, 1, unit, share);
            for (size_t p = 0; p < m->n_param; p++) {
                take_out(m->j[q] + 3 * i * m->n_param + p, m->n_param, unit, share);
                take_out_var(m->j_var[q] + 3 * i * m->n_param + p, m->n_param, unit, share);
            }
        }
    }
}
