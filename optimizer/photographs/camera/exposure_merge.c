#include "optimizer/photographs/camera/exposure_merge.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

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

/* ---- pictures ---- */

const struct noise_channel *exposure_noise(const struct exposure_set *e, size_t c)
{
    static const struct noise_channel none = {0};
    return e->noise != NULL ? &e->noise->channel[c] : &none;
}

double exposure_sample_dn(const struct exposure_set *e, size_t i, size_t p)
{
    double v = (double)e->image[i]->pixel[p];
    return v >= 1.0 && e->full_scale[i] != 1.0 ? NAN : v * e->full_scale[i];
}

/* Sums over rectangles that begin in the upper left corner, of light and time of the exposures that are shorter than
 * exposure i: sum[2 ((y + 1) (width + 1) + x + 1)]. */
static void sum_shorter(const struct exposure_set *e, size_t i, size_t c, double *sum)
{
    const struct noise_channel *k = exposure_noise(e, c);
    const size_t stride = 2 * (e->width + 1);
    for (size_t y = 0; y < e->height; y++)
        for (size_t x = 0; x < e->width; x++) {
            double own[2] = {0.0, 0.0}, *to = sum + (y + 1) * stride + 2 * (x + 1);
            for (size_t j = 0; j < e->n; j++) {
                if (!(e->t_s[j] < e->t_s[i])) continue;
                double dn = exposure_sample_dn(e, j, 3 * (y * e->width + x) + c);
                if (isnan(dn)) continue;
                own[0] += dn - k->read_mean - e->t_s[j] * k->dark_mean;
                own[1] += e->t_s[j];
            }
            for (size_t a = 0; a < 2; a++) to[a] = own[a] + *(to + a - 2) + *(to + a - stride) - *(to + a - stride - 2);
        }
}

/* Rate around a pixel by those sums, over a square without the pixel itself; NaN without a sample. */
static double rate_around(const struct exposure_set *e, const double *sum, size_t x, size_t y)
{
    enum { REACH = 3 };
    const size_t x0 = x > REACH ? x - REACH : 0, y0 = y > REACH ? y - REACH : 0, stride = 2 * (e->width + 1),
                 x1 = x + REACH < e->width ? x + REACH + 1 : e->width,
                 y1 = y + REACH < e->height ? y + REACH + 1 : e->height;
    double of[2];
    for (size_t a = 0; a < 2; a++) {
        const double *s = sum + a;
        of[a] = s[y1 * stride + 2 * x1] - s[y0 * stride + 2 * x1] - s[y1 * stride + 2 * x0] + s[y0 * stride + 2 * x0];
        of[a] -= s[(y + 1) * stride + 2 * (x + 1)] - s[y * stride + 2 * (x + 1)] - s[(y + 1) * stride + 2 * x] +
                 s[y * stride + 2 * x];
    }
    return of[1] > 1e-9 * e->t_s[0] ? of[0] / of[1] : NAN;
}

/* Marks as saturated (1 or more) the samples of exposure i, channel c that may be cut by saturation. The choice must
 * depend neither on a sample's own noise nor on the noise of the samples that stay in its place: leaving out only
 * samples that reach the full scale leaves the darker half of the noise, and makes an area whose mean is near the full
 * scale darker by 0.2 %. So the shorter exposures of the pixels around it decide. */
static void leave_out_near_saturation(const struct exposure_set *e, size_t i, size_t c, double *sum)
{
    static const double sd_away = 4.0, unknown_noise = 0.05; /* share of the full scale */
    const struct noise_channel *k = exposure_noise(e, c);
    const bool known = k->read_var + k->dark_var + k->shot_var > 0.0;
    if (e->full_scale[i] == 1.0) return;
    sum_shorter(e, i, c, sum);
    for (size_t y = 0; y < e->height; y++)
        for (size_t x = 0; x < e->width; x++) {
            double rate = rate_around(e, sum, x, y);
            if (isnan(rate)) continue;
            double margin =
                known ? sd_away * sqrt(variance(k, e->t_s[i], 0.0, rate, false)) : unknown_noise * e->full_scale[i];
            double predicted = e->t_s[i] * (rate + k->dark_mean) + k->read_mean + margin;
            float *v = &e->image[i]->pixel[3 * (y * e->width + x) + c];
            if (predicted > e->full_scale[i]) *v = fmaxf(*v, 1.0f);
        }
}

/* From the longest exposure on, because the decisions about one take the samples of shorter ones as they were. */
static void leave_out_all_near_saturation(const struct exposure_set *e, double *sum)
{
    bool done[EXPOSURE_MAX] = {false};
    for (size_t turn = 0; turn < e->n; turn++) {
        size_t longest = SIZE_MAX;
        for (size_t i = 0; i < e->n; i++)
            if (!done[i] && (longest == SIZE_MAX || e->t_s[i] > e->t_s[longest])) longest = i;
        done[longest] = true;
        for (size_t c = 0; c < 3; c++) leave_out_near_saturation(e, longest, c, sum);
    }
}

/* Adds the light that each exposure has in a merged sample. */
static void add_light(const struct exposure_set *e, size_t c, const double *y_dn, const struct merged_sample *m,
                      double light[EXPOSURE_MAX][3])
{
    const struct noise_channel *k = exposure_noise(e, c);
    const bool known = k->read_var + k->dark_var + k->shot_var > 0.0;
    double weight[EXPOSURE_MAX] = {0}, sum = 0.0;
    for (size_t i = 0; i < e->n; i++) {
        if (isnan(y_dn[i])) continue;
        const double v = known ? variance(k, e->t_s[i], 0.0, m->value, false) : e->t_s[i];
        weight[i] = e->t_s[i] * e->t_s[i] / (v > 0.0 ? v : e->t_s[i]);
        sum += weight[i];
    }
    for (size_t i = 0; i < e->n && sum > 0.0; i++) light[i][c] += weight[i] / sum * m->value / e->full_scale[0];
}

/* Merges pixel p. Returns whether a channel is saturated in all exposures. */
static bool merge_pixel(const struct exposure_set *e, size_t p, struct image *variance, double (*light)[3])
{
    const size_t brief = shortest(e->n, e->t_s);
    bool saturated = false;
    for (size_t c = 0; c < 3; c++) {
        double y[EXPOSURE_MAX];
        for (size_t i = 0; i < e->n; i++) y[i] = exposure_sample_dn(e, i, 3 * p + c);
        struct merged_sample m = exposure_merge(exposure_noise(e, c), e->n, e->t_s, y, 2);
        const bool lost = m.n_used == 0;
        if (lost) m.value = (double)e->image[brief]->pixel[3 * p + c] * e->full_scale[brief] / e->t_s[brief];
        if (!lost && light != NULL) add_light(e, c, y, &m, light);
        saturated = saturated || lost;
        if (variance != NULL)
            variance->pixel[3 * p + c] = lost ? 0.0f : (float)(m.se * m.se / (e->full_scale[0] * e->full_scale[0]));
        e->image[0]->pixel[3 * p + c] = (float)(m.value / e->full_scale[0]);
    }
    return saturated;
}

status exposure_merge_images(const struct exposure_set *e, struct image *variance, struct exposure_light *light,
                             double *saturated_share, struct error *err)
{
    size_t n_saturated = 0;
    double *sum = calloc(2 * (e->width + 1) * (e->height + 1), sizeof *sum);
    if (sum == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot merge exposures: out of memory");
    if (e->n > 1) leave_out_all_near_saturation(e, sum);
    free(sum);
    for (size_t y = 0; y < e->height; y++)
        for (size_t x = 0; x < e->width; x++) {
            const size_t *r = light != NULL ? light->region : NULL;
            const bool inside = r != NULL && x >= r[0] && y >= r[1] && x < r[2] && y < r[3];
            n_saturated += merge_pixel(e, y * e->width + x, variance, inside ? light->light : NULL);
        }
    for (size_t i = 0; light != NULL && i < 3 * e->n; i++)
        light->light[i / 3][i % 3] /=
            (double)((light->region[2] - light->region[0]) * (light->region[3] - light->region[1]));
    *saturated_share = (double)n_saturated / (double)(e->width * e->height);
    return STATUS_OK;
}
