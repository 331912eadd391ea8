/* The section "cloth" of the job document: descriptions are read with their defaults, and mistakes are named. */
#include "optimizer/job/document/cloth_json.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_document.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/job_document_text.h"

#define CLOTH(members) "{\"sample\":\"s\",\"cloth\":{" members "},\"measurements\":{\"file\":\"a.csv\"}}"

static const struct cloth_number *number(const struct job_document *doc, const char *name)
{
    int i = cloth_number_index(doc->cloth->description, name);
    if (i < 0) fail_msg("the cloth has no number '%s'", name);
    return &doc->cloth->description->number[i];
}

static void test_a_name_is_enough(void **state)
{
    (void)state;
    for (const char *const *weave = cloth_weave_names; *weave != NULL; weave++) {
        char text[200];
        snprintf(text, sizeof text, CLOTH("\"weave\":\"%s\""), *weave);
        struct job_document *doc = job_document_of_text(text);
        assert_string_equal(doc->cloth->description->weave, *weave);
        assert_int_equal(doc->cloth->description->seed, 1);
        for (size_t i = 0; i < doc->cloth->description->n_number; i++) {
            assert_false(doc->cloth->description->number[i].fitted);
            assert_true(doc->cloth->description->number[i].value == doc->cloth->description->number[i].info->standard);
        }
        assert_true(cloth_number_index(doc->cloth->description, "yarns[0].fiber_radius_um") >= 0);
        assert_int_equal(cloth_number_index(doc->cloth->description, "density") >= 0, strcmp(*weave, "felt") == 0);
        job_document_free(doc);
    }
}

static void test_everything_given(void **state)
{
    (void)state;
    struct job_document *doc = job_document_of_text(CLOTH(
        "\"draft\":[\"1000\",\"0011\",\"0110\"],\"warp\":[0,1,1],\"weft\":[1],\"warp_per_cm\":40,\"seed\":7,\"tile_"
        "warps\":"
        "24,\"crimp\":{\"lower\":0.4,\"upper\":0.6,\"prior\":[0.5,0.1]},\"disorder\":0.02,\"yarns\":[{\"fibers\":30,"
        "\"packing\":0.55},{\"fibers\":20,\"plies\":2,\"ply_twist_per_m\":-700,\"melange_with\":0,\"melange\":0.3,"
        "\"flatness\":{\"value\":2,\"fit\":false}}]"));
    const struct cloth_description *d = doc->cloth->description;
    assert_true(d->n_weft == 3 && d->n_warp == 4 && d->n_kind == 2 && d->seed == 7);
    assert_true(d->warp_over[2][0] && !d->warp_over[2][1] && d->warp_over[0][1]); /* the upper row first */
    assert_true(d->n_yarn[CLOTH_WARP] == 24 && d->n_yarn[CLOTH_WEFT] == 9);
    assert_true(d->n_order[CLOTH_WARP] == 3 && d->order[CLOTH_WARP][2] == 1 && d->order[CLOTH_WEFT][0] == 1);
    assert_true(cloth_number_index(d, "cover_warp") < 0 && d->threads_per_cm[CLOTH_WARP] == 40.0);
    const struct cloth_number *crimp = number(doc, "crimp");
    assert_true(crimp->fitted && crimp->lower == 0.4 && crimp->upper == 0.6 && crimp->prior_mean == 0.5 &&
                crimp->prior_sd == 0.1 && crimp->value == 0.5);
    assert_true(!number(doc, "yarns[1].flatness")->fitted && number(doc, "yarns[1].flatness")->value == 2.0);
    assert_true(number(doc, "yarns[0].packing")->value == 0.55 && number(doc, "yarns[1].packing")->value == 0.6);
    assert_true(number(doc, "yarns[1].ply_twist_per_m")->value == -700.0);
    assert_true(d->kind[1].n_ply == 2 && d->kind[1].melange_with == 0 && d->kind[0].melange_with == -1);
    job_document_free(doc);
}

/* Kinds of yarn with names have scattering parameters of their own. */
static void test_named_kinds(void **state)
{
    (void)state;
    struct job_document *doc = job_document_of_text(
        CLOTH("\"weave\":\"plain\",\"weft\":[1],\"yarns\":[{\"name\":\"red\"},{\"name\":\"blue\"}]"));
    assert_int_equal(doc->cloth->n_group, 2);
    assert_string_equal(doc->cloth->group[0], "red");
    assert_string_equal(doc->cloth->group[1], "blue");
    job_document_free(doc);
    doc = job_document_of_text(CLOTH("\"weave\":\"plain\",\"weft\":[1],\"yarns\":[{},{}]"));
    assert_int_equal(doc->cloth->n_group, 0);
    job_document_free(doc);
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"weft\":[1],\"yarns\":[{\"name\":\"red\"},{}]"),
                             "cloth.yarns[0].name", "or none");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"weft\":[1],\"yarns\":[{\"name\":\"a\"},{\"name\":\"a\"}]"),
                             "cloth.yarns[1].name", "second time");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"yarns\":[{\"name\":\"a b\"}]"), "cloth.yarns[0].name",
                             "1 to 20");
}

/* The section that results state for a described cloth is accepted, and describes the same cloth. */
static void describes_itself(const char *text)
{
    struct job_document *doc = job_document_of_text(text);
    json_t *document = json_pack("{s:s, s:o, s:{s:s}}", "sample", "s", "cloth",
                                 cloth_section_json(doc->cloth->description, NULL), "measurements", "file", "a.csv");
    char *again_text = json_dumps(document, JSON_REAL_PRECISION(17));
    assert_non_null(again_text);
    struct job_document *again = job_document_of_text(again_text);
    assert_int_equal(again->cloth->n_group, doc->cloth->n_group);
    assert_memory_equal(again->cloth->group, doc->cloth->group, sizeof doc->cloth->group);
    for (size_t i = 0; i < doc->cloth->description->n_number; i++) { /* numbers that were searched are given now */
        struct cloth_number *n = &doc->cloth->description->number[i];
        n->fitted = false;
        n->lower = n->info->lower;
        n->upper = n->info->upper;
        n->prior_mean = n->prior_sd = again->cloth->description->number[i].prior_mean;
    }
    assert_memory_equal(again->cloth->description, doc->cloth->description, sizeof *doc->cloth->description);
    free(again_text);
    json_decref(document);
    job_document_free(again);
    job_document_free(doc);
}

static void test_a_cloth_describes_itself(void **state)
{
    (void)state;
    for (const char *const *weave = cloth_weave_names; *weave != NULL; weave++) {
        char text[200];
        snprintf(text, sizeof text, CLOTH("\"weave\":\"%s\",\"seed\":3"), *weave);
        describes_itself(text);
    }
    describes_itself(CLOTH("\"draft\":[\"1000\",\"0011\",\"0110\"],\"warp\":[0,1,1],\"weft\":[1],"
                           "\"warp_per_cm\":40,\"weft_per_cm\":30.5,\"tile_warps\":24,"
                           "\"crimp\":{\"lower\":0.4,\"upper\":0.6,\"prior\":[0.5,0.1]},"
                           "\"yarns\":[{\"name\":\"a\",\"packing\":0.55},"
                           "{\"name\":\"b-2\",\"plies\":2,\"melange_with\":0,\"melange\":0.3}]"));
    describes_itself(CLOTH(
        "\"weave\":\"plain\",\"weft\":[1,2],"
        "\"yarns\":[{\"name\":\"a\"},{\"name\":\"b\",\"fibers\":9,\"film_width_um\":90,\"film_wraps_per_m\":-4000,"
        "\"film_metal\":\"gold\",\"film_surface\":\"brushed\",\"film_optics\":\"r_ohs\","
        "\"film_grain_um\":12.5},{\"film_width_um\":200,\"film_color\":[1,0.5,0.001]}],"
        "\"sequin_diameter_um\":900,\"sequin_spacing_um\":800,\"sequin_surface\":\"flakes\","
        "\"sequin_roughness\":0.02"));
}

static void test_mistakes_are_named(void **state)
{
    (void)state;
    job_document_check_error(CLOTH("\"weave\":\"tweed\""), "cloth.weave", "twill31");
    job_document_check_error(CLOTH("\"seed\":1"), "cloth.weave", "takes one of");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"draft\":[\"10\",\"01\"]"), "cloth.weave", "takes one of");
    job_document_check_error(CLOTH("\"draft\":[\"10\",\"011\"]"), "cloth.draft", "does not repeat");
    job_document_check_error(CLOTH("\"draft\":[\"10\",\"10\"]"), "cloth.draft", "never crosses");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"warp\":[0,1]"), "cloth.warp", "one of the 1 kinds");
    job_document_check_error(CLOTH("\"weave\":\"twill\",\"tile_wefts\":6"), "cloth.tile_wefts", "multiple of 4");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"crimp\":1.5"), "cloth.crimp", "1");
    job_document_check_error(CLOTH("\"weave\":\"felt\",\"crimp\":0.5"), "cloth.crimp", "weaves and velvets have it");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"warp_per_cm\":30,\"cover_warp\":1"), "cloth.cover_warp",
                             "weaves and velvets without 'warp_per_cm'");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"yarns\":[{\"packing\":0.95}]"), "cloth.yarns[0].packing",
                             "0.85");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"yarns\":[{\"melange\":0.5}]"), "cloth.yarns[0].melange",
                             "'melange_with'");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"yarns\":[{\"melange_with\":0}]"),
                             "cloth.yarns[0].melange_with", "another");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"yarns\":[{\"fibers\":5000}]"), "cloth.yarns[0].fibers",
                             "1000");
    job_document_check_error(CLOTH("\"weave\":\"velvet\",\"yarns\":[{}]"), "cloth.yarns", "pile");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"crimp\":{\"lower\":0.6,\"upper\":0.4}"), "cloth.crimp",
                             "rise");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"crimp\":{\"value\":0.9,\"upper\":0.6}"), "cloth.crimp",
                             "starts");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"crimp\":{\"prior\":[0.5,0]}"), "cloth.crimp", "prior");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"crimp\":{\"prior\":[0.5]}"), "cloth.crimp.prior",
                             "2 numbers");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"crimp\":{\"prior\":[7,0.1]}"), "cloth.crimp",
                             "mean of the prior");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"crimp\":{\"mean\":1}"), "cloth.crimp.mean", "unknown");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"crimp\":\"NaN\""), "cloth.crimp", "but it is a text");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"crimp\":1e308"), "cloth.crimp", "1e+308");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"tile_warps\":-4"), "cloth.tile_warps", "-4");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"final_tiles\":2"), "cloth.final_tiles", "numbers are fitted");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"crimp\":{},\"final_tiles\":2,\"tile_wefts\":80"),
                             "cloth.final_tiles", "160 yarns of the weft");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"crimp\":{},\"final_tiles\":0"), "cloth.final_tiles", "0");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"renew_places\":true"), "cloth.renew_places",
                             "numbers are fitted");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"crimp\":{},\"renew_places\":2"), "cloth.renew_places",
                             "true or false");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"warp\":[]"), "cloth.warp", "1 to 64");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"warp\":[\"red\"],\"yarns\":[{\"name\":\"red\"}]"),
                             "cloth.warp", "element 0");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"yarns\":[]"), "cloth.yarns", "1 to 4");
    job_document_check_error("{\"sample\":\"s\"," VOLUME
                             ",\"cloth\":{\"weave\":\"plain\"},\"measurements\":{\"file\":\"a.csv\"}}",
                             "cloth", "one of them");
}

/* Keys that a structure has no use for are refused, so that nobody believes they had an effect. */
static void test_what_would_have_no_effect(void **state)
{
    (void)state;
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"yarns\":[{},{}]"), "cloth.yarns[1]",
                             "the kind 'cloth.yarns[1]': name");
    job_document_check_error(CLOTH("\"weave\":\"jersey\",\"warp\":[0]"), "cloth.warp", "jersey has none");
    job_document_check_error(CLOTH("\"weave\":\"jersey\",\"weft_per_cm\":9"), "cloth.weft_per_cm", "jersey has none");
    job_document_check_error(CLOTH("\"weave\":\"felt\",\"tile_wefts\":4"), "cloth.tile_wefts", "felt has none");
    job_document_check_error(CLOTH("\"weave\":\"felt\",\"yarns\":[{},{}]"), "cloth.yarns",
                             "one kind of fibers, 'cloth.yarns' has 2");
    job_document_check_error(CLOTH("\"weave\":\"felt\",\"yarns\":[{\"plies\":2}]"), "cloth.yarns[0].plies",
                             "'cloth.yarns[0].plies': fibers");
    job_document_check_error(CLOTH("\"weave\":\"velvet\",\"yarns\":[{},{\"plies\":2}]"), "cloth.yarns[1].plies",
                             "no plies");
    job_document_check_error(CLOTH("\"weave\":\"velvet\",\"yarns\":[{},{\"melange_with\":0}]"),
                             "cloth.yarns[1].melange_with", "of one kind");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"yarns\":[{\"film_metal\":\"gold\"}]"),
                             "cloth.yarns[0].film_metal", "without 'film_width_um'");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"sequin_tilt_deg\":5"), "cloth.sequin_tilt_deg",
                             "without 'sequin_diameter_um'");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"yarns\":[{\"film_width_um\":90,\"film_optics\":\"r_ghs\"}]"),
                             "cloth.yarns[0].film_optics", "not rendered by waves");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"sequin_diameter_um\":3000,\"sequin_surface\":\"flakes\","
                                   "\"sequin_optics\":\"ohs\""),
                             "cloth.sequin_optics", "not rendered by waves");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"yarns\":[{\"film_width_um\":90,\"film_grain_um\":20}]"),
                             "cloth.yarns[0].film_grain_um", "smooth");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"yarns\":[{\"film_width_um\":90,\"film_metal\":\"gold\","
                                   "\"film_color\":[1,1,1]}]"),
                             "cloth.yarns[0].film_metal", "replaces");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"yarns\":[{\"film_width_um\":90,\"film_surface\":\"noise\","
                                   "\"film_optics\":\"ohs\",\"film_grain_um\":129}]"),
                             "cloth.yarns[0].film_grain_um", "4 to 128");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"yarns\":[{\"film_width_um\":90,\"film_surface\":\"noise\","
                                   "\"film_optics\":\"ohs\",\"film_grain_um\":100,\"film_roughness\":0.21}]"),
                             "cloth.yarns[0].film_roughness", "higher than 10 um");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"sequin_diameter_um\":3000,\"sequin_surface\":\"flakes\","
                                   "\"sequin_roughness\":0.6"),
                             "cloth.sequin_roughness", "at most 0.5");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"weft\":[0,1],\"yarns\":[{\"melange_with\":1},"
                                   "{\"film_width_um\":90}]"),
                             "cloth.yarns[0].melange_with", "no fibers");
    job_document_free(job_document_of_text(
        CLOTH("\"weave\":\"plain\",\"yarns\":[{\"film_width_um\":90,\"film_optics\":\"r_ghs\",\"film_surface\":"
              "\"noise\"}]")));
}

#define LAME(picture)                                                                                                  \
    "{\"sample\":\"s\",\"cloth\":{\"weave\":\"plain\",\"yarns\":[{\"film_width_um\":90}]},"                            \
    "\"measurements\":{\"file\":\"a.csv\"},\"pictures\":[{" picture "}]}"
#define VIEW                                                                                                           \
    "\"kind\":\"measurement\",\"on\":\"flat\",\"light_theta_deg\":20,\"light_phi_deg\":0,\"camera_theta_deg\":30,"     \
    "\"camera_phi_deg\":180,"

static void test_pictures_that_show_no_films(void **state)
{
    (void)state;
    job_document_check_error(LAME("\"kind\":\"drape\",\"method\":\"dual\""), "pictures[0].method", "films");
    job_document_check_error(LAME(VIEW "\"method\":\"fast\",\"deep_light\":\"cells\""), "pictures[0].deep_light",
                             "films");
    job_document_check_error(LAME(VIEW "\"method\":\"fast\",\"visibility\":\"tables\""), "pictures[0].visibility",
                             "films");
    job_document_free(job_document_of_text(LAME(VIEW "\"method\":\"fast\"")));
    job_document_free(job_document_of_text(LAME(VIEW "\"method\":\"path\"")));
}

static void test_sizes_of_drafts(void **state)
{
    (void)state;
    char text[4000] = "{\"sample\":\"s\",\"cloth\":{\"draft\":[";
    for (int i = 0; i < 33; i++) strcat(text, i % 2 == 0 ? (i == 0 ? "\"10\"" : ",\"10\"") : ",\"01\"");
    strcat(text, "]},\"measurements\":{\"file\":\"a.csv\"}}");
    job_document_check_error(text, "cloth.draft", "1 to 32");
    job_document_check_error(CLOTH("\"draft\":[]"), "cloth.draft", "1 to 32");
    job_document_check_error(CLOTH("\"draft\":[\"\",\"\"]"), "cloth.draft", "1 to 32");
    job_document_check_error(
        CLOTH("\"draft\":[\"101010101010101010101010101010101\",\"010101010101010101010101010101010\"]"), "cloth.draft",
        "1 to 32");
    job_document_check_error(CLOTH("\"draft\":[10,\"01\"]"), "cloth.draft", "no text");
    job_document_check_error(CLOTH("\"draft\":[\"11\",\"01\"]"), "cloth.draft", "never crosses");
}

/* Two plain weaves on top of each other, with nothing that holds them together; one lifted warp stitches them. */
static void test_drafts_that_fall_apart(void **state)
{
    (void)state;
    job_document_check_error(CLOTH("\"draft\":[\"1110\",\"1011\",\"1000\",\"0010\"]"), "cloth.draft",
                             "4 of its 8 yarns, weft 0 and warp 0 among them, lie above all others");
    job_document_check_error(CLOTH("\"draft\":[\"1000\",\"0010\",\"1110\",\"1011\"]"), "cloth.draft",
                             "4 of its 8 yarns, weft 0 and warp 1 among them, lie below all others");
    describes_itself(CLOTH("\"draft\":[\"1110\",\"1011\",\"1100\",\"0010\"],\"yarns\":[{}]"));
}

static void test_fitted_numbers_without_effect(void **state)
{
    (void)state;
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"warp\":[0,1],\"yarns\":[{\"hair_length_um\":{}},"
                                   "{\"hairs_per_mm\":3}]"),
                             "cloth.yarns[0].hair_length_um", "changes nothing while 'hairs_per_mm' is 0");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"nap_tilt_deg\":{}"), "cloth.nap_tilt_deg", "hairs_per_mm");
    job_document_check_error(CLOTH("\"weave\":\"plain\",\"nap_direction_deg\":{},\"yarns\":[{\"hairs_per_mm\":{}}]"),
                             "cloth.nap_direction_deg", "nap_tilt_deg");
    job_document_check_error(CLOTH("\"weave\":\"velvet\",\"pile_tilt_deg\":0,\"pile_direction_deg\":{}"),
                             "cloth.pile_direction_deg", "pile_tilt_deg");
    describes_itself(CLOTH("\"weave\":\"plain\",\"nap_tilt_deg\":{},\"yarns\":[{\"hairs_per_mm\":{},"
                           "\"hair_length_um\":{}}]"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_name_is_enough),
        cmocka_unit_test(test_everything_given),
        cmocka_unit_test(test_named_kinds),
        cmocka_unit_test(test_a_cloth_describes_itself),
        cmocka_unit_test(test_mistakes_are_named),
        cmocka_unit_test(test_what_would_have_no_effect),
        cmocka_unit_test(test_pictures_that_show_no_films),
        cmocka_unit_test(test_sizes_of_drafts),
        cmocka_unit_test(test_drafts_that_fall_apart),
        cmocka_unit_test(test_fitted_numbers_without_effect),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
