/* The command "look". */
#include "geometry/vision/vision.h"
#include "geometry/vision/vision_texture.h"
#include "geometry/weave/weave_contrast.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/photographs/reader/photograph.h"
#include "optimizer/tools/phantom/phantom_commands.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] =
    "selvedge-phantom look --photograph FILE --rendering FILE.exr --period-px P [options]\n"
    "\n"
    "Compares a rendering with a photograph of the same piece of cloth, as JSON: mean colors, contrast of the texture\n"
    "at half of, at and at twice the period P of the weave (docs/weave-detection.md), and the relative errors of "
    "both.\n"
    "\n"
    "  --photograph FILE       .png (sRGB) or .exr\n"
    "  --crop-px X0,Y0,X1,Y1   the piece of the photograph that the rendering shows               [all of it]\n"
    "  --scale S               pixel value of the photograph times S is radiance                  [1]\n"
    "  --linear                a PNG holds linear values, not sRGB\n"
    "  --rendering FILE        OpenEXR; the variances of its pixels, where it has them, are taken off the contrast\n"
    "  --period-px P           period of the weave in the photograph, as `detect` prints it\n"
    "  --blur-px B             blur of the camera: standard deviation of a Gaussian, in pixels of the photograph [0]\n"
    "\n"
    "Exit codes: 0 done, 1 failed, 2 wrong arguments.\n";

enum { MAX_PIXEL = 1 << 26 };

struct look_option {
    const char *photograph, *rendering;
    double crop_px[4], scale, period_px, blur_px;
    bool srgb;
};

static status parse(int argc, char **argv, struct look_option *o, struct error *err)
{
    *o = (struct look_option){.scale = 1.0, .srgb = true};
    const struct command_option option[] = {
        {.name = "photograph", .kind = OPTION_TEXT, .to = &o->photograph},
        {.name = "crop-px", .kind = OPTION_NUMBER_LIST, .to = o->crop_px, .n = 4},
        {.name = "scale", .kind = OPTION_NUMBER, .to = &o->scale},
        {.name = "linear", .kind = OPTION_FALSE, .to = &o->srgb},
        {.name = "rendering", .kind = OPTION_TEXT, .to = &o->rendering},
        {.name = "period-px", .kind = OPTION_NUMBER, .to = &o->period_px},
        {.name = "blur-px", .kind = OPTION_NUMBER, .to = &o->blur_px},
    };
    status s = command_options_parse(argc, argv, option, sizeof option / sizeof *option, err);
    if (s != STATUS_OK) return s;
    if (o->photograph == NULL || o->rendering == NULL || !(o->period_px > 0.0))
        return error_set(err, STATUS_INVALID, "--photograph, --rendering and --period-px are needed");
    if (!(o->blur_px >= 0.0 && o->scale > 0.0))
        return error_set(err, STATUS_INVALID, "--blur-px must not be negative, --scale must be positive");
    for (int k = 0; k < 4; k++)
        if (!(o->crop_px[k] >= 0.0 && o->crop_px[k] <= 1e6))
            return error_set(err, STATUS_INVALID, "--crop-px: four pixels");
    return STATUS_OK;
}

/* Smooths each channel by a Gaussian of sigma_px pixels. */
static status blur(struct image *im, double sigma_px, struct error *err)
{
    size_t n = im->width * im->height;
    float *plane = malloc(2 * n * sizeof *plane);
    status s = plane != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot blur a picture: out of memory");
    for (size_t c = 0; c < 3 && s == STATUS_OK; c++) {
        for (size_t i = 0; i < n; i++) plane[i] = im->pixel[3 * i + c];
        s = vision_smooth(plane, im->width, im->height, sigma_px, plane + n, err);
        for (size_t i = 0; i < n && s == STATUS_OK; i++) im->pixel[3 * i + c] = plane[n + i];
    }
    free(plane);
    return s;
}

/* Variance of a pixel's brightness over the square of the mean brightness; the channels of a light path have the same
 * noise, so standard deviations add. 0 for a picture without variances. */
static double relative_variance(const char *path, const struct image *rendering)
{
    struct image var;
    double sum = 0.0, mean = 0.0;
    size_t n = rendering->width * rendering->height;
    if (image_read_exr_variance(&var, path, MAX_PIXEL, NULL) != STATUS_OK) return 0.0;
    for (size_t i = 0; i < n; i++) {
        double sd = 0.0;
        for (size_t c = 0; c < 3; c++) {
            sd += sqrt((double)var.pixel[3 * i + c]) / 3.0;
            mean += (double)rendering->pixel[3 * i + c] / (3.0 * (double)n);
        }
        sum += sd * sd / (double)n;
    }
    image_release(&var);
    return isfinite(sum) && mean > 0.0 ? sum / (mean * mean) : 0.0;
}

static status measure_rendering(const struct look_option *o, double width_px, struct weave_look *look,
                                struct error *err)
{
    struct image im;
    double noise[WEAVE_SCALES];
    status s = image_read_exr(&im, o->rendering, MAX_PIXEL, err);
    if (s != STATUS_OK) return s;
    double to_px = (double)im.width / width_px, period_px = o->period_px * to_px, blur_px = o->blur_px * to_px;
    double variance = relative_variance(o->rendering, &im);
    if (blur_px > 0.0) s = blur(&im, blur_px, err);
    if (s == STATUS_OK) s = weave_look_measure(im.pixel, im.width, im.height, period_px, look, err);
    if (s == STATUS_OK) s = weave_contrast_noise(variance, blur_px, period_px, noise, err);
    for (int k = 0; k < WEAVE_SCALES && s == STATUS_OK; k++)
        look->contrast[k] = sqrt(fmax(0.0, look->contrast[k] * look->contrast[k] - noise[k]));
    image_release(&im);
    return s == STATUS_OK ? s : error_prefix(err, s, "rendering '%s'", o->rendering);
}

static status measure_photograph(const struct look_option *o, struct weave_look *look, double *width_px,
                                 struct error *err)
{
    struct job_photograph p = o->srgb ? photograph_plain(JOB_TRANSFER_SRGB) : photograph_assumed(JOB_TRANSFER_LINEAR);
    struct image im;
    p.scale = o->scale;
    for (int k = 0; k < 4; k++) p.crop_px[k] = (size_t)o->crop_px[k];
    status s = photograph_read(o->photograph, &p, &im, NULL, err);
    if (s != STATUS_OK) return s;
    *width_px = (double)im.width;
    s = weave_look_measure(im.pixel, im.width, im.height, o->period_px, look, err);
    image_release(&im);
    return s == STATUS_OK ? s : error_prefix(err, s, "photograph '%s'", o->photograph);
}

static json_t *look_json(const struct weave_look *look)
{
    return json_pack("{s:o, s:o}", "mean_rgb", json_number_list(look->mean_rgb, 3, 1.0), "contrast",
                     json_number_list(look->contrast, WEAVE_SCALES, 1.0));
}

int phantom_command_look(int argc, char **argv)
{
    struct look_option o;
    struct weave_look photograph, rendering;
    struct error err = {0};
    double width_px = 0.0;
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], "--help") == 0) {
            fputs(usage, stdout);
            return 0;
        }
    if (parse(argc, argv, &o, &err) != STATUS_OK) {
        fprintf(stderr, "selvedge-phantom look: %s\n", err.text);
        return 2;
    }
    status s = vision_init(&err);
    if (s == STATUS_OK) s = measure_photograph(&o, &photograph, &width_px, &err);
    if (s == STATUS_OK) s = measure_rendering(&o, width_px, &rendering, &err);
    if (s != STATUS_OK) {
        fprintf(stderr, "selvedge-phantom look: %s\n", err.text);
        return 1;
    }
    json_t *j = json_pack("{s:o, s:o, s:o, s:o}", "photograph", look_json(&photograph), "rendering",
                          look_json(&rendering), "color_error", json_number(weave_color_error(&rendering, &photograph)),
                          "contrast_error", json_number(weave_contrast_error(&rendering, &photograph)));
    json_dumpf(j, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(6));
    putchar('\n');
    json_decref(j);
    return 0;
}
