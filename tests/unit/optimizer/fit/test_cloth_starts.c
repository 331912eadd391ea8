/* Several searches over the numbers of a cloth, of which cross-validation keeps one (cloth_search.h). */
#include "tests/support/tracer/fake_numbers.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double mid_cloth[FAKE_N_NUMBER] = {2.6, 0.62, 4.0};

static struct cloth_search_result *search_from(size_t n_start, size_t n_screen, double misfit)
{
    struct fake_numbers x;
    struct cloth_search_result *r = malloc(sizeof *r);
    fake_numbers_init(&x, mid_cloth, 5, 1.0, 0.01, misfit);
    x.option.n_start = n_start;
    x.search.n_screen = n_screen;
    x.search.screen_expected = n_screen * x.search.screen_budget;
    x.problem.max_iteration = 6;
    fake_numbers_run(&x, r);
    fake_numbers_release(&x);
    return r;
}

/* The first of several searches is the one that would be made alone; the others begin at cloths of their own, and the
 * one that predicts left-out rows best is the result. */
static void test_best_prediction_is_kept(void **state)
{
    (void)state;
    enum { N_START = 3 };
    for (size_t n_screen = 0; n_screen < 3; n_screen++) {
        struct cloth_search_result *alone = search_from(1, n_screen, 0.05), *r = search_from(N_START, n_screen, 0.05);
        const struct fit_start *start = r->final.start;
        size_t kept = N_START, best = 0;
        uint64_t n_path = 0;
        assert_int_equal(alone->final.n_start, 0);
        assert_int_equal(r->final.n_start, N_START);
        assert_memory_equal(start[0].param, alone->final.param, sizeof start[0].param);
        assert_int_equal(start[0].n_path, alone->n_path);
        for (size_t k = 0; k < N_START; k++) {
            assert_true(start[k].cross_validation > 0.0);
            if (start[k].cross_validation < start[best].cross_validation) best = k;
            if (start[k].kept) kept = k;
            n_path += start[k].n_path;
            for (size_t j = 0; j < k; j++) assert_true(start[k].from[FAKE_N_PARAM] != start[j].from[FAKE_N_PARAM]);
        }
        assert_int_equal(kept, best);
        assert_memory_equal(start[kept].param, r->final.param, sizeof start[kept].param);
        assert_true(r->final.cross_validation.rel_rms == start[kept].cross_validation);
        assert_int_equal(r->n_path, n_path);
        assert_true(r->n_step > alone->n_step);
        free(alone);
        free(r);
    }
}

static void test_too_many(void **state)
{
    (void)state;
    struct fake_numbers x;
    struct cloth_search_result *r = malloc(sizeof *r);
    struct error err = {0};
    fake_numbers_init(&x, mid_cloth, 5, 0.0, 0.0, 0.0);
    x.option.n_start = FIT_MAX_START + 1;
    assert_int_equal(cloth_search_run(&x.search, r, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "17 starts"));
    fake_numbers_release(&x);
    free(r);
}

/* Watches which cloths the search asks for while it says that a final fit is made. */
struct watch {
    struct cloth_source inner;
    bool final;
    size_t n_final, n_search;
    double number[FAKE_N_NUMBER]; /* of the final fit */
};

static void watch_final(void *context, bool final) { ((struct watch *)context)->final = final; }

static status watch_estimate(void *context, const double *number, const struct estimator_call *call,
                             const struct progress *progress, struct estimate *out, double *wall_s, struct error *err)
{
    struct watch *w = context;
    if (w->n_final == 0 && w->final) memcpy(w->number, number, sizeof w->number);
    if (w->final) assert_memory_equal(number, w->number, sizeof w->number);
    w->n_final += w->final;
    w->n_search += !w->final;
    return w->inner.estimate(w->inner.context, number, call, progress, out, wall_s, err);
}

/* The final fit, and nothing else, is said to be one: it sees the chosen cloth alone. */
static void test_final_fit_is_announced(void **state)
{
    (void)state;
    struct fake_numbers x;
    struct cloth_search_result *r = malloc(sizeof *r);
    fake_numbers_init(&x, mid_cloth, 5, 1.0, 0.01, 0.0);
    struct watch w = {.inner = x.numbers.source};
    x.numbers.source = (struct cloth_source){&w, FAKE_N_NUMBER, watch_estimate, watch_final};
    x.problem.max_iteration = 6;
    fake_numbers_run(&x, r);
    assert_false(r->took_screened);
    assert_true(w.n_final > 0 && w.n_search > w.n_final && !w.final);
    assert_memory_equal(w.number, r->number, sizeof w.number);
    fake_numbers_release(&x);
    free(r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_best_prediction_is_kept),
        cmocka_unit_test(test_too_many),
        cmocka_unit_test(test_final_fit_is_announced),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
