#include "optimizer/report/result/result_thumbnail.h"
#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"

#include <math.h>
#include <stdlib.h>
#include <unistd.h>

enum { EDGE_PX = 72 };
static const double bright_share = 0.98, bright_level = 0.85;

/* A picture of n_channel values a pixel: linear, or bytes. */
struct source {
    const float *linear;
    const uint8_t *bytes;
    size_t width, height, n_channel;
};

static double value_of(const struct source *s, size_t x, size_t y, size_t channel)
{
    size_t i = (y * s->width + x) * s->n_channel + channel;
    return s->linear != NULL ? (double)s->linear[i] : (double)s->bytes[i];
}

static float box_mean(const struct source *s, size_t x, size_t y, size_t channel, const size_t out[2])
{
    size_t x0 = x * s->width / out[0], x1 = (x + 1) * s->width / out[0];
    size_t y0 = y * s->height / out[1], y1 = (y + 1) * s->height / out[1], n = 0;
    double sum = 0;
    for (size_t j = y0; j < (y1 > y0 ? y1 : y0 + 1); j++)
        for (size_t i = x0; i < (x1 > x0 ? x1 : x0 + 1); i++, n++) sum += value_of(s, i, j, channel);
    return isfinite(sum) ? (float)(sum / (double)n) : 0.0f;
}

static status shrink(const struct source *s, struct image *small, struct error *err)
{
    size_t longest = s->width > s->height ? s->width : s->height, out[2] = {s->width, s->height};
    if (longest == 0) return error_set(err, STATUS_INVALID, "cannot make a thumbnail of an empty picture");
    if (longest > EDGE_PX) {
        out[0] = (s->width * EDGE_PX + longest - 1) / longest;
        out[1] = (s->height * EDGE_PX + longest - 1) / longest;
    }
    status st = image_init(small, out[0], out[1], 3, err);
    for (size_t y = 0; st == STATUS_OK && y < out[1]; y++)
        for (size_t x = 0; x < out[0]; x++)
            for (size_t k = 0; k < 3; k++)
                small->pixel[(y * out[0] + x) * 3 + k] = box_mean(s, x, y, k < s->n_channel ? k : 0, out);
    return st;
}

static int by_value(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* The factor that shows the percentile bright_share at bright_level; 1 for a black picture. */
static double exposure_of(const struct image *im)
{
    size_t n = im->width * im->height * 3;
    float *sorted = malloc(n * sizeof *sorted);
    if (sorted == NULL) return 1;
    for (size_t i = 0; i < n; i++) sorted[i] = im->pixel[i];
    qsort(sorted, n, sizeof *sorted, by_value);
    double level = (double)sorted[(size_t)(bright_share * (double)(n - 1))];
    free(sorted);
    return level > 0 ? bright_level / level : 1;
}

static status put(const struct report *report, status written, const char *temporary, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, JOB_THUMBNAIL, path);
    status s = written == STATUS_OK ? worker_folder_check(report->in.job->tools->folder, err) : written;
    if (s == STATUS_OK) return durable_rename(temporary, path, err);
    unlink(temporary);
    return s;
}

status result_thumbnail_of_image(const struct report *report, const struct image *im, struct error *err)
{
    char temporary[WORKER_PATH_BYTES];
    struct image small;
    const struct source source = {im->pixel, NULL, im->width, im->height, im->n_channel};
    status s = shrink(&source, &small, err);
    if (s != STATUS_OK) return s;
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, ".part-" JOB_THUMBNAIL, temporary);
    s = put(report, image_write_png(&small, exposure_of(&small), temporary, err), temporary, err);
    image_release(&small);
    return s;
}

status result_thumbnail_of_bytes(const struct report *report, const uint8_t *rgb, size_t width, size_t height,
                                 struct error *err)
{
    char temporary[WORKER_PATH_BYTES];
    struct image small;
    const struct source source = {NULL, rgb, width, height, 3};
    status s = shrink(&source, &small, err);
    if (s != STATUS_OK) return s;
    size_t n = small.width * small.height * 3;
    uint8_t *bytes = malloc(n);
    for (size_t i = 0; bytes != NULL && i < n; i++) bytes[i] = (uint8_t)lrintf(small.pixel[i]);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, ".part-" JOB_THUMBNAIL, temporary);
    s = bytes == NULL ? error_set(err, STATUS_NO_MEMORY, "cannot make a thumbnail: out of memory")
                      : image_write_png_rgb8(bytes, small.width, small.height, temporary, err);
    s = put(report, s, temporary, err);
    free(bytes);
    image_release(&small);
    return s;
}
