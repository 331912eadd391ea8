/* Which jobs retention removes: by age, by size, in which order, and which never. */
#include "base/clock.h"
#include "server/retention/job_keep.h"
#include "server/retention/retention.h"
#include "server/settings/job_paths.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/store/service_fixture.h"

#include <jansson.h>
#include <setjmp.h>
#include <sqlite3.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { DAY_S = 86400 };

static const struct retention_limits everything = {.max_bytes = 1};

/* Whether the plan has exactly these jobs, in this order. */
static void expect_plan(struct service_fixture *f, const struct retention_limits *limits, size_t n,
                        char (*id)[STORE_ID_BYTES], enum retention_reason reason)
{
    struct retention_plan p;
    assert_int_equal(retention_plan_make(f->service, limits, &p, NULL), STATUS_OK);
    assert_int_equal(p.n, n);
    int64_t removed = 0;
    for (size_t i = 0; i < n; i++) {
        assert_string_equal(p.job[i].id, id[i]);
        assert_int_equal(p.job[i].reason, reason);
        assert_true(p.job[i].bytes > 0);
        removed += p.job[i].bytes;
    }
    assert_true(p.removed_bytes == removed && p.total_bytes >= removed);
    retention_plan_release(&p);
}

static void test_by_age(void **state)
{
    struct service_fixture *f = *state;
    char id[3][STORE_ID_BYTES], other[STORE_ID_BYTES];
    const double now = clock_wall_s();
    service_fixture_job(f, NULL, JOB_FAILED, now - 10 * DAY_S, id[1]);
    service_fixture_job(f, NULL, JOB_SUCCEEDED, now - 12 * DAY_S, id[0]);
    service_fixture_job(f, NULL, JOB_CANCELLED, now - 5 * DAY_S - 60, id[2]);
    service_fixture_job(f, NULL, JOB_SUCCEEDED, now - 5 * DAY_S + 60, other);
    for (int s = JOB_DRAFT; s <= JOB_PAUSED; s++) service_fixture_job(f, NULL, (enum job_state)s, 0, other);
    expect_plan(f, &(struct retention_limits){.max_age_days = 5}, 3, id, RETENTION_AGE);
    expect_plan(f, &(struct retention_limits){.max_age_days = 11}, 1, id, RETENTION_AGE);
    expect_plan(f, &(struct retention_limits){.max_age_days = 0}, 0, id, RETENTION_AGE);
}

/* While the folders hold more than the limit, the job that ended first goes, and no more than needed. */
static void test_by_size(void **state)
{
    struct service_fixture *f = *state;
    char id[3][STORE_ID_BYTES];
    struct retention_plan p;
    const double now = clock_wall_s();
    for (int i = 0; i < 3; i++) service_fixture_job(f, NULL, JOB_SUCCEEDED, now - 100 + i, id[i]);
    assert_int_equal(retention_plan_make(f->service, &everything, &p, NULL), STATUS_OK);
    const int64_t total = p.total_bytes, first = p.job[0].bytes;
    retention_plan_release(&p);
    expect_plan(f, &everything, 3, id, RETENTION_SIZE);
    expect_plan(f, &(struct retention_limits){.max_bytes = total}, 0, id, RETENTION_SIZE);
    expect_plan(f, &(struct retention_limits){.max_bytes = total - 1}, 1, id, RETENTION_SIZE);
    expect_plan(f, &(struct retention_limits){.max_bytes = total - first}, 1, id, RETENTION_SIZE);
    expect_plan(f, &(struct retention_limits){.max_bytes = total - first - 1}, 2, id, RETENTION_SIZE);
}

/* Jobs that ended at the same time go by their id, so that the plan that a user sees is the one that is done. */
static void test_equal_ends(void **state)
{
    struct service_fixture *f = *state;
    char id[2][STORE_ID_BYTES], swap[STORE_ID_BYTES];
    for (int i = 0; i < 2; i++) service_fixture_job(f, NULL, JOB_SUCCEEDED, 1000, id[i]);
    if (strcmp(id[0], id[1]) > 0) {
        memcpy(swap, id[0], sizeof swap);
        memcpy(id[0], id[1], sizeof swap);
        memcpy(id[1], swap, sizeof swap);
    }
    expect_plan(f, &everything, 2, id, RETENTION_SIZE);
}

/* A job that has not ended, whatever it waits for, keeps the job whose geometry or whose profile it asks for. */
static void test_sources_of_open_jobs(void **state)
{
    static const char *const document[] = {
        "{\"sample\":\"x\",\"geometry\":{\"job\":\"%s\"},\"measurements\":{\"file\":\"rows.csv\"}}",
        "{\"sample\":\"x\",\"volume\":{\"files\":[\"a.tif\"],\"voxel_size_um\":2.0},\"measurements\":{\"file\":"
        "\"rows.csv\"},\"fit\":{\"model\":\"two_lobe.v1\",\"profile_job\":\"%s\"}}"};
    struct service_fixture *f = *state;
    for (size_t k = 0; k < 2; k++)
        for (int s = JOB_DRAFT; s < JOB_N_STATE; s++) {
            char source[1][STORE_ID_BYTES], asks[STORE_ID_BYTES], text[400];
            struct retention_job removed;
            struct error err = {0};
            bool open = s < JOB_SUCCEEDED;
            service_fixture_job(f, NULL, JOB_SUCCEEDED, 1000, source[0]);
            snprintf(text, sizeof text, document[k], source[0]);
            service_fixture_job(f, text, (enum job_state)s, open ? 0 : 2000, asks);
            const struct retention_limits old = {.max_age_days = 1};
            struct retention_plan p;
            assert_int_equal(retention_plan_make(f->service, &old, &p, NULL), STATUS_OK);
            assert_int_equal(p.n, open ? 0 : 2);
            retention_plan_release(&p);
            status got = retention_remove(f->service, source[0], RETENTION_AGE, &removed, &err);
            if (got != (open ? STATUS_CONFLICT : STATUS_OK))
                fail_msg("asked for by a %s job", job_state_name((enum job_state)s));
            if (open) assert_non_null(strstr(err.text, "asks for the geometry"));
            assert_int_equal(job_delete(f->service, asks, NULL), STATUS_OK);
            if (open)
                assert_int_equal(retention_remove(f->service, source[0], RETENTION_AGE, &removed, &err), STATUS_OK);
        }
}

/* Jobs that nobody asks for go beside some that are asked for. */
static void test_other_jobs_than_sources(void **state)
{
    struct service_fixture *f = *state;
    char source[2][STORE_ID_BYTES], other[1][STORE_ID_BYTES], asks[STORE_ID_BYTES], text[400];
    struct retention_job removed;
    service_fixture_job(f, NULL, JOB_SUCCEEDED, 1000, other[0]);
    for (int i = 0; i < 2; i++) {
        service_fixture_job(f, NULL, JOB_SUCCEEDED, 2000 + i, source[i]);
        snprintf(text, sizeof text,
                 "{\"sample\":\"x\",\"geometry\":{\"job\":\"%s\"},\"measurements\":{\"file\":\"rows.csv\"}}",
                 source[i]);
        service_fixture_job(f, text, JOB_DRAFT, 0, asks);
    }
    expect_plan(f, &(struct retention_limits){.max_age_days = 1}, 1, other, RETENTION_AGE);
    for (int i = 0; i < 2; i++)
        assert_int_equal(retention_remove(f->service, source[i], RETENTION_AGE, &removed, NULL), STATUS_CONFLICT);
    assert_int_equal(retention_remove(f->service, other[0], RETENTION_AGE, &removed, NULL), STATUS_OK);
}

static void test_jobs_that_are_kept(void **state)
{
    struct service_fixture *f = *state;
    char id[2][STORE_ID_BYTES], none[STORE_ID_BYTES];
    struct retention_plan p;
    struct retention_job removed;
    struct error err = {0};
    for (int i = 0; i < 2; i++) service_fixture_job(f, NULL, JOB_SUCCEEDED, 1000 + i, id[i]);
    const int64_t before = service_fixture_row(f, id[1]).revision;
    assert_false(job_is_kept(f->service, id[1]));
    assert_int_equal(job_keep(f->service, id[1], true, NULL), STATUS_OK);
    assert_true(job_is_kept(f->service, id[1]) && service_fixture_logged(f, "is kept from now on"));
    const int64_t kept = service_fixture_row(f, id[1]).revision;
    assert_true(kept > before); /* who watches the job sees it */
    assert_int_equal(job_keep(f->service, id[1], true, NULL), STATUS_OK);
    assert_int_equal(service_fixture_row(f, id[1]).revision, kept); /* the same again is no change */
    assert_int_equal(retention_plan_make(f->service, &everything, &p, NULL), STATUS_OK);
    assert_true(p.n == 1 && p.n_kept == 1 && strcmp(p.job[0].id, id[0]) == 0);
    retention_plan_release(&p);
    assert_int_equal(retention_remove(f->service, id[1], RETENTION_SIZE, &removed, &err), STATUS_CONFLICT);
    assert_non_null(strstr(err.text, "is kept"));
    assert_int_equal(job_keep(f->service, id[1], false, NULL), STATUS_OK);
    assert_true(!job_is_kept(f->service, id[1]) && service_fixture_logged(f, "is no longer kept"));
    assert_true(service_fixture_row(f, id[1]).revision > kept);
    expect_plan(f, &everything, 2, id, RETENTION_SIZE);
    memcpy(none, id[0], sizeof none);
    none[0] = none[0] == 'a' ? 'b' : 'a';
    assert_int_equal(job_keep(f->service, none, true, NULL), STATUS_NOT_FOUND);
}

/* A worker may put a folder in the place of the mark: it keeps the job until it is taken away as any mark is. */
static void test_a_mark_that_is_a_folder(void **state)
{
    struct service_fixture *f = *state;
    char id[STORE_ID_BYTES], path[PATH_BYTES];
    service_fixture_job(f, NULL, JOB_SUCCEEDED, 1000, id);
    path_join(path, f->settings.data, "jobs", id, "kept", "x", NULL);
    char command[PATH_BYTES + 20];
    snprintf(command, sizeof command, "mkdir -p '%s'", path);
    assert_int_equal(system(command), 0);
    assert_true(job_is_kept(f->service, id));
    for (int keep = 0; keep < 2; keep++) {
        assert_int_equal(job_keep(f->service, id, keep == 1, NULL), STATUS_OK);
        assert_int_equal(job_is_kept(f->service, id), keep == 1);
    }
}

/* What was removed is gone, logged and recorded; what may not go says why. */
static void test_removals_are_recorded(void **state)
{
    struct service_fixture *f = *state;
    char id[3][STORE_ID_BYTES], draft[STORE_ID_BYTES];
    struct retention_job removed;
    struct error err = {0};
    json_t *list = NULL;
    assert_int_equal(retention_removals(f->service, 5, &list, NULL), STATUS_OK);
    assert_int_equal(json_array_size(list), 0);
    json_decref(list);
    static const enum retention_reason reason[] = {RETENTION_AGE, RETENTION_SIZE, RETENTION_REQUEST};
    static const char *const name[] = {"age", "size", "request"};
    for (int i = 0; i < 3; i++) {
        service_fixture_job(f, NULL, JOB_SUCCEEDED, 1000 + i, id[i]);
        assert_int_equal(retention_remove(f->service, id[i], reason[i], &removed, NULL), STATUS_OK);
        assert_true(strcmp(removed.id, id[i]) == 0 && removed.reason == reason[i] && removed.bytes > 0);
        assert_true(strcmp(removed.sample, "small") == 0 && removed.finished_unix_s == 1000 + i);
        assert_true(service_fixture_row(f, id[i]).deleted && service_fixture_logged(f, id[i]));
    }
    assert_int_equal(retention_removals(f->service, 2, &list, NULL), STATUS_OK);
    assert_int_equal(json_array_size(list), 2);
    for (size_t i = 0; i < 2; i++) {
        json_t *one = json_array_get(list, i);
        assert_string_equal(json_string_value(json_object_get(one, "id")), id[2 - i]);
        assert_string_equal(json_string_value(json_object_get(one, "reason")), name[2 - i]);
        assert_string_equal(json_string_value(json_object_get(one, "state")), "succeeded");
        assert_true(json_number_value(json_object_get(one, "removed_unix_s")) > clock_wall_s() - 60);
    }
    json_decref(list);
    assert_int_equal(retention_removals(f->service, 5, &list, NULL), STATUS_OK);
    assert_int_equal(json_array_size(list), 3);
    json_decref(list);
    service_fixture_job(f, NULL, JOB_DRAFT, 0, draft);
    assert_int_equal(retention_remove(f->service, draft, RETENTION_AGE, &removed, &err), STATUS_CONFLICT);
    assert_non_null(strstr(err.text, "is draft; only jobs that have ended"));
    assert_int_equal(retention_remove(f->service, id[0], RETENTION_AGE, &removed, &err), STATUS_NOT_FOUND);
}

/* Whose geometry is needed cannot be known without the jobs, so nothing is planned or removed then. */
static void test_a_database_that_fails(void **state)
{
    struct service_fixture *f = *state;
    char id[STORE_ID_BYTES];
    struct retention_plan p = {0};
    struct retention_job removed = {0};
    sqlite3 *db = NULL;
    service_fixture_job(f, NULL, JOB_SUCCEEDED, 1000, id);
    assert_int_equal(sqlite3_open(scratch_path(&f->folder, "selvedge.db"), &db), SQLITE_OK);
    assert_int_equal(sqlite3_exec(db, "ALTER TABLE job RENAME COLUMN sample TO other", NULL, NULL, NULL), SQLITE_OK);
    sqlite3_close(db);
    assert_true(retention_plan_make(f->service, &(struct retention_limits){.max_age_days = 1}, &p, NULL) != STATUS_OK);
    assert_true(retention_remove(f->service, id, RETENTION_AGE, &removed, NULL) != STATUS_OK);
}

int main(void)
{
#define WITH_SERVICE(test) cmocka_unit_test_setup_teardown(test, service_fixture_setup, service_fixture_teardown)
    const struct CMUnitTest tests[] = {
        WITH_SERVICE(test_by_age),
        WITH_SERVICE(test_by_size),
        WITH_SERVICE(test_equal_ends),
        WITH_SERVICE(test_sources_of_open_jobs),
        WITH_SERVICE(test_other_jobs_than_sources),
        WITH_SERVICE(test_jobs_that_are_kept),
        WITH_SERVICE(test_a_mark_that_is_a_folder),
        WITH_SERVICE(test_removals_are_recorded),
        WITH_SERVICE(test_a_database_that_fails),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
