/* The section fit of the job document: models, methods, parameters, ties, bounds, priors, textures. */
#include "base/catalogue/method_catalogue.h"
#include "base/catalogue/model_sets.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_document.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_fit_option.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/options/option_table.h"
#include "renderer/scattering/appearance.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/job_document_text.h"

static void test_fit(void **state)
{
    (void)state;
    job_document_check_error(FIT_OF("{\"model\":\"three_lobe.v1\"}"), "fit.model", "two_lobe.v1");
    job_document_check_error(FIT_OF("{\"method\":\"adam\"}"), "fit.method", method_gauss_newton.id);
    job_document_check_error(FIT_OF("{\"seed\":-1}"), "fit.seed", "-1");
    job_document_check_error(FIT_OF("{\"fixed\":{\"beta_X\":1}}"), "fit.fixed.beta_X", "C_R");
    job_document_check_error(FIT_OF("{\"fixed\":{\"beta_R\":50}}"), "fit.fixed.beta_R", "1 to 30");
    job_document_check_error(FIT_OF("{\"start\":{\"C_TT\":[0.1,0.2]}}"), "fit.start.C_TT", "3 numbers");
    job_document_check_error(FIT_OF("{\"start\":{\"C_TT\":0.5,\"C_TT.r\":0.2}}"), "fit.start.C_TT.r", "second time");
    job_document_check_error(FIT_OF("{\"start\":{\"beta_R\":5},\"fixed\":{\"beta_R\":5}}"), "fit.start", "beta_R");
    job_document_check_error(
        FIT_OF("{\"model\":\"two_lobe.v1\",\"fixed\":{\"beta_R\":5,\"beta_TT\":10,\"gamma_TT\":10,\"C_R\":0.1,"
               "\"C_TT\":0.8}}"),
        "fit.fixed", "at least one free");
    job_document_check_error(FIT_OF("{\"path_budget\":10}"), "fit.path_budget", "1000");
    job_document_check_error(FIT_OF("{\"model\":\"microflake.v1\",\"fit_density\":true}"), "fit.fit_density",
                             "behind the cloth");
    job_document_check_error(FIT_OF("{\"fit_density\":true}"), "fit.fit_density", "volume models");
    job_document_check_error(FIT_OF("{\"model\":\"microflake.v1\",\"fit_density\":1}"), "fit.fit_density",
                             "true or false");
}

static void resolve(const char *fit, struct job_fit_parameter k[JOB_MAX_PARAM])
{
    const struct job_document *d = job_document_of_text(fit);
    static struct model_sets m;
    const struct job_cloth *cloth = d->cloth;
    struct error err = {0};
    assert_int_equal(model_sets_init(&m, model_catalogue_find(d->fit->model[0].id), cloth->group, cloth->n_group, &err),
                     STATUS_OK);
    if (job_fit_resolve(m.info.param, m.info.n_param, &d->fit->model[0], k, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    job_document_free((struct job_document *)(uintptr_t)d);
}

static void test_names_of_groups(void **state)
{
    (void)state;
    struct job_document *d = job_document_of_text(FIBERS_OF("\"groups\":[\"warp\",\"we-ft_2\"]"));
    assert_int_equal(d->cloth->n_group, 2);
    assert_string_equal(d->cloth->group[1], "we-ft_2");
    job_document_free(d);
    job_document_check_error(FIBERS_OF("\"groups\":[\"warp\"]"), "fibers.groups", "2 to 8");
    job_document_check_error(FIBERS_OF("\"groups\":\"warp\""), "fibers.groups", "2 to 8");
    job_document_check_error(FIBERS_OF("\"groups\":[\"warp\",\"warp\"]"), "fibers.groups[1]", "second time");
    job_document_check_error(FIBERS_OF("\"groups\":[\"warp\",\"a.b\"]"), "fibers.groups[1]", "1 to 20");
    job_document_check_error(FIBERS_OF("\"groups\":[\"warp\",3]"), "fibers.groups[1]", "1 to 20");
    job_document_check_error(FIBERS_OF("\"groups\":[\"warp\",\"abcdefghijabcdefghijk\"]"), "fibers.groups[1]",
                             "1 to 20");
    job_document_check_error(
        "{\"sample\":\"s\",\"fibers\":{\"file\":\"c.hair\",\"groups\":[\"a\",\"b\",\"c\",\"d\",\"e\",\"f\","
        "\"g\",\"h\"]},"
        "\"photographs\":[" PHOTO "],\"fit\":{}}",
        "fit.model", "104");
}

/* Names with that of a group concern its set, names without it concern all sets. */
static void test_parameters_of_groups(void **state)
{
    (void)state;
    struct job_fit_parameter k[JOB_MAX_PARAM];
    resolve(GROUPS_OF("{\"model\":\"two_lobe.v1\",\"start\":{\"C_R\":[0.1,0.2,0.3],\"warp.C_TT\":0.5,\"weft.C_TT\":[0."
                      "6,0.7,0.8]},"
                      "\"fixed\":{\"beta_R\":5,\"weft.gamma_TT\":19},\"bounds\":{\"warp.beta_TT\":[12,30]},"
                      "\"priors\":{\"weft.beta_TT\":{\"mean\":21,\"se\":1}}}"),
            k);
    for (size_t s = 0; s < 2; s++)
        for (size_t c = 0; c < 3; c++) {
            assert_true(k[9 * s + c].start == 0.1 * (double)(c + 1) || fabs(k[9 * s + c].start - 0.3) < 1e-12);
            assert_true(fabs(k[9 * s + 3 + c].start - (s == 0 ? 0.5 : 0.6 + 0.1 * (double)c)) < 1e-12);
        }
    assert_true(k[6].fixed && k[15].fixed && !k[8].fixed && k[17].fixed && k[17].start == 19.0);
    assert_true(k[7].lower == 12.0 && k[7].upper == 30.0 && k[16].upper == 45.0 && k[16].start == 21.0);
    resolve(GROUPS_OF("{\"model\":\"two_lobe.v1\",\"tied\":[[\"beta_TT\"],{\"warp.C_R\":1,\"weft.C_R\":0.5}],\"start\":"
                      "{\"weft.beta_TT\":17}}"),
            k);
    assert_true(k[7].start == 17.0 && k[16].start == 17.0 && k[9].start == 0.5 * k[0].start);
    const struct job_document *d =
        job_document_of_text(GROUPS_OF("{\"model\":\"two_lobe.v1\",\"tied\":[[\"beta_TT\"]]}"));
    assert_true(d->fit->model[0].option.leader[16] == 7 && d->fit->model[0].option.leader[17] == 17);
    job_document_free((struct job_document *)(uintptr_t)d);
    job_document_check_error(GROUPS_OF("{\"fixed\":{\"pile.C_R\":0.1}}"), "fit.fixed.pile.C_R", "or weft.C_R ...");
    job_document_check_error(GROUPS_OF("{\"start\":{\"C_R\":[0.1,0.2,0.3,0.1,0.2,0.3]}}"), "fit.start.C_R",
                             "3 numbers");
    job_document_check_error(GROUPS_OF("{\"start\":{\"C_R\":0.1,\"weft.C_R\":0.2}}"), "fit.start.weft.C_R",
                             "second time");
    job_document_check_error(GROUPS_OF("{\"tied\":[[\"warp.beta_TT\"]]}"), "fit.tied[0]", "at least two");
    job_document_check_error(FIT_OF("{\"fixed\":{\"warp.C_R\":0.1}}"), "fit.fixed.warp.C_R", "C_R");
}

/* A volume model has one set in any cloth, and keys that name a group then concern the surface models. */
static void test_groups_and_volume_models(void **state)
{
    (void)state;
    struct job_document *d = job_document_of_text(
        GROUPS_OF("{\"models\":[\"microflake.v1\",\"two_lobe.v1\"],\"start\":{\"weft.C_R\":0.2}}"));
    assert_true(d->fit->model[1].start[9] == 0.2 && isnan(d->fit->model[0].start[9]));
    job_document_free(d);
}

/* two_lobe.v1: C_R 0..2, C_TT 3..5, beta_R 6, beta_TT 7, gamma_TT 8 */
static void test_fit_options(void **state)
{
    (void)state;
    struct job_fit_parameter k[JOB_MAX_PARAM];
    resolve(FIT_OF("{\"model\":\"two_lobe.v1\",\"tied\":[[\"C_R\"],{\"beta_TT\":1,\"gamma_TT\":0.5}],\"bounds\":{"
                   "\"beta_R\":[2,8],\"gamma_TT\":[6,20]},"
                   "\"start\":{\"gamma_TT\":8},\"priors\":{\"beta_R\":{\"mean\":3,\"se\":1}}}"),
            k);
    assert_true(k[6].lower == 2.0 && k[6].upper == 8.0 && k[6].start == 3.0);
    assert_true(fabs(k[7].lower - 12.0) < 1e-12 && fabs(k[7].upper - 40.0) < 1e-12 && fabs(k[7].start - 16.0) < 1e-12);
    assert_true(fabs(k[8].lower - 6.0) < 1e-12 && fabs(k[8].upper - 20.0) < 1e-12 && k[8].start == 8.0);
    resolve(FIT_OF("{\"model\":\"two_lobe.v1\",\"tied\":[[\"C_R.r\",\"C_R.b\"]],\"fixed\":{\"C_R.b\":0.3}}"), k);
    assert_true(k[0].fixed && k[0].start == 0.3 && !k[1].fixed && k[2].fixed);
    struct job_document *d =
        job_document_of_text(FIT_OF("{\"starts\":4,\"nuisance\":{\"gain\":\"per_photograph\",\"gain_prior_rel\":0.1,"
                                    "\"stray_light\":true},\"models\":[\"two_lobe.v1\",\"two_lobe_balanced.v1\"]}"));
    for (size_t i = 0; i < 2; i++) {
        const struct job_fit_option *o = &d->fit->model[i].option;
        assert_true(o->n_start == 4 && o->gain == JOB_GAIN_PER_PHOTOGRAPH && o->gain_prior_rel == 0.1);
        assert_true(o->stray_light && o->stray_light_prior == 0.01);
    }
    job_document_free(d);
    d = job_document_of_text(FIT_OF("{\"candidates\":{\"grid\":true}}"));
    assert_int_equal(d->fit->n_candidate, 56);
    job_document_free(d);
    d = job_document_of_text(FIT_OF(
        "{\"candidates\":[{\"light_theta_deg\":10,\"light_phi_deg\":1,\"camera_theta_deg\":2,\"camera_phi_deg\":3}]}"));
    assert_true(d->fit->n_candidate == 1 && d->fit->candidate[0].camera_phi_deg == 3.0 &&
                d->fit->candidate[0].cloth_rotation_deg == 0.0);
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
    struct job_document *d = job_document_of_text(FIT_OF("{\"texture\":{\"block_mm\":0.5}}"));
    assert_true(d->fit->texture_block_mm == 0.5 && d->fit->texture_weight == 1.0 &&
                job_texture_cells(d->setup->crop_cm, d->fit->texture_block_mm) == 20);
    job_document_free(d);
    d = job_document_of_text(FIT_OF(
        "{\"texture\":{\"block_mm\":0.85}}")); /* the crop has 11.8 of these blocks, so 12 smaller ones are used */
    assert_true(d->fit->texture_block_mm == 0.85 &&
                job_texture_cells(d->setup->crop_cm, d->fit->texture_block_mm) == 12 &&
                job_texture_cell_mm(d->setup->crop_cm, d->fit->texture_block_mm) == 10.0 / 12);
    job_document_free(d);
    d = job_document_of_text(FIT_OF("{\"texture\":{\"block_mm\":5,\"weight\":0},\"method\":\"published_sgd.v1\"}"));
    assert_true(d->fit->texture_block_mm == 5.0 && d->fit->texture_weight == 0.0 &&
                job_texture_cells(d->setup->crop_cm, d->fit->texture_block_mm) == 2);
    job_document_free(d);
    d = job_document_of_text(FIT_OF("{}"));
    assert_true(d->fit->texture_block_mm == 0.0);
    job_document_free(d);
    job_document_check_error("{\"sample\":\"s\"," VOLUME
                             ",\"measurements\":{\"file\":\"a.csv\"},\"fit\":{\"texture\":{\"block_mm\":1}}}",
                             "fit.texture", "needs photographs");
    job_document_check_error(FIT_OF("{\"texture\":{}}"), "fit.texture.block_mm", "missing");
    job_document_check_error(FIT_OF("{\"texture\":{\"block_mm\":5.1}}"), "fit.texture.block_mm", "2 to 32 blocks");
    job_document_check_error(FIT_OF("{\"texture\":{\"block_mm\":0.3}}"), "fit.texture.block_mm", "2 to 32 blocks");
    job_document_check_error(FIT_OF("{\"texture\":{\"block_mm\":1,\"weight\":-1}}"), "fit.texture.weight", "-1");
    job_document_check_error(FIT_OF("{\"texture\":{\"block_um\":1}}"), "fit.texture.block_um", "unknown field");
    job_document_check_error(FIT_OF("{\"texture\":{\"block_mm\":1},\"method\":\"published_sgd.v1\"}"), "fit.texture",
                             method_gauss_newton.id);
    job_document_check_error(FIT_OF("{\"texture\":{\"block_mm\":1},\"nuisance\":{\"stray_light\":true}}"),
                             "fit.texture", "stray_light");
}

static void test_errors_of_ties_and_bounds(void **state)
{
    (void)state;
    job_document_check_error(FIT_OF("{\"tied\":[\"C_R\"]}"), "fit.tied[0]", "list of parameter names");
    job_document_check_error(FIT_OF("{\"tied\":{}}"), "fit.tied", "list of groups");
    job_document_check_error(FIT_OF("{\"tied\":[[\"beta_R\"]]}"), "fit.tied[0]", "at least two");
    job_document_check_error(FIT_OF("{\"tied\":[[\"beta_R\",\"beta_R\"]]}"), "fit.tied[0]", "second time");
    job_document_check_error(FIT_OF("{\"tied\":[[\"C_R\"],[\"C_R.r\",\"C_TT.r\"]]}"), "fit.tied[1]", "second time");
    job_document_check_error(FIT_OF("{\"tied\":[[\"beta_R\",\"beta_X\"]]}"), "fit.tied[0]",
                             "unknown parameter 'beta_X'");
    job_document_check_error(FIT_OF("{\"tied\":[[\"beta_R\",\"C_R.r\"]]}"), "fit.tied[0]", "same unit");
    job_document_check_error(FIT_OF("{\"tied\":[[\"beta_R\",7]]}"), "fit.tied[0]", "list of parameter names");
    job_document_check_error(FIT_OF("{\"tied\":[{\"beta_R\":1,\"beta_TT\":0}]}"), "fit.tied[0].beta_TT", "0.001");
    job_document_check_error(FIT_OF("{\"tied\":[{\"beta_R\":10,\"beta_TT\":1}]}"), "fit.tied", "no room");
    job_document_check_error(FIT_OF("{\"tied\":[[\"C_R\"]],\"fixed\":{\"C_R\":[0.1,0.2,0.1]}}"), "fit.fixed",
                             "does not allow");
    job_document_check_error(FIT_OF("{\"tied\":[[\"C_R\"]],\"start\":{\"C_R\":[0.1,0.2,0.1]}}"), "fit.start",
                             "does not allow");
    job_document_check_error(FIT_OF("{\"bounds\":{\"beta_R\":[2]}}"), "fit.bounds.beta_R", "2 numbers");
    job_document_check_error(FIT_OF("{\"bounds\":{\"beta_R\":[5,5]}}"), "fit.bounds.beta_R", "below the second");
    job_document_check_error(FIT_OF("{\"bounds\":{\"beta_R\":[0,5]}}"), "fit.bounds.beta_R[0]", "1 to 30");
    job_document_check_error(FIT_OF("{\"bounds\":{\"C_R\":[0.1,0.5],\"C_R.g\":[0.1,0.2]}}"), "fit.bounds.C_R.g",
                             "second time");
    job_document_check_error(FIT_OF("{\"bounds\":{\"beta_R\":[2,4]},\"start\":{\"beta_R\":5}}"), "fit.start",
                             "2 and 4");
    job_document_check_error(FIT_OF("{\"bounds\":{\"beta_R\":[2,4]},\"fixed\":{\"beta_R\":5}}"), "fit.fixed",
                             "2 and 4");
    job_document_check_error(
        FIT_OF("{\"model\":\"two_lobe.v1\",\"tied\":[{\"beta_TT\":1,\"gamma_TT\":2}],\"fixed\":{\"gamma_TT\":10}}"),
        "fit.fixed", "'gamma_TT' at 10: its bounds are 20 and 45, with those of what 'fit.tied' ties it to");
    job_document_check_error(
        FIT_OF("{\"model\":\"two_lobe.v1\",\"tied\":[{\"beta_TT\":1,\"gamma_TT\":2}],\"start\":{\"beta_TT\":40}}"),
        "fit.start", "'beta_TT' at 40: its bounds are 10 and 22.5, with");
    job_document_check_error(
        FIT_OF("{\"model\":\"two_lobe.v1\",\"tied\":[{\"beta_TT\":1,\"gamma_TT\":2}],\"fixed\":{\"gamma_TT\":"
               "30},\"start\":{\"beta_TT\":20}}"),
        "fit.start", "'beta_TT', which 'fit.fixed' holds fixed");
}

static void test_errors_of_priors(void **state)
{
    (void)state;
    job_document_check_error(FIT_OF("{\"priors\":{\"beta_R\":{\"mean\":5}}}"), "fit.priors.beta_R.se", "missing");
    job_document_check_error(FIT_OF("{\"priors\":{\"beta_R\":{\"mean\":50,\"se\":1}}}"), "fit.priors.beta_R.mean",
                             "1 to 30");
    job_document_check_error(FIT_OF("{\"priors\":{\"beta_R\":{\"mean\":5,\"se\":0}}}"), "fit.priors.beta_R.se", "0");
    job_document_check_error(FIT_OF("{\"priors\":{\"beta_R\":{\"mean\":5,\"sd\":1}}}"), "fit.priors.beta_R.sd",
                             "unknown field");
    job_document_check_error(FIT_OF("{\"priors\":{\"beta_R\":{\"mean\":5,\"se\":1}},\"fixed\":{\"beta_R\":5}}"),
                             "fit.priors", "fixed");
    job_document_check_error(FIT_OF("{\"priors\":{\"beta_R\":{\"mean\":5,\"se\":1}},\"method\":\"published_sgd.v1\"}"),
                             "fit.priors", method_gauss_newton.id);
    job_document_check_error(
        FIT_OF("{\"model\":\"two_lobe.v1\",\"tied\":[{\"beta_TT\":1,\"gamma_TT\":0.2}],\"priors\":{\"gamma_"
               "TT\":{\"mean\":1,\"se\":1}}}"),
        "fit.priors", "10 and 45");
    job_document_check_error(FIT_OF("{\"bounds\":{\"beta_R\":[2,4]},\"priors\":{\"beta_R\":{\"mean\":9,\"se\":0.01}}}"),
                             "fit.priors", "'beta_R' at 9 +- 0.01, its bounds are 2 and 4");
    job_document_check_error(
        FIT_OF("{\"model\":\"two_lobe.v1\",\"bounds\":{\"beta_TT\":[30,40]},\"tied\":[{\"beta_TT\":2,\"gamma_TT\":1}],"
               "\"priors\":{\"gamma_TT\":{\"mean\":10,\"se\":1}}}"),
        "fit.priors", "'gamma_TT' at 10 +- 1, its bounds are 15 and 20");
    job_document_free(
        job_document_of_text(FIT_OF("{\"bounds\":{\"beta_R\":[2,4]},\"priors\":{\"beta_R\":{\"mean\":5,\"se\":1}}}")));
}

static void test_errors_of_nuisance_and_candidates(void **state)
{
    (void)state;
    job_document_check_error(FIT_OF("{\"fit_radius\":1}"), "fit.fit_radius",
                             "true, false or an object of lower_um and upper_um");
    job_document_check_error(FIT_OF("{\"nuisance\":{\"stray_light\":true},\"method\":\"published_sgd.v1\"}"),
                             "fit.nuisance", method_gauss_newton.id);
    job_document_check_error(FIT_OF("{\"nuisance\":{\"gain\":\"each\"}}"), "fit.nuisance.gain", "per_photograph");
    job_document_check_error(FIT_OF("{\"nuisance\":{\"gain_prior_rel\":0}}"), "fit.nuisance.gain_prior_rel", "0.0001");
    job_document_check_error(FIT_OF("{\"nuisance\":{\"gain_prior_rel\":0.1}}"), "fit.nuisance.gain_prior_rel",
                             "no gain");
    job_document_check_error(FIT_OF("{\"nuisance\":{\"gain\":\"none\",\"gain_prior_rel\":0.1}}"),
                             "fit.nuisance.gain_prior_rel", "'fit.nuisance.gain'");
    job_document_check_error(FIT_OF("{\"nuisance\":{\"gain\":\"global\",\"stray_light_prior\":0.1}}"),
                             "fit.nuisance.stray_light_prior", "no stray light");
    job_document_check_error(FIT_OF("{\"nuisance\":{\"stray_light\":false,\"stray_light_prior\":0.1}}"),
                             "fit.nuisance.stray_light_prior", "'fit.nuisance.stray_light'");
    job_document_free(
        job_document_of_text(FIT_OF("{\"nuisance\":{\"gain\":\"global\",\"gain_prior_rel\":0.1,\"stray_light\":true,"
                                    "\"stray_light_prior\":0.1}}")));
    job_document_check_error(FIT_OF("{\"candidates\":[]}"), "fit.candidates", "1 to 1024");
    job_document_check_error(FIT_OF("{\"candidates\":{\"gird\":true}}"), "fit.candidates.gird", "unknown field");
    job_document_check_error(FIT_OF("{\"candidates\":[{\"light_theta_deg\":95}]}"), "fit.candidates[0].light_theta_deg",
                             "below 90");
    job_document_check_error(FIT_OF("{\"candidates\":[7]}"), "fit.candidates[0]", "must be an object");
    job_document_check_error(FIT_OF("{\"starts\":0}"), "fit.starts", "1 to 16");
    job_document_check_error(PHOTO_OF("\"camera_theta_deg\":1,\"light_theta_deg\":10,\"weight\":-1"),
                             "photographs[0].weight", "-1");
}

static void test_bounds_are_values(void **state)
{
    (void)state;
    struct job_document *d = job_document_of_text(
        FIT_OF("{\"model\":\"two_lobe.v1\",\"start\":{\"beta_TT\":45,\"gamma_TT\":1},\"fixed\":{\"C_TT\":0.999}}"));
    const struct scattering_model *m = scattering_find(d->fit->model[0].id);
    assert_true(fabs(d->fit->model[0].start[scattering_param_index(m, "beta_TT")] - 45.0) < 1e-9);
    assert_true(d->fit->model[0].fixed[scattering_param_index(m, "C_TT.g")] == 0.999);
    job_document_free(d);
}

#define MICROFLAKE "{\"method\":\"%s\",\"model\":\"microflake.v1\","
/* A term of the objective is refused for exactly those methods that do not take it. The error names one that does. */
static void test_methods_get_what_they_take(void **state)
{
    static const struct {
        unsigned ability;
        const char *field, *term;
    } wanted[] = {
        {METHOD_TAKES_PRIORS, "fit.priors", "\"priors\":{\"gamma\":{\"mean\":0.1,\"se\":0.1}}"},
        {METHOD_TAKES_NUISANCE, "fit.nuisance", "\"nuisance\":{\"gain\":\"global\"}"},
        {METHOD_TAKES_NUISANCE, "fit.nuisance", "\"nuisance\":{\"stray_light\":true}"},
        {METHOD_TAKES_TEXTURE, "fit.texture", "\"texture\":{\"block_mm\":1}"},
        {METHOD_TAKES_PRECISION, "fit.precision", "\"precision\":0.5"},
        {METHOD_TAKES_STARTS, "fit.starts", "\"starts\":3"},
        {METHOD_TAKES_STARTS, "fit.start", "\"start\":{\"gamma\":0.1}"},
        {METHOD_TAKES_TIES, "fit.tied", "\"tied\":[[\"alpha\"]]"},
    };
    (void)state;
    char text[1000];
    const struct method_info *m;
    for (size_t i = 0; (m = method_catalogue_at(i)) != NULL; i++) {
        for (size_t k = 0; k < sizeof wanted / sizeof *wanted; k++) {
            snprintf(text, sizeof text, FIT_OF(MICROFLAKE "%s}"), m->id, wanted[k].term);
            if ((m->takes & wanted[k].ability) != 0)
                job_document_free(job_document_of_text(text));
            else
                job_document_check_error(text, wanted[k].field, method_catalogue_taking(wanted[k].ability)->id);
        }
        for (size_t more = 0; more < 2; more++) {
            snprintf(text, sizeof text, FIT_OF(MICROFLAKE "\"starts\":%d,\"max_iterations\":%zu}"), m->id,
                     (m->takes & METHOD_TAKES_STARTS) != 0 ? 2 : 1, m->max_iteration_of_starts + more);
            if (more == 0) job_document_free(job_document_of_text(text));
        }
        job_document_check_error(text, "fit.max_iterations", "takes at most");
    }
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
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_fit),
                                       cmocka_unit_test(test_fit_options),
                                       cmocka_unit_test(test_names_of_groups),
                                       cmocka_unit_test(test_parameters_of_groups),
                                       cmocka_unit_test(test_groups_and_volume_models),
                                       cmocka_unit_test(test_start_of_density),
                                       cmocka_unit_test(test_texture),
                                       cmocka_unit_test(test_errors_of_ties_and_bounds),
                                       cmocka_unit_test(test_errors_of_priors),
                                       cmocka_unit_test(test_errors_of_nuisance_and_candidates),
                                       cmocka_unit_test(test_bounds_are_values),
                                       cmocka_unit_test(test_methods_get_what_they_take),
                                       cmocka_unit_test(test_density_row)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
