/* The job document: valid documents are accepted, and each mistake is refused with the path of the field at fault. The
 * section fit is in test_job_document_fit.c. */
#include "base/catalogue/method_catalogue.h"
#include "optimizer/job/document/job_file_name.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/document/picture_words.h"
#include "optimizer/job/job_parse.h"
#include "optimizer/job/stage_table.h"
#include "renderer/scattering/scattering.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/job_document_text.h"

static void test_defaults(void **state)
{
    (void)state;
    struct job_document *d =
        job_document_of_text("{\"sample\":\"blue \xc3\xa9toffe\"," VOLUME ",\"measurements\":{\"file\":\"a.csv\"}}");
    assert_true(d->scan->given);
    assert_string_equal(d->scan->file[0], "scan.tif");
    assert_true(d->scan->voxel_size_um[2] == 2.0);
    assert_string_equal(d->scan->axes, "");
    assert_true(isnan(d->scan->density_low) && isnan(d->scan->filter_s) && isnan(d->scan->radius_um) &&
                isnan(d->fit->model[0].fixed[0]) && isnan(d->fit->model[0].start[8]));
    assert_true(d->setup->lamp_side_cm == 10.0 && d->setup->lamp_distance_cm == 61.0 &&
                d->setup->camera_distance_cm == 100.0 && d->setup->crop_cm == 1.0);
    assert_true(d->setup->black_sheet);
    assert_int_equal(d->fit->n_model, 1);
    assert_string_equal(d->fit->model[0].id, "textile.v3");
    assert_string_equal(d->fit->method, method_gauss_newton.id);
    assert_int_equal(d->rows->n_photograph, 0);
    assert_int_equal(d->scan->radius_per_axis, -1);
    assert_string_equal(d->rows->measurement_file, "a.csv");
    job_document_free(d);
}

static void test_everything_given(void **state)
{
    (void)state;
    struct job_document *d = job_document_of_text(
        "{\"sample\":\"s\",\"volume\":{\"files\":[\"a.tif\",\"b.tif\"],\"voxel_size_um\":[1,2,3.5],\"axes\":\"-z-x-y\","
        "\"matrix\":[1,0.1,0,0,1,0,0,0,1],"
        "\"crop_voxel\":[0,1,2,10,11,12],\"density_low\":10,\"density_high\":200,\"filter\":{\"s\":1,\"t\":2,\"h\":11,"
        "\"eps_d\":0.4,\"eps_J\":-10},"
        "\"link_sigma_voxel\":4,\"min_vertices\":8,\"radius_um\":7.5,\"radius_per_axis\":true},"
        "\"lamp\":{\"side_cm\":5,\"distance_cm\":50},\"camera\":{\"distance_cm\":80,\"crop_cm\":0.5},\"black_sheet\":"
        "false,"
        "\"photographs\":[" PHOTO ",{\"file\":\"p1.png\",\"set\":\"held-out\",\"light_theta_deg\":150,\"light_phi_"
        "deg\":-10,\"camera_theta_deg\":0,"
        "\"camera_phi_deg\":0,\"cloth_rotation_deg\":90,\"scale\":2,\"crop_px\":[1,2,3,4],\"transfer\":\"srgb\"}],"
        "\"fit\":{\"model\":\"two_lobe_balanced.v1\",\"method\":\"published_sgd.v1\",\"seed\":9,\"max_iterations\":5,"
        "\"path_budget\":100000,"
        "\"fixed\":{\"beta_R\":5,\"C_R.g\":0.5},\"start\":{\"C_TT\":[0.1,0.2,0.3],\"C_R.r\":0.9},\"render_px\":32,"
        "\"render_samples\":2}}");
    assert_int_equal(d->scan->n_file, 2);
    assert_string_equal(d->scan->axes, "-z-x-y");
    assert_int_equal(d->scan->crop_voxel[5], 12);
    assert_false(d->setup->black_sheet);
    assert_int_equal(d->rows->photograph[1].set, JOB_SET_HELD_OUT);
    assert_true(d->rows->photograph[1].transfer == JOB_TRANSFER_SRGB && d->rows->photograph[1].scale == 2.0 &&
                d->rows->photograph[1].light_theta_deg == 150.0);
    const struct scattering_model *m = scattering_find(d->fit->model[0].id);
    assert_true(d->fit->model[0].start[scattering_param_index(m, "C_TT.b")] == 0.3);
    assert_true(isnan(d->fit->model[0].start[scattering_param_index(m, "C_R.b")]));
    assert_true(d->fit->model[0].fixed[scattering_param_index(m, "C_R.g")] == 0.5);
    assert_true(d->fit->model[0].fixed[scattering_param_index(m, "beta_R")] == 5.0);
    job_document_free(d);
}

static void test_geometry_only(void **state)
{
    (void)state;
    struct job_document *doc = NULL;
    const char *alone = "{\"sample\":\"s\"," VOLUME "}",
               *on = "{\"sample\":\"s\",\"geometry\":{\"job\":\"5e0c-1\"},\"measurements\":{\"file\":\"a.csv\"}}";
    assert_int_equal(job_document_parse(alone, strlen(alone), &doc, NULL), STATUS_OK);
    struct job_sections section = job_document_sections(doc);
    assert_true(job_sections_kind(&section) == JOB_OF_GEOMETRY && doc->scan->given &&
                doc->scan->geometry_job[0] == '\0');
    job_document_free(doc);
    assert_int_equal(job_document_parse(on, strlen(on), &doc, NULL), STATUS_OK);
    section = job_document_sections(doc);
    assert_true(job_sections_kind(&section) != JOB_OF_GEOMETRY && !doc->scan->given);
    assert_string_equal(doc->scan->geometry_job, "5e0c-1");
    job_document_free(doc);
}

static void test_structure(void **state)
{
    (void)state;
    job_document_check_error("{", "", "not valid JSON");
    job_document_check_error("[]", "", "must be an object");
    job_document_check_error("{\"sample\":\"s\",\"sample\":\"t\"}", "", "duplicate");
    job_document_check_error("{\"sampel\":\"s\"}", "sampel", "did you mean 'sample'? Allowed here are sample, volume");
    job_document_check_error("{\"sample\":\"\"}", "sample", "1 to");
    job_document_check_error("{\"sample\":7}", "sample", "must be a text, but it is a number");
    job_document_check_error("{\"sample\":\"a\\u0001b\"}", "sample", "control");
    job_document_check_error("{\"sample\":\"s\"}", "volume", "missing");
    job_document_check_error("{\"sample\":\"s\"," VOLUME ",\"fibers\":{\"file\":\"a.hair\"}}", "fibers", "one of them");
    job_document_check_error("{\"sample\":\"s\"," VOLUME ",\"fit\":{}}", "photographs", "'fit' is given");
    job_document_check_error("{\"sample\":\"s\"," VOLUME ",\"correction\":{}}", "photographs", "'correction' is given");
    job_document_check_error("{\"sample\":\"s\",\"fibers\":{\"file\":\"a.hair\"}}", "photographs", "missing");
    job_document_check_error("{\"sample\":\"s\",\"geometry\":{\"job\":\"x\"}}", "photographs", "missing");
    job_document_check_error("{\"sample\":\"s\",\"geometry\":{\"job\":\"a/b\"}}", "geometry.job",
                             "not the id of a job");
    job_document_check_error("{\"sample\":\"s\"," VOLUME
                             ",\"measurements\":{\"file\":\"a.csv\"},\"photographs\":[" PHOTO "]}",
                             "photographs", "one of them");
    job_document_check_error("{\"sample\":\"s\"," VOLUME ",\"photographs\":[]}", "photographs", "1 to 1024");
    job_document_check_error("{\"sample\":\"s\"," VOLUME ",\"photographs\":[" PHOTO "," PHOTO "]}",
                             "photographs[1].file", "second time");
    job_document_check_error("{\"sample\":\"s\"," VOLUME ",\"measurements\":{\"file\":\"scan.tif\"}}",
                             "volume.files[0]", "second time");
    job_document_check_error("{\"sample\":\"s\"," VOLUME ",\"measurements\":{\"file\":\"../a.csv\"}}",
                             "measurements.file", "127 bytes of UTF-8");
    job_document_check_error("{\"sample\":\"s\"," VOLUME ",\"measurements\":{}}", "measurements.file", "missing");
    job_document_check_error("{\"sample\":\"s\"," VOLUME
                             ",\"measurements\":{\"file\":\"a.csv\"},\"lamp\":{\"side_cm\":true}}",
                             "lamp.side_cm", "true or false");
    job_document_check_error("{\"sample\":\"s\"," VOLUME ",\"measurements\":{\"file\":\"a.csv\"},\"black_sheet\":1}",
                             "black_sheet", "true or false");
}

static void test_volume(void **state)
{
    (void)state;
    job_document_check_error("{\"sample\":\"s\",\"volume\":{},\"photographs\":[" PHOTO "]}", "volume.files",
                             "list of 1 to");
    job_document_check_error("{\"sample\":\"s\",\"volume\":{\"files\":[\"a\\\\b\"]}}", "volume.files[0]",
                             "a file name");
    job_document_check_error(VOLUME_OF("\"voxel_size_um\":0"), "volume.voxel_size_um", "0.01 to 1000");
    job_document_check_error(VOLUME_OF("\"voxel_size_um\":[1,2]"), "volume.voxel_size_um", "3 numbers");
    job_document_check_error(VOLUME_OF("\"voxel_size_um\":[1,2,-1]"), "volume.voxel_size_um[2]", "-1");
    job_document_check_error(VOLUME_OF("\"axes\":\"xxy\""), "volume.axes", "each of x, y, z once");
    job_document_check_error(VOLUME_OF("\"matrix\":[1,0,0,0,1,0,1,0,0]"), "volume.matrix", "invertible");
    job_document_check_error(VOLUME_OF("\"crop_voxel\":[5,0,0,5,9,9]"), "volume.crop_voxel", "empty along x");
    job_document_check_error(VOLUME_OF("\"density_low\":5,\"density_high\":5"), "volume.density_high", "above");
    job_document_check_error(VOLUME_OF("\"filter\":{\"eps_d\":2}"), "volume.filter.eps_d", "0 to 1");
    job_document_check_error(VOLUME_OF("\"filter\":{\"s\":2,\"t\":1}"), "volume.filter.t", "above half of s (2)");
    job_document_check_error(VOLUME_OF("\"filter\":{\"h\":1.5}"), "volume.filter.h", "whole number");
    job_document_check_error(VOLUME_OF("\"filter\":{\"h\":64}"), "volume.filter.h", "3 to 63");
    job_document_check_error(VOLUME_OF("\"filter\":{\"epsd\":1}"), "volume.filter.epsd", "unknown field");
    job_document_check_error(VOLUME_OF("\"density_low\":1e999"), "", "not valid JSON");
}

/* A given matrix or box replaces "auto". */
static void test_alignment(void **state)
{
    (void)state;
    struct job_document *d =
        job_document_of_text(VOLUME_OF("\"align\":\"auto\",\"crop\":\"auto\",\"crop_keep\":0.3,\"join_seams\":false,"
                                       "\"transfer_directions\":false,\"three_subvolumes\":true"));
    assert_true(d->scan->align && d->scan->crop && d->scan->crop_keep == 0.3 && !d->scan->join_seams);
    assert_true(!d->scan->transfer_directions && d->scan->three_subvolumes);
    job_document_free(d);
    d = job_document_of_text(
        VOLUME_OF("\"align\":\"auto\",\"crop\":\"auto\",\"matrix\":[1,0,0,0,1,0,0,0,1],\"crop_voxel\":[0,0,0,9,9,9]"));
    assert_true(!d->scan->align && !d->scan->crop && d->scan->join_seams && d->scan->transfer_directions &&
                !d->scan->three_subvolumes && isnan(d->scan->crop_keep));
    job_document_free(d);
    job_document_check_error(VOLUME_OF("\"align\":\"yes\""), "volume.align", "auto");
    job_document_check_error(VOLUME_OF("\"crop\":true"), "volume.crop", "none, auto");
    job_document_check_error(VOLUME_OF("\"crop_keep\":0"), "volume.crop_keep", "0.1 to 1");
}

static void test_photographs(void **state)
{
    (void)state;
    job_document_check_error(PHOTO_OF("\"camera_theta_deg\":0"), "photographs[0].light_theta_deg", "missing");
    job_document_check_error(PHOTO_OF("\"camera_theta_deg\":0,\"light_theta_deg\":90"),
                             "photographs[0].light_theta_deg", "below 90");
    job_document_check_error(PHOTO_OF("\"camera_theta_deg\":0,\"light_theta_deg\":120"),
                             "photographs[0].light_theta_deg", "black_sheet");
    job_document_check_error(PHOTO_OF("\"camera_theta_deg\":91,\"light_theta_deg\":10"),
                             "photographs[0].camera_theta_deg", "91");
    job_document_check_error(PHOTO_OF("\"camera_theta_deg\":-1,\"light_theta_deg\":10"),
                             "photographs[0].camera_theta_deg", "-1");
    job_document_check_error(PHOTO_OF("\"camera_theta_deg\":1,\"light_theta_deg\":10,\"set\":\"test\""),
                             "photographs[0].set", "fit, held-out");
    job_document_check_error(PHOTO_OF("\"camera_theta_deg\":1,\"light_theta_deg\":10,\"scale\":0"),
                             "photographs[0].scale", "1e-09");
    job_document_check_error(PHOTO_OF("\"camera_theta_deg\":1,\"light_theta_deg\":10,\"crop_px\":[4,0,4,5]"),
                             "photographs[0].crop_px", "empty");
    job_document_check_error(PHOTO_OF("\"camera_theta_deg\":1,\"light_theta_deg\":10,\"transfer\":\"gamma\""),
                             "photographs[0].transfer", "linear, srgb");
    job_document_check_error(PHOTO_OF("\"camera_theta_deg\":1,\"light_theta_deg\":10,\"set\":\"held-out\""),
                             "photographs", "at least one");
}

static void test_file_names(void **state)
{
    (void)state;
    assert_true(job_file_name_valid("a-b_c.9"));
    assert_false(job_file_name_valid(""));
    assert_false(job_file_name_valid(".hidden"));
    assert_false(job_file_name_valid("a/b"));
    assert_false(job_file_name_valid("a\nb"));
    static const char *const good[] = {"Probe 3 Gr\u00f6\u00dfe_00.tif", "a&b (2).tif", "\u7d39 1.tif", "a'b.tif",
                                       "100%.csv"};
    static const char *const bad[] = {"a\\b",
                                      "a\x7f",
                                      "a\tb",
                                      "Gr\xf6\xdf"
                                      "e",
                                      "\xc2\x85",
                                      "\xc0\xaf",
                                      "a/../b",
                                      "\xed\xa0\x80"};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) assert_true(job_file_name_valid(good[i]));
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) assert_false(job_file_name_valid(bad[i]));
    char plain[JOB_MAX_NAME_BYTES];
    job_file_name_make_valid("Gr\u00f6\u00dfe 1.tif", plain);
    assert_string_equal(plain, "Gr____e_1.tif");
    char name[200];
    memset(name, 'a', sizeof name);
    name[127] = '\0';
    assert_true(job_file_name_valid(name));
    name[127] = 'a';
    name[128] = '\0';
    assert_false(job_file_name_valid(name));
}

/* A document that is cut anywhere, or has any one byte changed, must not crash the parser. When parsing fails, no
 * document is returned. */
static void test_damage(void **state)
{
    (void)state;
    const char *text =
        FIT_OF("{\"fixed\":{\"beta_R\":5},\"start\":{\"C_TT\":[0.1,0.2,0.3]},\"tied\":[[\"C_R\"],{\"beta_TT\":1,"
               "\"gamma_TT\":2}],"
               "\"bounds\":{\"C_TT\":[0.1,0.9]},\"priors\":{\"C_R.r\":{\"mean\":0.2,\"se\":0.1}},\"starts\":2,"
               "\"nuisance\":{\"gain\":\"global\",\"stray_light\":false},\"texture\":{\"block_mm\":1},\"candidates\":[{"
               "\"light_theta_deg\":1,"
               "\"light_phi_deg\":2,\"camera_theta_deg\":3,\"camera_phi_deg\":4}]}");
    size_t n = strlen(text);
    char *copy = malloc(n + 1);
    for (size_t i = 0; i < n; i++) {
        for (int kind = 0; kind < 4; kind++) {
            static const char other[] = {'\0', '9', '"', '\xff'};
            struct job_document *doc = NULL;
            memcpy(copy, text, n + 1);
            copy[i] = other[kind];
            status s = job_document_parse(copy, kind == 0 ? i : n, &doc, NULL);
            assert_true((s == STATUS_OK) == (doc != NULL));
            job_document_free(doc);
        }
    }
    free(copy);
    struct error err = {0};
    struct job_document *doc = NULL;
    assert_int_equal(job_document_parse(text, (size_t)JOB_MAX_DOCUMENT_BYTES + 1, &doc, &err), STATUS_TOO_LARGE);
}

static void test_stage_weights(void **state)
{
    (void)state;
    size_t n_stage;
    double total = 0.0;
    const struct pipeline_stage_info *stage = pipeline_stage_table(&n_stage);
    for (size_t i = 0; i < n_stage; i++) total += stage[i].weight;
    assert_true(fabs(total - 1.0) < 1e-9);
}

/* A file without a header is described completely, or not at all. */
static void test_raw_volume(void **state)
{
    (void)state;
    struct job_document *d = job_document_of_text(
        VOLUME_OF("\"raw\":{\"shape\":[3,4,5],\"type\":\"uint16\",\"endian\":\"big\",\"header_bytes\":8}"));
    assert_true(d->scan->raw_shape[0] == 3 && d->scan->raw_shape[2] == 5 && d->scan->raw_big_endian &&
                d->scan->raw_header_bytes == 8);
    assert_string_equal(d->scan->raw_type, "uint16");
    job_document_free(d);
    job_document_free(job_document_of_text(VOLUME_OF("\"raw\":{\"shape\":[3,4,5],\"type\":\"uint8\"}")));
    job_document_check_error(VOLUME_OF("\"raw\":{\"shape\":[3,4,5],\"type\":\"uint16\"}"), "volume.raw",
                             "lacks 'endian'");
    job_document_check_error(VOLUME_OF("\"raw\":{\"shape\":[3,4,5]}"), "volume.raw", "lacks 'type'");
    job_document_check_error(VOLUME_OF("\"raw\":{\"type\":\"uint8\"}"), "volume.raw", "lacks 'shape'");
    job_document_check_error(VOLUME_OF("\"raw\":{\"shape\":[3,0,5],\"type\":\"uint8\"}"), "volume.raw.shape[1]",
                             "allowed are 1 to");
    job_document_check_error(VOLUME_OF("\"raw\":{\"shape\":[3,5],\"type\":\"uint8\"}"), "volume.raw.shape", "3");
    job_document_check_error(
        "{\"sample\":\"s\",\"volume\":{\"files\":[\"a.bin\",\"b.bin\"],\"raw\":{\"shape\":[3,4,5],\"type\":\"uint8\"}},"
        "\"photographs\":[" PHOTO "]}",
        "volume.raw", "describes one file, 'volume.files' names 2");
    job_document_check_error(VOLUME_OF("\"raw\":{\"shape\":[3,4,5],\"type\":\"uint12\"}"), "volume.raw.type", "uint8");
    job_document_check_error(VOLUME_OF("\"raw\":{\"shape\":[3,4,5],\"type\":\"uint8\",\"order\":1}"),
                             "volume.raw.order", "order");
}

#define PROFILE(mode, models)                                                                                          \
    "{\"sample\":\"s\",\"profile\":{\"file\":\"p.csv\",\"mode\":\"" mode "\"},\"fit\":{\"models\":[" models "]}}"

/* A mode alone needs a model that has modes apart, which each model of the job must be. */
static void test_mode_of_profile(void **state)
{
    (void)state;
    job_document_free(job_document_of_text(PROFILE("TRT", "\"elliptical_oriented.v1\"")));
    job_document_free(job_document_of_text(PROFILE("all", "\"fur.v1\",\"isotropic.v1\"")));
    job_document_check_error(PROFILE("TRT", "\"elliptical_oriented.v1\",\"fur.v1\""), "profile.mode", "'fur.v1'");
    job_document_check_error(PROFILE("R", "\"elliptical.v1\""), "profile.mode", "'elliptical_oriented.v1' has");
}

/* A stated turn of the section counts in one model at least. */
static void test_turn_of_profile(void **state)
{
    static const char *const document =
        "{\"sample\":\"s\",\"profile\":{\"file\":\"p.csv\",\"turn_deg\":20},\"fit\":{\"models\":[\"fur.v1\"%s]}}";
    char text[400];
    (void)state;
    snprintf(text, sizeof text, document, ",\"textile.v3\"");
    job_document_free(job_document_of_text(text));
    snprintf(text, sizeof text, document, "");
    job_document_check_error(text, "profile.turn_deg", "'fur.v1' does not change");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_defaults),        cmocka_unit_test(test_everything_given),
        cmocka_unit_test(test_geometry_only),   cmocka_unit_test(test_structure),
        cmocka_unit_test(test_volume),          cmocka_unit_test(test_alignment),
        cmocka_unit_test(test_photographs),     cmocka_unit_test(test_file_names),
        cmocka_unit_test(test_damage),          cmocka_unit_test(test_stage_weights),
        cmocka_unit_test(test_raw_volume),      cmocka_unit_test(test_mode_of_profile),
        cmocka_unit_test(test_turn_of_profile),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
