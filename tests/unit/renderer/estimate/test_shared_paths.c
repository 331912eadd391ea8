/* Configurations that differ in their lamp and share their camera paths: the same means as apart, and the correlation
 * of their noise. */
#include "tests/support/tracer/estimate_fixture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

static struct estimate_fixture fixture;

static int set_up(void **state)
{
    (void)state;
    return estimate_fixture_init(&fixture);
}

static int tear_down(void **state)
{
    (void)state;
    estimate_fixture_release(&fixture);
    return 0;
}

/* Shared paths: the same means and derivatives as separate ones within their errors, the same bits for any threads. */
static void shared_paths_agree_with_separate_ones(void **state)
{
    (void)state;
    enum { N = 5, N_PARAM = 9 };
    const size_t n_path[N] = {16384, 8192, 0, 4096, 16384};
    struct configuration c[N];
    struct estimate separate[N], shared[N], again[N];
    struct estimate_request q = estimate_fixture_request(&fixture, n_path, N);
    for (int i = 0; i < N; i++) {
        c[i] = fixture.configuration[i == 3 ? 4 : 0]; /* one of them with the cloth turned: alone in its group */
        c[i].light_theta_rad = 0.2 + 0.25 * i;
        c[i].light_phi_rad = 2.0 + 0.7 * i;
    }
    c[4].environment_rgb[1] = 0.1; /* differs in more than its lamp: alone, too */
    q.configuration = c;
    estimate_fixture_run(&q, 2, separate);
    q.share_camera_paths = true;
    estimate_fixture_run(&q, 2, shared);
    estimate_fixture_run(&q, 1, again);
    assert_memory_equal(shared, again, sizeof shared);
    assert_int_equal(shared[2].n_path, 0);
    assert_int_equal(shared[1].n_path, 16384); /* as many as configuration 0 asks for */
    for (int i = 0; i < N; i++)
        for (int k = 0; k < 3 && i != 2; k++) {
            double se = sqrt(separate[i].var[k] + shared[i].var[k]);
            if (!(fabs(separate[i].mean[k] - shared[i].mean[k]) < 4 * se && shared[i].mean[k] > 0))
                fail_msg("configuration %d, channel %d: %g and %g, +- %g", i, k, separate[i].mean[k], shared[i].mean[k],
                         se);
            for (int p = 0; p < N_PARAM; p++) {
                double jac_se = sqrt(separate[i].jac_var[k * N_PARAM + p] + shared[i].jac_var[k * N_PARAM + p]);
                if (fabs(separate[i].jac[k * N_PARAM + p] - shared[i].jac[k * N_PARAM + p]) > 4.5 * jac_se)
                    fail_msg("configuration %d, derivative %d of channel %d: %g and %g, +- %g", i, p, k,
                             separate[i].jac[k * N_PARAM + p], shared[i].jac[k * N_PARAM + p], jac_se);
            }
        }
    /* a group of one has the paths of its own estimate when it is first: same key, same numbers */
    q.n_configuration = 1;
    estimate_fixture_run(&q, 1, again);
    q.share_camera_paths = false;
    estimate_fixture_run(&q, 1, separate);
    assert_memory_equal(&again[0].mean, &separate[0].mean, sizeof again[0].mean);
    assert_memory_equal(&again[0].jac, &separate[0].jac, sizeof again[0].jac);
}

/* The stated correlation of means that share camera paths is that of repeated estimates; also of means over rotations,
 * and estimates that are moved to other places keep it. */
static void shared_paths_state_their_correlation(void **state)
{
    (void)state;
    enum { N = 3, REPEAT = 200 };
    const size_t n_path[N] = {256, 256, 256};
    for (uint32_t n_rotation = 1; n_rotation <= 2; n_rotation++) {
        struct configuration c[N] = {fixture.configuration[1], fixture.configuration[4], fixture.configuration[1]};
        struct estimate e[N];
        struct estimate_request q = estimate_fixture_request(&fixture, n_path, N);
        double sum[2] = {0}, square[2] = {0}, product = 0.0, stated = 0.0;
        c[2].light_theta_rad += 0.2;
        c[0].n_rotation = c[2].n_rotation = n_rotation;
        q.configuration = c;
        q.share_camera_paths = true;
        q.input.want_derivative = false;
        for (int k = 0; k < REPEAT; k++) {
            q.iteration = (uint32_t)k;
            estimate_fixture_run(&q, 2, e);
            assert_true(e[0].n_partner == 0 && e[1].n_partner == 0 && e[2].n_partner == 1);
            assert_int_equal(e[2].partner[0].configuration, 0);
            double x = e[0].mean[0] + e[0].mean[1] + e[0].mean[2], y = e[2].mean[0] + e[2].mean[1] + e[2].mean[2];
            sum[0] += x / REPEAT;
            sum[1] += y / REPEAT;
            square[0] += x * x / REPEAT;
            square[1] += y * y / REPEAT;
            product += x * y / REPEAT;
            stated += (double)e[2].partner[0].correlation / REPEAT;
        }
        double found =
            (product - sum[0] * sum[1]) / sqrt((square[0] - sum[0] * sum[0]) * (square[1] - sum[1] * sum[1]));
        double se = (1.0 - found * found) / sqrt(REPEAT);
        if (!(stated > 0.2 && stated < 0.98 && fabs(found - stated) < 4.0 * se + 0.05))
            fail_msg("%u rotations: stated %g, found %g +- %g", n_rotation, stated, found, se);
        estimate_move_partners(&e[2], (const size_t[N]){7, SIZE_MAX, SIZE_MAX});
        assert_true(e[2].n_partner == 1 && e[2].partner[0].configuration == 7);
        e[2].partner[0].configuration = 1;
        estimate_move_partners(&e[2], (const size_t[N]){7, SIZE_MAX, SIZE_MAX});
        assert_int_equal(e[2].n_partner, 0);
    }
}

/* Without a lamp nothing is shared: the estimate for an environment alone agrees with that by separate paths. */
static void shared_paths_without_a_lamp(void **state)
{
    (void)state;
    const size_t n_path[2] = {4096, 4096};
    struct configuration c[2] = {fixture.configuration[0], fixture.configuration[0]};
    struct estimate separate[2], shared[2];
    struct estimate_request q = estimate_fixture_request(&fixture, n_path, 2);
    for (int i = 0; i < 2; i++) {
        c[i].light = LIGHT_NO_LAMP;
        c[i].environment_rgb[0] = c[i].environment_rgb[1] = c[i].environment_rgb[2] = 0.5 + i;
    }
    q.configuration = c;
    estimate_fixture_run(&q, 2, separate);
    q.share_camera_paths = true;
    estimate_fixture_run(&q, 2, shared);
    assert_memory_equal(shared[0].mean, separate[0].mean,
                        sizeof shared[0].mean); /* first in the order: same key, same numbers */
    for (int k = 0; k < 3; k++) {
        double se = sqrt(separate[1].var[k] + shared[1].var[k]);
        if (!(fabs(shared[1].mean[k] - separate[1].mean[k]) < 4 * se && shared[1].mean[k] > 0))
            fail_msg("channel %d: %g, alone %g, +- %g", k, shared[1].mean[k], separate[1].mean[k], se);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(shared_paths_agree_with_separate_ones),
                                       cmocka_unit_test(shared_paths_state_their_correlation),
                                       cmocka_unit_test(shared_paths_without_a_lamp)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
