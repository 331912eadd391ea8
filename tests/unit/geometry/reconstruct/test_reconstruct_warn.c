/* Every warning about a scan and its fibers: a clean scan has none, and each figure warns on its own side of its limit
 * only, with its numbers and the option that it is about. */
#include "base/option_id.h"
#include "geometry/reconstruct/reconstruct.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

struct told {
    size_t n;
    char option[64], text[800]; /* of the last one */
};

static void tell(void *context, const char *option, const char *text)
{
    struct told *t = context;
    t->n++;
    snprintf(t->option, sizeof t->option, "%s", option);
    snprintf(t->text, sizeof t->text, "%s", text);
}

static struct reconstruct_option clean_option(void)
{
    struct reconstruct_option o = {.voxel_size_m = {2e-6, 2e-6, 2e-6}, .crop_voxel = {10, 20, 0, 110, 120, 50}};
    return o;
}

static struct reconstruct_report clean_report(void)
{
    struct reconstruct_report r = {.n = {100, 100, 50}, .separability = 0.9, .noise.scan_sd = 0.2, .dice = 0.9};
    for (int a = 0; a < 3; a++) r.voxel_size_m[a] = 2e-6;
    r.fiber_diameter_voxel = 7.0;
    r.other_diameter_voxel = r.other_diameter_noise_share = NAN;
    r.grade.verdict = GRADE_RESOLVED;
    return r;
}

static void expect_volume(const struct reconstruct_option *o, const struct reconstruct_report *r, const char *option,
                          const char *part)
{
    struct told t = {.n = 0};
    reconstruct_warn_volume(o, r, &(struct warning_sink){tell, &t});
    if (t.n != (part == NULL ? 0 : 1)) fail_msg("%zu warnings, the last '%s'", t.n, t.text);
    if (part == NULL) return;
    assert_string_equal(t.option, option);
    if (strstr(t.text, part) == NULL) fail_msg("'%s' is not in '%s'", part, t.text);
}

static void test_padding(void **state)
{
    const struct reconstruct_option o = clean_option();
    struct reconstruct_report r = clean_report();
    (void)state;
    r.has_padding = true;
    r.tile = (struct tile_crop){.valid = {0, 0, 100, 100}};
    expect_volume(&o, &r, NULL, NULL);
    r.tile = (struct tile_crop){.valid = {15, 20, 85, 80}};
    expect_volume(&o, &r, OPTION_CROP_BOX,
                  "padding, which is no measurement, reaches into the tile, so only 42 % of it is complete: crop to x "
                  "25..95, y 40..100");
    r.has_padding = false;
    expect_volume(&o, &r, OPTION_CROP_BOX, "the matrix brings corners from outside of the scan into the tile");
    r = clean_report();
    r.has_padding = r.is_all_padded = true;
    expect_volume(&o, &r, OPTION_CROP_BOX, "the tile is nowhere complete");
}

static void test_alignment(void **state)
{
    struct reconstruct_option o = clean_option();
    struct reconstruct_report r = clean_report();
    (void)state;
    r.align.outcome = ALIGN_NO_DIRECTION;
    expect_volume(&o, &r, NULL, NULL); /* not asked for */
    o.align = true;
    expect_volume(&o, &r, OPTION_ALIGN, "no clear main direction");
    r.align.outcome = ALIGN_OTHER_AXES;
    r.main.share_z = 0.73;
    expect_volume(&o, &r, OPTION_ALIGN, "73 % of the fibers run along z");
    r.main.n = 1;
    r.main.direction[1][2] = 0.8;
    r.main.direction[1][1] = -0.6;
    expect_volume(&o, &r, OPTION_ALIGN, "run along (0.00, -0.60, 0.80), which");
    r.main.n = 2;
    r.main.direction[0][0] = 0.5;
    expect_volume(&o, &r, OPTION_ALIGN, "run along (0.50, 0.00, 0.00) and another direction");
    o.align = false;
    expect_volume(&o, &r, NULL, NULL);
    o.align = true;
    r.align.outcome = ALIGN_DONE;
    r.align.se_deg = 1.5;
    expect_volume(&o, &r, NULL, NULL);
    r.aligned = true;
    expect_volume(&o, &r, OPTION_ALIGN, "directions of warp and weft is 1.5 degrees");
    r.align.se_deg = 1.0;
    expect_volume(&o, &r, NULL, NULL);
}

static void test_crop(void **state)
{
    struct reconstruct_option o = clean_option();
    struct reconstruct_report r = clean_report();
    const size_t valid[4] = {5, 10, 85, 70}, nearly[4] = {0, 0, 99, 100};
    (void)state;
    memcpy(r.tile.valid, valid, sizeof valid);
    expect_volume(&o, &r, OPTION_CROP_BOX, "only 48 % of it is complete: crop to x 15..95, y 30..90");
    o.crop = true;
    expect_volume(&o, &r, NULL, NULL);
    o.crop = false;
    memcpy(r.tile.valid, nearly, sizeof nearly);
    expect_volume(&o, &r, NULL, NULL);
    o.crop = true;
    r.tile.mismatch[0] = r.tile.mismatch[1] = 0.6;
    expect_volume(&o, &r, NULL, NULL);
    r.tile.mismatch[1] = 0.83;
    expect_volume(&o, &r, OPTION_CROP, "match across y (mismatch 0.83");
    r.tile.mismatch[0] = 0.7;
    r.tile.mismatch[1] = NAN;
    expect_volume(&o, &r, OPTION_CROP, "match across x (mismatch 0.70");
    o.crop = false;
    expect_volume(&o, &r, NULL, NULL);
}

static void test_densities(void **state)
{
    const struct reconstruct_option o = clean_option();
    struct reconstruct_report r = clean_report();
    (void)state;
    r.noise.scan_sd = 0.51;
    expect_volume(&o, &r, OPTION_SCAN_FILES, "its standard deviation is 0.51");
    r.separability = 0.69; /* says more than that it is noisy */
    expect_volume(&o, &r, OPTION_SCAN_FILES, "separability 0.69");
    r = clean_report();
    r.separability = 0.7;
    r.noise.scan_sd = 0.5;
    expect_volume(&o, &r, NULL, NULL);
}

static void expect_fibers(const struct reconstruct_report *r, size_t n_fiber, double radius_m, const char *part)
{
    struct told t = {.n = 0};
    float radius[8];
    const struct fiber_set f = {.n_fiber = n_fiber, .radius_m = radius};
    for (size_t i = 0; i < 8; i++) radius[i] = (float)radius_m;
    reconstruct_warn_fibers(r, &f, &(struct warning_sink){tell, &t});
    if (t.n != (part == NULL ? 0 : 1)) fail_msg("%zu warnings, the last '%s'", t.n, t.text);
    if (part != NULL && strstr(t.text, part) == NULL) fail_msg("'%s' is not in '%s'", part, t.text);
}

static void test_fibers(void **state)
{
    struct reconstruct_report r = clean_report();
    (void)state;
    expect_fibers(&r, 5, 7e-6, NULL);
    expect_fibers(&r, 4, 7e-6, "only 4 fibers");
    expect_fibers(&r, 1, 7e-6, "only 1 fiber");
    expect_fibers(&r, 8, 1.1e-6, NULL);
    expect_fibers(&r, 8, 0.9e-6, "a mean radius of 0.9 um");
    expect_fibers(&r, 8, 240e-6, NULL);
    expect_fibers(&r, 8, 260e-6, "a mean radius of 260 um");
    r.fiber_diameter_voxel = 4.0;
    expect_fibers(&r, 8, 7e-6, NULL);
    r.fiber_diameter_voxel = 3.9;
    expect_fibers(&r, 8, 7e-6, "only 3.9 voxels thick");
    r.fiber_diameter_voxel = 0.0; /* fibers from a file */
    expect_fibers(&r, 8, 7e-6, NULL);
    r.fiber_diameter_voxel = 7.0;
    r.diameter_noise_share = 0.5;
    expect_fibers(&r, 8, 7e-6, NULL);
    r.diameter_noise_share = 0.6;
    expect_fibers(&r, 8, 7e-6, "7.0 voxels is uncertain, because 60 %");
    r = clean_report();
    r.dice = 0.5;
    expect_fibers(&r, 8, 7e-6, NULL);
    r.dice = 0.49;
    expect_fibers(&r, 8, 7e-6, "Dice 0.49");
    r.n[0] = 0; /* there was no scan */
    expect_fibers(&r, 8, 7e-6, NULL);
}

static void test_grade(void **state)
{
    struct reconstruct_report r = clean_report();
    (void)state;
    r.grade = (struct scan_grade){.verdict = GRADE_PARTLY, .contrast = 0.5, .safe_share = 0.62};
    expect_fibers(&r, 8, 7e-6, "in part: 62 % of the traced length is sure");
    r.grade = (struct scan_grade){.verdict = GRADE_UNRESOLVED, .contrast = 0.11, .safe_share = 0.03};
    expect_fibers(&r, 8, 7e-6,
                  "11 % of the contrast that such fibers would have, and only 3 % of their length is sure; take");
    r.grade.contrast = -0.1;
    r.grade.n_dropped = 12;
    expect_fibers(&r, 8, 7e-6, "have, and only 3 % of their length is sure; 12 of them were left out");
    r.grade.verdict = GRADE_NONE;
    expect_fibers(&r, 8, 7e-6, NULL);
}

/* Lines that hold several fibers are counted where they can be told one by one. */
static void test_yarns(void **state)
{
    struct reconstruct_report r = clean_report();
    (void)state;
    r.grade = (struct scan_grade){.verdict = GRADE_RESOLVED, .section = {.surface = 0.046, .several_share = 0.1145}};
    expect_fibers(&r, 8, 7e-6, NULL);
    r.grade.faults = GRADE_SEVERAL;
    expect_fibers(&r, 8, 7e-6, "11 % of the traced length is in lines that hold several fibers");
    r.grade.section = (struct section_misfit){.surface = 0.22, .several_share = 0.0};
    expect_fibers(&r, 8, 7e-6, "densities around their axes vary by 22 %): each line may hold several");
}

/* A scan that would not show lumens says so, unless it shows no fibers either. */
static void test_unseen_lumens(void **state)
{
    struct reconstruct_report r = clean_report();
    (void)state;
    r.fiber_diameter_voxel = 4.2;
    r.noise.scan_sd = 0.5;
    expect_fibers(&r, 8, 7e-6, NULL);
    r.lumens = LUMENS_UNKNOWN;
    expect_fibers(&r, 8, 7e-6, "does not tell whether the fibers are hollow");
    expect_fibers(&r, 8, 7e-6, "here it is 4.2 voxels and 2.0");
    r.lumens = LUMENS_NONE;
    expect_fibers(&r, 8, 7e-6, NULL);
    r.lumens = LUMENS_UNKNOWN;
    r.noise.scan_sd = 0.07;
    expect_fibers(&r, 8, 7e-6, "here it is 4.2 voxels and 14.3");
    r.fiber_diameter_voxel = 5.2; /* not the walls of wider fibers, and clear */
    expect_fibers(&r, 8, 7e-6, NULL);
}

/* Lumens that are clear were filled, unless the job says that there are none; faint ones are a question. */
static void test_lumens(void **state)
{
    struct reconstruct_option o = clean_option();
    struct reconstruct_report r = clean_report();
    (void)state;
    r.lumen = (struct lumen_evidence){.enclosed_share = 0.05, .middle_share = 0.012, .hollow_share = NAN};
    expect_volume(&o, &r, OPTION_HOLLOW_FIBERS, "the fibers look hollow: voids in the middle of fibers are 1.20 %");
    o.hollow_fibers = 1;
    expect_volume(&o, &r, NULL, NULL);
    r.lumens_found = true;
    expect_volume(&o, &r, OPTION_HOLLOW_FIBERS, "was filled before tracing; give false if they are solid");
    r.lumens_found = false;
    o.hollow_fibers = 0;
    r.lumen.middle_share = 0.001;
    expect_volume(&o, &r, OPTION_HOLLOW_FIBERS, "the fibers may be hollow: voids in the middle of fibers are 0.10 %");
    r.lumen.enclosed_share = 0.08; /* as in solid fibers of 4 voxels */
    expect_volume(&o, &r, NULL, NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lumens), cmocka_unit_test(test_padding),   cmocka_unit_test(test_alignment),
        cmocka_unit_test(test_crop),   cmocka_unit_test(test_densities), cmocka_unit_test(test_fibers),
        cmocka_unit_test(test_grade),  cmocka_unit_test(test_yarns),     cmocka_unit_test(test_unseen_lumens),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
