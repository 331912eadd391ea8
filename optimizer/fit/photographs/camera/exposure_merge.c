#include "optimizer/fit/photographs/camera/exposure_merge.h"

#include <math.h>

/* Variance of sample i: by the sample itself in the first estimate, by the estimate so far in the others. */
static double variance(const struct noise_channel *k, double t_s, double y_dn, double rate, bool first)
{
    double light = first ? y_dn : t_s * rate;
    return k->read_var + k->dark_var * t_s + k->shot_var * fmax(light, 0.0);
}

struct merged_sample exposure_merge(const struct noise_channel *k, size_t n, const double *t_s, const double *y_dn,
                                    size_t n_reweight)
{
    const struct noise_channel shot_alone = {.shot_var = 1.0};
    bool known = k->read_var + k->dark_var + k->shot_var > 0.0;
    struct merged_sample m = {.value = NAN, .se = NAN};
    if (!known) {
        double sum = 0.0, time = 0.0;
        for (size_t i = 0; i < n; i++) {
            if (isnan(y_dn[i])) continue;
            sum += y_dn[i] - k->read_mean - t_s[i] * k->dark_mean;
            time += t_s[i];
            m.n_used++;
        }
        if (m.n_used > 0) m.value = sum / time;
        return m;
    }
    for (size_t round = 0; round <= n_reweight; round++) {
        double over = 0.0, under = 0.0, rate = m.value;
        m.n_used = 0;
        for (size_t i = 0; i < n; i++) {
            if (isnan(y_dn[i])) continue;
            double v = variance(k, t_s[i], y_dn[i], rate, round == 0);
            if (!(v > 0.0)) v = shot_alone.shot_var; /* no read noise and no light: any weight gives the same */
            over += (y_dn[i] - k->read_mean - t_s[i] * k->dark_mean) * t_s[i] / v;
            under += t_s[i] * t_s[i] / v;
            m.n_used++;
        }
        if (m.n_used == 0) return m;
        m.value = over / under;
        m.se = 1.0 / sqrt(under);
    }
    return m;
}

static size_t shortest(size_t n, const double *t_s)
{
    size_t i = 0;
    for (size_t k = 1; k < n; k++)
        if (t_s[k] < t_s[i]) i = k;
    return i;
}

void exposure_merge_images(const struct noise_record *noise, size_t n, const double *t_s, const double *full_scale,
                           struct image *const *exposure, double noise_se_rgb[3], double *saturated_share)
{
    const struct noise_channel none = {0};
    size_t n_pixel = exposure[0]->width * exposure[0]->height, n_saturated = 0, brief = shortest(n, t_s);
    double var[3] = {0};
    for (size_t p = 0; p < n_pixel; p++) {
        bool saturated = false;
        for (size_t c = 0; c < 3; c++) {
            const struct noise_channel *k = noise != NULL ? &noise->channel[c] : &none;
            double y[EXPOSURE_MAX];
            for (size_t i = 0; i < n; i++) {
                double v = (double)exposure[i]->pixel[3 * p + c];
                y[i] = v >= 1.0 && full_scale[i] != 1.0 ? NAN : v * full_scale[i];
            }
            struct merged_sample m = exposure_merge(k, n, t_s, y, 2);
            bool lost = m.n_used == 0;
            if (lost) m.value = (double)exposure[brief]->pixel[3 * p + c] * full_scale[brief] / t_s[brief];
            saturated = saturated || lost;
            var[c] += lost ? 0.0 : m.se * m.se;
            exposure[0]->pixel[3 * p + c] = (float)(m.value / full_scale[0]);
        }
        n_saturated += saturated;
    }
    for (size_t c = 0; c < 3; c++) noise_se_rgb[c] = sqrt(var[c]) / (double)n_pixel / full_scale[0];
    *saturated_share = (double)n_saturated / (double)n_pixel;
}
