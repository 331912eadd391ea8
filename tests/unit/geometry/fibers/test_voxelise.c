/* Voxels of fibers: the volume of the fibers is preserved at any voxel size, directions are their tangents, the grid is
 * periodic, and the result does not depend on the number of threads. */
#include "base/angle.h"
#include "geometry/fibers/voxelise.h"
#include "tests/support/cloth/hand_weave.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { LIMIT = 1 << 28 };
static const double um = 1e-6;

static void voxelise(const struct fiber_set *f, double voxel_m, size_t n_thread, struct direction_volume *v)
{
    const struct voxelise_option o = {.voxel_size_m = voxel_m, .limit_bytes = LIMIT};
    struct thread_pool *pool = NULL;
    double used;
    assert_int_equal(thread_pool_new(n_thread, &pool, NULL), STATUS_OK);
    assert_int_equal(fibers_voxelise(f, &o, pool, NULL, v, &used, NULL), STATUS_OK);
    thread_pool_free(pool);
}

static double volume_of(const struct direction_volume *v)
{
    double sum = 0.0;
    for (size_t i = 0; i < volume_n_voxel(v->n); i++) sum += v->density[i] / 255.0;
    return sum * v->voxel_size_m[0] * v->voxel_size_m[1] * v->voxel_size_m[2];
}

/* Straight fibers through the tile, in a direction that is not aligned with the grid. They do not touch. */
static void slanted(struct fiber_set *f, size_t n, double tile_m, double radius_m)
{
    fiber_set_init(f);
    assert_int_equal(fiber_set_reserve(f, n, 3 * n, NULL), STATUS_OK);
    f->tile_size_m[0] = f->tile_size_m[1] = tile_m;
    for (size_t i = 0; i < n; i++) {
        f->first_vertex[i + 1] = 3 * (i + 1);
        f->radius_m[i] = (float)radius_m;
        f->axis_class[i] = 0;
        for (size_t k = 0; k < 3; k++) {
            float *p = f->position_m + 3 * (3 * i + k);
            p[0] = (float)(0.5 * tile_m * (double)k);
            p[1] = 0.37f * p[0] + 0.618f * (float)(tile_m * (double)i);
            p[2] = (float)(0.1 * tile_m * (double)k + 3.3 * radius_m * (double)i);
        }
    }
}

static void test_volume_is_kept(void **unused)
{
    (void)unused;
    const double tile = 300 * um, radius = 10 * um, length = tile * sqrt(1.0 + 0.37 * 0.37 + 0.04),
                 want = M_PI * radius * radius * length;
    /* edges against the radius; the tolerance is that of cutting to voxels at the ends and of bytes for coarse ones */
    static const double edge[] = {0.3, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0};
    enum { N = 25 }; /* many, at all places between the centers of coarse voxels */
    struct fiber_set f;
    slanted(&f, N, tile, radius);
    for (size_t i = 0; i < sizeof edge / sizeof edge[0]; i++) {
        struct direction_volume v;
        voxelise(&f, edge[i] * radius, 2, &v);
        double got = volume_of(&v) / (N * want);
        print_message("voxel %.1f r: volume %.4f of the truth\n", edge[i], got);
        assert_true(fabs(got - 1.0) < 0.02);
        direction_volume_release(&v);
    }
    fiber_set_release(&f);
}

/* Every fiber has its own radius in the density: the share of material on one of two radii is that of its disc. */
static void test_fibers_of_unequal_radius(void **unused)
{
    (void)unused;
    const double tile = 300 * um, length = tile * sqrt(1.0 + 0.37 * 0.37 + 0.04), radius[2] = {6 * um, 14 * um};
    struct fiber_set f;
    struct direction_volume v;
    for (int thick = 0; thick < 2; thick++) {
        slanted(&f, 2, tile, 10 * um);
        f.radius_m[thick] = (float)radius[1];
        f.radius_m[1 - thick] = (float)radius[0];
        f.position_m[3 * 3 + 2] = f.position_m[3 * 4 + 2] = f.position_m[3 * 5 + 2] = (float)(150 * um);
        voxelise(&f, 4 * um, 1, &v);
        double low = 0.0;
        for (size_t i = 0; i < volume_n_voxel(v.n); i++)
            if ((double)(i / (v.n[0] * v.n[1])) < 0.5 * (double)v.n[2]) low += v.density[i] / 255.0 * pow(4 * um, 3);
        double want = M_PI * radius[thick == 0] * radius[thick == 0] * length;
        assert_true(fabs(low / want - 1.0) < 0.03);
        direction_volume_release(&v);
        fiber_set_release(&f);
    }
}

static void test_directions_are_tangents(void **unused)
{
    (void)unused;
    struct fiber_set f;
    struct direction_volume v;
    size_t n = 0;
    slanted(&f, 2, 300 * um, 10 * um);
    voxelise(&f, 5 * um, 1, &v);
    for (size_t i = 0; i < volume_n_voxel(v.n); i++) {
        float d[3];
        const double t = sqrt(1.0 + 0.37 * 0.37 + 0.04);
        if (v.density[i] == 0) continue;
        direction_volume_get(&v, i, d);
        double cosine = fabs(((double)d[0] + 0.37 * (double)d[1] + 0.2 * (double)d[2]) / t);
        assert_true(cosine > cos(0.02 * RAD_PER_DEG));
        n++;
    }
    assert_true(n > 1000);
    fiber_set_release(&f);
    direction_volume_release(&v);
}

/* A cloth that is moved by whole voxels gives the moved volume, so that the edges of the tile leave no trace. */
static void test_periodic(void **unused)
{
    (void)unused;
    struct fiber_set f;
    struct direction_volume a, b;
    hand_weave_small(&f);
    voxelise(&f, 8 * um, 1, &a);
    size_t shift[2] = {a.n[0] / 3, a.n[1] / 2}, n_other = 0;
    for (size_t k = 0; k < f.n_vertex; k++)
        for (size_t i = 0; i < 2; i++) f.position_m[3 * k + i] += (float)((double)shift[i] * a.voxel_size_m[i]);
    voxelise(&f, 8 * um, 1, &b);
    assert_memory_equal(a.n, b.n, sizeof a.n);
    for (size_t k = 0; k < a.n[2]; k++)
        for (size_t j = 0; j < a.n[1]; j++)
            for (size_t i = 0; i < a.n[0]; i++) {
                size_t to = volume_index(a.n, (i + shift[0]) % a.n[0], (j + shift[1]) % a.n[1], k);
                n_other += abs(a.density[volume_index(a.n, i, j, k)] - b.density[to]) > 1;
            }
    assert_true(n_other <= volume_n_voxel(a.n) / 10000); /* positions are single precision */
    fiber_set_release(&f);
    direction_volume_release(&a);
    direction_volume_release(&b);
}

static void test_threads_do_not_matter(void **unused)
{
    (void)unused;
    struct fiber_set f;
    struct direction_volume a, b;
    hand_weave_small(&f);
    voxelise(&f, NAN, 1, &a);
    voxelise(&f, NAN, 3, &b);
    assert_memory_equal(a.n, b.n, sizeof a.n);
    assert_true(fabs(a.voxel_size_m[2] - 8 * um) < 0.01 * um); /* half of 16 um */
    assert_memory_equal(a.density, b.density, volume_n_voxel(a.n));
    assert_memory_equal(a.octahedral, b.octahedral, 4 * volume_n_voxel(a.n));
    /* no voxel above 1, and no more material than the fibers have */
    double fibers = 0.0;
    for (size_t i = 0; i < f.n_fiber; i++)
        fibers += M_PI * (double)f.radius_m[i] * (double)f.radius_m[i] / (double)f.n_fiber;
    double share = volume_of(&a) / (fibers * fiber_set_length_m(&f));
    assert_true(share > 0.7 && share < 1.01); /* strands of the hand-made weave overlap a little */
    fiber_set_release(&f);
    direction_volume_release(&a);
    direction_volume_release(&b);
}

static void test_limits(void **unused)
{
    (void)unused;
    struct fiber_set f;
    struct direction_volume v;
    struct thread_pool *pool = NULL;
    struct error err;
    double used;
    slanted(&f, 2, 300 * um, 10 * um);
    assert_int_equal(thread_pool_new(1, &pool, NULL), STATUS_OK);
    struct voxelise_option o = {.voxel_size_m = 1 * um, .limit_bytes = 100000};
    assert_int_equal(fibers_voxelise(&f, &o, pool, NULL, &v, &used, &err), STATUS_TOO_LARGE);
    assert_non_null(strstr(err.text, "1 um"));
    assert_null(v.density);
    o.voxel_size_m = NAN; /* chosen automatically, as small as the limit allows */
    assert_int_equal(fibers_voxelise(&f, &o, pool, NULL, &v, &used, &err), STATUS_OK);
    assert_true(used > 5 * um && 5 * volume_n_voxel(v.n) <= o.limit_bytes &&
                6 * volume_n_voxel(v.n) > o.limit_bytes / 2);
    direction_volume_release(&v);
    o = (struct voxelise_option){.voxel_size_m = 1e-3, .limit_bytes = LIMIT};
    assert_int_equal(fibers_voxelise(&f, &o, pool, NULL, &v, &used, &err), STATUS_INVALID);
    o.voxel_size_m = -1.0;
    assert_int_equal(fibers_voxelise(&f, &o, pool, NULL, &v, &used, &err), STATUS_INVALID);
    atomic_bool cancel = true;
    const struct progress cancelled = {NULL, NULL, &cancel};
    o.voxel_size_m = 5 * um;
    assert_int_equal(fibers_voxelise(&f, &o, pool, &cancelled, &v, &used, &err), STATUS_CANCELLED);
    assert_null(v.density);
    thread_pool_free(pool);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_volume_is_kept), cmocka_unit_test(test_directions_are_tangents),
        cmocka_unit_test(test_periodic),       cmocka_unit_test(test_threads_do_not_matter),
        cmocka_unit_test(test_limits),         cmocka_unit_test(test_fibers_of_unequal_radius),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
