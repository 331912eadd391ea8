/* The procedural cloth: it follows its numbers smoothly, closes at the faces, and refuses what cannot be. */
#include "geometry/cloth/cloth.h"
#include "geometry/fibers/seam/fiber_seam.h"
#include "geometry/phantom/compare.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct cloth_description small_cloth(const char *weave)
{
    struct cloth_description d;
    struct error err = {0};
    assert_int_equal(cloth_description_init(&d, weave, &err), STATUS_OK);
    d.kind[0].n_fiber = d.structure == CLOTH_FELT ? 60 : 8;
    if (d.pile_kind >= 0) d.kind[d.pile_kind].n_fiber = 4;
    if (d.structure != CLOTH_FELT)
        d.n_yarn[0] = d.n_yarn[1] = strcmp(weave, "satin") == 0 ? 5 : strcmp(weave, "plain") == 0 ? 2 : 4;
    assert_int_equal(cloth_description_check(&d, &err), STATUS_OK);
    return d;
}

static void set_number(struct cloth_description *d, const char *name, double value)
{
    int i = cloth_number_index(d, name);
    assert_true(i >= 0);
    d->number[i].value = value;
}

static void build(const struct cloth_description *d, const double *number, struct thread_pool *pool,
                  struct fiber_set *f, struct cloth_report *r)
{
    struct error err = {0};
    fiber_set_init(f);
    status st = cloth_build(d, number, pool, NULL, f, r, &err);
    if (st != STATUS_OK) fail_msg("%s: %s", err.field, err.text);
}

/* Every weave makes fibers that continue across the faces, and the same ones with two threads, and without a report. */
static void test_every_weave(void **state)
{
    (void)state;
    struct thread_pool *pool = NULL;
    assert_int_equal(thread_pool_new(2, &pool, NULL), STATUS_OK);
    for (const char *const *weave = cloth_weave_names; *weave != NULL; weave++) {
        struct cloth_description d = small_cloth(*weave);
        struct fiber_set f, g, bare;
        struct cloth_report r, again;
        struct fiber_seam seam;
        build(&d, NULL, NULL, &f, &r);
        build(&d, NULL, pool, &g, &again);
        build(&d, NULL, NULL, &bare, NULL);
        assert_int_equal(f.n_vertex, g.n_vertex);
        assert_memory_equal(f.position_m, g.position_m, 3 * f.n_vertex * sizeof *f.position_m);
        assert_memory_equal(&r, &again, sizeof r);
        assert_int_equal(f.n_vertex, bare.n_vertex);
        assert_memory_equal(f.position_m, bare.position_m, 3 * f.n_vertex * sizeof *f.position_m);
        assert_int_equal(fiber_seam_measure(&f, &seam, NULL), STATUS_OK);
        /* staples that end within a radius of a face by chance have no partner there */
        if (d.structure != CLOTH_VELVET) assert_true(seam.n_end[0] > 20 && seam.share[0] > 0.8);
        assert_true(r.cover > 0.3 && r.cover <= 1.0 && r.volume_fraction > 0.05 && r.volume_fraction < 0.75);
        assert_true(r.overlap_mean < 0.1 && r.n_fiber[0] >= d.kind[0].n_fiber);
        assert_int_equal(fiber_set_n_group(&f), d.n_kind);
        fiber_set_release(&f);
        fiber_set_release(&g);
        fiber_set_release(&bare);
    }
    thread_pool_free(pool);
}

/* Root mean square distance between the fibers f at the description's values and those with one number moved. */
static double moved_m(const struct cloth_description *d, const struct fiber_set *f, size_t i_number, double by)
{
    const struct compare_option o = {.voxel_size_m = 8e-6};
    struct compare_report compared;
    struct fiber_set g;
    struct cloth_report r;
    double number[CLOTH_MAX_NUMBER];
    for (size_t i = 0; i < d->n_number; i++) number[i] = d->number[i].value;
    number[i_number] += by;
    build(d, number, NULL, &g, &r);
    assert_int_equal(compare_fibers(f, &g, &o, &compared, NULL), STATUS_OK);
    if (!(compared.center_recall > 0.97))
        fail_msg("%s moved by %g loses fibers: recall %g", d->number[i_number].name, by, compared.center_recall);
    fiber_set_release(&g);
    return compared.centerline_rms_voxel * o.voxel_size_m;
}

/* A tenth of the change of a number moves the fibers by about a tenth, or by less than 5 % of their radius: there are
 * no steps where something is rounded. */
static void test_numbers_move_fibers_smoothly(void **state)
{
    (void)state;
    static const char *const weave[] = {"plain", "felt", "jersey", "velvet"};
    for (size_t w = 0; w < 4; w++) {
        struct cloth_description d = small_cloth(weave[w]);
        struct fiber_set f;
        struct cloth_report r;
        if (w == 0) set_number(&d, "yarns[0].hairs_per_mm", 6.03);
        if (w >= 2) { /* two yarns are enough here */
            d.n_yarn[0] = d.n_yarn[1] = 2;
            assert_int_equal(cloth_description_check(&d, NULL), STATUS_OK);
        }
        build(&d, NULL, NULL, &f, &r);
        for (size_t i = 0; i < d.n_number; i++) {
            if (w >= 2 && d.number[i].kind >= 0) continue; /* yarns are those of the plain weave */
            const struct cloth_number_info *n = d.number[i].info;
            double step = 2e-4 * (n->upper - n->lower), sign = d.number[i].value + step > n->upper ? -1.0 : 1.0;
            double whole = moved_m(&d, &f, i, sign * step), tenth = moved_m(&d, &f, i, 0.1 * sign * step);
            if (!(whole < 3e-6 && tenth < fmax(0.2 * whole, 0.4e-6)))
                fail_msg("%s of %s: a step moves fibers by %g um, a tenth of it by %g um", d.number[i].name, weave[w],
                         1e6 * whole, 1e6 * tenth);
        }
        fiber_set_release(&f);
    }
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* 90 % of the length of the warp fibers lies at angles up to this one to the warp, seen from above. */
static double steep_angle_rad(const struct fiber_set *f)
{
    double *angle = calloc(f->n_vertex, sizeof *angle);
    size_t n = 0;
    assert_non_null(angle);
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t k = f->first_vertex[i]; f->axis_class[i] == 1 && k + 1 < f->first_vertex[i + 1]; k++) {
            const float *a = f->position_m + 3 * k, *b = a + 3;
            angle[n++] = fabs(atan2((double)(b[0] - a[0]), (double)(b[1] - a[1])));
        }
    qsort(angle, n, sizeof *angle, ascending);
    double steep = angle[(size_t)(0.9 * (double)n)];
    free(angle);
    return steep;
}

/* Flattening a yarn leaves the angle of its fibers on the flat side as the twist says. */
static void test_flat_yarns_keep_the_angle_of_twist(void **state)
{
    (void)state;
    double ratio[2];
    for (int k = 0; k < 2; k++) {
        struct cloth_description d = small_cloth("twill");
        struct fiber_set f;
        struct cloth_report r;
        set_number(&d, "yarns[0].flatness", k == 0 ? 1.8 : 4.0);
        set_number(&d, "yarns[0].twist_per_m", 1500.0);
        set_number(&d, "yarns[0].fiber_angle_deg", 0.0);
        set_number(&d, "yarns[0].packing", 0.4);
        set_number(&d, "crimp", 0.0);
        set_number(&d, "disorder", 0.0);
        build(&d, NULL, NULL, &f, &r);
        ratio[k] = tan(steep_angle_rad(&f)) / tan(r.surface_angle_rad[0]);
        if (!(ratio[k] > 0.7 && ratio[k] < 1.15)) fail_msg("flatness %d: the tangents' ratio is %g", k, ratio[k]);
        fiber_set_release(&f);
    }
    assert_true(fabs(ratio[1] / ratio[0] - 1.0) < 0.15);
}

static void refuse(const struct cloth_description *given, const char *field)
{
    struct cloth_description d = *given;
    struct error err = {0};
    struct fiber_set f;
    struct cloth_report r;
    fiber_set_init(&f);
    status st = cloth_description_check(&d, &err);
    if (st == STATUS_OK) st = cloth_build(&d, NULL, NULL, NULL, &f, &r, &err);
    assert_int_equal(st, STATUS_INVALID);
    assert_string_equal(err.field, field);
    assert_true(strlen(err.text) > 20);
}

static void test_contradictions_are_named(void **state)
{
    (void)state;
    static const char *const never[] = {"10", "10"}, *const uneven[] = {"10", "011"}, *const odd[] = {"1x", "01"};
    struct cloth_description d = small_cloth("plain");
    struct error err = {0};
    set_number(&d, "crimp", 1.2);
    refuse(&d, "crimp");
    set_number(&d, "crimp", 0.0);
    set_number(&d, "yarns[0].flatness", 1.0);
    refuse(&d, "crimp");
    d = small_cloth("plain");
    set_number(&d, "yarns[0].packing", 0.95);
    refuse(&d, "yarns[0].packing");
    d = small_cloth("plain");
    d.threads_per_cm[CLOTH_WARP] = 900.0;
    cloth_description_number(&d);
    refuse(&d, "warp_per_cm");
    d = small_cloth("plain");
    d.order[CLOTH_WEFT][0] = 1;
    refuse(&d, "weft");
    d = small_cloth("plain");
    d.n_yarn[CLOTH_WEFT] = 3;
    refuse(&d, "tile_wefts");
    d = small_cloth("plain");
    assert_int_equal(cloth_description_draft(&d, never, 2, &err), STATUS_OK);
    refuse(&d, "draft");
    assert_int_equal(cloth_description_draft(&d, uneven, 2, &err), STATUS_INVALID);
    assert_string_equal(err.field, "draft");
    assert_int_equal(cloth_description_draft(&d, odd, 2, &err), STATUS_INVALID);
    assert_int_equal(cloth_description_init(&d, "tweed", &err), STATUS_INVALID);
    assert_string_equal(err.text,
                        "unknown weave 'tweed': it is plain, twill, twill31, satin, basket, rib, jersey, velvet "
                        "or felt");
}

/* A cloth that no job could trace is refused before memory runs out. */
static void test_too_many_fibers(void **state)
{
    (void)state;
    struct cloth_description d = small_cloth("plain");
    struct error err = {0};
    struct fiber_set f;
    struct cloth_report r;
    fiber_set_init(&f);
    d.kind[0].n_fiber = CLOTH_MAX_FIBER;
    d.n_yarn[0] = d.n_yarn[1] = CLOTH_MAX_YARN;
    assert_int_equal(cloth_description_check(&d, &err), STATUS_OK);
    assert_int_equal(cloth_build(&d, NULL, NULL, NULL, &f, &r, &err), STATUS_TOO_LARGE);
    assert_non_null(strstr(err.text, "fewer yarns"));
}

/* The thickness without hairs is nearly that of the cloth that has none; hairs push some fibers aside. */
static void test_thickness_without_hairs(void **state)
{
    (void)state;
    struct cloth_description d = small_cloth("plain");
    struct fiber_set f;
    struct cloth_report bare, hairy;
    d.kind[0].n_fiber = 40; /* hairs between few fibers would push them out */
    build(&d, NULL, NULL, &f, &bare);
    fiber_set_release(&f);
    set_number(&d, "yarns[0].hairs_per_mm", 20.0);
    build(&d, NULL, NULL, &f, &hairy);
    fiber_set_release(&f);
    assert_true(fabs(bare.thickness_m - bare.body_thickness_m) < 1e-9);
    assert_true(hairy.thickness_m > 1.3 * bare.thickness_m);
    assert_true(fabs(hairy.body_thickness_m / bare.thickness_m - 1.0) < 0.1);
    assert_true(hairy.volume_fraction > 0.9 * bare.volume_fraction &&
                hairy.volume_fraction < 2.0 * bare.volume_fraction);
}

/* Hairs leave the surface of their yarn: very short ones make a cloth of flat yarns hardly thicker. */
static void test_roots_of_hairs(void **state)
{
    (void)state;
    struct cloth_description d = small_cloth("plain");
    struct fiber_set f;
    struct cloth_report bare, hairy;
    d.kind[0].n_fiber = 60;
    set_number(&d, "yarns[0].flatness", 4.0);
    build(&d, NULL, NULL, &f, &bare);
    fiber_set_release(&f);
    set_number(&d, "yarns[0].hairs_per_mm", 10.0);
    set_number(&d, "yarns[0].hair_length_um", 50.0);
    build(&d, NULL, NULL, &f, &hairy);
    fiber_set_release(&f);
    assert_true(hairy.n_fiber[0] > bare.n_fiber[0]);
    print_message("thickness %.1f um, with short hairs %.1f um\n", 1e6 * bare.thickness_m, 1e6 * hairy.thickness_m);
    assert_true(hairy.thickness_m < bare.thickness_m + 0.1e-3);
}

/* A melange has the asked share of the other kind, between fibers as well. */
static void test_melange(void **state)
{
    (void)state;
    static const double share[] = {0.0, 0.31, 0.7, 1.0};
    for (size_t i = 0; i < 4; i++) {
        struct cloth_description d = small_cloth("twill");
        struct fiber_set f;
        struct cloth_report r;
        d.n_kind = 2;
        d.kind[1] = d.kind[0];
        d.kind[0].melange_with = 1;
        cloth_description_number(&d);
        set_number(&d, "yarns[0].melange", share[i]);
        assert_int_equal(cloth_description_check(&d, NULL), STATUS_OK);
        build(&d, NULL, NULL, &f, &r);
        assert_true(fabs(r.length_m[1] / (r.length_m[0] + r.length_m[1]) - share[i]) < 0.01);
        fiber_set_release(&f);
    }
}

/* Counted threads replace the cover, and the spacing is theirs. */
static void test_threads_per_cm(void **state)
{
    (void)state;
    struct cloth_description d = small_cloth("plain");
    struct fiber_set f;
    struct cloth_report r;
    d.threads_per_cm[CLOTH_WARP] = 100.0;
    cloth_description_number(&d);
    assert_true(cloth_number_index(&d, "cover_warp") < 0 && cloth_number_index(&d, "cover_weft") >= 0);
    build(&d, NULL, NULL, &f, &r);
    assert_true(fabs(r.yarn_spacing_m[0] - 1e-4) < 1e-12 &&
                fabs(r.yarn_spacing_m[1] - r.yarn_width_m[0] / 0.95) < 1e-9);
    fiber_set_release(&f);
}

/* Mean length of all fibers of a cloth over four seeds, and its standard error; the report of the last one. */
static void length_of_seeds(const struct cloth_description *d, double *mean_m, double *se_m, struct cloth_report *r)
{
    enum { N_SEED = 4 };
    double sum = 0.0, square = 0.0;
    for (size_t k = 0; k < N_SEED; k++) {
        struct cloth_description other = *d;
        struct fiber_set f;
        other.seed = d->seed + k;
        build(&other, NULL, NULL, &f, r);
        const double length_m = fiber_set_length_m(&f);
        sum += length_m;
        square += length_m * length_m;
        fiber_set_release(&f);
    }
    *mean_m = sum / N_SEED;
    *se_m = sqrt(fmax(0.0, square - sum * sum / N_SEED) / (N_SEED * (N_SEED - 1)));
}

/* A tile that is twice as long along both edges has four times the length of fibers of the same cloth, and counts that
 * no cloth can have are refused. The means of four seeds may differ by 6 standard errors, which have six degrees of
 * freedom: a chance of 0.1 %. A tile of two yarns is too short for the longest waves of its fibers. */
static void test_larger_tiles(void **state)
{
    (void)state;
    const char *const weave[] = {"plain", "jersey", "velvet", "felt"};
    for (size_t i = 0; i < sizeof weave / sizeof *weave; i++) {
        struct cloth_description d = small_cloth(weave[i]), large;
        struct cloth_report small_report, r;
        struct error err = {0};
        double mean_m[2], se_m[2];
        if (d.structure != CLOTH_FELT) d.n_yarn[0] = d.n_yarn[1] = 4;
        assert_int_equal(cloth_description_enlarge(&d, 2, &large, &err), STATUS_OK);
        assert_int_equal(cloth_description_check(&large, &err), STATUS_OK);
        length_of_seeds(&d, &mean_m[0], &se_m[0], &small_report);
        length_of_seeds(&large, &mean_m[1], &se_m[1], &r);
        const double ratio = mean_m[1] / mean_m[0], se = hypot(ratio * se_m[0], se_m[1]) / mean_m[0];
        print_message("%s: fibers of the larger tile have %.4f +- %.4f times the length\n", weave[i], ratio, se);
        assert_true(fabs(ratio - 4.0) < 6.0 * se && se < 0.02);
        for (int a = 0; a < 2; a++) assert_true(fabs(r.tile_m[a] / small_report.tile_m[a] - 2.0) < 0.01);
        assert_true(fabs(r.body_thickness_m / small_report.body_thickness_m - 1.0) < 0.3);
        assert_true(fabs(r.volume_fraction / small_report.volume_fraction - 1.0) < 0.3);
        assert_true(cloth_description_enlarge(&d, 1000, &large, &err) == STATUS_INVALID &&
                    strcmp(err.field, "final_tiles") == 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_weave),
        cmocka_unit_test(test_numbers_move_fibers_smoothly),
        cmocka_unit_test(test_flat_yarns_keep_the_angle_of_twist),
        cmocka_unit_test(test_contradictions_are_named),
        cmocka_unit_test(test_too_many_fibers),
        cmocka_unit_test(test_thickness_without_hairs),
        cmocka_unit_test(test_roots_of_hairs),
        cmocka_unit_test(test_melange),
        cmocka_unit_test(test_threads_per_cm),
        cmocka_unit_test(test_larger_tiles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
