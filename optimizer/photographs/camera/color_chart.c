#include "optimizer/photographs/camera/color_chart.h"

#include "base/option_id.h"
#include "geometry/vision/vision_chart.h"
#include "optimizer/photographs/camera/color_matrix.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Edge of a patch and the gap between patches, in the unit of OpenCV's model of the chart. */
static const double patch = 2.5, gap = 0.25;
static const double middle = 0.5; /* share of a patch's edge that is averaged */
enum { SAMPLES = 24, PARTS = 4, PICTURE_PATCH_PX = 60, LEAST_PATCH_PX = 6 };
static const double warn_delta_e = 4.0, refuse_delta_e = 6.0; /* means of CIEDE2000 */
static const double other_edition_share = 0.7; /* of the difference of the declared one, below which it fits better */
static const double warn_light = 0.1;

/* ---- where it is ---- */

/* Projective map of the unit square to four points (Heckbert 1989, section 2.2.3). */
void color_chart_place(const double p[8], double u, double v, double at[2])
{
    double sx = p[0] - p[2] + p[4] - p[6], sy = p[1] - p[3] + p[5] - p[7];
    double dx1 = p[2] - p[4], dx2 = p[6] - p[4], dy1 = p[3] - p[5], dy2 = p[7] - p[5];
    double det = dx1 * dy2 - dx2 * dy1, g = (sx * dy2 - dx2 * sy) / det, h = (dx1 * sy - sx * dy1) / det;
    double w = g * u + h * v + 1.0;
    at[0] = ((p[2] - p[0] + g * p[2]) * u + (p[6] - p[0] + h * p[6]) * v + p[0]) / w;
    at[1] = ((p[3] - p[1] + g * p[3]) * u + (p[7] - p[1] + h * p[7]) * v + p[1]) / w;
}

static int compare_float(const void *a, const void *b)
{
    float x, y;
    memcpy(&x, a, sizeof x);
    memcpy(&y, b, sizeof y);
    return x < y ? -1 : x > y;
}

/* The value that becomes white in the picture for the search: the 99th percentile of a sample of all channels. */
static double bright_value(const struct image *im)
{
    enum { N = 4096 };
    float value[N];
    size_t n = im->width * im->height * 3;
    for (size_t i = 0; i < N; i++) value[i] = im->pixel[(size_t)((double)i / N * (double)n)];
    qsort(value, N, sizeof *value, compare_float);
    return (double)value[N * 99 / 100];
}

static uint8_t encoded(double v)
{
    v = fmin(fmax(v, 0.0), 1.0);
    v = v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1.0 / 2.4) - 0.055;
    return (uint8_t)lrint(255.0 * v);
}

/* The margin that OpenCV's model has around the patches is taken off. */
static void shrink_to_patches(double corner[8])
{
    double own[8], width = 6.0 * patch + 7.0 * gap, height = 4.0 * patch + 5.0 * gap;
    for (size_t i = 0; i < 4; i++) {
        double u = i == 0 || i == 3 ? gap / width : 1.0 - gap / width, v = i < 2 ? gap / height : 1.0 - gap / height;
        color_chart_place(corner, u, v, own + 2 * i);
    }
    memcpy(corner, own, sizeof own);
}

status color_chart_find(const struct image *im, double corner_px[8], bool *found, struct error *err)
{
    size_t n = im->width * im->height * 3;
    *found = false;
    if (!isnan(corner_px[0])) return STATUS_OK;
    uint8_t *rgb = malloc(n);
    if (rgb == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot look for a color chart: out of memory");
    double bright = bright_value(im);
    for (size_t i = 0; i < n; i++) rgb[i] = bright > 0.0 ? encoded((double)im->pixel[i] / bright) : 0;
    status s = vision_find_chart(rgb, im->width, im->height, corner_px, err);
    free(rgb);
    if (s != STATUS_OK) return s;
    shrink_to_patches(corner_px);
    *found = true;
    return STATUS_OK;
}

/* ---- its colors ---- */

/* Point (u, v) in [0, 1]^2 of patch i. */
static void place_in_patch(const double corner_px[8], size_t i, double u, double v, double at[2])
{
    double width = 6.0 * patch + 5.0 * gap, height = 4.0 * patch + 3.0 * gap;
    double x = (double)(i % COLOR_CHART_COLUMNS) * (patch + gap) + u * patch;
    double y = (double)(i / COLOR_CHART_COLUMNS) * (patch + gap) + v * patch;
    color_chart_place(corner_px, x / width, y / height, at);
}

static const float *pixel_at(const struct image *im, const double at[2])
{
    if (!(at[0] >= 0.0 && at[1] >= 0.0 && at[0] < (double)im->width && at[1] < (double)im->height)) return NULL;
    return im->pixel + 3 * ((size_t)at[1] * im->width + (size_t)at[0]);
}

/* part: sums over parts of patch i. */
static void set_variance(struct color_chart *k, size_t i, const double (*part)[3])
{
    const double n = PARTS * PARTS, n_sample = SAMPLES * SAMPLES / n;
    for (size_t c = 0; c < 3; c++) {
        double sum = 0.0;
        for (size_t j = 0; j < PARTS * PARTS; j++) sum += pow(part[j][c] / n_sample - k->measured_rgb[i][c], 2.0);
        k->patch_var[i][c] = sum / (n * (n - 1.0));
    }
}

static status measure_patch(struct color_chart *k, const struct image *im, size_t i, double saturation,
                            struct error *err)
{
    double sum[3] = {0}, part[PARTS * PARTS][3] = {{0}};
    k->saturated[i] = false;
    for (size_t j = 0; j < SAMPLES * SAMPLES; j++) {
        double at[2], u = ((double)(j % SAMPLES) + 0.5) / SAMPLES - 0.5,
                      v = ((double)(j / SAMPLES) + 0.5) / SAMPLES - 0.5;
        place_in_patch(k->corner_px, i, 0.5 + middle * u, 0.5 + middle * v, at);
        const float *p = pixel_at(im, at);
        if (p == NULL)
            return error_set(err, STATUS_INVALID, "its patch %zu lies outside of the picture, at (%.0f, %.0f)", i + 1,
                             at[0], at[1]);
        for (size_t c = 0; c < 3; c++) {
            sum[c] += (double)p[c];
            part[j / SAMPLES * PARTS / SAMPLES * PARTS + j % SAMPLES * PARTS / SAMPLES][c] += (double)p[c];
            if ((double)p[c] >= saturation) k->saturated[i] = true;
        }
    }
    for (size_t c = 0; c < 3; c++) {
        k->measured_rgb[i][c] = sum[c] / (SAMPLES * SAMPLES);
        if (!(sum[c] > 0.0)) k->saturated[i] = true; /* cut off at black, as colors outside of sRGB are */
    }
    set_variance(k, i, (const double(*)[3])part);
    return STATUS_OK;
}

/* Place of point (u, v) of patch i: from -1 to 1 along the chart's length, in the same unit along its height. */
static void place_on_chart(size_t i, double place[2])
{
    const double width = 6.0 * patch + 5.0 * gap, height = 4.0 * patch + 3.0 * gap;
    place[0] = 2.0 * (((double)(i % COLOR_CHART_COLUMNS)) * (patch + gap) + 0.5 * patch) / width - 1.0;
    place[1] = (2.0 * ((double)(i / COLOR_CHART_COLUMNS) * (patch + gap) + 0.5 * patch) - height) / width;
}

/* Finds the place of a pixel on the chart by Newton's method, which starts at the middle. Returns false where the pixel
 * lies far off the chart. */
static bool pixel_to_chart(const double corner_px[8], const double at_px[2], double place[2])
{
    static const double step = 1e-4;
    const double width = 6.0 * patch + 5.0 * gap, height = 4.0 * patch + 3.0 * gap;
    double uv[2] = {0.5, 0.5};
    for (int round = 0; round < 20; round++) {
        double here[2], right[2], down[2];
        color_chart_place(corner_px, uv[0], uv[1], here);
        color_chart_place(corner_px, uv[0] + step, uv[1], right);
        color_chart_place(corner_px, uv[0], uv[1] + step, down);
        const double a = (right[0] - here[0]) / step, b = (down[0] - here[0]) / step, c = (right[1] - here[1]) / step,
                     d = (down[1] - here[1]) / step, det = a * d - b * c, x = at_px[0] - here[0],
                     y = at_px[1] - here[1];
        uv[0] += (d * x - b * y) / det;
        uv[1] += (a * y - c * x) / det;
    }
    place[0] = 2.0 * uv[0] - 1.0;
    place[1] = (2.0 * uv[1] - 1.0) * height / width;
    return fabs(uv[0] - 0.5) <= 1.0 && fabs(uv[1] - 0.5) <= 1.0;
}

/* The patches that are not saturated, as the fit takes them. */
struct used_patches {
    double measured[COLOR_CHART_PATCHES][3], wanted[COLOR_CHART_PATCHES][3], var[COLOR_CHART_PATCHES][3],
        place[COLOR_CHART_PATCHES][2];
    size_t of[COLOR_CHART_PATCHES];
    struct chart_patches list;
};

static status use_patches(const struct color_chart *k, double cos_theta, struct used_patches *u, struct error *err)
{
    size_t n = 0;
    for (size_t i = 0; i < COLOR_CHART_PATCHES; i++) {
        if (k->saturated[i]) continue;
        u->of[n] = i;
        memcpy(u->var[n], k->patch_var[i], sizeof u->var[n]);
        memcpy(u->measured[n], k->measured_rgb[i], sizeof u->measured[n]);
        memcpy(u->wanted[n], k->wanted_rgb[i], sizeof u->wanted[n]);
        place_on_chart(i, u->place[n++]);
    }
    u->list = (struct chart_patches){n,
                                     (const double(*)[3])u->measured,
                                     (const double(*)[3])u->wanted,
                                     (const double(*)[3])u->var,
                                     (const double(*)[2])u->place,
                                     {0.0, 0.0},
                                     cos_theta};
    if (isnan(k->scale_at_px[0]) || pixel_to_chart(k->corner_px, k->scale_at_px, u->list.scale_at)) return STATUS_OK;
    return error_set(err, STATUS_INVALID, "the cloth's place (%g, %g) is more than half a chart away from the chart",
                     k->scale_at_px[0], k->scale_at_px[1]);
}

/* Difference of a radiance and the wanted one, as under a lamp that makes a perfect white 1. */
static double difference(const struct color_chart *k, size_t i, const double rgb[3], double cos_theta)
{
    double own[3], wanted[3];
    for (size_t c = 0; c < 3; c++) {
        own[c] = rgb[c] / cos_theta;
        wanted[c] = k->wanted_rgb[i][c] / cos_theta;
    }
    return color_delta_e_2000(own, wanted);
}

/* Sets the color differences. Saturated patches have none of the matrix of the others. */
static void compare(struct color_chart *k, const struct used_patches *u, double factor, double cos_theta)
{
    double least = INFINITY, most = 0.0;
    k->worst = u->of[0];
    for (size_t i = 0; i < COLOR_CHART_PATCHES; i++) {
        double before[3], after[3], place[2];
        place_on_chart(i, place);
        k->light[i] = chart_fit_light(&k->fit, place);
        least = fmin(least, k->light[i]);
        most = fmax(most, k->light[i]);
        color_matrix_apply(k->fit.matrix, k->measured_rgb[i], after);
        for (size_t c = 0; c < 3; c++) {
            before[c] = k->measured_rgb[i][c] * factor / k->light[i];
            after[c] /= k->light[i];
        }
        k->delta_e_before[i] = difference(k, i, before, cos_theta);
        k->delta_e_after[i] = k->delta_e_left_out[i] = difference(k, i, after, cos_theta);
    }
    for (size_t j = 0; j < u->list.n; j++) {
        double rgb[3];
        if (!chart_fit_left_out(&u->list, j, rgb)) continue;
        k->delta_e_left_out[u->of[j]] = difference(k, u->of[j], rgb, cos_theta);
        if (k->delta_e_left_out[u->of[j]] > k->delta_e_left_out[k->worst]) k->worst = u->of[j];
    }
    k->light_range = least > 0.0 ? most / least - 1.0 : INFINITY;
}

double color_chart_mean(const double delta_e[COLOR_CHART_PATCHES])
{
    double sum = 0.0;
    for (size_t i = 0; i < COLOR_CHART_PATCHES; i++) sum += delta_e[i] / COLOR_CHART_PATCHES;
    return sum;
}

static status judge(const struct color_chart *k, const struct warning_sink *warn, struct error *err)
{
    const double left_out = color_chart_mean(k->delta_e_left_out), before = color_chart_mean(k->delta_e_before);
    const double mean = fmin(left_out, k->matrix_used ? left_out : before);
    if (!(mean <= refuse_delta_e))
        return error_set(err, STATUS_INVALID,
                         "its colors are not those of a ColorChecker: by the matrix of the other patches each differs "
                         "by %.1f (CIEDE2000) in the mean, '%s' by %.0f; check the order of the corners, shadows, "
                         "reflections and the edition; for a chart of another maker give its colors ('reference')",
                         mean, color_chart_patch_name(k->worst), k->delta_e_left_out[k->worst]);
    if (mean > warn_delta_e)
        warning_send(warn, OPTION_COLOR_CHART,
                     "by the matrix of the other patches each patch of the color chart differs by %.1f (CIEDE2000) in "
                     "the mean, '%s' by %.0f, where a good photograph has 0.2 to 3: check the edition, shadows and "
                     "reflections",
                     mean, color_chart_patch_name(k->worst), k->delta_e_left_out[k->worst]);
    else if (k->delta_e_left_out[k->worst] > refuse_delta_e)
        warning_send(warn, OPTION_COLOR_CHART,
                     "patch '%s' of the color chart differs by %.0f (CIEDE2000) from the matrix of the other patches, "
                     "which differ by %.1f in the mean: look for a shadow or a reflection there",
                     color_chart_patch_name(k->worst), k->delta_e_left_out[k->worst], left_out);
    if (!k->matrix_used && left_out > before + 0.5)
        warning_send(warn, OPTION_COLOR_CHART,
                     "the matrix of the color chart makes colors worse (CIEDE2000 %.1f in the mean, %.1f without it) "
                     "and is not used: one factor applies to all channels",
                     left_out, before);
    if (k->light_range > warn_light)
        warning_send(warn, OPTION_COLOR_CHART,
                     "the lamp's light falls by %.0f %% over the color chart, which is corrected; the scale holds %s",
                     100.0 * (1.0 - 1.0 / (1.0 + k->light_range)),
                     isnan(k->scale_at_px[0]) ? "in its middle" : "at 'cloth_px'");
    return STATUS_OK;
}

/* Fits matrix and light. */
static status fit(struct color_chart *k, double cos_theta, struct error *err)
{
    struct used_patches u;
    status s = use_patches(k, cos_theta, &u, err);
    if (s == STATUS_OK) s = chart_fit_patches(&u.list, &k->fit, err);
    if (s != STATUS_OK) return s;
    const double factor = chart_fit_factor(&u.list, &k->fit);
    compare(k, &u, factor, cos_theta);
    k->matrix_used = color_chart_mean(k->delta_e_left_out) <= color_chart_mean(k->delta_e_before);
    if (!k->matrix_used) { /* the covariance of the matrix stays: the factor is at least as good */
        for (size_t j = 0; j < 9; j++) k->fit.matrix[j] = j % 4 == 0 ? factor : 0.0;
        memcpy(k->delta_e_after, k->delta_e_before, sizeof k->delta_e_after);
    }
    return STATUS_OK;
}

static void set_wanted(struct color_chart *k, double cos_theta)
{
    k->white = 0;
    for (size_t i = 0; i < COLOR_CHART_PATCHES; i++) {
        if (k->reference != NULL)
            memcpy(k->wanted_rgb[i], k->reference[i], sizeof k->wanted_rgb[i]);
        else
            color_chart_reference(k->from_2014, i, k->wanted_rgb[i]);
        for (size_t c = 0; c < 3; c++) k->wanted_rgb[i][c] *= cos_theta;
        if (k->wanted_rgb[i][1] > k->wanted_rgb[k->white][1]) k->white = i;
    }
}

/* Warns where the colors of the other edition fit clearly better: the wrong one makes a radiance wrong by up to
 * 7 %, and differ by 1 in the mean, as a good photograph does. */
static void check_edition(const struct color_chart *k, double cos_theta, const struct warning_sink *warn)
{
    struct color_chart other = *k;
    other.from_2014 = !k->from_2014;
    if (k->reference != NULL) return;
    set_wanted(&other, cos_theta);
    if (fit(&other, cos_theta, NULL) != STATUS_OK) return;
    const double own = color_chart_mean(k->delta_e_left_out), of_other = color_chart_mean(other.delta_e_left_out);
    if (of_other < other_edition_share * own)
        warning_send(warn, OPTION_COLOR_CHART,
                     "the colors of a chart made %s November 2014 fit better (CIEDE2000 %.1f in the mean, %.1f as "
                     "declared): check 'edition'",
                     other.from_2014 ? "since" : "before", of_other, own);
}

static status check_size(const double corner_px[8], struct error *err)
{
    double at[3][2];
    place_in_patch(corner_px, 0, 0.0, 0.0, at[0]);
    place_in_patch(corner_px, 0, 1.0, 0.0, at[1]);
    place_in_patch(corner_px, 0, 0.0, 1.0, at[2]);
    double edge =
        fmin(hypot(at[1][0] - at[0][0], at[1][1] - at[0][1]), hypot(at[2][0] - at[0][0], at[2][1] - at[0][1]));
    if (edge >= LEAST_PATCH_PX) return STATUS_OK;
    return error_set(err, STATUS_INVALID, "its patches are only %.1f pixels wide: %d are needed", edge, LEAST_PATCH_PX);
}

status color_chart_measure(struct color_chart *k, const struct image *im, double saturation, double light_theta_rad,
                           const struct warning_sink *warn, struct error *err)
{
    const double cos_theta = cos(light_theta_rad);
    status s = check_size(k->corner_px, err);
    set_wanted(k, cos_theta);
    for (size_t i = 0; i < COLOR_CHART_PATCHES && s == STATUS_OK; i++) s = measure_patch(k, im, i, saturation, err);
    if (s != STATUS_OK) return s;
    if (k->saturated[k->white])
        return error_set(err, STATUS_INVALID, "its white patch is saturated: expose for less light");
    s = fit(k, cos_theta, err);
    if (s == STATUS_OK) s = judge(k, warn, err);
    if (s == STATUS_OK) check_edition(k, cos_theta, warn);
    return s;
}

status color_chart_picture(const struct color_chart *k, const struct image *im, struct image *picture,
                           struct error *err)
{
    const double width = 6.0 * patch + 5.0 * gap, height = 4.0 * patch + 3.0 * gap;
    size_t w = (size_t)(width / patch * PICTURE_PATCH_PX), h = (size_t)(height / patch * PICTURE_PATCH_PX);
    status s = image_init(picture, w, h, 3, err);
    for (size_t y = 0; y < h && s == STATUS_OK; y++)
        for (size_t x = 0; x < w; x++) {
            double u = ((double)x + 0.5) / (double)w, v = ((double)y + 0.5) / (double)h, at[2], rgb[3] = {0};
            double in_x = fmod(u * width, patch + gap) / patch, in_y = fmod(v * height, patch + gap) / patch;
            size_t i = (size_t)(v * height / (patch + gap)) * COLOR_CHART_COLUMNS + (size_t)(u * width / (patch + gap));
            color_chart_place(k->corner_px, u, v, at);
            const float *p = pixel_at(im, at);
            if (fabs(in_x - 0.5) < 0.2 && fabs(in_y - 0.5) < 0.2)
                memcpy(rgb, k->wanted_rgb[i], sizeof rgb);
            else if (p != NULL)
                color_matrix_apply(k->fit.matrix, (double[3]){(double)p[0], (double)p[1], (double)p[2]}, rgb);
            for (size_t c = 0; c < 3; c++) picture->pixel[3 * (y * w + x) + c] = (float)rgb[c];
        }
    return s;
}
