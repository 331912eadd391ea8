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

struct exposure_set {
    const struct noise_record *noise; /* NULL: none */
    size_t n, width, height;
    const double *t_s, *full_scale;
    struct image *const *image;
};

static const struct noise_channel *channel_noise(const struct exposure_set *e, size_t c)
{
    static const struct noise_channel none = {0};
    return e->noise != NULL ? &e->noise->channel[c] : &none;
}

/* Sample p of exposure i in DN, NaN where it is saturated. */
static double sample_dn(const struct exposure_set *e, size_t i, size_t p)
{
    double v = (double)e->image[i]->pixel[p];
    return v >= 1.0 && e->full_scale[i] != 1.0 ? NAN : v * e->full_scale[i];
}

/* Sums over rectangles that begin in the upper left corner, of light and time of the exposures that are shorter than
 * exposure i: sum[2 ((y + 1) (width + 1) + x + 1)]. */
static void sum_shorter(const struct exposure_set *e, size_t i, size_t c, double *sum)
{
    const struct noise_channel *k = channel_noise(e, c);
    const size_t stride = 2 * (e->width + 1);
    for (size_t y = 0; y < e->height; y++)
        for (size_t x = 0; x < e->width; x++) {
            double own[2] = {0.0, 0.0}, *to = sum + (y + 1) * stride + 2 * (x + 1);
            for (size_t j = 0; j < e->n; j++) {
                if (!(e->t_s[j] < e->t_s[i])) continue;
                double dn = sample_dn(e, j, 3 * (y * e->width + x) + c);
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
    const struct noise_channel *k = channel_noise(e, c);
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

/* Returns the light of exposure i over the other exposures' prediction for the same samples; NaN where there is too
 * little of it. */
static double light_ratio(const struct exposure_set *e, size_t i)
{
    static const double least_share = 0.005, most_share = 0.9; /* of the full scale */
    const size_t n_sample = 3 * e->width * e->height;
    double own = 0.0, predicted = 0.0;
    for (size_t p = 0; p < n_sample; p++) {
        const struct noise_channel *k = channel_noise(e, p % 3);
        double light = 0.0, time_s = 0.0, here = NAN;
        for (size_t j = 0; j < e->n; j++) {
            if ((double)e->image[j]->pixel[p] >= most_share) continue;
            const double dn = sample_dn(e, j, p) - k->read_mean - e->t_s[j] * k->dark_mean;
            if (j == i)
                here = dn;
            else
                light += dn, time_s += e->t_s[j];
        }
        if (isnan(here) || !(time_s > 0.0)) continue;
        own += here;
        predicted += light / time_s * e->t_s[i];
    }
    const double least = least_share * e->full_scale[i] * (double)n_sample, most = fmax(own, predicted);
    return most > least ? fmax(own, 1e-3 * most) / fmax(predicted, 1e-3 * most) : NAN;
}

status exposure_check_agreement(const struct noise_record *noise, size_t n, const double *t_s, const double *full_scale,
                                struct image *const *exposure, const char *const *name, struct error *err)
{
    static const double most = 1.25;
    const struct exposure_set e = {noise, n, exposure[0]->width, exposure[0]->height, t_s, full_scale, exposure};
    double farthest = 0.0, ratio_there = 1.0;
    size_t worst = 0;
    for (size_t i = 0; n > 1 && i < n; i++) {
        const double ratio = light_ratio(&e, i);
        if (isnan(ratio) || fabs(log(ratio)) <= farthest) continue;
        farthest = fabs(log(ratio));
        ratio_there = ratio;
        worst = i;
    }
    if (farthest <= log(most)) return STATUS_OK;
    return error_set(err, STATUS_INVALID,
                     "cannot merge the exposures of '%s': '%s' has %.2g times the light that the others and the "
                     "exposure times predict: check 'exposure_s', and that all show the same view in the same light",
                     name[0], name[worst], ratio_there);
}

status exposure_merge_images(const struct noise_record *noise, size_t n, const double *t_s, const double *full_scale,
                             struct image *const *exposure, struct image *variance, double *saturated_share,
                             struct error *err)
{
    const struct exposure_set e = {noise, n, exposure[0]->width, exposure[0]->height, t_s, full_scale, exposure};
    const size_t n_pixel = e.width * e.height, brief = shortest(n, t_s);
    size_t n_saturated = 0;
    double *sum = calloc(2 * (e.width + 1) * (e.height + 1), sizeof *sum);
    if (sum == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot merge exposures: out of memory");
    if (n > 1) leave_out_all_near_saturation(&e, sum);
    free(sum);
    for (size_t p = 0; p < n_pixel; p++) {
        bool saturated = false;
        for (size_t c = 0; c < 3; c++) {
            double y[EXPOSURE_MAX];
            for (size_t i = 0; i < n; i++) y[i] = sample_dn(&e, i, 3 * p + c);
            struct merged_sample m = exposure_merge(channel_noise(&e, c), n, t_s, y, 2);
            bool lost = m.n_used == 0;
            if (lost) m.value = (double)exposure[brief]->pixel[3 * p + c] * full_scale[brief] / t_s[brief];
            saturated = saturated || lost;
            if (variance != NULL)
                variance->pixel[3 * p + c] = lost ? 0.0f : (float)(m.se * m.se / (full_scale[0] * full_scale[0]));
            exposure[0]->pixel[3 * p + c] = (float)(m.value / full_scale[0]);
        }
        n_saturated += saturated;
    }
    *saturated_share = (double)n_saturated / (double)n_pixel;
    return STATUS_OK;
}
