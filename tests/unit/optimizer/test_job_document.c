/* The job document: valid documents are accepted, and each mistake is refused with the path of the field at fault. */
#include "base/catalogue/method_catalogue.h"
#include "base/catalogue/model_catalogue.h"
#include "optimizer/fit/descent/descent.h"
#include "optimizer/job/job_document.h"
#include "optimizer/job/options/option_table.h"
#include "optimizer/job/stage_table.h"
#include "renderer/scattering/appearance.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define PHOTO                                                                                                          \
    "{\"file\":\"p0.exr\",\"set\":\"fit\",\"light_theta_deg\":20,\"light_phi_deg\":0,\"camera_theta_deg\":30,"         \
    "\"camera_phi_deg\":180}"
#define VOLUME "\"volume\":{\"files\":[\"scan.tif\"],\"voxel_size_um\":2}"
#define FIT_OF(fit) "{\"sample\":\"s\"," VOLUME ",\"photographs\":[" PHOTO "],\"fit\":" fit "}"
#define VOLUME_OF(extra)                                                                                               \
    "{\"sample\":\"s\",\"volume\":{\"files\":[\"scan.tif\"]," extra "},\"photographs\":[" PHOTO "]}"
#define PHOTO_OF(extra)                                                                                                \
    "{\"sample\":\"s\"," VOLUME                                                                                        \
    ",\"photographs\":[{\"file\":\"p0.exr\",\"light_phi_deg\":0,\"camera_phi_deg\":180," extra "}]}"

static void check_error(const char *text, const char *field, const char *part)
{
    struct job_document *doc = NULL;
    struct error err = {0};
    assert_int_equal(job_document_parse(text, strlen(text), &doc, &err), STATUS_INVALID);
    assert_null(doc);
    assert_string_equal(err.field, field);
    if (strstr(err.text, part) == NULL) fail_msg("'%s' is not in '%s'", part, err.text);
}

static struct job_document *parse(const char *text)
{
    struct job_document *doc = NULL;
    struct error err = {0};
    if (job_document_parse(text, strlen(text), &doc, &err) != STATUS_OK) fail_msg("%s: %s", err.field, err.text);
    return doc;
}

static void test_defaults(void **state)
{
    (void)state;
    struct job_document *d =
        parse("{\"sample\":\"blue \xc3\xa9toffe\"," VOLUME ",\"measurements\":{\"file\":\"a.csv\"}}");
    assert_true(d->has_volume);
    assert_string_equal(d->volume_file[0], "scan.tif");
    assert_true(d->voxel_size_um[2] == 2.0);
    assert_string_equal(d->axes, "xyz");
    assert_true(isnan(d->density_low) && isnan(d->filter_s) && isnan(d->radius_um) && isnan(d->model[0].fixed[0]) &&
                isnan(d->model[0].start[8]));
    assert_true(d->lamp_side_cm == 10.0 && d->lamp_distance_cm == 61.0 && d->camera_distance_cm == 100.0 &&
                d->crop_cm == 1.0);
    assert_true(d->black_sheet);
    assert_string_equal(d->model[0].id, "two_lobe.v1");
    assert_string_equal(d->method, method_gauss_newton.id);
    assert_int_equal(d->n_photograph, 0);
    assert_int_equal(d->radius_per_axis, -1);
    assert_string_equal(d->measurement_file, "a.csv");
    job_document_free(d);
}

static void test_everything_given(void **state)
{
    (void)state;
    struct job_document *d = parse(
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
    assert_int_equal(d->n_volume_file, 2);
    assert_string_equal(d->axes, "-z-x-y");
    assert_int_equal(d->crop_voxel[5], 12);
    assert_false(d->black_sheet);
    assert_int_equal(d->photograph[1].set, JOB_SET_HELD_OUT);
    assert_true(d->photograph[1].srgb && d->photograph[1].scale == 2.0 && d->photograph[1].light_theta_deg == 150.0);
    const struct scattering_model *m = scattering_find(d->model[0].id);
    assert_true(d->model[0].start[scattering_param_index(m, "C_TT.b")] == 0.3);
    assert_true(isnan(d->model[0].start[scattering_param_index(m, "C_R.b")]));
    assert_true(d->model[0].fixed[scattering_param_index(m, "C_R.g")] == 0.5);
    assert_true(d->model[0].fixed[scattering_param_index(m, "beta_R")] == 5.0);
    job_document_free(d);
}

static void test_structure(void **state)
{
    (void)state;
    check_error("{", "", "not valid JSON");
    check_error("[]", "", "must be an object");
    check_error("{\"sample\":\"s\",\"sample\":\"t\"}", "", "duplicate");
    check_error("{\"sampel\":\"s\"}", "sampel", "allowed here are sample, volume");
    check_error("{\"sample\":\"\"}", "sample", "1 to");
    check_error("{\"sample\":7}", "sample", "must be a text, but it is a number");
    check_error("{\"sample\":\"a\\u0001b\"}", "sample", "control");
    check_error("{\"sample\":\"s\"}", "volume", "missing");
    check_error("{\"sample\":\"s\"," VOLUME ",\"fibers\":{\"file\":\"a.hair\"}}", "fibers", "one of them");
    check_error("{\"sample\":\"s\"," VOLUME "}", "photographs", "missing");
    check_error("{\"sample\":\"s\"," VOLUME ",\"measurements\":{\"file\":\"a.csv\"},\"photographs\":[" PHOTO "]}",
                "photographs", "one of them");
    check_error("{\"sample\":\"s\"," VOLUME ",\"photographs\":[]}", "photographs", "1 to 1024");
    check_error("{\"sample\":\"s\"," VOLUME ",\"photographs\":[" PHOTO "," PHOTO "]}", "photographs[1].file",
                "second time");
    check_error("{\"sample\":\"s\"," VOLUME ",\"measurements\":{\"file\":\"scan.tif\"}}", "volume.files[0]",
                "second time");
    check_error("{\"sample\":\"s\"," VOLUME ",\"measurements\":{\"file\":\"../a.csv\"}}", "measurements.file",
                "A-Z a-z 0-9");
    check_error("{\"sample\":\"s\"," VOLUME ",\"measurements\":{}}", "measurements.file", "missing");
    check_error("{\"sample\":\"s\"," VOLUME ",\"measurements\":{\"file\":\"a.csv\"},\"lamp\":{\"side_cm\":true}}",
                "lamp.side_cm", "true or false");
    check_error("{\"sample\":\"s\"," VOLUME ",\"measurements\":{\"file\":\"a.csv\"},\"black_sheet\":1}", "black_sheet",
                "true or false");
}

static void test_volume(void **state)
{
    (void)state;
    check_error("{\"sample\":\"s\",\"volume\":{},\"photographs\":[" PHOTO "]}", "volume.files", "list of 1 to");
    check_error("{\"sample\":\"s\",\"volume\":{\"files\":[\"a b\"]}}", "volume.files[0]", "a file name");
    check_error(VOLUME_OF("\"voxel_size_um\":0"), "volume.voxel_size_um", "0.01 to 1000");
    check_error(VOLUME_OF("\"voxel_size_um\":[1,2]"), "volume.voxel_size_um", "3 numbers");
    check_error(VOLUME_OF("\"voxel_size_um\":[1,2,-1]"), "volume.voxel_size_um[2]", "-1");
    check_error(VOLUME_OF("\"axes\":\"xxy\""), "volume.axes", "each of x, y, z once");
    check_error(VOLUME_OF("\"matrix\":[1,0,0,0,1,0,1,0,0]"), "volume.matrix", "invertible");
    check_error(VOLUME_OF("\"crop_voxel\":[5,0,0,5,9,9]"), "volume.crop_voxel", "empty along x");
    check_error(VOLUME_OF("\"density_low\":5,\"density_high\":5"), "volume.density_high", "above");
    check_error(VOLUME_OF("\"filter\":{\"eps_d\":2}"), "volume.filter.eps_d", "0 to 1");
    check_error(VOLUME_OF("\"filter\":{\"s\":2,\"t\":1}"), "volume.filter.t", "above half of s (2)");
    check_error(VOLUME_OF("\"filter\":{\"h\":1.5}"), "volume.filter.h", "whole number");
    check_error(VOLUME_OF("\"filter\":{\"h\":64}"), "volume.filter.h", "3 to 63");
    check_error(VOLUME_OF("\"filter\":{\"epsd\":1}"), "volume.filter.epsd", "unknown field");
    check_error(VOLUME_OF("\"density_low\":1e999"), "", "not valid JSON");
}

/* A given matrix or box replaces "auto". */
static void test_alignment(void **state)
{
    (void)state;
    struct job_document *d =
        parse(VOLUME_OF("\"align\":\"auto\",\"crop\":\"auto\",\"crop_keep\":0.3,\"join_seams\":false"));
    assert_true(d->align && d->crop && d->crop_keep == 0.3 && !d->join_seams);
    job_document_free(d);
    d = parse(
        VOLUME_OF("\"align\":\"auto\",\"crop\":\"auto\",\"matrix\":[1,0,0,0,1,0,0,0,1],\"crop_voxel\":[0,0,0,9,9,9]"));
    assert_true(!d->align && !d->crop && d->join_seams && isnan(d->crop_keep));
    job_document_free(d);
    check_error(VOLUME_OF("\"align\":\"yes\""), "volume.align", "auto");
    check_error(VOLUME_OF("\"crop\":true"), "volume.crop", "none, auto");
    check_error(VOLUME_OF("\"crop_keep\":0"), "volume.crop_keep", "0.1 to 1");
}

static void test_photographs(void **state)
{
    (void)state;
    check_error(PHOTO_OF("\"camera_theta_deg\":0"), "photographs[0].light_theta_deg", "missing");
    check_error(PHOTO_OF("\"camera_theta_deg\":0,\"light_theta_deg\":90"), "photographs[0].light_theta_deg",
                "below 90");
    check_error(PHOTO_OF("\"camera_theta_deg\":0,\"light_theta_deg\":120"), "photographs[0].light_theta_deg",
                "black_sheet");
    check_error(PHOTO_OF("\"camera_theta_deg\":91,\"light_theta_deg\":10"), "photographs[0].camera_theta_deg", "91");
    check_error(PHOTO_OF("\"camera_theta_deg\":-1,\"light_theta_deg\":10"), "photographs[0].camera_theta_deg", "-1");
    check_error(PHOTO_OF("\"camera_theta_deg\":1,\"light_theta_deg\":10,\"set\":\"test\""), "photographs[0].set",
                "fit, held-out");
    check_error(PHOTO_OF("\"camera_theta_deg\":1,\"light_theta_deg\":10,\"scale\":0"), "photographs[0].scale", "1e-09");
    check_error(PHOTO_OF("\"camera_theta_deg\":1,\"light_theta_deg\":10,\"crop_px\":[4,0,4,5]"),
                "photographs[0].crop_px", "empty");
    check_error(PHOTO_OF("\"camera_theta_deg\":1,\"light_theta_deg\":10,\"transfer\":\"gamma\""),
                "photographs[0].transfer", "linear, srgb");
    check_error(PHOTO_OF("\"camera_theta_deg\":1,\"light_theta_deg\":10,\"set\":\"held-out\""), "photographs",
                "at least one");
}

static void test_fit(void **state)
{
    (void)state;
    check_error(FIT_OF("{\"model\":\"three_lobe.v1\"}"), "fit.model", "two_lobe.v1");
    check_error(FIT_OF("{\"method\":\"adam\"}"), "fit.method", method_gauss_newton.id);
    check_error(FIT_OF("{\"seed\":-1}"), "fit.seed", "-1");
    check_error(FIT_OF("{\"fixed\":{\"beta_X\":1}}"), "fit.fixed.beta_X", "C_R");
    check_error(FIT_OF("{\"fixed\":{\"beta_R\":50}}"), "fit.fixed.beta_R", "1 to 10");
    check_error(FIT_OF("{\"start\":{\"C_TT\":[0.1,0.2]}}"), "fit.start.C_TT", "3 numbers");
    check_error(FIT_OF("{\"start\":{\"C_TT\":0.5,\"C_TT.r\":0.2}}"), "fit.start.C_TT.r", "second time");
    check_error(FIT_OF("{\"start\":{\"beta_R\":5},\"fixed\":{\"beta_R\":5}}"), "fit.start", "beta_R");
    check_error(FIT_OF("{\"fixed\":{\"beta_R\":5,\"beta_TT\":10,\"gamma_TT\":10,\"C_R\":0.1,\"C_TT\":0.8}}"),
                "fit.fixed", "at least one free");
    check_error(FIT_OF("{\"path_budget\":10}"), "fit.path_budget", "1000");
    check_error(FIT_OF("{\"model\":\"microflake.v1\",\"fit_density\":true}"), "fit.fit_density", "behind the cloth");
    check_error(FIT_OF("{\"fit_density\":true}"), "fit.fit_density", "volume models");
    check_error(FIT_OF("{\"model\":\"microflake.v1\",\"fit_density\":1}"), "fit.fit_density", "true or false");
}

static void resolve(const char *fit, struct job_fit_parameter k[JOB_MAX_PARAM])
{
    struct job_document *d = parse(fit);
    struct appearance m;
    struct error err = {0};
    assert_true(appearance_find(d->model[0].id, &m));
    if (job_fit_resolve(m.param, m.n_param, &d->model[0], k, &err) != STATUS_OK) fail_msg("%s", err.text);
    job_document_free(d);
}

/* two_lobe.v1: C_R 0..2, C_TT 3..5, beta_R 6, beta_TT 7, gamma_TT 8 */
static void test_fit_options(void **state)
{
    (void)state;
    struct job_fit_parameter k[JOB_MAX_PARAM];
    resolve(
        FIT_OF(
            "{\"tied\":[[\"C_R\"],{\"beta_TT\":1,\"gamma_TT\":0.5}],\"bounds\":{\"beta_R\":[2,8],\"gamma_TT\":[6,20]},"
            "\"start\":{\"gamma_TT\":8},\"priors\":{\"beta_R\":{\"mean\":3,\"se\":1}}}"),
        k);
    assert_true(k[6].lower == 2.0 && k[6].upper == 8.0 && k[6].start == 3.0);
    assert_true(fabs(k[7].lower - 12.0) < 1e-12 && fabs(k[7].upper - 40.0) < 1e-12 && fabs(k[7].start - 16.0) < 1e-12);
    assert_true(fabs(k[8].lower - 6.0) < 1e-12 && fabs(k[8].upper - 20.0) < 1e-12 && k[8].start == 8.0);
    resolve(FIT_OF("{\"tied\":[[\"C_R.r\",\"C_R.b\"]],\"fixed\":{\"C_R.b\":0.3}}"), k);
    assert_true(k[0].fixed && k[0].start == 0.3 && !k[1].fixed && k[2].fixed);
    struct job_document *d =
        parse(FIT_OF("{\"starts\":4,\"nuisance\":{\"gain\":\"per_photograph\",\"gain_prior_rel\":0.1,"
                     "\"stray_light\":true},\"models\":[\"two_lobe.v1\",\"two_lobe_balanced.v1\"]}"));
    for (size_t i = 0; i < 2; i++) {
        const struct job_fit_option *o = &d->model[i].option;
        assert_true(o->n_start == 4 && o->gain == JOB_GAIN_PER_PHOTOGRAPH && o->gain_prior_rel == 0.1);
        assert_true(o->stray_light && o->stray_light_prior == 0.01);
    }
    job_document_free(d);
    d = parse(FIT_OF("{\"candidates\":{\"grid\":true}}"));
    assert_int_equal(d->n_candidate, 56);
    job_document_free(d);
    d = parse(FIT_OF(
        "{\"candidates\":[{\"light_theta_deg\":10,\"light_phi_deg\":1,\"camera_theta_deg\":2,\"camera_phi_deg\":3}]}"));
    assert_true(d->n_candidate == 1 && d->candidate[0].camera_phi_deg == 3.0 &&
                d->candidate[0].cloth_rotation_deg == 0.0);
    job_document_free(d);
}

/* The start of the density multiplier in 1/cm, which is the last parameter of phase_two_lobe.v1. */
static void test_start_of_density(void **state)
{
    (void)state;
    static const char prior[] = "\"priors\":{\"density_multiplier\":{\"mean\":800,\"se\":100}}";
    static const struct {
        const char *more;
        double start;
        bool with_prior;
    } golden[] = {{"\"fit_density\":true", 4000.0, false},
                  {"\"fit_density\":true", 800.0, true},
                  {"\"fit_density\":true,\"density_multiplier_per_cm\":2000", 2000.0, false},
                  {"\"fit_density\":true,\"density_multiplier_per_cm\":2000", 2000.0, true},
                  {"\"fit_density\":true,\"bounds\":{\"density_multiplier\":[100,1000]}", 1000.0, false}};
    for (size_t i = 0; i < sizeof golden / sizeof golden[0]; i++) {
        struct job_fit_parameter k[JOB_MAX_PARAM];
        struct appearance m;
        char text[600];
        snprintf(text, sizeof text,
                 "{\"sample\":\"s\"," VOLUME ",\"measurements\":{\"file\":\"a.csv\"},\"black_sheet\":false,"
                 "\"fit\":{\"model\":\"phase_two_lobe.v1\",%s%s%s}}",
                 golden[i].more, golden[i].with_prior ? "," : "", golden[i].with_prior ? prior : "");
        resolve(text, k);
        assert_true(appearance_find("phase_two_lobe.v1", &m));
        if (fabs(k[m.n_param - 1].start - golden[i].start) > 1e-9 * golden[i].start || k[m.n_param - 1].fixed)
            fail_msg("%s: starts at %g", text, k[m.n_param - 1].start);
    }
}

/* The crop of PHOTO is 10 mm. */
static void test_texture(void **state)
{
    (void)state;
    struct job_document *d = parse(FIT_OF("{\"texture\":{\"block_mm\":0.5}}"));
    assert_true(d->texture_block_mm == 0.5 && d->texture_weight == 1.0 && job_texture_cells(d) == 20);
    job_document_free(d);
    d = parse(FIT_OF(
        "{\"texture\":{\"block_mm\":0.85}}")); /* the crop has 11.8 of these blocks, so 12 smaller ones are used */
    assert_true(d->texture_block_mm == 0.85 && job_texture_cells(d) == 12 && job_texture_cell_mm(d) == 10.0 / 12);
    job_document_free(d);
    d = parse(FIT_OF("{\"texture\":{\"block_mm\":5,\"weight\":0},\"method\":\"published_sgd.v1\"}"));
    assert_true(d->texture_block_mm == 5.0 && d->texture_weight == 0.0 && job_texture_cells(d) == 2);
    job_document_free(d);
    d = parse(FIT_OF("{}"));
    assert_true(d->texture_block_mm == 0.0);
    job_document_free(d);
    check_error("{\"sample\":\"s\"," VOLUME
                ",\"measurements\":{\"file\":\"a.csv\"},\"fit\":{\"texture\":{\"block_mm\":1}}}",
                "fit.texture", "needs photographs");
    check_error(FIT_OF("{\"texture\":{}}"), "fit.texture.block_mm", "missing");
    check_error(FIT_OF("{\"texture\":{\"block_mm\":5.1}}"), "fit.texture.block_mm", "2 to 32 blocks");
    check_error(FIT_OF("{\"texture\":{\"block_mm\":0.3}}"), "fit.texture.block_mm", "2 to 32 blocks");
    check_error(FIT_OF("{\"texture\":{\"block_mm\":1,\"weight\":-1}}"), "fit.texture.weight", "-1");
    check_error(FIT_OF("{\"texture\":{\"block_um\":1}}"), "fit.texture.block_um", "unknown field");
    check_error(FIT_OF("{\"texture\":{\"block_mm\":1},\"method\":\"published_sgd.v1\"}"), "fit.texture",
                method_gauss_newton.id);
    check_error(FIT_OF("{\"texture\":{\"block_mm\":1},\"nuisance\":{\"stray_light\":true}}"), "fit.texture",
                "stray_light");
}

static void test_fit_option_errors(void **state)
{
    (void)state;
    check_error(FIT_OF("{\"tied\":[\"C_R\"]}"), "fit.tied[0]", "list of parameter names");
    check_error(FIT_OF("{\"tied\":{}}"), "fit.tied", "list of groups");
    check_error(FIT_OF("{\"tied\":[[\"beta_R\"]]}"), "fit.tied[0]", "at least two");
    check_error(FIT_OF("{\"tied\":[[\"beta_R\",\"beta_R\"]]}"), "fit.tied[0]", "second time");
    check_error(FIT_OF("{\"tied\":[[\"C_R\"],[\"C_R.r\",\"C_TT.r\"]]}"), "fit.tied[1]", "second time");
    check_error(FIT_OF("{\"tied\":[[\"beta_R\",\"beta_X\"]]}"), "fit.tied[0]", "unknown parameter 'beta_X'");
    check_error(FIT_OF("{\"tied\":[[\"beta_R\",\"C_R.r\"]]}"), "fit.tied[0]", "same unit");
    check_error(FIT_OF("{\"tied\":[[\"beta_R\",7]]}"), "fit.tied[0]", "list of parameter names");
    check_error(FIT_OF("{\"tied\":[{\"beta_R\":1,\"beta_TT\":0}]}"), "fit.tied[0].beta_TT", "0.001");
    check_error(FIT_OF("{\"tied\":[{\"beta_R\":10,\"beta_TT\":1}]}"), "fit.tied", "no room");
    check_error(FIT_OF("{\"tied\":[[\"C_R\"]],\"fixed\":{\"C_R\":[0.1,0.2,0.1]}}"), "fit.fixed", "does not allow");
    check_error(FIT_OF("{\"tied\":[[\"C_R\"]],\"start\":{\"C_R\":[0.1,0.2,0.1]}}"), "fit.start", "does not allow");
    check_error(FIT_OF("{\"bounds\":{\"beta_R\":[2]}}"), "fit.bounds.beta_R", "2 numbers");
    check_error(FIT_OF("{\"bounds\":{\"beta_R\":[5,5]}}"), "fit.bounds.beta_R", "below the second");
    check_error(FIT_OF("{\"bounds\":{\"beta_R\":[0,5]}}"), "fit.bounds.beta_R[0]", "1 to 10");
    check_error(FIT_OF("{\"bounds\":{\"C_R\":[0.1,0.5],\"C_R.g\":[0.1,0.2]}}"), "fit.bounds.C_R.g", "second time");
    check_error(FIT_OF("{\"bounds\":{\"beta_R\":[2,4]},\"start\":{\"beta_R\":5}}"), "fit.start", "2 and 4");
    check_error(FIT_OF("{\"bounds\":{\"beta_R\":[2,4]},\"fixed\":{\"beta_R\":5}}"), "fit.fixed", "2 and 4");
    check_error(FIT_OF("{\"tied\":[{\"beta_TT\":1,\"gamma_TT\":2}],\"fixed\":{\"gamma_TT\":10}}"), "fit.fixed",
                "'gamma_TT' at 10: its bounds are 20 and 45, with those of what 'fit.tied' ties it to");
    check_error(FIT_OF("{\"tied\":[{\"beta_TT\":1,\"gamma_TT\":2}],\"start\":{\"beta_TT\":40}}"), "fit.start",
                "'beta_TT' at 40: its bounds are 10 and 22.5, with");
    check_error(
        FIT_OF("{\"tied\":[{\"beta_TT\":1,\"gamma_TT\":2}],\"fixed\":{\"gamma_TT\":30},\"start\":{\"beta_TT\":20}}"),
        "fit.start", "'beta_TT', which 'fit.fixed' holds fixed");
    check_error(FIT_OF("{\"fit_radius\":1}"), "fit.fit_radius", "true, false or an object of lower_um and upper_um");
    check_error(FIT_OF("{\"priors\":{\"beta_R\":{\"mean\":5}}}"), "fit.priors.beta_R.se", "missing");
    check_error(FIT_OF("{\"priors\":{\"beta_R\":{\"mean\":50,\"se\":1}}}"), "fit.priors.beta_R.mean", "1 to 10");
    check_error(FIT_OF("{\"priors\":{\"beta_R\":{\"mean\":5,\"se\":0}}}"), "fit.priors.beta_R.se", "0");
    check_error(FIT_OF("{\"priors\":{\"beta_R\":{\"mean\":5,\"sd\":1}}}"), "fit.priors.beta_R.sd", "unknown field");
    check_error(FIT_OF("{\"priors\":{\"beta_R\":{\"mean\":5,\"se\":1}},\"fixed\":{\"beta_R\":5}}"), "fit.priors",
                "fixed");
    check_error(FIT_OF("{\"priors\":{\"beta_R\":{\"mean\":5,\"se\":1}},\"method\":\"published_sgd.v1\"}"), "fit.priors",
                method_gauss_newton.id);
    check_error(FIT_OF("{\"tied\":[{\"beta_TT\":1,\"gamma_TT\":0.2}],\"priors\":{\"gamma_TT\":{\"mean\":1,\"se\":1}}}"),
                "fit.priors", "10 and 45");
    check_error(FIT_OF("{\"bounds\":{\"beta_R\":[2,4]},\"priors\":{\"beta_R\":{\"mean\":9,\"se\":0.01}}}"),
                "fit.priors", "'beta_R' at 9 +- 0.01, its bounds are 2 and 4");
    check_error(FIT_OF("{\"bounds\":{\"beta_TT\":[30,40]},\"tied\":[{\"beta_TT\":2,\"gamma_TT\":1}],"
                       "\"priors\":{\"gamma_TT\":{\"mean\":10,\"se\":1}}}"),
                "fit.priors", "'gamma_TT' at 10 +- 1, its bounds are 15 and 20");
    job_document_free(parse(FIT_OF("{\"bounds\":{\"beta_R\":[2,4]},\"priors\":{\"beta_R\":{\"mean\":5,\"se\":1}}}")));
    check_error(FIT_OF("{\"nuisance\":{\"stray_light\":true},\"method\":\"published_sgd.v1\"}"), "fit.nuisance",
                method_gauss_newton.id);
    check_error(FIT_OF("{\"nuisance\":{\"gain\":\"each\"}}"), "fit.nuisance.gain", "per_photograph");
    check_error(FIT_OF("{\"nuisance\":{\"gain_prior_rel\":0}}"), "fit.nuisance.gain_prior_rel", "0.0001");
    check_error(FIT_OF("{\"nuisance\":{\"gain_prior_rel\":0.1}}"), "fit.nuisance.gain_prior_rel", "no gain");
    check_error(FIT_OF("{\"nuisance\":{\"gain\":\"none\",\"gain_prior_rel\":0.1}}"), "fit.nuisance.gain_prior_rel",
                "'fit.nuisance.gain'");
    check_error(FIT_OF("{\"nuisance\":{\"gain\":\"global\",\"stray_light_prior\":0.1}}"),
                "fit.nuisance.stray_light_prior", "no stray light");
    check_error(FIT_OF("{\"nuisance\":{\"stray_light\":false,\"stray_light_prior\":0.1}}"),
                "fit.nuisance.stray_light_prior", "'fit.nuisance.stray_light'");
    job_document_free(parse(FIT_OF("{\"nuisance\":{\"gain\":\"global\",\"gain_prior_rel\":0.1,\"stray_light\":true,"
                                   "\"stray_light_prior\":0.1}}")));
    check_error(FIT_OF("{\"candidates\":[]}"), "fit.candidates", "1 to 1024");
    check_error(FIT_OF("{\"candidates\":{\"gird\":true}}"), "fit.candidates.gird", "unknown field");
    check_error(FIT_OF("{\"candidates\":[{\"light_theta_deg\":95}]}"), "fit.candidates[0].light_theta_deg", "below 90");
    check_error(FIT_OF("{\"candidates\":[7]}"), "fit.candidates[0]", "must be an object");
    check_error(FIT_OF("{\"starts\":0}"), "fit.starts", "1 to 16");
    check_error(FIT_OF("{\"starts\":2,\"max_iterations\":1000}"), "fit.max_iterations", "500");
    check_error(PHOTO_OF("\"camera_theta_deg\":1,\"light_theta_deg\":10,\"weight\":-1"), "photographs[0].weight", "-1");
}

static void test_bounds_are_values(void **state)
{
    (void)state;
    struct job_document *d = parse(FIT_OF("{\"start\":{\"beta_TT\":45,\"gamma_TT\":1},\"fixed\":{\"C_TT\":0.999}}"));
    const struct scattering_model *m = scattering_find(d->model[0].id);
    assert_true(fabs(d->model[0].start[scattering_param_index(m, "beta_TT")] - 45.0) < 1e-9);
    assert_true(d->model[0].fixed[scattering_param_index(m, "C_TT.g")] == 0.999);
    job_document_free(d);
}

static void test_file_names(void **state)
{
    (void)state;
    assert_true(job_file_name_valid("a-b_c.9"));
    assert_false(job_file_name_valid(""));
    assert_false(job_file_name_valid(".hidden"));
    assert_false(job_file_name_valid("a/b"));
    assert_false(job_file_name_valid("a\nb"));
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

/* A term of the objective is refused for exactly those methods that do not take it. The error names one that does. */
static void test_methods_get_what_they_take(void **state)
{
    static const struct {
        unsigned ability;
        const char *field, *term;
    } wanted[METHOD_N_ABILITY + 1] = {
        {METHOD_TAKES_PRIORS, "fit.priors", "\"priors\":{\"beta_R\":{\"mean\":5,\"se\":1}}"},
        {METHOD_TAKES_NUISANCE, "fit.nuisance", "\"nuisance\":{\"gain\":\"global\"}"},
        {METHOD_TAKES_NUISANCE, "fit.nuisance", "\"nuisance\":{\"stray_light\":true}"},
        {METHOD_TAKES_TEXTURE, "fit.texture", "\"texture\":{\"block_mm\":1}"},
    };
    (void)state;
    const struct method_info *m;
    for (size_t i = 0; (m = method_catalogue_at(i)) != NULL; i++) {
        char text[1000];
        for (size_t k = 0; k < sizeof wanted / sizeof *wanted; k++) {
            snprintf(text, sizeof text, FIT_OF("{\"method\":\"%s\",%s}"), m->id, wanted[k].term);
            if ((m->takes & wanted[k].ability) != 0)
                job_document_free(parse(text));
            else
                check_error(text, wanted[k].field, method_catalogue_taking(wanted[k].ability)->id);
        }
        const char *const starts = FIT_OF("{\"method\":\"%s\",\"starts\":2,\"max_iterations\":%zu}");
        snprintf(text, sizeof text, starts, m->id, m->max_iteration_of_starts);
        job_document_free(parse(text));
        snprintf(text, sizeof text, starts, m->id, m->max_iteration_of_starts + 1);
        check_error(text, "fit.max_iterations", "several starts");
    }
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
    struct job_document *d =
        parse(VOLUME_OF("\"raw\":{\"shape\":[3,4,5],\"type\":\"uint16\",\"endian\":\"big\",\"header_bytes\":8}"));
    assert_true(d->raw_shape[0] == 3 && d->raw_shape[2] == 5 && d->raw_big_endian && d->raw_header_bytes == 8);
    assert_string_equal(d->raw_type, "uint16");
    job_document_free(d);
    job_document_free(parse(VOLUME_OF("\"raw\":{\"shape\":[3,4,5],\"type\":\"uint8\"}")));
    check_error(VOLUME_OF("\"raw\":{\"shape\":[3,4,5],\"type\":\"uint16\"}"), "volume.raw", "lacks 'endian'");
    check_error(VOLUME_OF("\"raw\":{\"shape\":[3,4,5]}"), "volume.raw", "lacks 'type'");
    check_error(VOLUME_OF("\"raw\":{\"type\":\"uint8\"}"), "volume.raw", "lacks 'shape'");
    check_error(VOLUME_OF("\"raw\":{\"shape\":[3,0,5],\"type\":\"uint8\"}"), "volume.raw.shape[1]", "allowed are 1 to");
    check_error(VOLUME_OF("\"raw\":{\"shape\":[3,5],\"type\":\"uint8\"}"), "volume.raw.shape", "3");
    check_error(
        "{\"sample\":\"s\",\"volume\":{\"files\":[\"a.bin\",\"b.bin\"],\"raw\":{\"shape\":[3,4,5],\"type\":\"uint8\"}},"
        "\"photographs\":[" PHOTO "]}",
        "volume.raw", "describes one file, 'volume.files' names 2");
    check_error(VOLUME_OF("\"raw\":{\"shape\":[3,4,5],\"type\":\"uint12\"}"), "volume.raw.type", "uint8");
    check_error(VOLUME_OF("\"raw\":{\"shape\":[3,4,5],\"type\":\"uint8\",\"order\":1}"), "volume.raw.order", "order");
}

/* The row of the density multiplier has the range and the start of the models' parameter. */
static void test_density_row(void **state)
{
    (void)state;
    const struct job_option *row = job_option_find("fit.density_multiplier_per_cm");
    const struct model_info *m;
    size_t n = 0;
    for (size_t i = 0; (m = model_catalogue_at(i)) != NULL; i++) {
        if (m->kind != MODEL_VOLUME) continue;
        const struct param_info *d = &m->param[m->n_param - 1];
        assert_true(fabs(row->lower / param_to_file_unit(d, d->lower) - 1.0) < 1e-12);
        assert_true(fabs(row->upper / param_to_file_unit(d, d->upper) - 1.0) < 1e-12);
        assert_true(fabs(strtod(row->left_out, NULL) / param_to_file_unit(d, d->start) - 1.0) < 1e-12);
        n++;
    }
    assert_true(n >= 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_density_row),
        cmocka_unit_test(test_raw_volume),
        cmocka_unit_test(test_alignment),
        cmocka_unit_test(test_defaults),
        cmocka_unit_test(test_everything_given),
        cmocka_unit_test(test_structure),
        cmocka_unit_test(test_volume),
        cmocka_unit_test(test_photographs),
        cmocka_unit_test(test_fit),
        cmocka_unit_test(test_fit_options),
        cmocka_unit_test(test_start_of_density),
        cmocka_unit_test(test_texture),
        cmocka_unit_test(test_fit_option_errors),
        cmocka_unit_test(test_bounds_are_values),
        cmocka_unit_test(test_file_names),
        cmocka_unit_test(test_damage),
        cmocka_unit_test(test_methods_get_what_they_take),
        cmocka_unit_test(test_stage_weights),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
