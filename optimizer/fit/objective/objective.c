#include "optimizer/fit/objective/objective.h"
#include "optimizer/fit/objective/product_noise.h"

#include <math.h>
#include <string.h>

double objective_relative_weight(const struct observation *o)
{
    double a = (o->mean_rgb[0] + o->mean_rgb[1] + o->mean_rgb[2]) / 3.0;
    double scale = observation_is_contrast(o) ? 2.0 * fmax(a, OBJECTIVE_CONTRAST_TAU) : fmax(a, OBJECTIVE_TAU);
    return 1.0 / (scale * scale);
}

double objective_weight(const struct observation *o) { return o->weight * objective_relative_weight(o); }

double objective_photograph_variance(const struct observation *o, size_t channel)
{
    return objective_weight(o) * o->se_rgb[channel] * o->se_rgb[channel];
}

double objective_mean_photograph_variance(const struct observation_set *o)
{
    double sum = 0.0;
    for (size_t row = 0; row < 3 * o->n; row++) sum += objective_photograph_variance(&o->item[row / 3], row % 3);
    return o->n > 0 ? sum / (3.0 * (double)o->n) : 0.0;
}

double objective_image_difference(const double x_rgb[3], const double y_rgb[3])
{
    double sum = 0.0;
    for (int c = 0; c < 3; c++) sum += (x_rgb[c] - y_rgb[c]) * (x_rgb[c] - y_rgb[c]);
    return sum;
}

/* Root of the mean square `square`, whose standard error is square_se, and the root's own standard error. */
static double root_of_square(double square, double square_se, double *se)
{
    double rms = sqrt(fmax(0.0, square));
    *se = sqrt(square_se); /* the delta method fails near 0 */
    if (rms > 0.0) *se = fmin(*se, 0.5 * square_se / rms);
    return rms;
}

/* (A - M)(B - M) of one channel, and its standard deviation. */
static double square_of_channel(const struct observation *o, const struct estimate *a, const struct estimate *b, int c,
                                double *sd)
{
    double ra = a->mean[c] - o->mean_rgb[c], rb = b->mean[c] - o->mean_rgb[c], va = a->var[c], vb = b->var[c];
    *sd = sqrt(fmax(ra * ra * vb + rb * rb * va - va * vb, va * vb));
    return ra * rb;
}

/* The noise of a row's product in the channels first .. end - 1. */
static struct product_noise noise_of(const struct observation *o, const struct estimate *a, const struct estimate *b,
                                     int first, int end)
{
    struct product_noise noise = {0};
    for (int c = first; c < end; c++) {
        const double residual[2] = {a->mean[c] - o->mean_rgb[c], b->mean[c] - o->mean_rgb[c]};
        product_noise_add(&noise, residual, (const double[2]){a->var[c], b->var[c]});
    }
    return noise;
}

/* Which rows a sum of squares has, and with which factor. */
typedef double row_factor(const struct observation *o, int channel);

static double factor_of_objective(const struct observation *o, int channel)
{
    (void)channel;
    return objective_weight(o);
}

static bool scored(const struct observation *o) { return observation_is_measured_mean(o) && o->weight > 0.0; }

static double factor_of_relative(const struct observation *o, int channel)
{
    (void)channel;
    return scored(o) ? objective_relative_weight(o) : 0.0;
}

static double factor_of_channel(const struct observation *o, int channel)
{
    double unit = fmax(o->mean_rgb[channel], OBJECTIVE_CHANNEL_TAU);
    return scored(o) ? 1.0 / (unit * unit) : 0.0;
}

/* Returns the covariance of rows that share their camera paths in the variance of a sum over rows: of all channels, or
 * of one. */
static double shared_variance(const struct observation_set *o, const struct estimate *a, const struct estimate *b,
                              row_factor *factor, int first, int end)
{
    double sum = 0.0;
    for (size_t i = 0; i < o->n; i++) {
        for (uint32_t k = 0; k < a[i].n_partner && k < b[i].n_partner; k++) {
            const size_t j = a[i].partner[k].configuration;
            const struct product_noise own = noise_of(&o->item[i], &a[i], &b[i], first, end),
                                       other = noise_of(&o->item[j], &a[j], &b[j], first, end);
            double correlation = 0.5 * ((double)a[i].partner[k].correlation + (double)b[i].partner[k].correlation);
            sum += 2.0 * factor(&o->item[i], first) * factor(&o->item[j], first) *
                   product_noise_covariance(&own, &other, correlation);
        }
    }
    return sum;
}

void objective_evaluate(const struct observation_set *o, const struct estimate *a, const struct estimate *b,
                        struct objective_value *out)
{
    double value = 0.0, var = 0.0, relative = 0.0, relative_var = 0.0, n_radiance = 0.0;
    for (size_t i = 0; i < o->n; i++) {
        double product = 0.0, sd = 0.0, channel_sd;
        for (int c = 0; c < 3; c++) {
            product += square_of_channel(&o->item[i], &a[i], &b[i], c, &channel_sd);
            sd += channel_sd;
        }
        double w = objective_weight(&o->item[i]);
        value += w * product;
        var += w * w * sd * sd;
        if (!scored(&o->item[i])) continue;
        w = objective_relative_weight(&o->item[i]);
        relative += w * product;
        relative_var += w * w * sd * sd;
        n_radiance += 3.0;
    }
    var += shared_variance(o, a, b, factor_of_objective, 0, 3);
    relative_var += shared_variance(o, a, b, factor_of_relative, 0, 3);
    out->value = value;
    out->se = sqrt(fmax(var, 0.0));
    n_radiance = fmax(n_radiance, 1.0);
    out->rel_square = relative / n_radiance;
    out->rel_square_se = sqrt(fmax(relative_var, 0.0)) / n_radiance;
    out->rel_rms = root_of_square(out->rel_square, out->rel_square_se, &out->rel_rms_se);
}

double objective_row_error(const struct observation *o, const struct estimate *a, const struct estimate *b, double *se)
{
    double product = 0.0, sd = 0.0, channel_sd;
    for (int c = 0; c < 3; c++) {
        product += square_of_channel(o, a, b, c, &channel_sd);
        sd += channel_sd;
    }
    const double w = objective_relative_weight(o) / 3.0;
    return root_of_square(w * product, w * sd, se);
}

void objective_evaluate_channels(const struct observation_set *o, const struct estimate *a, const struct estimate *b,
                                 struct objective_channels *out)
{
    for (int c = 0; c < 3; c++) {
        double square = 0.0, var = 0.0, n = 0.0;
        for (size_t i = 0; i < o->n; i++) {
            double sd, factor = factor_of_channel(&o->item[i], c);
            if (!scored(&o->item[i])) continue;
            square += factor * square_of_channel(&o->item[i], &a[i], &b[i], c, &sd);
            var += factor * factor * sd * sd;
            n += 1.0;
        }
        var = fmax(0.0, var + shared_variance(o, a, b, factor_of_channel, c, c + 1));
        out->rel_rms[c] = out->rel_rms_se[c] = NAN;
        if (n > 0.0) out->rel_rms[c] = root_of_square(square / n, sqrt(var) / n, &out->rel_rms_se[c]);
    }
}

void objective_gradient(const struct observation_set *o, const struct estimate *a, const struct estimate *b,
                        size_t n_param, double *gradient)
{
    memset(gradient, 0, n_param * sizeof *gradient);
    for (size_t i = 0; i < o->n; i++) {
        double w = objective_weight(&o->item[i]);
        for (size_t c = 0; c < 3; c++) {
            double ra = w * (a[i].mean[c] - o->item[i].mean_rgb[c]), rb = w * (b[i].mean[c] - o->item[i].mean_rgb[c]);
            for (size_t p = 0; p < n_param; p++)
                gradient[p] += ra * b[i].jac[c * n_param + p] + rb * a[i].jac[c * n_param + p];
        }
    }
}
