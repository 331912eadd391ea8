/* From raw files of a simulated camera to radiances: noise, three exposures, a wrong white balance, dark frames, a
 * color chart or a white reference; the record of the camera's noise from dark and flat frames. */
#include "base/rng.h"
#include "optimizer/job/job_parse.h"
#include "optimizer/photographs/camera/color_matrix.h"
#include "optimizer/photographs/camera/noise_calibrate.h"
#include "optimizer/photographs/camera/photograph_process_load.h"
#include "optimizer/photographs/rows/observation_load.h"
#include "optimizer/tools/simulated_camera/dng_file.h"
#include "tests/support/camera_files.h"
#include "tests/support/drawn_chart.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>

#include <cmocka.h>

enum { BLACK = 512, WHITE = 16383, EDGE = 96 };

static const double camera[9] = {0.61, 0.22, 0.05, 0.11, 0.74, 0.09, 0.02, 0.18, 0.48}; /* radiance to camera rgb */
static const double read_sd = 4.0, dark_dn_per_s = 3.0, shot_var = 0.5, dn_per_s = 60000.0;

/* Time that files state over the true one. */
static double stated_over_true = 1.0;

/* One exposure of an image of camera rgb as a mosaic with noise. */
static void expose(const char *path, const struct image *im, double t_s, uint32_t seed)
{
    size_t w = 2 * im->width, h = 2 * im->height;
    uint16_t *mosaic = malloc(w * h * sizeof *mosaic);
    struct rng_key key = {.seed = seed};
    assert_non_null(mosaic);
    for (size_t i = 0; i < w * h; i++) {
        size_t x = i % w, y = i / w, c = y % 2 == 0 ? x % 2 : 1 + x % 2;
        double light = (double)im->pixel[3 * (y / 2 * im->width + x / 2) + c] * dn_per_s * t_s, z[2];
        struct rng r;
        rng_start(&r, &key, (uint32_t)i, 0);
        rng_normal_pair(&r, z);
        double sd = sqrt(read_sd * read_sd + shot_var * light + 0.5 * dark_dn_per_s * t_s);
        mosaic[i] = (uint16_t)fmin(fmax(rint(BLACK + light + dark_dn_per_s * t_s + sd * z[0]), 0.0), WHITE);
    }
    assert_int_equal(
        dng_file_write(path, &(struct dng_picture){w, h, BLACK, WHITE, t_s * stated_over_true, 100, 8}, mosaic, NULL),
        STATUS_OK);
    free(mosaic);
}

static void even(struct image *im, size_t edge, const double radiance[3])
{
    double rgb[3];
    assert_int_equal(image_init(im, edge, edge, 3, NULL), STATUS_OK);
    color_matrix_apply(camera, radiance, rgb);
    for (size_t i = 0; i < 3 * edge * edge; i++) im->pixel[i] = (float)rgb[i % 3];
}

static void take(void **state, const char *name, size_t edge, const double radiance[3], double t_s, uint32_t seed)
{
    struct image im;
    even(&im, edge, radiance);
    expose(scratch_path(state, name), &im, t_s, seed);
    image_release(&im);
}

static void calibrate(void **state, struct noise_record *r)
{
    static char path[16][1024];
    const char *dark[8], *flat[6];
    struct error err = {0};
    for (size_t i = 0; i < 8; i++) {
        snprintf(path[i], sizeof path[i], "%s", scratch_path(state, "dark") /* numbered below */);
        snprintf(path[i] + strlen(path[i]), 16, "%zu.dng", i);
        struct image im;
        even(&im, EDGE, (double[3]){0, 0, 0});
        expose(path[i], &im, i < 4 ? 0.01 : 4.0, (uint32_t)(100 + i));
        image_release(&im);
        dark[i] = path[i];
    }
    for (size_t i = 0; i < 6; i++) {
        snprintf(path[8 + i], sizeof path[0], "%s", scratch_path(state, "flat"));
        snprintf(path[8 + i] + strlen(path[8 + i]), 16, "%zu.dng", i);
        struct image im;
        even(&im, EDGE, (double[3]){0.8, 0.8, 0.8});
        expose(path[8 + i], &im, i < 2 ? 0.2 : 0.1, (uint32_t)(200 + i));
        image_release(&im);
        flat[i] = path[8 + i];
    }
    const struct noise_frames f = {.dark = dark, .n_dark = 8, .flat = flat, .n_flat = 6, .exposure_s = NAN};
    if (noise_calibrate(&f, NULL, r, &err) != STATUS_OK) fail_msg("%s", err.text);
    const struct noise_frames few = {.dark = dark, .n_dark = 1, .flat = flat, .n_flat = 6, .exposure_s = NAN};
    assert_int_equal(noise_calibrate(&few, NULL, &(struct noise_record){0}, &err), STATUS_INVALID);
    const struct noise_frames black = {.dark = dark, .n_dark = 8, .flat = dark, .n_flat = 4, .exposure_s = NAN};
    assert_int_equal(noise_calibrate(&black, NULL, &(struct noise_record){0}, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "no brighter than the dark frames"));
}

static void test_noise_record(void **state)
{
    struct noise_record r, again;
    struct error err = {0};
    calibrate(state, &r);
    for (size_t c = 0; c < 3; c++) {
        double share = c == 1 ? 0.5 : 1.0; /* the green of a pixel is a mean of two samples */
        const struct noise_channel *k = &r.channel[c];
        if (!(fabs(k->read_var / (share * (read_sd * read_sd + 1.0 / 12.0)) - 1.0) < 0.06 && fabs(k->read_mean) < 0.1 &&
              fabs(k->dark_mean / dark_dn_per_s - 1.0) < 0.03 && fabs(k->shot_var / (share * shot_var) - 1.0) < 0.06 &&
              fabs(k->dark_var / (share * 0.5 * dark_dn_per_s) - 1.0) < 0.3))
            fail_msg("channel %zu: %g %g %g %g %g", c, k->read_mean, k->read_var, k->dark_mean, k->dark_var,
                     k->shot_var);
    }
    assert_true(r.iso == 100.0 && strstr(r.camera, "Test camera") != NULL);
    const char *path = scratch_path(state, "noise.json");
    assert_int_equal(noise_record_write(&r, path, &err), STATUS_OK);
    assert_int_equal(noise_record_read(path, &again, &err), STATUS_OK);
    assert_true(fabs(again.channel[2].shot_var / r.channel[2].shot_var - 1.0) < 1e-9 && again.n_flat == 6);
    const char *half = "{\"selvedge_camera_noise\":1,\"read_mean_dn\":[0,0]}";
    scratch_write(path, half, strlen(half));
    assert_int_equal(noise_record_read(path, &again, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "'read_mean_dn' must be three numbers"));
}

static struct job_document *parse(const char *camera_keys, const char *photographs, const char *color)
{
    char text[4096];
    struct job_document *doc = NULL;
    struct error err = {0};
    const bool has_camera = camera_keys[0] != '\0';
    snprintf(text, sizeof text, "{\"sample\":\"s\",\"fibers\":{\"file\":\"c.hair\"}%s%s%s,\"photographs\":[%s]%s%s}",
             has_camera ? ",\"camera\":{" : "", camera_keys, has_camera ? "}" : "", photographs,
             color[0] != '\0' ? ",\"color\":" : "", color);
    if (job_document_parse(text, strlen(text), &doc, &err) != STATUS_OK) fail_msg("%s: %s", err.field, err.text);
    return doc;
}

#define ANGLES "\"set\":\"fit\",\"light_theta_deg\":0,\"light_phi_deg\":0,\"camera_theta_deg\":30,\"camera_phi_deg\":0"
#define THREE(name)                                                                                                    \
    "{\"file\":\"" name "0.dng\",\"more_exposures\":[{\"file\":\"" name "1.dng\"},{\"file\":\"" name                   \
    "2.dng\"}]," ANGLES "}"

static json_t *files; /* the list of ledgers, of the test; NULL: not wanted */

static status load(void **state, struct job_document *doc, struct observation_set *o, struct error *err)
{
    char folder[1024];
    const char *path = scratch_path(state, "x");
    struct photograph_process k;
    snprintf(folder, sizeof folder, "%.*s", (int)(strrchr(path, '/') - path), path);
    observation_set_init(o);
    photograph_process_init(&k);
    k.files = files;
    status s = photograph_process_load(&k, doc->setup, doc->rows, folder, err);
    if (s == STATUS_OK) s = observation_set_load(doc->setup, doc->rows, doc->fit, folder, &k, NULL, o, err);
    photograph_process_release(&k);
    return s;
}

/* Within 1 % and three of the stated standard errors, of at most six values. */
static void check_radiance(const struct observation *o, const double radiance[3])
{
    for (size_t c = 0; c < 3; c++) {
        double off = o->mean_rgb[c] - radiance[c];
        if (!(fabs(off) < 0.01 * radiance[c] && fabs(off) < 3.0 * o->se_rgb[c]))
            fail_msg("%s channel %zu: %g +- %g, not %g", o->name, c, o->mean_rgb[c], o->se_rgb[c], radiance[c]);
    }
}

static const double bright[3] = {0.9, 0.7, 0.6}, dim[3] = {0.011, 0.009, 0.013};
static const double exposure_s[3] = {0.02, 0.16, 1.28};

static void take_views(void **state)
{
    for (size_t i = 0; i < 3; i++) {
        char name[16];
        snprintf(name, sizeof name, "b%zu.dng", i);
        take(state, name, EDGE, bright, exposure_s[i], (uint32_t)(10 + i));
        snprintf(name, sizeof name, "d%zu.dng", i);
        take(state, name, EDGE, dim, exposure_s[i], (uint32_t)(20 + i));
    }
    struct noise_record r;
    calibrate(state, &r);
    assert_int_equal(noise_record_write(&r, scratch_path(state, "noise.json"), NULL), STATUS_OK);
}

/* The bright view saturates in its longest exposure, the dim one is near black in its shortest. */
static void test_chart_round_trip(void **state)
{
    const double corner[8] = {42, 38, 270, 56, 262, 206, 30, 186};
    struct image chart;
    struct observation_set o;
    struct error err = {0};
    take_views(state);
    assert_int_equal(image_init(&chart, 320, 240, 3, NULL), STATUS_OK);
    draw_chart(&chart, corner, camera, cos(20.0 * M_PI / 180.0), 0.0);
    expose(scratch_path(state, "chart.dng"), &chart, 0.16, 31);
    image_release(&chart);
    struct job_document *doc = parse("\"noise_file\":\"noise.json\"", THREE("b") "," THREE("d"),
                                     "{\"chart\":{\"file\":\"chart.dng\",\"light_theta_deg\":20}}");
    if (load(state, doc, &o, &err) != STATUS_OK) fail_msg("%s: %s", err.field, err.text);
    check_radiance(&o.item[0], bright);
    check_radiance(&o.item[1], dim);
    assert_true(o.item[0].photograph.n_exposure == 3 && o.item[0].photograph.noise_se_rgb[1] > 0.0);
    assert_true(o.item[0].photograph.noise_se_rgb[1] < 0.3 * o.item[0].mean_rgb[1] / EDGE);
    observation_set_release(&o);
    job_document_free(doc);
}

/* A view of four times the bright one, whose exposure of the chart's time is saturated everywhere. */
static const double glaring[3] = {3.6, 2.8, 2.4};
#define GLARE "{\"file\":\"g0.dng\",\"more_exposures\":[{\"file\":\"g1.dng\"}]," ANGLES "}"

/* Stated times that are 5 % off: the exposure that has the chart's time keeps the scale, the others are measured by
 * their light, and the ledger says so. A view whose exposures have no light in common takes the ratio of the others. */
static void test_wrong_exposure_times(void **state)
{
    const double corner[8] = {42, 38, 270, 56, 262, 206, 30, 186};
    static const double off[3] = {1.0 / 1.05, 1.05, 1.0 / 1.05};
    struct image chart;
    struct observation_set o;
    struct error err = {0};
    take_views(state);
    for (size_t i = 0; i < 3; i++) {
        char name[16];
        stated_over_true = off[i];
        snprintf(name, sizeof name, "b%zu.dng", i);
        take(state, name, EDGE, bright, exposure_s[i] / off[i], (uint32_t)(10 + i));
        snprintf(name, sizeof name, "d%zu.dng", i);
        take(state, name, EDGE, dim, exposure_s[i] / off[i], (uint32_t)(20 + i));
        snprintf(name, sizeof name, "g%zu.dng", i);
        take(state, name, EDGE, glaring, exposure_s[i] / off[i], (uint32_t)(70 + i));
    }
    assert_int_equal(image_init(&chart, 320, 240, 3, NULL), STATUS_OK);
    draw_chart(&chart, corner, camera, cos(20.0 * M_PI / 180.0), 0.0);
    stated_over_true = off[1];
    expose(scratch_path(state, "chart.dng"), &chart, 0.16 / off[1], 31);
    stated_over_true = 1.0;
    image_release(&chart);
    struct job_document *doc = parse("\"noise_file\":\"noise.json\"", GLARE "," THREE("b") "," THREE("d"),
                                     "{\"chart\":{\"file\":\"chart.dng\",\"light_theta_deg\":20}}");
    files = json_array();
    if (load(state, doc, &o, &err) != STATUS_OK) fail_msg("%s: %s", err.field, err.text);
    check_radiance(&o.item[1], bright);
    check_radiance(&o.item[2], dim);
    for (size_t c = 0; c < 3; c++) {
        const double wrong = o.item[0].mean_rgb[c] / glaring[c] - 1.0;
        const double error = o.item[0].photograph.exposure_se_rgb[c] / glaring[c];
        if (!(fabs(wrong) < 0.01 && fabs(error - 0.009) < 0.001))
            fail_msg("channel %zu: %g, error %g", c, wrong, error);
    }
    const struct photograph_record *r = &o.item[2].photograph;
    assert_true(fabs(r->scale_s - 0.16) < 1e-6 && fabs(r->fitted_s[2] / (1.28 * 1.05 * 1.05) - 1.0) < 0.01);
    assert_non_null(strstr(o.item[1].photograph.exposure_warning, "is stated as"));
    assert_true(r->exposure_se_rgb[0] > 0.0 && r->exposure_se_rgb[0] < 0.01 * dim[0]);
    assert_true(r->color_error[0][PHOTOGRAPH_TIME_CAUSE] == 0.0); /* the chart has this time */
    char *text = json_dumps(files, 0);
    if (strstr(text, "0.02 s; the fitted ratio says 0.022") == NULL ||
        strstr(text, "0.16 s, the other exposures are measured against it") == NULL)
        fail_msg("%s", text);
    free(text);
    json_decref(files);
    files = NULL;
    observation_set_release(&o);
    job_document_free(doc);
}

static void test_white_and_dark_frames(void **state)
{
    struct observation_set o;
    struct error err = {0};
    take_views(state);
    take(state, "white.dng", EDGE, (double[3]){0.98, 0.98, 0.98}, 0.16, 41);
    for (uint32_t i = 0; i < 4; i++) {
        char name[16];
        snprintf(name, sizeof name, "k%u.dng", i);
        take(state, name, EDGE, (double[3]){0, 0, 0}, i < 2 ? 0.16 : 1.28, 50 + i);
    }
    /* a white reference corrects the channels, not their mixture: grey cloth comes out right */
    take(state, "grey.dng", EDGE, (double[3]){0.02, 0.02, 0.02}, 1.28, 61);
    const char *dark = "\"dark_frames\":[\"k0.dng\",\"k1.dng\",\"k2.dng\",\"k3.dng\"]";
    const char *white = "{\"white\":{\"file\":\"white.dng\",\"reflectance\":0.98}}";
    struct job_document *doc = parse(dark, "{\"file\":\"grey.dng\"," ANGLES "}", white);
    if (load(state, doc, &o, &err) != STATUS_OK) fail_msg("%s: %s", err.field, err.text);
    check_radiance(&o.item[0], (double[3]){0.02, 0.02, 0.02});
    observation_set_release(&o);
    job_document_free(doc);
    doc = parse(dark, "{\"file\":\"b0.dng\"," ANGLES "}", white);
    assert_int_equal(load(state, doc, &o, &err), STATUS_INVALID);
    assert_string_equal(err.field, "photograph_file[0]");
    assert_non_null(strstr(err.text, "no dark frame has its exposure time"));
    observation_set_release(&o);
    job_document_free(doc);
}

static void check_refused(void **state, const char *camera_keys, const char *photographs, const char *color,
                          const char *part)
{
    struct observation_set o;
    struct error err = {0};
    struct job_document *doc = parse(camera_keys, photographs, color);
    assert_int_not_equal(load(state, doc, &o, &err), STATUS_OK);
    if (strstr(err.text, part) == NULL) fail_msg("'%s' is not in '%s'", part, err.text);
    observation_set_release(&o);
    job_document_free(doc);
}

/* States that the picture is to be shown after half a turn. */
static void turn_file(const char *path)
{
    TIFF *tiff = TIFFOpen(path, "r+");
    assert_non_null(tiff);
    TIFFSetField(tiff, TIFFTAG_ORIENTATION, ORIENTATION_BOTRIGHT);
    assert_int_equal(TIFFRewriteDirectory(tiff), 1);
    TIFFClose(tiff);
}

static void test_refused(void **state)
{
    static uint16_t word[EDGE * EDGE * 3];
    for (size_t i = 0; i < EDGE * EDGE * 3; i++) word[i] = (uint16_t)(20000 + i % 17);
    take(state, "a.dng", EDGE, bright, 0.02, 1);
    take(state, "small.dng", EDGE / 2, bright, 0.04, 2);
    camera_write_tiff(scratch_path(state, "a.tif"), &(struct camera_tiff){EDGE, EDGE, 3, 16}, word);
    camera_write_tiff(scratch_path(state, "low.tif"),
                      &(struct camera_tiff){EDGE, EDGE, 3, 16, .exposure_s = 0.01, .iso = 100, .aperture = 8}, word);
    camera_write_tiff(scratch_path(state, "iso.tif"),
                      &(struct camera_tiff){EDGE, EDGE, 3, 16, .exposure_s = 0.02, .iso = 400, .aperture = 8}, word);
    check_refused(state, "", "{\"file\":\"a.dng\",\"more_exposures\":[{\"file\":\"small.dng\"}]," ANGLES "}", "",
                  "different sizes");
    check_refused(state, "",
                  "{\"file\":\"low.tif\",\"transfer\":\"linear\",\"more_exposures\":[{\"file\":\"iso.tif\"}]," ANGLES
                  "}",
                  "", "different ISO values");
    turn_file(scratch_path(state, "iso.tif"));
    check_refused(state, "",
                  "{\"file\":\"low.tif\",\"transfer\":\"linear\",\"more_exposures\":[{\"file\":\"iso.tif\"}]," ANGLES
                  "}",
                  "", "different orientations");
    camera_write_tiff(scratch_path(state, "dark.tif"),
                      &(struct camera_tiff){EDGE, EDGE, 3, 16, .exposure_s = 0.01, .iso = 100, .aperture = 8}, word);
    turn_file(scratch_path(state, "dark.tif"));
    check_refused(state, "\"dark_frames\":[\"dark.tif\"]", "{\"file\":\"low.tif\",\"transfer\":\"linear\"," ANGLES "}",
                  "", "its orientation is 1, its dark frame's is 3");
    check_refused(state, "", "{\"file\":\"a.dng\"," ANGLES "},{\"file\":\"a.tif\",\"transfer\":\"linear\"," ANGLES "}",
                  "", "'a.tif': its exposure time is not known, but that of 'a.dng' is");
    check_refused(state, "", "{\"file\":\"a.dng\"," ANGLES "}",
                  "{\"chart\":{\"file\":\"a.tif\",\"transfer\":\"linear\"}}",
                  "cannot use color chart 'a.tif': no chart was found");
    check_refused(state, "", "{\"file\":\"a.dng\"," ANGLES "}",
                  "{\"white\":{\"file\":\"a.tif\",\"transfer\":\"linear\"}}", "have no common scale");
    scratch_write(scratch_path(state, "bad.json"), "{}", 2);
    check_refused(state, "\"noise_file\":\"bad.json\"", "{\"file\":\"a.dng\"," ANGLES "}", "", "calibrate-camera");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_noise_record),
        cmocka_unit_test(test_chart_round_trip),
        cmocka_unit_test(test_wrong_exposure_times),
        cmocka_unit_test(test_white_and_dark_frames),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
