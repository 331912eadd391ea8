#include "optimizer/report/surface/surface_passes.h"
#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST_SAMPLES = 2, PASS_PATHS = 1 << 21, N_CHANNEL = 6, N_RGB = 3 };
static const char *const channel_name[N_CHANNEL] = {"R", "G", "B", "var.R", "var.G", "var.B"};

/* The beginning of a checkpoint; the pixels follow, as they are in memory. Another machine's would not be read: a job
 * stays where its folder is. */
struct pass_header {
    char magic[8];
    uint64_t width, height, n_sample, n_first;
};
static const char magic[8] = "SELVPAS2";

static void checkpoint_path(const struct report *report, const char *name, char path[WORKER_PATH_BYTES])
{
    char relative[80];
    snprintf(relative, sizeof relative, "report/%s.pass", name);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_WORK, relative, path);
}

static status make_image(struct image *im, size_t width, size_t height, struct error *err)
{
    status s = image_init(im, width, height, N_CHANNEL, err);
    if (s == STATUS_OK) im->channel_name = channel_name;
    return s;
}

status surface_passes_start(const struct report *report, const char *name, size_t width, size_t height,
                            struct surface_passes *p, struct error *err)
{
    char path[WORKER_PATH_BYTES], *text = NULL;
    size_t n_byte = 0, n_pixel_byte = width * height * N_CHANNEL * sizeof(float),
           n_first_byte = width * height * N_RGB * sizeof(float);
    struct pass_header h;
    *p = (struct surface_passes){.name = name};
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_WORK, "report", path);
    status s = durable_make_folder(path, err);
    if (s == STATUS_OK) s = make_image(&p->image, width, height, err);
    if (s == STATUS_OK) s = image_init(&p->first, width, height, N_RGB, err);
    if (s != STATUS_OK) return s;
    checkpoint_path(report, name, path);
    struct error unread;
    if (file_read_all(path, sizeof h + n_pixel_byte + n_first_byte, &text, &n_byte, &unread) == STATUS_OK &&
        n_byte == sizeof h + n_pixel_byte + n_first_byte) {
        memcpy(&h, text, sizeof h);
        if (memcmp(h.magic, magic, sizeof magic) == 0 && h.width == width && h.height == height) {
            memcpy(p->image.pixel, text + sizeof h, n_pixel_byte);
            memcpy(p->first.pixel, text + sizeof h + n_pixel_byte, n_first_byte);
            p->n_sample = h.n_sample;
            p->n_first = h.n_first;
        }
    }
    free(text);
    return STATUS_OK;
}

static size_t next_pass(const struct surface_passes *p, size_t n_wanted)
{
    size_t most = PASS_PATHS / (p->image.width * p->image.height), left = n_wanted - p->n_sample;
    size_t n = p->n_sample == 0 ? FIRST_SAMPLES : p->n_sample;
    if (most < FIRST_SAMPLES) most = FIRST_SAMPLES;
    if (n > most) n = most;
    return n + FIRST_SAMPLES > left ? left : n; /* one sample alone has no variance */
}

/* Adds a picture of n samples to the one of p->n_sample. */
static void add_pass(struct surface_passes *p, const struct image *im, size_t n)
{
    double all = (double)(p->n_sample + n), a = (double)p->n_sample / all, b = (double)n / all;
    for (size_t i = 0; i < p->image.width * p->image.height; i++)
        for (size_t k = 0; k < N_CHANNEL; k++) {
            float *sum = &p->image.pixel[i * N_CHANNEL + k], added = im->pixel[i * im->n_channel + k];
            bool mean = k < 3;
            double old = p->n_sample > 0 ? (mean ? a : a * a) * (double)*sum : 0.0;
            *sum = (float)(old + (mean ? b : b * b) * (double)added);
        }
    p->n_sample += n;
}

/* Whether the next samples belong to the first half, which then has no more samples than the second. */
static bool is_first_next(const struct surface_passes *p) { return 2 * p->n_first <= p->n_sample; }

/* Adds it to the first half, too, if it belongs there. */
static void add_first(struct surface_passes *p, const struct image *im, size_t n)
{
    if (!is_first_next(p)) return;
    const double all = (double)(p->n_first + n), a = (double)p->n_first / all, b = (double)n / all;
    for (size_t i = 0; i < p->image.width * p->image.height; i++)
        for (size_t k = 0; k < N_RGB; k++) {
            float *mean = &p->first.pixel[i * N_RGB + k];
            *mean = (float)(a * (double)*mean + b * (double)im->pixel[i * im->n_channel + k]);
        }
    p->n_first += n;
}

static status write_checkpoint(const struct report *report, const struct surface_passes *p, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    const size_t n_pixel = p->image.width * p->image.height, n_pixel_byte = n_pixel * N_CHANNEL * sizeof(float),
                 n_first_byte = n_pixel * N_RGB * sizeof(float),
                 n_byte = sizeof(struct pass_header) + n_pixel_byte + n_first_byte;
    struct pass_header h = {
        .width = p->image.width, .height = p->image.height, .n_sample = p->n_sample, .n_first = p->n_first};
    char *block = malloc(n_byte);
    if (block == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot keep a picture: out of memory");
    memcpy(h.magic, magic, sizeof magic);
    memcpy(block, &h, sizeof h);
    memcpy(block + sizeof h, p->image.pixel, n_pixel_byte);
    memcpy(block + sizeof h + n_pixel_byte, p->first.pixel, n_first_byte);
    checkpoint_path(report, p->name, path);
    status s = worker_folder_replace(report->in.job->tools->folder, path, block, n_byte, err);
    free(block);
    return s;
}

status surface_passes_add(struct report *report, const struct render_request *q, const struct progress *progress,
                          struct surface_passes *p, struct error *err)
{
    struct render_request pass = *q;
    struct image im = {0};
    struct progress_part part;
    const size_t n = next_pass(p, q->n_sample),
                 part_of[2] = {n < 2 * FIRST_SAMPLES ? n : n / 2, n < 2 * FIRST_SAMPLES ? 0 : n - n / 2};
    status s = STATUS_OK;
    for (int k = 0; k < 2 && part_of[k] > 0; k++) {
        pass.first_sample = is_first_next(p) ? p->n_first : RENDER_HALF + p->n_sample - p->n_first;
        pass.n_sample = part_of[k];
        struct progress inner = progress_begin_part(&part, progress, (double)p->n_sample / (double)q->n_sample,
                                                    (double)pass.n_sample / (double)q->n_sample);
        s = render_run(&pass, report->in.job->tools->pool, &inner, &im, err);
        if (s != STATUS_OK) return s;
        add_first(p, &im, pass.n_sample);
        add_pass(p, &im, pass.n_sample);
        image_release(&im);
    }
    return write_checkpoint(report, p, err);
}

status surface_passes_halves(const struct surface_passes *p, struct image half[2], struct error *err)
{
    const size_t n_second = p->n_sample - p->n_first;
    half[1] = (struct image){0};
    status s = image_init(&half[0], p->image.width, p->image.height, N_RGB, err);
    if (s == STATUS_OK) s = image_init(&half[1], p->image.width, p->image.height, N_RGB, err);
    for (size_t i = 0; s == STATUS_OK && i < p->image.width * p->image.height; i++)
        for (size_t k = 0; k < N_RGB; k++) {
            const double all = (double)p->image.pixel[i * N_CHANNEL + k], first = (double)p->first.pixel[i * N_RGB + k];
            half[0].pixel[i * N_RGB + k] = (float)first;
            half[1].pixel[i * N_RGB + k] =
                (float)(n_second > 0 ? ((double)p->n_sample * all - (double)p->n_first * first) / (double)n_second
                                     : all);
        }
    if (s != STATUS_OK) image_release(&half[0]);
    return s;
}

void surface_passes_release(struct surface_passes *p)
{
    image_release(&p->image);
    image_release(&p->first);
}
