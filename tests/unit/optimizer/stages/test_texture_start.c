/* Start values that a described cloth takes from a photograph: threads, flatness, crimp, covers, colors; what the job
 * states stays. */
#include "base/catalogue/correction_numbers.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/job_parse.h"
#include "optimizer/stages/reading/texture_start.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct job {
    struct job_document *doc;
    struct job_inputs in;
    struct model_setup model;
    struct observation row[2];
};

static char fit_text[200] = "";

/* A plain weave of two kinds of yarn whose photograph has warps every 10 and wefts every 20 pixels. */
static void job_init(struct job *j, const char *cloth, const char *yarn)
{
    char text[1000];
    struct error err = {0};
    *j = (struct job){.doc = NULL};
    snprintf(
        text, sizeof text,
        "{\"sample\":\"s\",\"cloth\":{\"texture\":\"a.png\",\"warp\":[0],\"weft\":[1],%s\"yarns\":[{\"name\":\"a\"%s},"
        "{\"name\":\"b\",\"plies\":2}]},\"measurements\":{\"file\":\"a.csv\"},\"fit\":{\"model\":\"two_lobe.v1\"%s}}",
        cloth, yarn, fit_text);
    if (job_document_parse(text, strlen(text), &j->doc, &err) != STATUS_OK) fail_msg("%s: %s", err.field, err.text);
    job_inputs_init(&j->in);
    j->in.section = job_document_sections(j->doc);
    j->in.model = &j->model;
    j->in.n_model = 1;
    j->in.texture = (struct texture_guess){.found = true,
                                           .guess = {.draft = {.n_warp = 2, .n_weft = 2, .warp_on_top = {1, 0, 0, 1}},
                                                     .spacing_px = {10.0, 20.0},
                                                     .cover = {0.9, 0.8},
                                                     .warp.rgb = {0.3, 0.2, 0.1},
                                                     .weft.rgb = {0.1, 0.2, 0.3},
                                                     .yarns_confidence = 0.9,
                                                     .draft_confidence = 0.9,
                                                     .cover_confidence = 0.6,
                                                     .color_confidence = 0.8}};
    const char(*group)[MODEL_SET_NAME_BYTES] = (const char(*)[MODEL_SET_NAME_BYTES])j->doc->cloth->group;
    const struct model_info *model = model_catalogue_find("two_lobe.v1");
    assert_int_equal(model_sets_init(&j->model.sets, model, group, j->doc->cloth->n_group, &err), STATUS_OK);
    for (size_t p = 0; p < j->model.sets.info.n_param; p++)
        j->model.parameter[p] = (struct fit_parameter){.lower = 0.01, .upper = 0.99, .start = 0.123};
    /* lit from the front at 60 degrees, and from behind */
    for (int i = 0; i < 2; i++)
        j->row[i] = (struct observation){
            .configuration.light_theta_rad = i == 0 ? M_PI / 3.0 : M_PI, .mean_rgb = {0.2, 0.2, 0.2}, .weight = 1.0};
    j->in.rows.observation = (struct observation_set){.n = 2, .item = j->row};
}

static void job_release(struct job *j) { job_document_free(j->doc); }

static double number(const struct job *j, const char *name)
{
    int i = cloth_number_index(j->doc->cloth->description, name);
    return i >= 0 ? j->doc->cloth->description->number[i].value : NAN;
}

static bool was_taken(const struct job *j, const char *name)
{
    for (size_t i = 0; i < j->in.texture.n_taken; i++)
        if (strcmp(j->in.texture.taken[i], name) == 0) return true;
    return false;
}

static void covers_without_a_scale(void **state)
{
    (void)state;
    struct job j;
    job_init(&j, "\"cover_weft\":0.7,", "");
    assert_int_equal(texture_take_widths(j.doc->cloth, &j.in.texture, NULL), STATUS_OK);
    assert_true(number(&j, "cover_warp") == 0.9 && number(&j, "cover_weft") == 0.7 && number(&j, "crimp") == 0.5);
    assert_true(was_taken(&j, "cover_warp") && !was_taken(&j, "cover_weft") && j.in.texture.n_taken == 1);
    job_release(&j);
}

static void threads_with_a_scale(void **state)
{
    (void)state;
    struct job j;
    job_init(&j, "\"texture_px_per_mm\":40,", "");
    assert_int_equal(texture_take_widths(j.doc->cloth, &j.in.texture, NULL), STATUS_OK);
    const struct cloth_description *d = j.doc->cloth->description;
    assert_true(d->threads_per_cm[CLOTH_WARP] == 40.0 && d->threads_per_cm[CLOTH_WEFT] == 20.0);
    assert_true(isnan(number(&j, "cover_warp")) && isnan(number(&j, "cover_weft")));
    assert_true(fabs(number(&j, "crimp") - 0.8) < 1e-12); /* 20^2 / (10^2 + 20^2) */
    double width_um = 16.0 * sqrt(40.0 / 0.6) * sqrt(number(&j, "yarns[0].flatness"));
    assert_true(fabs(width_um - 0.9 * 250.0) < 1e-9);
    assert_true(was_taken(&j, "warp_per_cm") && was_taken(&j, "weft_per_cm") && was_taken(&j, "crimp"));
    assert_true(was_taken(&j, "yarns[0].flatness") && !was_taken(&j, "yarns[1].flatness")); /* it has plies */
    job_release(&j);
}

static void given_values_stay(void **state)
{
    (void)state;
    struct job j;
    job_init(&j, "\"texture_px_per_mm\":40,\"warp_per_cm\":33,\"cover_weft\":0.7,\"crimp\":0.4,", ",\"flatness\":3");
    assert_int_equal(texture_take_widths(j.doc->cloth, &j.in.texture, NULL), STATUS_OK);
    assert_true(j.doc->cloth->description->threads_per_cm[CLOTH_WARP] == 33.0 &&
                j.doc->cloth->description->threads_per_cm[CLOTH_WEFT] == 0.0);
    assert_true(number(&j, "cover_weft") == 0.7 && number(&j, "crimp") == 0.4 &&
                number(&j, "yarns[0].flatness") == 3.0);
    assert_true(j.in.texture.n_taken == 0);
    job_release(&j);
}

static void what_is_not_certain_is_not_taken(void **state)
{
    (void)state;
    struct job j;
    job_init(&j, "\"texture_px_per_mm\":40,\"texture_colors\":true,", "");
    j.in.texture.guess.yarns_confidence = j.in.texture.guess.cover_confidence = 0.2;
    assert_int_equal(texture_take_widths(j.doc->cloth, &j.in.texture, NULL), STATUS_OK);
    assert_true(j.in.texture.n_taken == 0 && j.doc->cloth->description->threads_per_cm[CLOTH_WARP] == 0.0);
    job_release(&j);
}

static void a_wrong_scale_is_named(void **state)
{
    (void)state;
    struct job j;
    struct error err = {0};
    job_init(&j, "\"texture_px_per_mm\":5000,", "");
    assert_int_equal(texture_take_widths(j.doc->cloth, &j.in.texture, &err), STATUS_INVALID);
    assert_string_equal(err.field, "texture_px_per_mm");
    assert_non_null(strstr(err.text, "5000 warp yarns"));
    job_release(&j);
}

/* Mean reflectance 0.2 / cos 60 degrees = 0.4, the mean of the photograph 0.2 in every channel. */
static void colors_start_the_kinds(void **state)
{
    (void)state;
    static const double factor[2][3] = {{1.5, 1.0, 0.5}, {0.5, 1.0, 1.5}};
    struct job j;
    snprintf(fit_text, sizeof fit_text,
             ",\"start\":{\"a.C_TT.r\":0.77},\"priors\":{\"b.C_TT.b\":{\"mean\":0.5,\"se\":1}}");
    job_init(&j, "\"texture_colors\":true,", "");
    fit_text[0] = '\0';
    texture_take_colors(&(struct stage_tools){.log = NULL}, &j.in);
    for (size_t p = 0; p < j.model.sets.info.n_param; p++) {
        const struct param_info *info = &j.model.sets.info.param[p];
        bool color = strcmp(param_own_symbol(info), "C_TT") == 0;
        bool stated = strcmp(info->name, "a.C_TT.r") == 0 || strcmp(info->name, "b.C_TT.b") == 0;
        double want = 0.123;
        if (color && !stated) want = texture_albedo(0.4 * factor[p / j.model.sets.n_own][info->channel]);
        assert_true(fabs(j.model.parameter[p].start - want) < 1e-12);
    }
    assert_true(j.in.texture.n_taken == 4 && was_taken(&j, "a.C_TT.g") && !was_taken(&j, "a.C_TT.r"));
    job_release(&j);
    job_init(&j, "", ""); /* the job does not ask for it */
    texture_take_colors(&(struct stage_tools){.log = NULL}, &j.in);
    assert_true(j.in.texture.n_taken == 0);
    job_release(&j);
}

static void albedo_of_a_thick_layer(void **state)
{
    (void)state;
    assert_true(texture_albedo(0.0) == 0.0 && texture_albedo(1.0) == 1.0);
    double s = sqrt(1.0 - 0.9); /* the two-stream reflectance of albedo 0.9 */
    assert_true(fabs(texture_albedo((1.0 - s) / (1.0 + s)) - 0.9) < 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(covers_without_a_scale),  cmocka_unit_test(threads_with_a_scale),
        cmocka_unit_test(given_values_stay),       cmocka_unit_test(what_is_not_certain_is_not_taken),
        cmocka_unit_test(a_wrong_scale_is_named),  cmocka_unit_test(colors_start_the_kinds),
        cmocka_unit_test(albedo_of_a_thick_layer),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
