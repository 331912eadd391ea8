#include "optimizer/report/page_pictures.h"
#include "base/files/durable.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/page_text.h"
#include "renderer/image/image.h"
#include "renderer/image/tone_curve.h"

#include <math.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Rows with pictures, and the largest edge of a picture in the page. */
enum { MAX_ROWS = 64, MAX_EDGE = 160, MAX_SURFACE_EDGE = 480, MAX_FRONT_EDGE = 1050, PNG_LIMIT_BYTES = 16 << 20 };

static int compare_float(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return x < y ? -1 : x > y;
}

/* 0.95 over the value that a twentieth of the samples exceeds; 1 where that is not above 0. */
static double exposure_of(const struct image *im)
{
    size_t n = im->width * im->height * im->n_channel;
    float *v = malloc((n + 1) * sizeof *v);
    double exposure = 1.0;
    if (v == NULL) return exposure;
    for (size_t i = 0; i < n; i++) v[i] = fabsf(im->pixel[i]);
    qsort(v, n, sizeof *v, compare_float);
    if (n > 0 && v[n * 19 / 20] > 0.0f) exposure = 0.95 / (double)v[n * 19 / 20];
    free(v);
    return exposure;
}

/* The image in width x height pixels, each the mean of the pixels that it covers. */
static status shrink(const struct image *from, size_t width, size_t height, struct image *to, struct error *err)
{
    status s = image_init(to, width, height, 3, err);
    for (size_t y = 0; y < height && s == STATUS_OK; y++)
        for (size_t x = 0; x < width; x++) {
            size_t x0 = x * from->width / width, x1 = (x + 1) * from->width / width;
            size_t y0 = y * from->height / height, y1 = (y + 1) * from->height / height;
            x1 = x1 > x0 ? x1 : x0 + 1;
            y1 = y1 > y0 ? y1 : y0 + 1;
            for (size_t c = 0; c < 3; c++) {
                double sum = 0.0;
                for (size_t j = y0; j < y1; j++)
                    for (size_t i = x0; i < x1; i++)
                        sum += (double)from->pixel[(j * from->width + i) * from->n_channel + c];
                to->pixel[(y * width + x) * 3 + c] = (float)(sum / (double)((x1 - x0) * (y1 - y0)));
            }
        }
    return s;
}

/* Writes the PNG file as <img src="data:...">. */
static status put_file(const char *path, const char *what, FILE *out, struct error *err)
{
    char *png = NULL;
    size_t n = 0;
    status s = file_read_all(path, PNG_LIMIT_BYTES, &png, &n, err);
    if (s != STATUS_OK) return s;
    size_t n_text = sodium_base64_ENCODED_LEN(n, sodium_base64_VARIANT_ORIGINAL);
    char *text = malloc(n_text);
    if (text == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot write the report: out of memory");
    else {
        sodium_bin2base64(text, n_text, (const unsigned char *)png, n, sodium_base64_VARIANT_ORIGINAL);
        fprintf(out, "<img alt=\"%s\" title=\"%s\" src=\"data:image/png;base64,%s\">", what, what, text);
    }
    free(text);
    free(png);
    return s;
}

static status put_image(const struct report *report, const struct image *im, double exposure, const char *what,
                        FILE *out, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    status s = stage_work_path(report->in.job->tools, "report", "page.png", path, err);
    if (s == STATUS_OK) s = image_write_png(im, exposure, path, err);
    if (s == STATUS_OK) s = put_file(path, what, out, err);
    unlink(path);
    return s;
}

status page_bytes_image(const struct report *report, const uint8_t *rgb, size_t width, size_t height, const char *what,
                        FILE *out, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    status s = stage_work_path(report->in.job->tools, "report", "page.png", path, err);
    if (s == STATUS_OK) s = image_write_png_rgb8(rgb, width, height, path, err);
    if (s == STATUS_OK) s = put_file(path, what, out, err);
    unlink(path);
    return s;
}

status page_picture_file(const struct report *report, const char *name, const char *what, FILE *out, bool *written,
                         struct error *err)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, name, path);
    *written = access(path, R_OK) == 0;
    return *written ? put_file(path, what, out, err) : STATUS_OK;
}

/* Rendering minus photograph, so that no difference is the middle of a picture of exposure 1. */
static void subtract(const struct image *photograph, struct image *rendering)
{
    size_t n = rendering->width * rendering->height * 3;
    for (size_t i = 0; i < n; i++) rendering->pixel[i] -= photograph->pixel[i];
    double scale = 0.5 * exposure_of(rendering);
    for (size_t i = 0; i < n; i++)
        rendering->pixel[i] = (float)fmax(0.2 + 0.4 * scale * (double)rendering->pixel[i], 0.0);
}

static size_t least(size_t a, size_t b) { return a < b ? a : b; }

/* Photograph (NULL for a row of a table), rendering and difference of one row. */
static status put_row(const struct report *report, const struct image *photograph, const struct image *rendering,
                      FILE *out, struct error *err)
{
    struct image small[2] = {{0}, {0}};
    size_t width = least(rendering->width, MAX_EDGE), height = least(rendering->height, MAX_EDGE);
    status s = shrink(rendering, width, height, &small[1], err);
    if (s == STATUS_OK && photograph != NULL) s = shrink(photograph, width, height, &small[0], err);
    if (s == STATUS_OK) {
        double exposure = exposure_of(photograph != NULL ? &small[0] : &small[1]);
        if (photograph != NULL) s = put_image(report, &small[0], exposure, "photograph", out, err);
        if (s == STATUS_OK) s = put_image(report, &small[1], exposure, "rendering", out, err);
        if (photograph != NULL) subtract(&small[0], &small[1]);
        if (s == STATUS_OK && photograph != NULL) s = put_image(report, &small[1], 1.0, "difference", out, err);
        fprintf(out, "<figcaption>exposure &times; %.3g", exposure);
    }
    image_release(&small[0]);
    image_release(&small[1]);
    return s;
}

static status put_figure(const struct report *report, size_t i, const json_t *row, FILE *out, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct image rendering, photograph;
    bool has_photograph = false;
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, page_string(row, "rendering_exr"), path);
    const bool filtered = json_is_string(json_object_get(row, "rendering_filter"));
    if ((filtered ? image_read_exr_filtered : image_read_exr)(&rendering, path, (size_t)1 << 26, NULL) != STATUS_OK)
        return STATUS_OK;
    if (report->in.photographs->n_photograph > i) {
        worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_INPUT, NULL, path);
        has_photograph =
            photograph_develop(&report->in.job->rows->process, path, &report->in.photographs->photograph[i],
                               &photograph, NULL, NULL) == STATUS_OK;
    }
    fputs("<figure>", out);
    status s = put_row(report, has_photograph ? &photograph : NULL, &rendering, out, err);
    fputs("<br><b>", out);
    page_escaped(page_string(row, "name"), out);
    fprintf(out, "</b> (%s), error ", page_string(row, "set"));
    page_percent(row, "rel_error", out);
    fputs("</figcaption></figure>\n", out);
    if (has_photograph) image_release(&photograph);
    image_release(&rendering);
    return s;
}

status page_pictures(const struct report *report, const json_t *rows, FILE *out, struct error *err)
{
    size_t n = json_array_size(rows), n_shown = n < MAX_ROWS ? n : MAX_ROWS;
    status s = STATUS_OK;
    fprintf(
        out,
        "<p>Photograph, rendering, and their difference about grey, which is amplified. Each row has an exposure of "
        "its own. %zu of %zu rows.</p>\n<div class=\"pictures\">\n",
        n_shown, n);
    for (size_t i = 0; i < n_shown && s == STATUS_OK; i++) s = put_figure(report, i, json_array_get(rows, i), out, err);
    fputs("</div>\n", out);
    return s;
}

/* A picture of the studio, which has a tone curve. */
static status put_toned(const struct report *report, const struct image *im, double exposure, FILE *out,
                        struct error *err)
{
    uint8_t *rgb = malloc(3 * im->width * im->height);
    if (rgb == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write the report: out of memory");
    tone_curve_bytes(im, exposure, rgb);
    status s = page_bytes_image(report, rgb, im->width, im->height, "the cloth", out, err);
    free(rgb);
    return s;
}

/* The picture in at most max_edge pixels an edge. *written: whether it could be read. */
static status put_surface_image(const struct report *report, const json_t *picture, size_t max_edge, FILE *out,
                                bool *written, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct image im, small = {0};
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, page_string(picture, "file"), path);
    *written = image_read_exr(&im, path, (size_t)1 << 28, NULL) == STATUS_OK;
    if (!*written) return STATUS_OK;
    const double most = (double)(im.width > im.height ? im.width : im.height), scale = fmin((double)max_edge / most, 1);
    status s = shrink(&im, (size_t)fmax(1.0, scale * (double)im.width), (size_t)fmax(1.0, scale * (double)im.height),
                      &small, err);
    const double exposure = page_number(picture, "png_exposure");
    if (s == STATUS_OK)
        s = json_object_get(picture, "tone_curve") != NULL ? put_toned(report, &small, exposure, out, err)
                                                           : put_image(report, &small, exposure, "the cloth", out, err);
    image_release(&small);
    image_release(&im);
    return s;
}

/* The file for the eye of a picture of the studio, which is filtered. */
static status put_eye_file(const struct report *report, const json_t *picture, FILE *out, bool *written,
                           struct error *err)
{
    char name[256];
    const char *file = page_string(picture, "file");
    snprintf(name, sizeof name, "%.*s.png", (int)strcspn(file, "."), file);
    return page_picture_file(report, name, "the cloth", out, written, err);
}

status page_front_surface(const struct report *report, const json_t *picture, FILE *out, bool *written,
                          struct error *err)
{
    *written = false;
    if (picture == NULL) return STATUS_OK;
    const bool studio = json_object_get(picture, "tone_curve") != NULL;
    status s = studio ? put_eye_file(report, picture, out, written, err)
                      : put_surface_image(report, picture, MAX_FRONT_EDGE, out, written, err);
    if (!*written) return s;
    fputs("<figcaption>The cloth, rendered: ", out);
    page_escaped(page_string(picture, "on"), out);
    fputs(".</figcaption>", out);
    return s;
}

static status put_surface(const struct report *report, const json_t *picture, FILE *out, struct error *err)
{
    bool written;
    fputs("<figure>", out);
    status s = put_surface_image(report, picture, MAX_SURFACE_EDGE, out, &written, err);
    fputs("<figcaption>", out);
    page_escaped(page_string(picture, "on"), out);
    fprintf(out, ", exposure &times; %.3g, noise of a pixel ", page_number(picture, "png_exposure"));
    page_with_error(json_object_get(picture, "noise"), NULL, 100.0, " %", out);
    const json_t *reference = json_object_get(picture, "reference");
    if (reference != NULL) {
        fputs(", fields of 4 &times; 4 pixels are ", out);
        page_with_error(json_object_get(reference, "field_difference_rms"), NULL, 100.0, " %", out);
        fputs(" from path tracing beyond a noise of ", out);
        page_with_error(json_object_get(reference, "field_noise"), NULL, 100.0, " %", out);
    }
    fputs("</figcaption></figure>\n", out);
    return s;
}

status page_surface_pictures(const struct report *report, const json_t *list, FILE *out, struct error *err)
{
    size_t i;
    const json_t *picture;
    status s = STATUS_OK;
    fputs("<div class=\"pictures surfaces\">\n", out);
    json_array_foreach(list, i, picture) if (s == STATUS_OK) s = put_surface(report, picture, out, err);
    fputs("</div>\n", out);
    return s;
}
