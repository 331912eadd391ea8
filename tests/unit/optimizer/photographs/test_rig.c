/* The rig file, positions in millimetres, and the errors of a lens. */
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/photographs/camera/photograph_process_load.h"
#include "optimizer/photographs/camera/rig.h"
#include "optimizer/photographs/rows/observation_load.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/job_document_text.h"

#define DOCUMENT(photographs, extra)                                                                                   \
    "{\"sample\":\"s\",\"fibers\":{\"file\":\"c.hair\"}," extra "\"photographs\":[" photographs "]}"
#define RIG "\"rig\":{\"file\":\"rig.json\"},"

static const char good_rig[] =
    "{\"selvedge_rig\":1,\"lamps\":{\"side\":{\"position_mm\":[0,305,528.2755]},\"top\":{\"theta_deg\":10,\"phi_deg\":"
    "5}},"
    "\"cameras\":{\"a\":{\"theta_deg\":45,\"phi_deg\":-90,\"distance_cm\":80}},"
    "\"views\":{\"v1\":{\"lamp\":\"side\",\"camera\":\"a\",\"cloth_rotation_deg\":90},\"v2\":{\"lamp\":\"top\","
    "\"camera\":\"a\"},"
    "\"v3\":{\"lamp\":\"none\",\"camera\":\"a\"}},"
    "\"lens\":{\"vignetting\":{\"center_px\":[16,16],\"radius_px\":16,\"a\":[-0.3,0.05,0]}}}";

static const char *folder_of(void **state)
{
    static char folder[1024];
    const char *path = scratch_path(state, "x");
    snprintf(folder, sizeof folder, "%.*s", (int)(strrchr(path, '/') - path), path);
    return folder;
}

static void test_radians(void **state)
{
    static const struct {
        const char *stations;
        bool refused;
    } given[] = {{"\"a\":{\"theta_deg\":0.349,\"phi_deg\":0},\"b\":{\"theta_deg\":1.117,\"phi_deg\":3.14}", true},
                 {"\"a\":{\"theta_deg\":20,\"phi_deg\":0},\"b\":{\"theta_deg\":1.117,\"phi_deg\":3.14}", false},
                 {"\"a\":{\"theta_deg\":1.117,\"phi_deg\":90},\"b\":{\"theta_deg\":1,\"phi_deg\":3.14}", false},
                 {"\"a\":{\"theta_deg\":1.117,\"phi_deg\":0}", false},
                 {"\"a\":{\"theta_deg\":0,\"phi_deg\":0},\"b\":{\"theta_deg\":0.1,\"phi_deg\":0}", false}};
    const char *path = scratch_path(state, "rig.json");
    struct job_document *doc = job_document_of_text(
        DOCUMENT("{\"file\":\"a.exr\",\"set\":\"fit\",\"crop_px\":[0,0,9,9],\"light_theta_deg\":10,"
                 "\"light_phi_deg\":0,\"camera_theta_deg\":5,\"camera_phi_deg\":0}",
                 RIG));
    for (size_t i = 0; i < sizeof given / sizeof given[0]; i++) {
        struct lens lens;
        struct marker_board board;
        struct error err = {0};
        char text[400];
        snprintf(text, sizeof text, "{\"selvedge_rig\":1,\"lamps\":{%s},\"views\":{}}", given[i].stations);
        scratch_write(path, text, strlen(text));
        status s = rig_apply(path, doc->setup, doc->rows, &lens, &board, &err);
        if (s != (given[i].refused ? STATUS_INVALID : STATUS_OK)) fail_msg("%zu: %s", i, err.text);
        if (given[i].refused) assert_non_null(strstr(err.text, "look like radians"));
    }
    job_document_free(doc);
}

static void test_views(void **state)
{
    struct lens lens;
    struct marker_board board;
    struct error err = {0};
    const char *path = scratch_path(state, "rig.json");
    scratch_write(path, good_rig, strlen(good_rig));
    struct job_document *doc = job_document_of_text(
        DOCUMENT("{\"file\":\"a.exr\",\"set\":\"fit\",\"view\":\"v1\"},{\"file\":\"b.exr\",\"view\":\"v2\"}", RIG));
    if (rig_apply(path, doc->setup, doc->rows, &lens, &board, &err) != STATUS_OK) fail_msg("%s", err.text);
    const struct job_photograph *p = doc->rows->photograph;
    assert_true(fabs(p[0].light_theta_deg - 30.0) < 1e-4 && fabs(p[0].light_phi_deg - 90.0) < 1e-9);
    assert_true(fabs(p[0].light_distance_cm - 61.0) < 1e-4 && p[0].camera_distance_cm == 80.0);
    assert_true(p[0].camera_theta_deg == 45.0 && p[0].camera_phi_deg == -90.0 && p[0].cloth_rotation_deg == 90.0);
    assert_true(p[1].light_theta_deg == 10.0 && isnan(p[1].light_distance_cm) && p[1].cloth_rotation_deg == 0.0);
    assert_true(lens.has_vignetting && !lens.has_distortion && lens.vignetting[0] == -0.3);
    snprintf(doc->rows->photograph[1].view, sizeof doc->rows->photograph[1].view, "v3");
    assert_int_equal(rig_apply(path, doc->setup, doc->rows, &lens, &board, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "cannot use rig 'rig.json'"));
    assert_non_null(strstr(err.text, "'lamps' has no 'none'"));
    snprintf(doc->rows->photograph[1].view, sizeof doc->rows->photograph[1].view, "v9");
    assert_int_equal(rig_apply(path, doc->setup, doc->rows, &lens, &board, &err), STATUS_INVALID);
    assert_string_equal(err.field, "photograph_view[1]");
    assert_non_null(strstr(err.text, "'b.exr' names the view 'v9'"));
    job_document_free(doc);
}

static void test_bad_rigs(void **state)
{
    static const struct {
        const char *rig, *part;
    } bad[] = {
        {"{", "not valid JSON"},
        {"{\"views\":{}}", "'selvedge_rig' is missing"},
        {"{\"selvedge_rig\":2}", "selvedge_rig"},
        {"{\"selvedge_rig\":1,\"lamp\":{}}", "unknown field 'lamp'"},
        {"{\"selvedge_rig\":1,\"lens\":{\"vignetting\":{\"radius_px\":3,\"a\":[0,0,0]}}}", "center_px' is missing"},
        {"{\"selvedge_rig\":1,\"lens\":{\"distortion\":{\"focal_px\":[0,9],\"center_px\":[1,1],\"k\":[0,0,0],\"p\":[0,"
         "0]}}}",
         "focal_px' must be at least 1"},
        {"{\"selvedge_rig\":1,\"views\":{\"v1\":{\"camera\":\"a\"}}}", "views.v1.lamp"},
        {"{\"selvedge_rig\":1,\"markers\":{\"dictionary\":\"4x4_50\",\"side_mm\":9,\"center_mm\":{\"1\":[1,2]}}}",
         "2 to 64 markers"},
        {"{\"selvedge_rig\":1,\"markers\":{\"dictionary\":\"4x4_50\",\"side_mm\":9,\"center_mm\":{},\"charuco\":{}}}",
         "both 'center_mm' and 'charuco'"},
        {"{\"selvedge_rig\":1,\"markers\":{\"dictionary\":\"4x4_50\",\"side_mm\":9,\"charuco\":{\"squares\":[5,2],"
         "\"square_mm\":12,\"upper_left_mm\":[0,0]}}}",
         "two whole numbers from 3 on"},
        {"{\"selvedge_rig\":1,\"markers\":{\"dictionary\":\"4x4_50\",\"side_mm\":9,\"charuco\":{\"squares\":[5,5],"
         "\"square_mm\":8,\"upper_left_mm\":[0,0]}}}",
         "must be larger than the markers"},
        {"{\"selvedge_rig\":1,\"markers\":{\"dictionary\":\"4x4_50\",\"side_mm\":9,\"center_mm\":{\"1\":[1,2],\"a\":[1,"
         "2]}}}",
         "the number of a marker"},
        {"{\"selvedge_rig\":1,\"views\":{\"v1\":{\"lamp\":\"a\",\"camera\":\"a\"}},\"lamps\":{\"a\":{\"theta_deg\":1.1}"
         "}}",
         "lamps.a.phi_deg' is missing"},
        {"{\"selvedge_rig\":1,\"views\":{\"v1\":{\"lamp\":\"a\",\"camera\":\"a\"}},\"lamps\":{\"a\":{\"theta_deg\":1,"
         "\"position_mm\":[1,1,9]}}}",
         "give one of them"},
        {"{\"selvedge_rig\":1,\"views\":{\"v1\":{\"lamp\":\"a\",\"camera\":\"a\"}},\"lamps\":{\"a\":{\"position_mm\":["
         "1,1,-90]}},"
         "\"cameras\":{\"a\":{\"theta_deg\":1,\"phi_deg\":1}}}",
         "without black_sheet"},
        {"{\"selvedge_rig\":1,\"views\":{\"v1\":{\"lamp\":\"a\",\"camera\":\"a\"}},\"lamps\":{\"a\":{\"position_mm\":["
         "1,1,90]}},"
         "\"cameras\":{\"a\":{\"position_mm\":[0,0,-90]}}}",
         "below the cloth"},
    };
    struct job_document *doc =
        job_document_of_text(DOCUMENT("{\"file\":\"a.exr\",\"set\":\"fit\",\"view\":\"v1\"}", RIG));
    const char *path = scratch_path(state, "rig.json");
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct lens lens;
        struct marker_board board;
        struct error err = {0};
        scratch_write(path, bad[i].rig, strlen(bad[i].rig));
        assert_int_not_equal(rig_apply(path, doc->setup, doc->rows, &lens, &board, &err), STATUS_OK);
        if (strstr(err.text, bad[i].part) == NULL || strstr(err.text, "rig.json") == NULL)
            fail_msg("'%s' is not in '%s'", bad[i].part, err.text);
        assert_string_equal(err.field, "rig_file");
    }
    job_document_free(doc);
}

static void test_places_in_documents(void **state)
{
#define FILE_A "\"file\":\"a.exr\",\"set\":\"fit\","
#define CAMERA "\"camera_theta_deg\":3,\"camera_phi_deg\":4"
    (void)state;
    struct job_document *doc =
        job_document_of_text(DOCUMENT("{" FILE_A CAMERA ",\"light_position_mm\":[300,0,300]}", ""));
    assert_true(fabs(doc->rows->photograph[0].light_theta_deg - 45.0) < 1e-9);
    assert_true(fabs(doc->rows->photograph[0].light_distance_cm - 30.0 * sqrt(2.0)) < 1e-9);
    assert_true(isnan(doc->rows->photograph[0].camera_distance_cm));
    job_document_free(doc);
    job_document_check_error(DOCUMENT("{" FILE_A CAMERA "}", ""), "photographs[0].light_theta_deg", "is missing");
    job_document_check_error(DOCUMENT("{" FILE_A CAMERA ",\"light_theta_deg\":3}", ""), "photographs[0].light_phi_deg",
                             "the other angle is given");
    job_document_check_error(
        DOCUMENT("{" FILE_A CAMERA ",\"light_theta_deg\":3,\"light_phi_deg\":3,\"light_position_mm\":[1,1,9]}", ""),
        "photographs[0].light_position_mm", "as well as angles");
    job_document_check_error(DOCUMENT("{" FILE_A CAMERA ",\"view\":\"v\"}", RIG), "photographs[0].camera_theta_deg",
                             "as well as 'view'");
    job_document_check_error(DOCUMENT("{" FILE_A "\"view\":\"v\"}", ""), "photographs[0].view", "needs 'rig'");
    job_document_check_error(DOCUMENT("{" FILE_A CAMERA ",\"light_position_mm\":[300,0,-300]}", ""),
                             "photographs[0].light_position_mm", "not above the cloth");
    job_document_check_error(DOCUMENT("{" FILE_A CAMERA ",\"light_position_mm\":[1,0,1]}", ""),
                             "photographs[0].light_position_mm", "nearer than 10 mm");
    job_document_check_error(DOCUMENT("{" FILE_A "\"view\":\"v\"}", "\"rig\":{\"file\":\"a.exr\"},"),
                             "photographs[0].file", "a second time");
}

static void test_lens(void **state)
{
    const struct lens l = {.has_distortion = true,
                           .focal_px = {60, 62},
                           .center_px = {31, 33},
                           .k = {-0.2, 0.03, 0.001},
                           .p = {0.002, -0.001}};
    const double crop[4] = {10, 12, 50, 44};
    struct image im;
    struct error err = {0};
    (void)state;
    double center[2] = {31, 33}, at[2];
    lens_distort(&l, center, at);
    assert_true(at[0] == 31.0 && at[1] == 33.0);
    lens_distort(&l, (double[2]){61, 33}, at); /* x = 0.5, r = 0.25 */
    double radial = 1.0 - 0.2 * 0.25 + 0.03 * 0.0625 + 0.001 * 0.015625;
    assert_true(fabs(at[0] - (31.0 + 60.0 * (0.5 * radial - 0.001 * 0.75))) < 1e-9);
    assert_true(fabs(at[1] - (33.0 + 62.0 * 0.002 * 0.25)) < 1e-9);
    assert_int_equal(image_init(&im, 64, 64, 3, NULL), STATUS_OK);
    for (size_t i = 0; i < 64 * 64 * 3; i++) /* a ramp, which bilinear interpolation keeps */
        im.pixel[i] = (float)(1.0 + 0.01 * ((double)(i / 3 % 64) + 0.5) + 0.02 * ((double)(i / 192) + 0.5));
    assert_int_equal(lens_correct(&l, crop, &im, &err), STATUS_OK);
    assert_true(im.width == 40 && im.height == 32);
    for (size_t i = 0; i < 40 * 32; i++) {
        double ideal[2] = {10.5 + (double)(i % 40), 12.5 + (double)(i / 40)};
        lens_distort(&l, ideal, at);
        assert_true(fabs((double)im.pixel[3 * i + 1] - (1.0 + 0.01 * at[0] + 0.02 * at[1])) < 1e-5);
    }
    assert_int_equal(lens_correct(&l, (double[4]){0, 0, 80, 2}, &im, &err), STATUS_INVALID);
    const struct lens wide = {.has_distortion = true, .focal_px = {20, 20}, .center_px = {20, 16}, .k = {0.5, 0, 0}};
    assert_int_equal(lens_correct(&wide, (double[4]){0}, &im, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "beyond the picture"));
    image_release(&im);
}

/* A picture with the fall-off of the rig's lens, under a lamp that is nearer in the second view. */
static void test_light_of_a_view(void **state)
{
    static const char near_rig[] = "{\"selvedge_rig\":1,\"lamps\":{\"far\":{\"theta_deg\":20,\"phi_deg\":0},\"near\":{"
                                   "\"theta_deg\":20,\"phi_deg\":0,"
                                   "\"distance_cm\":30.5}},\"cameras\":{\"a\":{\"theta_deg\":45,\"phi_deg\":0}},"
                                   "\"views\":{\"v1\":{\"lamp\":\"far\","
                                   "\"camera\":\"a\"},\"v2\":{\"lamp\":\"near\",\"camera\":\"a\"}},\"lens\":{"
                                   "\"vignetting\":{\"center_px\":[16,16],"
                                   "\"radius_px\":16,\"a\":[-0.3,0.05,0]}}}";
    struct observation_set o;
    struct photograph_process k;
    struct image im;
    struct error err = {0};
    scratch_write(scratch_path(state, "rig.json"), near_rig, strlen(near_rig));
    assert_int_equal(image_init(&im, 32, 32, 3, NULL), STATUS_OK);
    for (size_t i = 0; i < 32 * 32 * 3; i++) {
        double x = ((double)(i / 3 % 32) + 0.5 - 16.0) / 16.0, y = ((double)(i / 96) + 0.5 - 16.0) / 16.0,
               r = x * x + y * y;
        im.pixel[i] = (float)(0.4 * (1.0 - 0.3 * r + 0.05 * r * r));
    }
    assert_int_equal(image_write_exr(&im, scratch_path(state, "a.exr"), NULL), STATUS_OK);
    assert_int_equal(image_write_exr(&im, scratch_path(state, "b.exr"), NULL), STATUS_OK);
    image_release(&im);
    struct job_document *doc =
        job_document_of_text(DOCUMENT("{\"file\":\"a.exr\",\"set\":\"fit\",\"view\":\"v1\",\"crop_px\":[4,4,32,30]},{"
                                      "\"file\":\"b.exr\",\"view\":\"v2\"}",
                                      RIG));
    observation_set_init(&o);
    photograph_process_init(&k);
    if (photograph_process_load(&k, doc->setup, doc->rows, folder_of(state), &err) != STATUS_OK)
        fail_msg("%s", err.text);
    if (observation_set_load(doc->setup, doc->rows, doc->fit, folder_of(state), &k, NULL, &o, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    assert_true(fabs(o.item[0].mean_rgb[1] - 0.4) < 1e-5 && o.item[0].se_rgb[1] < 1e-5);
    assert_true(fabs(o.item[1].mean_rgb[1] - 0.1) < 1e-5); /* four times the light */
    assert_true(o.item[0].configuration.light_distance_m == 0.61 && o.item[1].configuration.light_distance_m == 0.305);
    photograph_process_release(&k);
    observation_set_release(&o);
    job_document_free(doc);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_views),    cmocka_unit_test(test_radians),
        cmocka_unit_test(test_bad_rigs), cmocka_unit_test(test_places_in_documents),
        cmocka_unit_test(test_lens),     cmocka_unit_test(test_light_of_a_view),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
