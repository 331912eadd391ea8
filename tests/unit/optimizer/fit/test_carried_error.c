/* Errors of numbers that were held fixed, carried into parameters: a linear problem with a known answer. */
#include "optimizer/fit/cloth/carried_error.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

/* Two parameters and one number between them in the order p, x, q, with shifts dp/dx = 2 and dq/dx = -1 at fixed
 * measurements. The joint covariance is that of p and q at fixed x plus S var(x) S'. */
static const double at_fixed_x[2][2] = {{0.5, 0.1}, {0.1, 0.8}}, shift[2] = {2.0, -1.0};
static const double joint_variance = 0.3;

static void make_joint(struct uncertainty *u)
{
    static const size_t at[2] = {0, 2};
    memset(u, 0, sizeof *u);
    u->n_param = 3;
    u->cov[3 * 1 + 1] = joint_variance;
    for (size_t a = 0; a < 2; a++) {
        u->cov[3 * at[a] + 1] = u->cov[3 * 1 + at[a]] = shift[a] * joint_variance;
        for (size_t b = 0; b < 2; b++)
            u->cov[3 * at[a] + at[b]] = at_fixed_x[a][b] + shift[a] * shift[b] * joint_variance;
    }
}

static void make_fixed(struct uncertainty *u)
{
    memset(u, 0, sizeof *u);
    u->n_param = 2;
    for (size_t a = 0; a < 2; a++) {
        u->se_param[a] = 10.0 * sqrt(at_fixed_x[a][a]); /* another unit */
        for (size_t b = 0; b < 2; b++) {
            u->cov[2 * a + b] = at_fixed_x[a][b];
            u->correlation[2 * a + b] = at_fixed_x[a][b] / sqrt(at_fixed_x[a][a] * at_fixed_x[b][b]);
        }
    }
}

static void expect(const struct uncertainty *u, double variance)
{
    for (size_t a = 0; a < 2; a++) {
        double own = at_fixed_x[a][a] + shift[a] * shift[a] * variance;
        assert_true(fabs(u->se_param[a] - 10.0 * sqrt(own)) < 1e-12);
        for (size_t b = 0; b < 2; b++) {
            double other = at_fixed_x[b][b] + shift[b] * shift[b] * variance;
            double both = at_fixed_x[a][b] + shift[a] * shift[b] * variance;
            assert_true(fabs(u->cov[2 * a + b] - both) < 1e-12);
            assert_true(fabs(u->correlation[2 * a + b] - both / sqrt(own * other)) < 1e-12);
        }
    }
}

static void test_joint_and_given_variance(void **state)
{
    (void)state;
    struct uncertainty joint, u;
    const double given = 0.07, none = 0.0;
    make_joint(&joint);
    make_fixed(&u);
    carried_error_add(&joint, 1, 1, NULL, &u);
    expect(&u, joint_variance);
    make_fixed(&u);
    carried_error_add(&joint, 1, 1, &given, &u);
    expect(&u, given);
    make_fixed(&u);
    carried_error_add(&joint, 1, 1, &none, &u);
    expect(&u, 0.0);
}

/* The same with two numbers whose errors in the joint fit are correlated: each shifts both parameters. */
static void test_two_numbers(void **state)
{
    (void)state;
    static const double s[2][2] = {{2.0, -0.7}, {-1.0, 0.4}}, c[2][2] = {{0.3, 0.12}, {0.12, 0.2}},
                        given[2] = {0.07, 0.02};
    static const size_t at[2] = {0, 3};
    struct uncertainty joint = {.n_param = 4}, u;
    for (size_t k = 0; k < 2; k++)
        for (size_t l = 0; l < 2; l++) joint.cov[4 * (1 + k) + 1 + l] = c[k][l];
    for (size_t a = 0; a < 2; a++)
        for (size_t b = 0; b < 2; b++) {
            joint.cov[4 * at[a] + 1 + b] = joint.cov[4 * (1 + b) + at[a]] = s[a][0] * c[0][b] + s[a][1] * c[1][b];
            joint.cov[4 * at[a] + at[b]] = at_fixed_x[a][b];
            for (size_t k = 0; k < 2; k++)
                for (size_t l = 0; l < 2; l++) joint.cov[4 * at[a] + at[b]] += s[a][k] * c[k][l] * s[b][l];
        }
    for (int is_given = 0; is_given < 2; is_given++) {
        make_fixed(&u);
        carried_error_add(&joint, 1, 2, is_given ? given : NULL, &u);
        for (size_t a = 0; a < 2; a++)
            for (size_t b = 0; b < 2; b++) {
                double want = at_fixed_x[a][b];
                for (size_t k = 0; k < 2; k++)
                    for (size_t l = 0; l < 2; l++)
                        want += s[a][k] * (is_given ? (k == l ? given[k] : 0.0) : c[k][l]) * s[b][l];
                assert_true(fabs(u.cov[2 * a + b] - want) < 1e-12);
            }
    }
    for (size_t k = 0; k < 4; k++) joint.cov[4 * 2 + k] = joint.cov[4 * k + 2] = 0.0; /* the second one was fixed */
    make_fixed(&u);
    carried_error_add(&joint, 1, 2, given, &u);
    const double first = joint.cov[1] / joint.cov[4 * 1 + 1]; /* shift of p by the first one */
    assert_true(fabs(u.cov[0] - (at_fixed_x[0][0] + first * first * given[0])) < 1e-12);
}

/* A number without variance was fixed in the joint fit too, and a fixed parameter keeps its zero. */
static void test_fixed_ones_are_left_out(void **state)
{
    (void)state;
    struct uncertainty joint, u, before;
    const double given = 0.07;
    make_joint(&joint);
    for (size_t k = 0; k < 3; k++) joint.cov[3 * 1 + k] = joint.cov[3 * k + 1] = 0.0;
    make_fixed(&u);
    before = u;
    carried_error_add(&joint, 1, 1, &given, &u);
    assert_memory_equal(&u, &before, sizeof u);
    make_joint(&joint);
    memset(u.cov, 0, sizeof u.cov);
    u.cov[3] = at_fixed_x[1][1];
    u.se_param[0] = 0.0;
    carried_error_add(&joint, 1, 1, &given, &u);
    assert_true(u.cov[0] == 0.0 && u.cov[1] == 0.0 && u.se_param[0] == 0.0);
    assert_true(fabs(u.cov[3] - (at_fixed_x[1][1] + given)) < 1e-12);
}

/* The numbers of a joint fit are left out of its errors: the others keep theirs, in their order. */
static void test_numbers_are_left_out(void **state)
{
    (void)state;
    enum { N = 5, FIRST = 1, N_OUT = 2, M = N - N_OUT };
    static const size_t from[M] = {0, 3, 4};
    struct uncertainty u = {.n_param = N}, out;
    for (size_t p = 0; p < N; p++) {
        u.se_param[p] = (double)p + 0.5;
        u.at_bound[p] = p == 3;
        u.determined[p] = p == 4;
        for (size_t q = 0; q < N; q++) {
            u.cov[p * N + q] = (double)(10 * p + q);
            u.correlation[p * N + q] = (double)(10 * p + q) / 100.0;
        }
    }
    memset(&out, 0, sizeof out);
    carried_error_leave_out(&u, FIRST, N_OUT, &out);
    assert_int_equal(out.n_param, M);
    for (size_t p = 0; p < M; p++) {
        assert_true(out.se_param[p] == (double)from[p] + 0.5);
        assert_true(out.at_bound[p] == (from[p] == 3) && out.determined[p] == (from[p] == 4));
        for (size_t q = 0; q < M; q++) {
            assert_true(out.cov[p * M + q] == (double)(10 * from[p] + from[q]));
            assert_true(out.correlation[p * M + q] == (double)(10 * from[p] + from[q]) / 100.0);
        }
    }
}

/* No error is larger than that of a parameter of which only the range is known, which is not determined then. */
static void test_limit(void **state)
{
    (void)state;
    static const struct param_info info[2] = {
        {"x", "x", PARAM_SHAPE, PARAM_UNIT_NONE, -1, 0.0, 1.0, 0.5, PARAM_LINEAR, ""},
        {"y", "y", PARAM_SHAPE, PARAM_UNIT_NONE, -1, 0.0, 1.0, 0.5, PARAM_LINEAR, ""}};
    static const struct fit_parameter parameter[2] = {{0.0, 1.0, 0.5, false}, {0.0, 1.0, 0.5, false}};
    struct uncertainty u = {.n_param = 2, .cov = {0.0001, 0.0, 0.0, 1.0}, .se_param = {0.01, 1.0}};
    u.determined[0] = false;
    u.determined[1] = true;
    carried_error_limit(info, parameter, &u);
    assert_true(u.determined[0] && !u.determined[1]);
    assert_true(u.se_param[0] == 0.01 && fabs(u.se_param[1] - 1.0 / sqrt(12.0)) < 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_joint_and_given_variance),
        cmocka_unit_test(test_two_numbers),
        cmocka_unit_test(test_fixed_ones_are_left_out),
        cmocka_unit_test(test_numbers_are_left_out),
        cmocka_unit_test(test_limit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
