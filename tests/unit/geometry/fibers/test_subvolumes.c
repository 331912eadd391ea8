/* Subvolumes: which slices a voxel belongs to, overlapping and disjoint, along a fiber that turns from one axis to
 * another.
 */
#include "geometry/fibers/slices/subvolumes.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

enum { N = 12, ROW = 3 };

/* Kept voxels in the middle rows, whose directions turn from x to y along x. */
static void make_turning(struct direction_volume *d)
{
    static const size_t n[3] = {N, ROW, ROW};
    static const double voxel_m[3] = {1e-6, 1e-6, 1e-6};
    assert_int_equal(direction_volume_init(d, n, voxel_m, NULL), STATUS_OK);
    for (size_t at = 0; at < volume_n_voxel(n); at++) {
        const double angle = M_PI_2 * (double)(at % N) / (N - 1);
        const float u[3] = {(float)cos(angle), (float)sin(angle), 0.0f};
        d->density[at] = at / N == ROW * ROW / 2 ? 200 : 0;
        direction_volume_set(d, at, u);
    }
}

static unsigned frames_at(const struct subvolumes *s, size_t i)
{
    return s->mask[(ROW * ROW / 2) * N + i] & ((1u << N_SLICE_FRAME) - 1u);
}

static void test_frames(void **state)
{
    (void)state;
    struct direction_volume d;
    struct subvolumes nine, three;
    unsigned turned = 0;
    make_turning(&d);
    assert_int_equal(subvolumes_init(&nine, &d, false, NULL, NULL), STATUS_OK);
    assert_int_equal(subvolumes_init(&three, &d, true, NULL, NULL), STATUS_OK);
    for (size_t i = 0; i < N; i++) {
        const unsigned axis = i < N / 2 ? 1u : 2u; /* bits of x and y */
        assert_int_equal(frames_at(&three, i), axis);
        assert_true((frames_at(&nine, i) & 7u) == axis || frames_at(&nine, i) > 8u);
        if (i > 0) turned += (frames_at(&nine, i) & frames_at(&nine, i - 1)) == 0;
        if (i > 0) assert_true(((frames_at(&three, i) & frames_at(&three, i - 1)) == 0) == (i == N / 2));
    }
    assert_int_equal(turned, 0); /* neighbours share a frame everywhere: the chain goes on */
    for (int a = 0; a < 3; a++) assert_int_equal(nine.n_class_voxel[a], three.n_class_voxel[a]);
    subvolumes_release(&nine);
    subvolumes_release(&three);
    direction_volume_release(&d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_frames)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
