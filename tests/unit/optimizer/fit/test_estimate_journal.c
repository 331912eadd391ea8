/* The journal of estimates: every method resumes from it with the same bits, wherever it was cut, and a journal of
 * another fit is not used. */
#include "optimizer/fit/descent/estimate_journal.h"
#include "tests/support/descent_fixture.h"
#include "tests/support/general_methods.h"
#include "tests/support/scratch_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

/* A fit with a journal that is stopped after n_call estimates, with or without a torn last record, has the same
 * result as an uninterrupted fit. */
static void resume_after(void **state, const struct descent_method *m, size_t n_call, bool tear,
                         const struct fit_result *want)
{
    struct descent_fixture x;
    struct fit_result r;
    struct error err = {0};
    struct estimate_journal *j = NULL;
    const char *path = scratch_path(state, "estimates.journal");
    unlink(path);
    descent_fixture_init(&x, 4, 1500000);
    x.problem.max_iteration = 6;
    x.cloth.fail_after = n_call;
    x.cloth.share_paths = true; /* estimates then have partners */
    assert_int_equal(estimate_journal_open(path, 7, &x.estimator, NULL, NULL, &j, NULL), STATUS_OK);
    struct estimator through = estimate_journal_estimator(j);
    x.problem.estimator = &through;
    assert_int_equal(m->run(&x.problem, &r, &err), STATUS_CANCELLED);
    estimate_journal_close(j);
    if (tear) {
        size_t n;
        char *bytes = scratch_read(path, &n);
        scratch_write(path, bytes, n - 5);
        free(bytes);
    }
    x.cloth.fail_after = 0;
    x.cloth.n_call = 0;
    assert_int_equal(estimate_journal_open(path, 7, &x.estimator, NULL, NULL, &j, NULL), STATUS_OK);
    through = estimate_journal_estimator(j);
    descent_fixture_run(&x, m, &r);
    assert_int_equal(estimate_journal_n_replayed(j), tear ? n_call - 1 : n_call);
    assert_memory_equal(r.param, want->param, sizeof r.param);
    assert_memory_equal(&r.uncertainty, &want->uncertainty, sizeof r.uncertainty);
    assert_true(r.n_path == want->n_path && r.n_step == want->n_step && r.wall_s == want->wall_s);
    estimate_journal_close(j);
    observation_set_release(&x.observation);
}

static void test_resume(void **state)
{
    for (const struct descent_method *const *m = general_methods(); *m != NULL; m++) {
        struct descent_fixture x;
        struct fit_result want;
        descent_fixture_init(&x, 4, 1500000);
        x.problem.max_iteration = 6;
        x.cloth.share_paths = true;
        descent_fixture_run(&x, *m, &want);
        observation_set_release(&x.observation);
        for (size_t n_call = 1; n_call <= 10; n_call += 3) {
            resume_after(state, *m, n_call, false, &want);
            resume_after(state, *m, n_call, true, &want);
        }
    }
}

/* A journal with another fingerprint, or an estimate of another request, must not be used. */
static void test_foreign_journal(void **state)
{
    struct descent_fixture x;
    struct estimate_journal *j = NULL;
    struct estimate out[FAKE_N_FIT];
    size_t n_path[FAKE_N_FIT];
    double wall_s, param[FAKE_N_PARAM];
    const char *path = scratch_path(state, "foreign.journal");
    descent_fixture_init(&x, 5, 0);
    for (size_t i = 0; i < FAKE_N_FIT; i++) n_path[i] = 256;
    memcpy(param, x.truth, sizeof param);
    struct estimator_call call = {param, n_path, 3, 0, true};
    for (int k = 0; k < 5; k++) {
        if (k == 3) param[0] *= 1.1;
        assert_int_equal(estimate_journal_open(path, k < 2 ? 1 : 2, &x.estimator, NULL, NULL, &j, NULL), STATUS_OK);
        struct estimator e = estimate_journal_estimator(j);
        assert_int_equal(e.run(e.context, &call, NULL, out, &wall_s, NULL), STATUS_OK);
        assert_int_equal(estimate_journal_n_replayed(j), k == 1 || k == 4 ? 1 : 0);
        estimate_journal_close(j);
    }
    observation_set_release(&x.observation);
}

static status refuse(void *context, struct error *err)
{
    (void)context;
    return error_set(err, STATUS_STALE, "not any more");
}

static void test_stale_writer(void **state)
{
    struct descent_fixture x;
    struct estimate_journal *j = NULL;
    struct fit_result r;
    descent_fixture_init(&x, 5, 100000);
    assert_int_equal(
        estimate_journal_open(scratch_path(state, "stale.journal"), 1, &x.estimator, refuse, NULL, &j, NULL),
        STATUS_OK);
    struct estimator e = estimate_journal_estimator(j);
    x.problem.estimator = &e;
    assert_int_equal(descent_registry()[0]->run(&x.problem, &r, NULL), STATUS_STALE);
    estimate_journal_close(j);
    observation_set_release(&x.observation);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_resume),
        cmocka_unit_test(test_foreign_journal),
        cmocka_unit_test(test_stale_writer),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
