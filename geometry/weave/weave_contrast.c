#include "geometry/weave/weave_contrast.h"

#include "geometry/vision/vision_texture.h"

#include <math.h>
#include <stdlib.h>

static const double SCALE[WEAVE_SCALES] = {0.5, 1.0, 2.0};
/* Standard deviation of the finer Gaussian of a band, and of the local mean, over the scale and the period. */
static const double BAND = 0.125, LOCAL_MEAN = 2.0;

struct planes {
    float *fine, *coarse, *mean;
};

static double relative_sd(const struct planes *p, size_t width, size_t height, size_t margin)
{
    double sum = 0.0, square = 0.0, n = 0.0;
    for (size_t y = margin; y + margin < height; y++)
        for (size_t x = margin; x + margin < width; x++) {
            size_t i = y * width + x;
            if (!(p->mean[i] > 0.0f)) continue;
            double v = ((double)p->fine[i] - (double)p->coarse[i]) / (double)p->mean[i];
            sum += v;
            square += v * v;
            n += 1.0;
        }
    return n > 0.0 ? sqrt(fmax(0.0, square / n - sum / n * (sum / n))) : 0.0;
}

static status measure(const float *grey, size_t width, size_t height, double period_px, struct planes *p,
                      double contrast[WEAVE_SCALES], struct error *err)
{
    size_t margin = (size_t)ceil(2.0 * period_px);
    status s = vision_smooth(grey, width, height, LOCAL_MEAN * period_px, p->mean, err);
    for (int k = 0; s == STATUS_OK && k < WEAVE_SCALES; k++) {
        double sigma_px = BAND * SCALE[k] * period_px;
        s = vision_smooth(grey, width, height, sigma_px, p->fine, err);
        if (s == STATUS_OK) s = vision_smooth(grey, width, height, 2.0 * sigma_px, p->coarse, err);
        if (s == STATUS_OK) contrast[k] = relative_sd(p, width, height, margin);
    }
    return s;
}

status weave_contrast(const float *grey, size_t width, size_t height, double period_px, double contrast[WEAVE_SCALES],
                      struct error *err)
{
    size_t least = width < height ? width : height;
    if (!(period_px >= 2.0 && period_px * 8.0 <= (double)least))
        return error_set(
            err, STATUS_INVALID,
            "cannot measure the contrast of %zu x %zu pixels at a period of %.4g pixels: it takes 2 pixels "
            "at least, and 8 periods in the picture",
            width, height, period_px);
    size_t bytes = width * height * sizeof(float);
    struct planes p = {malloc(bytes), malloc(bytes), malloc(bytes)};
    status s = p.fine != NULL && p.coarse != NULL && p.mean != NULL
                   ? measure(grey, width, height, period_px, &p, contrast, err)
                   : error_set(err, STATUS_NO_MEMORY, "cannot measure contrast: out of memory");
    free(p.fine);
    free(p.coarse);
    free(p.mean);
    return s;
}

/* Energy of the bands' response to one bright pixel in the middle of a picture of edge x edge pixels that was blurred
 * before. */
static status impulse_energy(struct planes *p, size_t edge, double blur_px, double period_px,
                             double square[WEAVE_SCALES], struct error *err)
{
    size_t n = edge * edge;
    status s = STATUS_OK;
    for (size_t i = 0; i < n; i++) p->mean[i] = p->fine[i] = i == edge / 2 * edge + edge / 2 ? 1.0f : 0.0f;
    if (blur_px > 0.0) s = vision_smooth(p->fine, edge, edge, blur_px, p->mean, err);
    for (int k = 0; k < WEAVE_SCALES && s == STATUS_OK; k++) {
        double sigma_px = BAND * SCALE[k] * period_px;
        s = vision_smooth(p->mean, edge, edge, sigma_px, p->fine, err);
        if (s == STATUS_OK) s = vision_smooth(p->mean, edge, edge, 2.0 * sigma_px, p->coarse, err);
        square[k] = 0.0;
        for (size_t i = 0; i < n; i++) square[k] += pow((double)p->fine[i] - (double)p->coarse[i], 2.0);
    }
    return s;
}

status weave_contrast_noise(double relative_var, double blur_px, double period_px, double square[WEAVE_SCALES],
                            struct error *err)
{
    if (!(period_px >= 2.0 && period_px < 1000.0 && blur_px >= 0.0 && blur_px < 100.0))
        return error_set(err, STATUS_INVALID, "cannot state the noise of contrast at a period of %.4g pixels",
                         period_px);
    size_t edge = (size_t)ceil(4.0 * period_px + 12.0 * blur_px) + 16, bytes = edge * edge * sizeof(float);
    struct planes p = {malloc(bytes), malloc(bytes), malloc(bytes)};
    status s = p.fine != NULL && p.coarse != NULL && p.mean != NULL
                   ? impulse_energy(&p, edge, blur_px, period_px, square, err)
                   : error_set(err, STATUS_NO_MEMORY, "cannot measure contrast: out of memory");
    for (int k = 0; k < WEAVE_SCALES && s == STATUS_OK; k++) square[k] *= relative_var;
    free(p.fine);
    free(p.coarse);
    free(p.mean);
    return s;
}

status weave_look_measure(const float *rgb, size_t width, size_t height, double period_px, struct weave_look *look,
                          struct error *err)
{
    size_t n = width * height;
    float *grey = malloc(n * sizeof *grey);
    if (grey == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure contrast: out of memory");
    for (int c = 0; c < 3; c++) look->mean_rgb[c] = 0.0;
    for (size_t i = 0; i < n; i++) {
        grey[i] = (rgb[3 * i] + rgb[3 * i + 1] + rgb[3 * i + 2]) / 3.0f;
        for (size_t c = 0; c < 3; c++) look->mean_rgb[c] += (double)rgb[3 * i + c] / (double)n;
    }
    status s = weave_contrast(grey, width, height, period_px, look->contrast, err);
    free(grey);
    return s;
}

static double relative_rms(const double *a, const double *b, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) sum += (a[i] / b[i] - 1.0) * (a[i] / b[i] - 1.0);
    return sqrt(sum / (double)n);
}

double weave_color_error(const struct weave_look *rendering, const struct weave_look *photograph)
{
    return relative_rms(rendering->mean_rgb, photograph->mean_rgb, 3);
}

double weave_contrast_error(const struct weave_look *rendering, const struct weave_look *photograph)
{
    return relative_rms(rendering->contrast, photograph->contrast, WEAVE_SCALES);
}
