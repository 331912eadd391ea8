#include "renderer/preview/joint_filter.h"
#include "renderer/preview/feature_image.h"
#include "renderer/preview/window_regression.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_RGB = 3, N_SCALE = 4, ERROR_REACH = 6, BLEND_REACH = 3, DEPTH_REACH = 12, N_FROM_FEATURE = N_FEATURE };
/* Reach of the windows in pixels; 0: the picture itself. */
static const size_t scale_reach[N_SCALE] = {0, 4, 8, 16};

struct run {
    const struct joint_input *in;
    const struct progress *progress;
    size_t width, height, n; /* n: pixels */
    float *block;            /* all planes below */
    struct regression_input planes;
    float *fitted[REGRESSION_VALUE]; /* of the scale under way */
    float *shown[N_SCALE][N_RGB];    /* light other than early light, of each scale */
    float *error[N_SCALE];           /* estimated squared error, then its mean around a pixel */
    float *spread[N_SCALE];          /* of that the part that is noise, which halves tell better */
    float *temporary;
    float *scratch; /* regression_scratch() of each thread */
    size_t reach;
};

enum { N_PLANE = REGRESSION_GUIDE + 2 * REGRESSION_VALUE + N_SCALE * (N_RGB + 2) + 1 };

static const float *pixel_of(const struct image *im, size_t i) { return im->pixel + i * im->n_channel; }

/* ---- planes ---- */

static void set_planes(struct run *r)
{
    float *at = r->block;
    for (size_t k = 0; k < REGRESSION_GUIDE; k++, at += r->n) r->planes.guide[k] = at;
    for (size_t k = 0; k < REGRESSION_VALUE; k++, at += r->n) r->planes.value[k] = at;
    for (size_t k = 0; k < REGRESSION_VALUE; k++, at += r->n) r->fitted[k] = at;
    for (size_t s = 0; s < N_SCALE; s++) {
        for (size_t c = 0; c < N_RGB; c++, at += r->n) r->shown[s][c] = at;
        r->error[s] = at;
        r->spread[s] = at + r->n;
        at += 2 * r->n;
    }
    r->temporary = at;
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
    const size_t across = (r->width + REGRESSION_TILE - 1) / REGRESSION_TILE;
    if (progress_cancelled(r->progress)) return;
    regression_tile(&r->planes, r->reach, i_tile % across * REGRESSION_TILE, i_tile / across * REGRESSION_TILE,
                    r->scratch + i_thread * regression_scratch(), r->fitted);
}

/* Sets the light of a scale and its squared error: with halves a, b and their filtered f, g, E(f - b)^2 is the squared
 * error of f and the variance of b, whose difference is known from (a - b)^2; averaging f and g takes (f - g)^2 / 4. */
static void judge(struct run *r, size_t s)
{
    for (size_t i = 0; i < r->n; i++) {
        float sum = 0, spread = 0;
        for (size_t c = 0; c < N_RGB; c++) {
            const float a = r->planes.value[c][i], b = r->planes.value[N_RGB + c][i];
            const float f = s > 0 ? r->fitted[c][i] : a, g = s > 0 ? r->fitted[N_RGB + c][i] : b;
            r->shown[s][c][i] = (f + g) / 2;
            spread += (f - g) * (f - g) / 4;
            if (s > 0) sum += ((f - b) * (f - b) + (g - a) * (g - a) - (a - b) * (a - b)) / 2 - (f - g) * (f - g) / 4;
        }
        r->spread[s][i] = spread / N_RGB;
        if (s == 0) sum = spread;
        r->error[s][i] = sum / N_RGB;
    }
}

static status run_scales(struct run *r, struct thread_pool *pool)
{
    const size_t across = (r->width + REGRESSION_TILE - 1) / REGRESSION_TILE,
                 down = (r->height + REGRESSION_TILE - 1) / REGRESSION_TILE;
    for (size_t s = 0; s < N_SCALE; s++) {
        r->reach = scale_reach[s];
        status st = s > 0 ? thread_pool_run(pool, across * down, run_tile, r, r->progress) : STATUS_OK;
        if (st == STATUS_OK && progress_cancelled(r->progress)) st = STATUS_CANCELLED;
        if (st != STATUS_OK) return st;
        judge(r, s);
    }
    return STATUS_OK;
}

/* ---- the picture ---- */

/* Chooses the scale with the least error around each pixel, and lets neighbouring choices run into each other. Returns
 * the sum of the squared errors of what was chosen, which is at least its noise. error[s] become the weights of the
 * scales. */
static double choose(struct run *r)
{
    double sum = 0, spread = 0;
    for (size_t s = 0; s < N_SCALE; s++) {
        memcpy(r->fitted[s], r->error[s], r->n * sizeof *r->error[s]);
        for (int k = 0; k < 2; k++) regression_box(r->error[s], r->width, r->height, ERROR_REACH, r->temporary);
    }
    for (size_t i = 0; i < r->n; i++) {
        size_t best = 0;
        for (size_t s = 1; s < N_SCALE; s++)
            if (r->error[s][i] < r->error[best][i]) best = s;
        sum += (double)r->fitted[best][i];
        spread += (double)r->spread[best][i];
        for (size_t s = 0; s < N_SCALE; s++) r->error[s][i] = s == best;
    }
    for (size_t s = 0; s < N_SCALE; s++)
        for (int k = 0; k < 2; k++) regression_box(r->error[s], r->width, r->height, BLEND_REACH, r->temporary);
    return fmax(sum, spread);
}

static void write_picture(struct run *r, struct image *out, double *error)
{
    double square = choose(r), mean = 0;
    for (size_t i = 0; i < r->n; i++) {
        const bool seen = pixel_of(r->in->feature, i)[FEATURE_SEEN] > 0;
        for (size_t c = 0; c < N_RGB; c++) {
            float sum = 0;
            for (size_t s = 0; s < N_SCALE; s++) sum += r->error[s][i] * r->shown[s][c][i];
            if (!seen) sum = r->shown[0][c][i];
            const float d = r->in->early != NULL ? pixel_of(r->in->early, i)[c] : 0;
            if (r->in->early != NULL) square += (double)pixel_of(r->in->early, i)[N_RGB + c] / N_RGB;
            out->pixel[i * N_RGB + c] = fmaxf(sum, seen ? 0 : -d) + d;
            mean += (double)out->pixel[i * N_RGB + c];
        }
    }
    mean /= (double)(N_RGB * r->n);
    *error = mean > 0 ? sqrt(fmax(square, 0) / (double)r->n) / mean : NAN;
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
