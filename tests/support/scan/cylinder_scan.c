#include "tests/support/scan/cylinder_scan.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <tiffio.h>

#include <cmocka.h>

enum { NX = CYLINDER_NX, NY = CYLINDER_NY, NZ = CYLINDER_NZ };

const struct test_cylinder cylinder_scan_axis[CYLINDER_N] = {
    {{0.0, 20.0, 12.0}, {1.0, 0.0, 0.0}, 3.5},    {{0.0, 27.2, 12.0}, {1.0, 0.0, 0.0}, 3.5},
    {{36.0, 45.0, 12.0}, {1.0, 0.15, 0.05}, 3.5}, {{20.0, 32.0, 30.0}, {0.1, 1.0, 0.0}, 3.5},
    {{50.0, 32.0, 32.0}, {0.0, 1.0, 0.9}, 3.5},
};

void cylinder_scan_write(const char *path)
{
    const size_t n[3] = {NX, NY, NZ};
    static uint16_t pixel[NX * NY * NZ];
    struct test_page page[NZ];
    struct volume v;
    assert_int_equal(volume_init(&v, n, (const double[3]){1.0, 1.0, 1.0}, NULL), STATUS_OK);
    test_fill_cylinders(&v, cylinder_scan_axis, CYLINDER_N, 0.2, 9);
    for (size_t i = 0; i < NX * NY * NZ; i++) pixel[i] = (uint16_t)lrintf(20000.0f + 10000.0f * v.density[i]);
    for (size_t k = 0; k < NZ; k++) page[k] = (struct test_page){NX, NY, 16, pixel + k * NX * NY};
    test_write_tiff(path, page, NZ, COMPRESSION_ADOBE_DEFLATE, TEST_STRIPS);
    volume_release(&v);
}

void cylinder_scan_run_in(struct scratch_space *space, const char *path, const struct reconstruct_option *o,
                          size_t n_thread, struct cylinder_result *x)
{
    struct error err = {0};
    struct thread_pool *pool;
    memset(x, 0, sizeof *x);
    x->o = *o;
    assert_int_equal(thread_pool_new(n_thread, &pool, &err), STATUS_OK);
    assert_int_equal(reconstruct_read(&path, 1, &x->o, space, pool, NULL, &x->v, &x->r, &err), STATUS_OK);
    assert_int_equal(reconstruct_orientation(&x->v, &x->o, pool, NULL, &x->d, &x->r, &err), STATUS_OK);
    fiber_set_init(&x->f);
    if (reconstruct_fibers(&x->v, &x->d, &x->o, pool, NULL, &x->f, &x->r, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(reconstruct_transfer(&x->f, &x->d, pool, NULL, &x->r, &err), STATUS_OK);
    thread_pool_free(pool);
}

void cylinder_scan_run_axes(struct scratch_space *space, const char *path, const char *axes, size_t n_thread,
                            struct cylinder_result *x)
{
    struct reconstruct_option o;
    reconstruct_option_default(&o);
    snprintf(o.axes, sizeof o.axes, "%s", axes);
    for (int a = 0; a < 3; a++) o.voxel_size_m[a] = 2e-6;
    cylinder_scan_run_in(space, path, &o, n_thread, x);
}

void cylinder_result_release(struct cylinder_result *x)
{
    volume_release(&x->v);
    direction_volume_release(&x->d);
    fiber_set_release(&x->f);
}
