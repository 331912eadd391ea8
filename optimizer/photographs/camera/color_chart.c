#include "optimizer/photographs/camera/color_chart.h"

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
static const double largest_mean_delta_e = 12.0;

static const double reference_lab[2][COLOR_CHART_PATCHES][3] = {
    {
        /* made before November 2014 */
        {37.986, 13.555, 14.059},  {65.711, 18.130, 17.810},   {49.927, -4.880, -21.925}, {43.139, -13.095, 21.905},
        {55.112, 8.844, -25.399},  {70.719, -33.397, -0.199},  {62.661, 36.067, 57.096},  {40.020, 10.410, -45.964},
        {51.124, 48.239, 16.248},  {30.325, 22.976, -21.587},  {72.532, -23.709, 57.255}, {71.941, 19.363, 67.857},
        {28.778, 14.179, -50.297}, {55.261, -38.342, 31.370},  {42.101, 53.378, 28.190},  {81.733, 4.039, 79.819},
        {51.935, 49.986, -14.574}, {51.038, -28.631, -28.638}, {96.539, -0.425, 1.186},   {81.257, -0.638, -0.335},
        {66.766, -0.734, -0.504},  {50.867, -0.153, -0.270},   {35.656, -0.421, -1.231},  {20.461, -0.079, -0.973},
    },
    {
        /* made in November 2014 or later */
        {37.54, 14.37, 14.92},  {64.66, 19.27, 17.50},   {49.32, -3.82, -22.54}, {43.46, -12.74, 22.72},
        {54.94, 9.61, -24.79},  {70.48, -32.26, -0.37},  {62.73, 35.83, 56.50},  {39.43, 10.75, -45.17},
        {50.57, 48.64, 16.67},  {30.10, 22.54, -20.87},  {71.77, -24.13, 58.19}, {71.51, 18.24, 67.37},
        {28.37, 15.42, -49.80}, {54.38, -39.72, 32.27},  {42.43, 51.05, 28.62},  {81.80, 2.67, 80.41},
        {50.63, 51.28, -14.12}, {49.57, -29.71, -28.32}, {95.19, -1.03, 2.93},   {81.29, -0.57, 0.44},
        {66.89, -0.75, -0.06},  {50.76, -0.13, 0.14},    {35.63, -0.46, -0.48},  {20.64, 0.07, -0.46},
    },
};

static double from_lab(double f) { return f > 6.0 / 29.0 ? f * f * f : (116.0 * f - 16.0) * 27.0 / 24389.0; }

void color_chart_reference(bool from_2014, size_t i, double rgb[3])
{
    static const double white_d50[3] = {0.96422, 1.0, 0.82521};
    /* XYZ under D50 to linear sRGB, adapted by Bradford (Lindbloom) */
    static const double to_rgb[9] = {3.1338561, -1.6168667, -0.4906146, -0.9787684, 1.9161415,
                                     0.0334540, 0.0719453,  -0.2289914, 1.4052427};
    const double *lab = reference_lab[from_2014][i];
    double fy = (lab[0] + 16.0) / 116.0;
    double xyz[3] = {white_d50[0] * from_lab(fy + lab[1] / 500.0), white_d50[1] * from_lab(fy),
                     white_d50[2] * from_lab(fy - lab[2] / 200.0)};
    color_matrix_apply(to_rgb, xyz, rgb);
}

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
    for (size_t c = 0; c < 3; c++) k->measured_rgb[i][c] = sum[c] / (SAMPLES * SAMPLES);
    set_variance(k, i, (const double(*)[3])part);
    return STATUS_OK;
}

/* Fits the matrix to the patches that are not saturated. */
static status fit(struct color_chart *k, struct error *err)
{
    double measured[COLOR_CHART_PATCHES][3], wanted[COLOR_CHART_PATCHES][3], var[COLOR_CHART_PATCHES][3];
    size_t n = 0, white = 0;
    for (size_t i = 0; i < COLOR_CHART_PATCHES; i++) {
        if (k->saturated[i]) continue;
        if (i == COLOR_CHART_WHITE) white = n;
        memcpy(var[n], k->patch_var[i], sizeof var[n]);
        memcpy(measured[n], k->measured_rgb[i], sizeof measured[n]);
        memcpy(wanted[n++], k->wanted_rgb[i], sizeof wanted[0]);
    }
    status s = color_matrix_fit(n, (const double(*)[3])measured, (const double(*)[3])wanted, white, k->matrix, err);
    if (s == STATUS_OK)
        color_matrix_covariance(n, (const double(*)[3])measured, (const double(*)[3])wanted, white, k->matrix,
                                (const double(*)[3])var, k->matrix_cov);
    return s;
}

/* Color differences before and after, as under a lamp that makes a perfect white 1. Returns the mean one after. */
static double compare(struct color_chart *k, double cos_theta)
{
    double sum = 0.0, gain = k->wanted_rgb[COLOR_CHART_WHITE][1] / k->measured_rgb[COLOR_CHART_WHITE][1];
    for (size_t i = 0; i < COLOR_CHART_PATCHES; i++) {
        double before[3], after[3], wanted[3];
        color_matrix_apply(k->matrix, k->measured_rgb[i], after);
        for (size_t c = 0; c < 3; c++) {
            before[c] = k->measured_rgb[i][c] * gain / cos_theta;
            after[c] /= cos_theta;
            wanted[c] = k->wanted_rgb[i][c] / cos_theta;
        }
        k->delta_e_before[i] = color_delta_e_2000(before, wanted);
        k->delta_e_after[i] = color_delta_e_2000(after, wanted);
        sum += k->delta_e_after[i];
    }
    return sum / COLOR_CHART_PATCHES;
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
                           struct error *err)
{
    status s = check_size(k->corner_px, err);
    for (size_t i = 0; i < COLOR_CHART_PATCHES && s == STATUS_OK; i++) {
        color_chart_reference(k->from_2014, i, k->wanted_rgb[i]);
        for (size_t c = 0; c < 3; c++) k->wanted_rgb[i][c] *= cos(light_theta_rad);
        s = measure_patch(k, im, i, saturation, err);
    }
    if (s != STATUS_OK) return s;
    if (k->saturated[COLOR_CHART_WHITE])
        return error_set(err, STATUS_INVALID, "its white patch is saturated: expose for less light");
    s = fit(k, err);
    if (s != STATUS_OK) return s;
    double mean = compare(k, cos(light_theta_rad));
    if (mean <= largest_mean_delta_e) return STATUS_OK;
    return error_set(err, STATUS_INVALID,
                     "its colors are not those of a ColorChecker: after the matrix they differ by %.0f (CIEDE2000) in "
                     "the mean; check the order of the corners, shadows and reflections",
                     mean);
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
                color_matrix_apply(k->matrix, (double[3]){(double)p[0], (double)p[1], (double)p[2]}, rgb);
            for (size_t c = 0; c < 3; c++) picture->pixel[3 * (y * w + x) + c] = (float)rgb[c];
        }
    return s;
}
