#include "renderer/preview/joint_filter.h"
#include "renderer/preview/feature_image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { REACH = 7, PATCH = 1, SMOOTH = 2, BAND = 16, N_RGB = 3 };
static const float k_color2 = 0.45f * 0.45f, k_feature2 = 0.6f * 0.6f, least_albedo = 0.05f;
/* Differences of features that count as none: of albedo, of a normal, of a distance over the width of the picture. */
static const float least_feature2[N_FEATURE] = {1e-3f, 1e-3f, 1e-3f, 1e-2f, 1e-2f, 1e-2f, 2e-4f};

struct run {
    const struct image *feature;
    const struct progress *progress;
    struct image color; /* over the albedo: rgb, and its smoothed variances */
    struct image *out;
    float *scratch; /* per thread: PATCH_ROWS rows of distances, then BAND rows of weights and of weighted colors */
    size_t scratch_length;
};

enum { PATCH_ROWS = BAND + 2 * PATCH };

static const float *pixel_of(const struct image *im, size_t x, size_t y)
{
    return im->pixel + (y * im->width + x) * im->n_channel;
}

static bool inside(const struct image *im, long x, long y)
{
    return x >= 0 && y >= 0 && x < (long)im->width && y < (long)im->height;
}

/* ---- what is filtered: the light on the cloth, its color divided by the albedo ---- */

static void albedo_at(const struct image *feature, size_t x, size_t y, float albedo[N_RGB])
{
    const float *f = pixel_of(feature, x, y) + FEATURE_ALBEDO;
    for (int c = 0; c < N_RGB; c++) albedo[c] = fmaxf(f[c], least_albedo);
}

static void divide_albedo(const struct image *picture, const struct image *feature, struct image *color)
{
    for (size_t y = 0; y < picture->height; y++)
        for (size_t x = 0; x < picture->width; x++) {
            float albedo[N_RGB], *out = color->pixel + (y * color->width + x) * color->n_channel;
            albedo_at(feature, x, y, albedo);
            for (int c = 0; c < N_RGB; c++) out[c] = pixel_of(picture, x, y)[c] / albedo[c];
            float n = 0;
            for (long v = (long)y - SMOOTH; v <= (long)y + SMOOTH; v++)
                for (long u = (long)x - SMOOTH; u <= (long)x + SMOOTH; u++) {
                    if (!inside(picture, u, v)) continue;
                    const float *p = pixel_of(picture, (size_t)u, (size_t)v);
                    n++;
                    for (int c = 0; c < N_RGB; c++) out[N_RGB + c] += p[N_RGB + c] / (albedo[c] * albedo[c]);
                }
            for (int c = 0; c < N_RGB; c++) {
                float own = pixel_of(picture, x, y)[N_RGB + c] / (albedo[c] * albedo[c]);
                out[N_RGB + c] = fmaxf(out[N_RGB + c] / n, own);
            }
        }
}

/* ---- weights ---- */

/* Squared difference of colors beyond what their variances explain, over these. */
static float color_distance(const float *p, const float *q)
{
    float sum = 0;
    for (int c = 0; c < N_RGB; c++) {
        float d = p[c] - q[c], vp = p[N_RGB + c], vq = q[N_RGB + c];
        sum += (d * d - (vp + fminf(vp, vq))) / (1e-12f + k_color2 * (vp + vq));
    }
    return sum / N_RGB;
}

static float feature_distance(const float *p, const float *q)
{
    float most = 0;
    for (int k = 0; k < N_FEATURE; k++) {
        float d = p[k] - q[k], vp = p[N_FEATURE + k], vq = q[N_FEATURE + k];
        most = fmaxf(most, (d * d - (vp + fminf(vp, vq))) / (k_feature2 * fmaxf(vp, least_feature2[k])));
    }
    return most;
}

/* Distances of a band's pixels, and of PATCH rows around it, to those at an offset; infinite where there is none. */
static void fill_distances(const struct run *r, size_t first, long dx, long dy, float *distance)
{
    const struct image *im = &r->color;
    for (long i = 0; i < PATCH_ROWS; i++)
        for (long x = 0; x < (long)im->width; x++) {
            long y = (long)first + i - PATCH;
            bool both = inside(im, x, y) && inside(im, x + dx, y + dy);
            distance[i * (long)im->width + x] = both ? color_distance(pixel_of(im, (size_t)x, (size_t)y),
                                                                      pixel_of(im, (size_t)(x + dx), (size_t)(y + dy)))
                                                     : INFINITY;
        }
}

static float patch_mean(const struct run *r, const float *distance, long row, long x)
{
    long width = (long)r->color.width;
    float sum = 0, n = 0;
    for (long v = row - PATCH; v <= row + PATCH; v++)
        for (long u = x - PATCH; u <= x + PATCH; u++) {
            if (u < 0 || u >= width || isinf(distance[v * width + u])) continue;
            sum += distance[v * width + u];
            n++;
        }
    return sum / n;
}

static void add_offset(const struct run *r, size_t first, size_t n_row, long dx, long dy, float *distance, float *sum)
{
    const struct image *im = &r->color;
    fill_distances(r, first, dx, dy, distance);
    for (size_t i = 0; i < n_row; i++)
        for (size_t x = 0; x < im->width; x++) {
            size_t y = first + i;
            long u = (long)x + dx, v = (long)y + dy;
            if (!inside(im, u, v)) continue;
            const float *q = pixel_of(im, (size_t)u, (size_t)v);
            float far = fmaxf(patch_mean(r, distance, (long)i + PATCH, (long)x), 0);
            far = fmaxf(far, feature_distance(pixel_of(r->feature, x, y), pixel_of(r->feature, (size_t)u, (size_t)v)));
            float weight = dx == 0 && dy == 0 ? 1 : expf(-far), *out = sum + (i * im->width + x) * (N_RGB + 1);
            for (int c = 0; c < N_RGB; c++) out[c] += weight * q[c];
            out[N_RGB] += weight;
        }
}

static void filter_band(void *context, size_t i_band, size_t i_thread)
{
    const struct run *r = context;
    size_t width = r->color.width, first = i_band * BAND, left = r->color.height - first;
    size_t n_row = left < BAND ? left : BAND;
    float *distance = r->scratch + i_thread * r->scratch_length, *sum = distance + PATCH_ROWS * width;
    memset(sum, 0, BAND * width * (N_RGB + 1) * sizeof *sum);
    for (long dy = -REACH; dy <= REACH && !progress_cancelled(r->progress); dy++)
        for (long dx = -REACH; dx <= REACH; dx++) add_offset(r, first, n_row, dx, dy, distance, sum);
    for (size_t i = 0; i < n_row; i++)
        for (size_t x = 0; x < width; x++) {
            const float *s = sum + (i * width + x) * (N_RGB + 1);
            float albedo[N_RGB], *out = r->out->pixel + ((first + i) * width + x) * N_RGB;
            albedo_at(r->feature, x, first + i, albedo);
            for (int c = 0; c < N_RGB; c++) out[c] = albedo[c] * s[c] / s[N_RGB];
        }
}

status joint_filter(const struct image *picture, const struct image *feature, struct thread_pool *pool,
                    const struct progress *progress, struct image *out, struct error *err)
{
    struct run r = {.feature = feature, .progress = progress, .out = out};
    size_t n_thread = pool != NULL ? thread_pool_n_thread(pool) : 1;
    memset(out, 0, sizeof *out);
    if (picture->n_channel < 2 * N_RGB || feature->n_channel != (size_t)2 * N_FEATURE ||
        picture->width != feature->width || picture->height != feature->height)
        return error_set(err, STATUS_INVALID, "cannot filter a picture of %zu channels by features of %zu",
                         picture->n_channel, feature->n_channel);
    r.scratch_length = (PATCH_ROWS + BAND * (N_RGB + 1)) * picture->width;
    r.scratch = malloc(n_thread * r.scratch_length * sizeof *r.scratch);
    status s = r.scratch != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot filter a picture: no memory");
    if (s == STATUS_OK) s = image_init(&r.color, picture->width, picture->height, 2 * N_RGB, err);
    if (s == STATUS_OK) s = image_init(out, picture->width, picture->height, N_RGB, err);
    if (s == STATUS_OK) {
        divide_albedo(picture, feature, &r.color);
        s = thread_pool_run(pool, (picture->height + BAND - 1) / BAND, filter_band, &r, progress);
        if (s == STATUS_OK && progress_cancelled(progress)) s = STATUS_CANCELLED;
        if (s != STATUS_OK) error_set(err, s, "filtering was cancelled");
    }
    image_release(&r.color);
    free(r.scratch);
    if (s != STATUS_OK) image_release(out);
    return s;
}
