/* Bytes that a scan of thin fibers takes, which are traced in a grid of seven voxels for each of its own: the arrays of
 * the grid count most. Bytes are counted, so the result is the same on all machines. */
#include "geometry/reconstruct/reconstruct.h"
#include "tests/support/scan/scan_files.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static const double voxel_m[3] = {2e-6, 2e-6, 2e-6};

enum { N_X = 48, N_Y = 56, N_Z = 72, N_ROW = 9, N_BUNDLE = N_ROW * N_ROW };
/* Bytes for each voxel of the scan; 174 were needed when the second look had a copy of the grid, and each copy
 * directions for all of its voxels. */
static const double MOST_BYTES = 60.0;

/* A bundle of parallel fibers of 4 voxels. Every third one is thinner, so that the second look has something to
 * find. */
static void make_bundle(struct volume *v, struct scratch_space *space)
{
    const size_t n[3] = {N_X, N_Y, N_Z};
    struct test_cylinder c[N_BUNDLE];
    for (int i = 0; i < N_BUNDLE; i++) {
        const double y = 0.5 * N_Y + 4.6 * (i % N_ROW - N_ROW / 2), z = 0.5 * N_Z + 4.6 * (i / N_ROW - N_ROW / 2);
        c[i] = (struct test_cylinder){{0.5 * N_X, y, z}, {1.0, 0.1, 0.05}, i % 3 == 0 ? 1.4 : 2.1};
    }
    assert_int_equal(volume_init_in(v, n, voxel_m, space, NULL), STATUS_OK);
    test_fill_cylinders(v, c, N_BUNDLE, 0.1, 7);
    for (size_t i = 0; i < volume_n_voxel(n); i++) v->density[i] = fminf(1.0f, fmaxf(0.0f, v->density[i]));
}

static void test_bytes_for_a_voxel(void **state)
{
    const char *folder = *state;
    struct scratch_space *space;
    struct volume v;
    struct direction_volume d;
    struct fiber_set f;
    struct reconstruct_option o;
    struct reconstruct_report r = {0};
    assert_int_equal(scratch_space_new(folder, (size_t)1 << 30, &space, NULL), STATUS_OK);
    make_bundle(&v, space);
    reconstruct_option_default(&o);
    o.fiber_diameter_voxel = 4.0;
    assert_int_equal(reconstruct_orientation(&v, &o, NULL, NULL, &d, &r, NULL), STATUS_OK);
    assert_true(r.trace_edge_voxel < 0.6);
    const double directions = (double)scratch_most_bytes(space) / (double)volume_n_voxel(v.n);
    assert_int_equal(reconstruct_fibers(&v, &d, &o, NULL, NULL, &f, &r, NULL), STATUS_OK);
    const double fibers = (double)scratch_most_bytes(space) / (double)volume_n_voxel(v.n);
    print_message("%zu fibers, radii spread by %.3f; bytes a voxel: directions %.1f, fibers %.1f\n", f.n_fiber,
                  r.radius_spread, directions, fibers);
    assert_in_range(f.n_fiber, N_BUNDLE - 8, N_BUNDLE + 8);
    assert_true(r.radius_spread > 0.05); /* the second look is made */
    assert_true(directions > 20.0 && fibers <= MOST_BYTES);
    fiber_set_release(&f);
    direction_volume_release(&d);
    volume_release(&v);
    scratch_space_free(space);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_bytes_for_a_voxel, scratch_folder_setup, scratch_folder_teardown)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
