#include "renderer/preview/joint_filter.h"
#include "renderer/preview/feature_image.h"
#include "renderer/preview/window_regression.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_RGB = 3, N_SCALE = 3, ERROR_REACH = 6, NOISE_REACH = 2, DEPTH_REACH = 12, N_FROM_FEATURE = N_FEATURE };
/* Pixels of a cell of the windows, which have 9 x 9 cells. */
static const size_t scale_cell[N_SCALE] = {1, 2, 4};

struct run {
    const struct joint_input *in;
    const struct progress *progress;
    size_t width, height, n; /* n: pixels */
    float *block;            /* all planes below */
    struct regression_input planes;
    float *fitted[REGRESSION_VALUE]; /* of the scale under way; then its squared errors and the part that is noise */
    float *shown[N_RGB];             /* light other than early light, of the scale under way */
    float *sum[N_RGB], *error[N_RGB], *weight; /* of all scales: light and its squared error, times weights */
    float *noise[N_RGB];                       /* squared, of the mean of both halves */
    float *early_noise[N_RGB];                 /* squared, of early light; 0 without it */
    float *temporary;
    float *scratch; /* regression_scratch() of each thread */
    double unit;    /* of squared errors */
    size_t cell;
};

enum { N_PLANE = REGRESSION_GUIDE + 2 * REGRESSION_VALUE + 5 * N_RGB + 2 };

static const float *pixel_of(const struct image *im, size_t i) { return im->pixel + i * im->n_channel; }

/* ---- planes ---- */

static void set_planes(struct run *r)
{
    float *at = r->block;
    for (size_t k = 0; k < REGRESSION_GUIDE; k++, at += r->n) r->planes.guide[k] = at;
    for (size_t k = 0; k < REGRESSION_VALUE; k++, at += r->n) r->planes.value[k] = at;
    for (size_t k = 0; k < REGRESSION_VALUE; k++, at += r->n) r->fitted[k] = at;
    for (size_t c = 0; c < N_RGB; c++, at += 5 * r->n) {
        r->shown[c] = at;
        r->sum[c] = at + r->n;
        r->error[c] = at + 2 * r->n;
        r->noise[c] = at + 3 * r->n;
        r->early_noise[c] = at + 4 * r->n;
    }
    r->weight = at;
    r->temporary = at + r->n;
}

/* Brings a plane to mean 0 and variance 1; one that hardly varies becomes 0. */
static void standardise(float *plane, size_t n)
{
    double sum = 0, square = 0;
    for (size_t i = 0; i < n; i++) {
        sum += (double)plane[i];
        square += (double)plane[i] * (double)plane[i];
    }
    const double mean = sum / (double)n, variance = square / (double)n - mean * mean;
    const double scale = variance > 1e-12 * (1.0 + mean * mean) ? 1.0 / sqrt(variance) : 0.0;
    for (size_t i = 0; i < n; i++) plane[i] = (float)(((double)plane[i] - mean) * scale);
}

static void fill_planes(struct run *r)
{
    const struct image *early = r->in->early;
    for (size_t i = 0; i < r->n; i++) {
        const float *feature = pixel_of(r->in->feature, i);
        for (size_t k = 0; k < N_FROM_FEATURE; k++) r->planes.guide[k][i] = feature[k];
        for (size_t c = 0; c < N_RGB; c++) {
            const float d = early != NULL ? pixel_of(early, i)[c] : 0;
            r->planes.guide[N_FROM_FEATURE + c][i] = d;
            for (size_t h = 0; h < 2; h++) r->planes.value[h * N_RGB + c][i] = pixel_of(r->in->half[h], i)[c] - d;
        }
    }
    /* how high a fiber lies beside its neighbours, and not the shape of the whole cloth */
    float *depth = r->planes.guide[FEATURE_DISTANCE];
    memcpy(r->fitted[0], depth, r->n * sizeof *depth);
    regression_box(r->fitted[0], r->width, r->height, DEPTH_REACH, r->temporary);
    for (size_t i = 0; i < r->n; i++) depth[i] -= r->fitted[0][i];
    for (size_t k = 0; k < REGRESSION_GUIDE; k++) standardise(r->planes.guide[k], r->n);
}

/* ---- scales ---- */

static void run_tile(void *context, size_t i_tile, size_t i_thread)
{
    struct run *r = context;
    const size_t edge = REGRESSION_TILE * r->cell, across = (r->width + edge - 1) / edge;
    if (progress_cancelled(r->progress)) return;
    regression_tile(&r->planes, r->cell, i_tile % across * edge, i_tile / across * edge,
                    r->scratch + i_thread * regression_scratch(), r->fitted);
}

static void spread(struct run *r, float *plane, size_t reach)
{
    for (int k = 0; k < 2; k++) regression_box(plane, r->width, r->height, reach, r->temporary);
}

/* Squared noise of the mean of both halves, around each pixel. */
static void find_noise(struct run *r)
{
    double square = 0;
    for (size_t c = 0; c < N_RGB; c++) {
        const float *a = r->planes.value[c], *b = r->planes.value[N_RGB + c];
        for (size_t i = 0; i < r->n; i++) {
            r->noise[c][i] = (a[i] - b[i]) * (a[i] - b[i]) / 4;
            square += (double)r->noise[c][i];
            r->early_noise[c][i] = r->in->early != NULL ? pixel_of(r->in->early, i)[N_RGB + c] : 0;
        }
        spread(r, r->noise[c], NOISE_REACH);
        spread(r, r->early_noise[c], NOISE_REACH);
    }
    r->unit = square > 0 ? square / (double)r->n : 1;
}

/* Adds a scale: its light, and the squared error around each pixel. With halves a, b and their filtered f, g,
 * E(f - b)^2 is the squared error of f and the variance of b, whose difference is known from (a - b)^2; averaging f and
 * g takes (f - g)^2 / 4, which is the least that the error can be. */
static void judge(struct run *r)
{
    for (size_t c = 0; c < N_RGB; c++) {
        const float *a = r->planes.value[c], *b = r->planes.value[N_RGB + c];
        float *error = r->fitted[c], *between = r->fitted[N_RGB + c];
        for (size_t i = 0; i < r->n; i++) {
            const float f = error[i], g = between[i], least = (f - g) * (f - g) / 4;
            const float fb = (f - b[i]) * (f - b[i]), ga = (g - a[i]) * (g - a[i]), ab = (a[i] - b[i]) * (a[i] - b[i]);
            r->shown[c][i] = (f + g) / 2;
            error[i] = (fb + ga - ab) / 2 - least;
            between[i] = least;
        }
        spread(r, error, ERROR_REACH);
        spread(r, between, ERROR_REACH);
    }
    for (size_t i = 0; i < r->n; i++) {
        float square[N_RGB];
        double all = 0;
        for (size_t c = 0; c < N_RGB; c++) {
            square[c] = fmaxf(r->fitted[c][i], r->fitted[N_RGB + c][i]);
            all += (double)square[c];
        }
        all = fmax(all / r->unit, 1e-7); /* nearly the scale with the least error, and no edges between scales */
        const float weight = (float)(1 / (all * all * all * all));
        r->weight[i] += weight;
        for (size_t c = 0; c < N_RGB; c++) {
            r->sum[c][i] += weight * r->shown[c][i];
            r->error[c][i] += weight * square[c];
        }
    }
}

static status run_scales(struct run *r, struct thread_pool *pool)
{
    memset(r->weight, 0, r->n * sizeof *r->weight);
    for (size_t c = 0; c < N_RGB; c++) {
        memset(r->sum[c], 0, r->n * sizeof *r->sum[c]);
        memset(r->error[c], 0, r->n * sizeof *r->error[c]);
    }
    find_noise(r);
    for (size_t s = 0; s < N_SCALE; s++) {
        r->cell = scale_cell[s];
        const size_t edge = REGRESSION_TILE * r->cell, across = (r->width + edge - 1) / edge,
                     down = (r->height + edge - 1) / edge;
        status st = thread_pool_run(pool, across * down, run_tile, r, r->progress);
        if (st == STATUS_OK && progress_cancelled(r->progress)) st = STATUS_CANCELLED;
        if (st != STATUS_OK) return st;
        judge(r);
    }
    return STATUS_OK;
}

/* ---- the picture ---- */

/* Blends a channel of a pixel with what is filtered so that the squared error that both are known to have is least: as
 * much of each as the other has error. Adds that error to *square. */
static float blended(const struct run *r, size_t i, size_t c, double *square)
{
    const float light = r->in->early != NULL ? pixel_of(r->in->early, i)[c] : 0;
    const float as_it_is = (r->planes.value[c][i] + r->planes.value[N_RGB + c][i]) / 2 + light;
    if (!(pixel_of(r->in->feature, i)[FEATURE_SEEN] > 0)) return as_it_is;
    const float filtered = fmaxf(r->sum[c][i] / r->weight[i], 0) + light,
                error = r->error[c][i] / r->weight[i] + r->early_noise[c][i], noise = r->noise[c][i];
    const float share = noise > 0 ? noise / (noise + error) : 0;
    *square += (double)(share * error);
    return fmaxf(share * filtered + (1 - share) * as_it_is, 0);
}

static void write_picture(const struct run *r, struct image *out, double *error)
{
    double square = 0, mean = 0;
    for (size_t i = 0; i < r->n; i++)
        for (size_t c = 0; c < N_RGB; c++) {
            const float value = blended(r, i, c, &square);
            out->pixel[i * N_RGB + c] = value;
            mean += (double)value;
        }
    mean /= (double)(N_RGB * r->n);
    *error = mean > 0 ? sqrt(square / (double)(N_RGB * r->n)) / mean : NAN;
}

static bool same_size(const struct image *a, const struct image *b)
{
    return a->width == b->width && a->height == b->height;
}

static status check(const struct joint_input *in, struct error *err)
{
    const bool fits = same_size(in->half[0], in->half[1]) && same_size(in->half[0], in->feature) &&
                      (in->early == NULL || same_size(in->half[0], in->early));
    if (fits && in->half[0]->n_channel >= N_RGB && in->half[1]->n_channel >= N_RGB &&
        (in->early == NULL || in->early->n_channel >= (size_t)2 * N_RGB) &&
        in->feature->n_channel == (size_t)2 * N_FEATURE)
        return STATUS_OK;
    return error_set(err, STATUS_INVALID, "cannot filter a picture of %zu channels by features of %zu",
                     in->half[0]->n_channel, in->feature->n_channel);
}

status joint_filter(const struct joint_input *in, struct thread_pool *pool, const struct progress *progress,
                    struct image *out, double *error, struct error *err)
{
    struct run r = {.in = in, .progress = progress, .width = in->half[0]->width, .height = in->half[0]->height};
    const size_t n_thread = pool != NULL ? thread_pool_n_thread(pool) : 1;
    memset(out, 0, sizeof *out);
    status s = check(in, err);
    if (s != STATUS_OK) return s;
    r.n = r.width * r.height;
    r.planes.width = r.width;
    r.planes.height = r.height;
    r.block = malloc(N_PLANE * r.n * sizeof *r.block);
    r.scratch = malloc(n_thread * regression_scratch() * sizeof *r.scratch);
    if (r.block == NULL || r.scratch == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot filter a picture: out of memory");
    if (s == STATUS_OK) s = image_init(out, r.width, r.height, N_RGB, err);
    if (s == STATUS_OK) {
        set_planes(&r);
        fill_planes(&r);
        s = run_scales(&r, pool);
        if (s == STATUS_OK)
            write_picture(&r, out, error);
        else
            error_set(err, s, "filtering was cancelled");
    }
    free(r.block);
    free(r.scratch);
    if (s != STATUS_OK) image_release(out);
    return s;
}
