/* Plied yarns with measured parameters: files of yarn parameters, the amount of material, and the spread of fibers. */
#include "geometry/phantom/phantom.h"
#include "tests/support/cloth/make_phantom.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char yarn_text[] = "ply_num: 3\nfiber_num: 12\naabb_min: [-1,-1,-1]\n\nyarn_clock_wise: "
                                "0\nfiber_clock_wise: 1\nyarn_alpha: 0.45\nalpha: 0.36\n"
                                "yarn_radius: 0.038\nellipse_long: 0.026\nellipse_short: 0.02\nepsilon: 0.1\nbeta: "
                                "0.2\nR_max: 1\nuse_migration: 1\ns_i: 1\n"
                                "rho_min: 0.85\nrho_max: 1\nuse_flyaways: 1\nflyaway_hair_density: "
                                "30\nflyaway_hair_ze: 0.002 0.06\nflyaway_hair_r0: 0.02 0.005\n"
                                "flyaway_hair_re: 0.016 0.009\nflyaway_hair_pe: 0.39 0.34\nflyaway_loop_density: "
                                "19\nflyaway_loop_r1: 0.025 0.005\n";

/* Tiles made from a yarn file, for every weave of yarns. The twist is a whole number of turns of the tile, and every
 * fiber that is cut at a seam continues across it. */
static void test_plied_yarns(void **state)
{
    static const enum phantom_weave weave[] = {PHANTOM_PLAIN, PHANTOM_KNIT};
    const char *path = scratch_path(state, "yarn.txt");
    scratch_write(path, yarn_text, sizeof yarn_text - 1);
    for (size_t w = 0; w < 2; w++) {
        struct phantom_option o;
        struct phantom_report r;
        struct fiber_set f;
        phantom_option_default(&o, weave[w]);
        o.flatness = 1.0;
        o.packing = 0.4;
        o.n_relax = 40;
        assert_int_equal(phantom_yarn_read(path, &o.yarn, NULL), STATUS_OK);
        assert_true(o.yarn.n_ply == 3 && o.yarn.n_fiber == 12 && o.yarn.fiber_pitch_m < 0.0 &&
                    fabs(o.yarn.ellipse_m[1] - 2e-4) < 1e-12);
        make_phantom(&o, 2, &f, &r);
        assert_int_equal(r.n_fiber_per_yarn, 36);
        assert_true(r.plied.n_hair > 0 && r.plied.n_loop > 0);
        double turns = r.plied.ply_turns[0]; /* thirds, within a sixth of the yarn's own */
        assert_true(fabs(3.0 * turns - round(3.0 * turns)) < 1e-9 &&
                    fabs(turns - r.plied.wanted_ply_turns[0]) < 1.0 / 6.0 + 1e-9);
        assert_true(turns * r.plied.fiber_turns[0] <= 0.0); /* opposite senses */
        size_t n_end[2] = {0, 0};                           /* of weft fibers at x = 0 and at x = tile */
        for (size_t i = 0; i < f.n_fiber; i++)
            for (int e = 0; e < 2; e++) {
                size_t k = e == 0 ? f.first_vertex[i] : f.first_vertex[i + 1] - 1;
                double x = (double)f.position_m[3 * k];
                n_end[0] += fabs(x) < 1e-9;
                n_end[1] += fabs(x - f.tile_size_m[0]) < 1e-9;
            }
        assert_int_equal(n_end[0], n_end[1]);
        if (weave[w] == PHANTOM_PLAIN) assert_true(n_end[0] >= o.n_yarn[0] * 36 && n_end[0] >= 72);
        assert_true(r.overlap_mean < 0.12);
        fiber_set_release(&f);
    }
}

/* Mean squared distance of the warp's fibers from the axis of their yarn, at the face y = 0. */
static double spread_m2(const struct fiber_set *f, double spacing_m)
{
    enum { YARN = 2 };
    double sum[YARN][2] = {{0}}, square = 0.0, count[YARN] = {0};
    for (int pass = 0; pass < 2; pass++)
        for (size_t i = 0; i < f->n_fiber; i++)
            for (int e = 0; e < 2; e++) {
                const float *p = f->position_m + 3 * (e == 0 ? f->first_vertex[i] : f->first_vertex[i + 1] - 1);
                if (f->axis_class[i] != 1 || fabs((double)p[1]) > 1e-9) continue;
                size_t yarn = (double)p[0] < spacing_m ? 0u : 1u;
                double at[2] = {(double)p[0], (double)p[2]};
                count[yarn] += pass == 0 ? 1.0 : 0.0;
                for (size_t a = 0; a < 2; a++) {
                    if (pass == 0)
                        sum[yarn][a] += at[a];
                    else
                        square += pow(at[a] - sum[yarn][a] / count[yarn], 2.0);
                }
            }
    return square / (count[0] + count[1]);
}

/* The four measured yarns, with the lengths of the file or scaled, have the designed share of fiber in the section of
 * a ply. It is measured by the material of the tile and by the spread of the fibers, before fibers are pushed apart. */
static void test_real_yarn_files(void **state)
{
    static const char *const name[] = {"cotton1", "polyester1", "rayon1", "silk1"};
    const char *data = getenv("SELVEDGE_DATA");
    (void)state;
    for (size_t i = 0; i < 4; i++) {
        char path[1024];
        struct phantom_yarn_law y;
        struct error err = {0};
        double packed[2];
        snprintf(path, sizeof path, "%s/yarns/%s.txt", data != NULL ? data : "../shared/data", name[i]);
        status s = phantom_yarn_read(path, &y, &err);
        if (s == STATUS_IO || s == STATUS_NOT_FOUND) {
            print_message("real data absent: %s (set SELVEDGE_DATA)\n", path);
            skip();
        }
        if (s != STATUS_OK) fail_msg("%s", err.text);
        assert_true(y.n_ply >= 2 && y.n_fiber >= 33 && y.hair_per_m > 0.0);
        y.hair_per_m = y.loop_per_m = 0.0;
        for (int true_size = 0; true_size < 2; true_size++) {
            struct phantom_option o;
            struct phantom_report r;
            struct fiber_set f;
            const double radius_m = 14e-6;
            phantom_option_default(&o, PHANTOM_PLAIN);
            for (int a = 0; a < 3; a++) o.fiber_radius_m[a] = radius_m;
            o.flatness = 1.0;
            o.packing = 0.5;
            o.n_relax = 0;
            o.vertex_spacing_m = 6e-5;
            o.voxel_size_m = 8e-6; /* of the view from above, which is not what is tested */
            o.yarn = y;
            o.yarn_true_size = true_size == 1;
            make_phantom(&o, 2, &f, &r);
            double section_m2 = M_PI * y.ellipse_m[0] * y.ellipse_m[1] * r.plied.scale * r.plied.scale,
                   fiber_m2 = M_PI * radius_m * radius_m;
            double design = true_size ? (double)y.n_fiber * fiber_m2 / section_m2 : o.packing, plies_m = 0.0;
            for (int a = 0; a < 2; a++)
                plies_m += 2.0 * (double)y.n_ply * r.plied.wanted_ply_turns[a] * y.ply_pitch_m * r.plied.scale;
            double share = fiber_m2 * fiber_set_length_m(&f) / (plies_m * section_m2);
            packed[true_size] =
                (double)(y.n_ply * y.n_fiber) * fiber_m2 / (M_PI * spread_m2(&f, r.yarn_spacing_m[0])) / design;
            print_message("%s%s: %.3f of a ply is fiber, designed %.3f; packed %.3f\n", name[i],
                          true_size ? ", true size" : "", share, design, packed[true_size]);
            assert_true(true_size ? r.plied.scale == 1.0 : r.plied.scale < 0.8);
            double winding = hypot(1.0, 2.0 * M_PI * y.ply_distance_m / y.ply_pitch_m * r.plied.ply_turns[0] /
                                            r.plied.wanted_ply_turns[0]);
            double excess =
                share / (design * winding); /* fibers are longer than their ply, which is longer than the yarn */
            assert_true(excess > 1.0 && excess < 1.15);
            fiber_set_release(&f);
        }
        assert_true(fabs(packed[1] / packed[0] - 1.0) <
                    0.1); /* fibers that stay a diameter apart have a slightly larger spread */
    }
}

static void test_wrong_yarn_files(void **state)
{
    static const struct {
        const char *from, *to, *part;
    } change[] = {
        {"ply_num: 3", "ply_num: 0", "line 1: out of range: 'ply_num'"},
        {"alpha: 0.36", "alfa: 0.36", "unknown key 'alfa'"},
        {"alpha: 0.36", "", "'alpha' is missing"},
        {"beta: 0.2", "beta: nan", "a number is missing after 'beta'"},
        {"R_max: 1", "R_max: 1 2", "more than a value after 'R_max'"},
        {"0.016 0.009", "0.016 -1", "negative: 'flyaway_hair_re'"},
        {"epsilon: 0.1", "epsilon 0.1", "not 'key: value'"},
    };
    const char *path = scratch_path(state, "wrong.txt");
    for (size_t i = 0; i < sizeof change / sizeof *change; i++) {
        char text[2048];
        struct phantom_yarn_law y;
        struct error err = {0};
        const char *at = strstr(yarn_text, change[i].from);
        while (strcmp(change[i].from, "alpha: 0.36") == 0 && at[-1] != '\n') at = strstr(at + 1, change[i].from);
        int n = snprintf(text, sizeof text, "%.*s%s%s", (int)(at - yarn_text), yarn_text, change[i].to,
                         at + strlen(change[i].from));
        scratch_write(path, text, (size_t)n);
        assert_int_equal(phantom_yarn_read(path, &y, &err), STATUS_FORMAT);
        if (strstr(err.text, change[i].part) == NULL) fail_msg("'%s' is not in '%s'", change[i].part, err.text);
    }
    struct phantom_option o;
    struct phantom_report r;
    struct fiber_set f;
    struct error err = {0};
    phantom_option_default(&o, PHANTOM_FELT);
    o.yarn.n_ply = 2;
    fiber_set_init(&f);
    assert_int_equal(phantom_generate(&o, NULL, NULL, &f, &r, &err), STATUS_INVALID);
    assert_string_equal(err.field, "yarn");
}

/* A weft of very thin fibers in a tile of many thick warps needs more nodes than there is memory for. */
static void test_too_many_nodes(void **state)
{
    struct phantom_option o;
    struct phantom_report r;
    struct fiber_set f;
    struct error err = {0};
    const char *path = scratch_path(state, "thin.txt");
    scratch_write(path, yarn_text, sizeof yarn_text - 1);
    phantom_option_default(&o, PHANTOM_PLAIN);
    assert_int_equal(phantom_yarn_read(path, &o.yarn, NULL), STATUS_OK);
    o.yarn.n_fiber = 1;
    o.fiber_radius_m[0] = 1e-7;
    o.n_yarn[0] = 2;
    o.n_yarn[1] = 400;
    o.yarn_true_size = true;
    o.n_relax = 0;
    fiber_set_init(&f);
    assert_int_equal(phantom_generate(&o, NULL, NULL, &f, &r, &err), STATUS_INVALID);
    assert_string_equal(err.field, "yarn");
    assert_non_null(strstr(err.text, "over a million nodes"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_plied_yarns),
        cmocka_unit_test(test_real_yarn_files),
        cmocka_unit_test(test_wrong_yarn_files),
        cmocka_unit_test(test_too_many_nodes),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
