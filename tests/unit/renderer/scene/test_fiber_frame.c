/* Fiber frames: orthonormal, right-handed, and with the normal of a flat section nearest to the cloth's normal. */
#include "renderer/scene/fiber_frame.h"

#include "base/rng.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static void random_direction(struct rng *r, float out[3])
{
    float norm;
    do {
        for (int a = 0; a < 3; a++) out[a] = 2 * rng_float(r) - 1;
        norm = sqrtf(fiber_frame_dot(out, out));
    } while (norm > 1 || norm < 0.1f);
    for (int a = 0; a < 3; a++) out[a] /= norm;
}

static void assert_frame(const struct fiber_frame *f)
{
    const float *axis[3] = {f->u, f->v, f->w};
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) assert_true(fabsf(fiber_frame_dot(axis[a], axis[b]) - (a == b ? 1 : 0)) < 1e-5f);
    for (int a = 0; a < 3; a++) {
        int b = (a + 1) % 3, c = (a + 2) % 3;
        assert_true(fabsf(f->u[b] * f->v[c] - f->u[c] * f->v[b] - f->w[a]) < 1e-5f);
    }
}

static void flat_frames_have_the_highest_normal(void **state)
{
    (void)state;
    struct rng r;
    rng_start(&r, &(struct rng_key){3, 0, 0, 0}, 0, 0);
    for (int i = 0; i < 1000; i++) {
        float u[3], back[3];
        struct fiber_frame f, other;
        random_direction(&r, u);
        for (int a = 0; a < 3; a++) back[a] = -u[a];
        fiber_frame_flat(&f, u);
        fiber_frame_flat(&other, back);
        assert_frame(&f);
        assert_frame(&other);
        for (int a = 0; a < 3; a++) assert_true(f.v[a] == other.v[a]); /* no matter which way the fiber is traced */
        for (int k = 0; k < 16; k++) {                                 /* no direction across the fiber is higher */
            double turn = k * M_PI / 8;
            assert_true((double)f.v[2] * cos(turn) + (double)f.w[2] * sin(turn) <= (double)f.v[2] + 1e-6);
        }
    }
}

static void fibers_along_the_normal_have_a_frame(void **state)
{
    (void)state;
    const float u[2][3] = {{0, 0, 1}, {0, 0, -1}};
    for (int i = 0; i < 2; i++) {
        struct fiber_frame f;
        fiber_frame_flat(&f, u[i]);
        assert_frame(&f);
        assert_true(f.v[0] == 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flat_frames_have_the_highest_normal),
        cmocka_unit_test(fibers_along_the_normal_have_a_frame),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
