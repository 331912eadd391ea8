#include "renderer/transport/environment.h"

#include "base/ranks/unique_number.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PIXEL = 1 << 26 };

struct environment {
    size_t width, height;
    float *radiance;         /* height x width x 3 */
    float *row_cdf;          /* height + 1 */
    float *column_cdf;       /* height x (width + 1) */
    uint64_t number;         /* that no other environment of this process has had */
    float pdf_per_luminance; /* density of a pixel per its luminance; 0: all black */
};

static float luminance(const float rgb[3]) { return 0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2]; }

static double row_solid_angle(const struct environment *e, size_t row)
{
    double a = M_PI * (double)row / (double)e->height, b = M_PI * (double)(row + 1) / (double)e->height;
    return (cos(a) - cos(b)) * 2 * M_PI;
}

/* Cumulative distribution; it is exactly 1 from the last entry with any luminance on. */
static void normalise(float *cdf, const double *sum, size_t n)
{
    for (size_t i = 0; i <= n; i++) cdf[i] = sum[n] > 0 ? (float)(sum[i] / sum[n]) : (float)i / (float)n;
}

static status make_tables(struct environment *e, struct error *err)
{
    size_t most = e->width > e->height ? e->width : e->height;
    double *row = calloc(e->height + 1, sizeof *row), *column = calloc(most + 1, sizeof *column);
    status st = STATUS_OK;
    if (row == NULL || column == NULL) {
        st = error_set(err, STATUS_NO_MEMORY, "cannot use environment: out of memory");
        goto out;
    }
    for (size_t i = 0; i < e->height; i++) {
        for (size_t j = 0; j < e->width; j++)
            column[j + 1] = column[j] + (double)luminance(e->radiance + 3 * (i * e->width + j));
        normalise(e->column_cdf + i * (e->width + 1), column, e->width);
        row[i + 1] = row[i] + column[e->width] / (double)e->width * row_solid_angle(e, i);
    }
    normalise(e->row_cdf, row, e->height);
    e->pdf_per_luminance = row[e->height] > 0 ? (float)(1 / row[e->height]) : 0;
out:
    free(row);
    free(column);
    return st;
}

static status copy_pixels(struct environment *e, const struct image *im, double scale, struct error *err)
{
    for (size_t i = 0; i < e->width * e->height; i++)
        for (size_t c = 0; c < 3; c++) {
            float v = (float)(scale * (double)im->pixel[i * im->n_channel + c]);
            if (!(v >= 0) || !isfinite(v))
                return error_set(err, STATUS_INVALID, "cannot use environment: pixel %zu, %zu is %g", i % e->width,
                                 i / e->width, (double)v);
            e->radiance[3 * i + c] = v;
        }
    return STATUS_OK;
}

/* Room for an image of a size that is allowed. */
static struct environment *make_room(size_t width, size_t height, struct error *err)
{
    struct environment *e = calloc(1, sizeof *e);
    if (e != NULL) {
        e->number = unique_number();
        e->width = width;
        e->height = height;
        e->radiance = malloc(3 * width * height * sizeof *e->radiance);
        e->row_cdf = malloc((height + 1) * sizeof *e->row_cdf);
        e->column_cdf = malloc(height * (width + 1) * sizeof *e->column_cdf);
        if (e->radiance != NULL && e->row_cdf != NULL && e->column_cdf != NULL) return e;
    }
    environment_free(e);
    error_set(err, STATUS_NO_MEMORY, "cannot use environment: no memory for %zu x %zu pixels", width, height);
    return NULL;
}

status environment_new(const struct image *im, double scale, struct environment **out, struct error *err)
{
    if (im->width == 0 || im->height == 0 || im->n_channel < 3 || im->width > MAX_PIXEL / im->height || !(scale > 0))
        return error_set(err, STATUS_INVALID, "cannot use environment: %zu x %zu pixels of %zu channels, scale %g",
                         im->width, im->height, im->n_channel, scale);
    struct environment *e = make_room(im->width, im->height, err);
    if (e == NULL) return STATUS_NO_MEMORY;
    status st = copy_pixels(e, im, scale, err);
    if (st == STATUS_OK) st = make_tables(e, err);
    if (st != STATUS_OK) {
        environment_free(e);
        return st;
    }
    *out = e;
    return STATUS_OK;
}

status environment_read_exr(const char *path, double scale, struct environment **out, struct error *err)
{
    struct image im = {0};
    status st = image_read_exr(&im, path, MAX_PIXEL, err);
    if (st == STATUS_OK) st = environment_new(&im, scale, out, err);
    image_release(&im);
    return st;
}

void environment_free(struct environment *e)
{
    if (e == NULL) return;
    free(e->radiance);
    free(e->row_cdf);
    free(e->column_cdf);
    free(e);
}

uint64_t environment_number(const struct environment *e) { return e->number; }

void environment_pack(const struct environment *e, struct byte_pack *p)
{
    BYTE_PACK(p, e->width);
    BYTE_PACK(p, e->height);
    byte_pack_put(p, e->radiance, 3 * e->width * e->height * sizeof *e->radiance);
}

status environment_unpack(struct byte_view *v, struct environment **out, struct error *err)
{
    size_t width, height;
    BYTE_VIEW(v, width);
    BYTE_VIEW(v, height);
    if (width == 0 || height == 0 || width > MAX_PIXEL / height)
        return error_set(err, STATUS_FORMAT, "an environment of another rank has %zu x %zu pixels", width, height);
    struct environment *e = make_room(width, height, err);
    if (e == NULL) return STATUS_NO_MEMORY;
    byte_view_get(v, e->radiance, 3 * width * height * sizeof *e->radiance);
    status st = byte_view_check(v, err);
    if (st == STATUS_OK) st = make_tables(e, err);
    if (st == STATUS_OK)
        *out = e;
    else
        environment_free(e);
    return st;
}

static size_t clamped(float x, size_t n)
{
    size_t i = x > 0 ? (size_t)x : 0;
    return i < n ? i : n - 1;
}

float environment_at(const struct environment *e, const float d[3], float radiance[3])
{
    float cos_theta = fminf(1, fmaxf(-1, d[2])), phi = atan2f(d[1], d[0]);
    if (phi < 0) phi += (float)(2 * M_PI);
    size_t row = clamped(acosf(cos_theta) * (float)M_1_PI * (float)e->height, e->height);
    size_t column = clamped(phi * (float)(0.5 * M_1_PI) * (float)e->width, e->width);
    memcpy(radiance, e->radiance + 3 * (row * e->width + column), 3 * sizeof *radiance);
    return luminance(radiance) * e->pdf_per_luminance;
}

/* Index of the interval of cdf[0..n] that holds u, and the relative position of u in it. */
static size_t find_interval(const float *cdf, size_t n, float u, float *share)
{
    size_t low = 0, high = n; /* cdf[low] <= u < cdf[high] */
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (cdf[middle] <= u)
            low = middle;
        else
            high = middle;
    }
    float width = cdf[low + 1] - cdf[low];
    *share = width > 0 ? (u - cdf[low]) / width : 0.5f;
    return low;
}

bool environment_sample(const struct environment *e, const float u[2], float d[3], float radiance[3], float *pdf_per_sr)
{
    if (!(e->pdf_per_luminance > 0)) return false;
    float y, x;
    size_t row = find_interval(e->row_cdf, e->height, u[0], &y);
    size_t column = find_interval(e->column_cdf + row * (e->width + 1), e->width, u[1], &x);
    memcpy(radiance, e->radiance + 3 * (row * e->width + column), 3 * sizeof *radiance);
    *pdf_per_sr = luminance(radiance) * e->pdf_per_luminance;
    if (!(*pdf_per_sr > 0)) return false; /* a black pixel between two bright ones, chosen by rounding */
    float top = cosf((float)M_PI * (float)row / (float)e->height),
          bottom = cosf((float)M_PI * (float)(row + 1) / (float)e->height);
    float phi = (float)(2 * M_PI) * ((float)column + x) / (float)e->width;
    d[2] = top + (bottom - top) * y;
    float sin_theta = sqrtf(fmaxf(0, 1 - d[2] * d[2]));
    d[0] = sin_theta * cosf(phi);
    d[1] = sin_theta * sinf(phi);
    return true;
}
