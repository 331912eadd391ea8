#include "optimizer/fit/objective/objective.h"

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

void objective_evaluate(const struct observation_set *o, const struct estimate *a, const struct estimate *b,
                        struct objective_value *out)
{
    double value = 0.0, var = 0.0, relative = 0.0, relative_var = 0.0, n_radiance = 0.0;
    for (size_t i = 0; i < o->n; i++) {
        double product = 0.0, sd = 0.0;
        for (int c = 0; c < 3; c++) {
            double ra = a[i].mean[c] - o->item[i].mean_rgb[c], rb = b[i].mean[c] - o->item[i].mean_rgb[c];
            double va = a[i].var[c], vb = b[i].var[c];
            product += ra * rb;
            sd += sqrt(fmax(ra * ra * vb + rb * rb * va - va * vb, va * vb));
        }
        double w = objective_weight(&o->item[i]);
        value += w * product;
        var += w * w * sd * sd;
        if (observation_is_contrast(&o->item[i]) || !(o->item[i].weight > 0.0)) continue;
        w = objective_relative_weight(&o->item[i]);
        relative += w * product;
        relative_var += w * w * sd * sd;
        n_radiance += 3.0;
    }
    out->value = value;
    out->se = sqrt(var);
    n_radiance = fmax(n_radiance, 1.0);
    out->rel_square = relative / n_radiance;
    out->rel_square_se = sqrt(relative_var) / n_radiance;
    out->rel_rms = sqrt(fmax(0.0, out->rel_square));
    out->rel_rms_se = sqrt(out->rel_square_se); /* the delta method fails near 0 */
    if (out->rel_rms > 0.0) out->rel_rms_se = fmin(out->rel_rms_se, 0.5 * out->rel_square_se / out->rel_rms);
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
