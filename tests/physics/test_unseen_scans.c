/* Synthetic scans of another generator that were traced wrong once, with their fibers (SELVEDGE_DATA/unseen-scans). */
#include "geometry/phantom/compare.h"
#include "geometry/reconstruct/reconstruct.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static const double voxel_m = 2.2e-6;

struct scan {
    struct volume v;
    struct fiber_set found, truth;
    struct reconstruct_report r;
    struct compare_report c;
};

static void path_of(char path[512], const char *name)
{
    const char *folder = getenv("SELVEDGE_DATA");
    snprintf(path, 512, "%s/unseen-scans/%s", folder != NULL ? folder : "../shared/data", name);
    if (access(path, R_OK) == 0) return;
    print_message("the scan '%s' is not there, test skipped\n", name);
    skip();
}

static void reconstruct_scan(const char *name, struct scan *s)
{
    char path[512];
    const char *file = path;
    struct error err = {0};
    struct reconstruct_option o;
    struct direction_volume d = {0};
    struct thread_pool *pool;
    path_of(path, name);
    memset(s, 0, sizeof *s);
    reconstruct_option_default(&o);
    for (int a = 0; a < 3; a++) o.voxel_size_m[a] = voxel_m;
    assert_int_equal(thread_pool_new(0, &pool, &err), STATUS_OK);
    assert_int_equal(reconstruct_read(&file, 1, &o, NULL, pool, NULL, &s->v, &s->r, &err), STATUS_OK);
    assert_int_equal(reconstruct_refill_lumens(&s->v, &o, pool, NULL, &s->r, &err), STATUS_OK);
    assert_int_equal(reconstruct_orientation(&s->v, &o, pool, NULL, &d, &s->r, &err), STATUS_OK);
    assert_int_equal(reconstruct_redirect(&s->v, &d, &o, pool, NULL, &s->r, &err), STATUS_OK);
    assert_int_equal(reconstruct_fibers(&s->v, &d, &o, pool, NULL, &s->found, &s->r, &err), STATUS_OK);
    assert_int_equal(reconstruct_grade(&s->v, &s->found, pool, &s->r, NULL, &err), STATUS_OK);
    direction_volume_release(&d);
    thread_pool_free(pool);
}

/* The true fibers: a line "fiber I radius R", then points in voxels whose centers are whole numbers. */
static void read_truth(const char *name, struct fiber_set *f)
{
    char path[512], line[256];
    float radius = 0.0f, x[3];
    path_of(path, name);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    fiber_set_init(f);
    assert_int_equal(fiber_set_reserve(f, 4096, 1u << 18, NULL), STATUS_OK);
    f->n_fiber = f->n_vertex = 0;
    f->first_vertex[0] = 0;
    while (fgets(line, sizeof line, file) != NULL) {
        if (strncmp(line, "fiber", 5) == 0) {
            assert_int_equal(sscanf(line, "%*s %*s %*s %f", &radius), 1);
            f->radius_m[f->n_fiber++] = (float)(radius * voxel_m);
        } else if (f->n_fiber > 0 && sscanf(line, "%f %f %f", &x[0], &x[1], &x[2]) == 3) {
            for (size_t a = 0; a < 3; a++) f->position_m[3 * f->n_vertex + a] = (float)((x[a] + 0.5) * voxel_m);
            f->first_vertex[f->n_fiber] = ++f->n_vertex;
        }
    }
    fclose(file);
}

static void compare(const char *name, struct scan *s)
{
    const struct compare_option o = {.voxel_size_m = s->v.voxel_size_m[0], .margin_m = 3.0 * s->v.voxel_size_m[0]};
    read_truth(name, &s->truth);
    memcpy(s->truth.tile_size_m, s->found.tile_size_m, sizeof s->truth.tile_size_m);
    assert_int_equal(compare_fibers(&s->truth, &s->found, &o, &s->c, NULL), STATUS_OK);
    print_message("%s: recall %.3f, precision %.3f, %.2f pieces a fiber, score %.3f, faults %u\n", name,
                  s->c.center_recall, s->c.center_precision, s->c.fragments_per_fiber, s->r.grade.score,
                  s->r.grade.faults);
}

static void release(struct scan *s)
{
    volume_release(&s->v);
    fiber_set_release(&s->found);
    fiber_set_release(&s->truth);
}

/* The weft has 0.35 of the warp's density: once half of the fibers were missing, and the scan was called good. */
static void test_two_densities(void **state)
{
    (void)state;
    struct scan s;
    reconstruct_scan("two-densities.tif", &s);
    compare("two-densities.truth.txt", &s);
    assert_true(s.c.center_recall > 0.95 && s.c.center_precision > 0.97 && s.c.fragments_per_fiber < 1.2);
    assert_true(s.r.kinds.n == 2);
    release(&s);
}

/* Diameters of 4.1 and 11.4 voxels: once two or three lines in each thick fiber, and radii 34 % too small. */
static void test_two_diameters(void **state)
{
    (void)state;
    struct scan s;
    reconstruct_scan("two-diameters.tif", &s);
    compare("two-diameters.truth.txt", &s);
    const struct fiber_kind *thick = &s.r.kinds.kind[0], *thin = &s.r.kinds.kind[1];
    print_message("radii %.2f and %.2f voxels\n", thick->radius_m / voxel_m, thin->radius_m / voxel_m);
    assert_true(s.c.center_recall > 0.985 && s.c.center_precision > 0.985 && s.c.fragments_per_fiber < 1.02);
    assert_true(s.r.kinds.n == 2 && thick->radius_m > 0.87 * 5.74 * voxel_m && thin->radius_m < 2.1 * voxel_m);
    assert_true(s.r.grade.faults == 0);
    release(&s);
}

/* 350 balls and no fiber: once 69 fibers, and the scan was called good. */
static void test_grains(void **state)
{
    (void)state;
    struct scan s;
    reconstruct_scan("grains.tif", &s);
    print_message("grains: score %.3f, faults %u\n", s.r.grade.score, s.r.grade.faults);
    assert_true(s.r.grade.faults != 0 && s.r.grade.score < GRADE_LEAST_SCORE);
    release(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_two_densities), cmocka_unit_test(test_two_diameters),
                                       cmocka_unit_test(test_grains)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
