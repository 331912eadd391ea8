/* One attempt at a job: what its beginning writes, and what its end makes of the job. */
#include "optimizer/job/job_folder.h"
#include "server/settings/job_paths.h"
#include "server/workers/attempt.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/store/service_fixture.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static const struct worker_end success = {.code = WORKER_SUCCEEDED, .peak_rss_bytes = 1000};

/* The end of the attempt with the token counts; that of an attempt whose job another daemon has taken over does not. */
static void test_the_token_decides(void **state)
{
    struct service_fixture *f = *state;
    struct attempt_outcome outcome = {0};
    char id[STORE_ID_BYTES], token[STORE_ID_BYTES];
    service_fixture_job(f, NULL, JOB_QUEUED, 0, id);
    assert_int_equal(attempt_prepare(f->service, id, token, NULL), STATUS_OK);
    struct job_row row = service_fixture_row(f, id);
    assert_true(row.state == JOB_RUNNING && row.attempt == 1 && strcmp(row.token, token) == 0);
    snprintf(row.token, sizeof row.token, "of-another-attempt");
    service_fixture_update(f, &row);
    row = service_fixture_row(f, id);
    assert_int_equal(attempt_finish(f->service, id, token, &success, STOP_NONE, &outcome, NULL), STATUS_OK);
    struct job_row after = service_fixture_row(f, id);
    assert_true(after.state == JOB_RUNNING && after.revision == row.revision && after.peak_rss_bytes == 0);
    assert_true(service_fixture_logged(f, "counts for nothing, because the job was taken over"));
    assert_int_equal(attempt_finish(f->service, id, "of-another-attempt", &success, STOP_NONE, &outcome, NULL),
                     STATUS_OK);
    after = service_fixture_row(f, id);
    assert_true(after.state == JOB_SUCCEEDED && after.peak_rss_bytes == 1000 && after.finished_unix_s > 0);
    /* the same end again changes nothing: the job does not run any more */
    assert_int_equal(attempt_finish(f->service, id, "of-another-attempt", &success, STOP_NONE, &outcome, NULL),
                     STATUS_OK);
    assert_int_equal(service_fixture_row(f, id).revision, after.revision);
}

/* What the end of a worker makes of the state of a job. */
static void test_ends(void **state)
{
    static const struct {
        struct worker_end end;
        enum attempt_stop stop;
        bool cancel;
        enum job_state want;
        const char *code;
    } check[] = {
        {{.code = WORKER_SUCCEEDED}, STOP_NONE, false, JOB_SUCCEEDED, ""},
        {{.code = WORKER_SUCCEEDED}, STOP_CANCEL, true, JOB_SUCCEEDED, ""},
        {{.code = WORKER_FAILED}, STOP_NONE, false, JOB_FAILED, "internal"},
        {{.code = WORKER_STALE}, STOP_NONE, false, JOB_QUEUED, ""},
        {{.code = WORKER_STALE}, STOP_NONE, true, JOB_CANCELLED, ""},
        {{.by_signal = true, .code = SIGTERM}, STOP_CANCEL, true, JOB_CANCELLED, ""},
        {{.by_signal = true, .code = SIGTERM}, STOP_SHUTDOWN, false, JOB_QUEUED, ""},
        {{.by_signal = true, .code = SIGTERM}, STOP_SHUTDOWN, true, JOB_CANCELLED, ""},
        {{.by_signal = true, .code = SIGTERM}, STOP_PAUSE, false, JOB_PAUSED, ""},
        {{.by_signal = true, .code = SIGTERM}, STOP_PAUSE, true, JOB_CANCELLED, ""},
        {{.by_signal = true, .code = SIGKILL}, STOP_TIME, false, JOB_FAILED, "time_limit"},
        {{.by_signal = true, .code = SIGKILL}, STOP_TIME, true, JOB_CANCELLED, ""},
        {{.by_signal = true, .code = SIGKILL}, STOP_MEMORY, false, JOB_FAILED, "memory_limit"},
        {{.by_signal = true, .code = SIGKILL}, STOP_MEMORY, true, JOB_CANCELLED, ""},
        {{.by_signal = true, .code = SIGKILL}, STOP_SILENT, false, JOB_QUEUED, ""},
        {{.by_signal = true, .code = SIGSEGV}, STOP_NONE, false, JOB_QUEUED, ""},
        {{.by_signal = true, .code = SIGSYS}, STOP_NONE, false, JOB_FAILED, "forbidden_call"},
        {{.cause = WORKER_REFUSED, .why = "no"}, STOP_NONE, false, JOB_FAILED, "backend_refused"},
        {{.cause = WORKER_CANCELLED_OUTSIDE}, STOP_NONE, false, JOB_CANCELLED, ""},
        {{.cause = WORKER_INTERRUPTED}, STOP_NONE, false, JOB_QUEUED, ""},
        {{.cause = WORKER_NOT_STARTED}, STOP_NONE, false, JOB_QUEUED, ""},
    };
    struct service_fixture *f = *state;
    for (size_t i = 0; i < sizeof check / sizeof *check; i++) {
        struct attempt_outcome outcome = {0};
        char id[STORE_ID_BYTES];
        service_fixture_job(f, NULL, JOB_RUNNING, 0, id);
        struct job_row row = service_fixture_row(f, id);
        row.cancel_requested = check[i].cancel;
        service_fixture_update(f, &row);
        assert_int_equal(attempt_finish(f->service, id, row.token, &check[i].end, check[i].stop, &outcome, NULL),
                         STATUS_OK);
        row = service_fixture_row(f, id);
        if (row.state != check[i].want || strcmp(row.error_code, check[i].code) != 0)
            fail_msg("end %zu: %s '%s'", i, job_state_name(row.state), row.error_code);
        bool over = row.state != JOB_QUEUED && row.state != JOB_PAUSED;
        assert_int_equal(row.finished_unix_s > 0, over);
        if (over) assert_false(row.cancel_requested);
        assert_int_equal(outcome.busy, row.state == JOB_QUEUED && check[i].end.code == WORKER_STALE);
    }
}

/* Attempts that are lost count, and wait longer each time, until there are too many. */
static void test_lost_attempts(void **state)
{
    struct service_fixture *f = *state;
    const struct worker_end crash = {.by_signal = true, .code = SIGSEGV, .peak_rss_bytes = 2500000};
    char id[STORE_ID_BYTES], token[STORE_ID_BYTES];
    f->settings.max_lost_attempts = 3;
    service_fixture_job(f, NULL, JOB_QUEUED, 0, id);
    for (int i = 1; i <= 3; i++) {
        struct attempt_outcome outcome = {0};
        assert_int_equal(attempt_prepare(f->service, id, token, NULL), STATUS_OK);
        service_fixture_write(f, id, "console.txt", "the last line\n");
        assert_int_equal(attempt_finish(f->service, id, token, &crash, STOP_NONE, &outcome, NULL), STATUS_OK);
        struct job_row row = service_fixture_row(f, id);
        assert_int_equal(row.lost_attempts, i);
        assert_int_equal(row.attempt, i);
        assert_int_equal(row.state, i < 3 ? JOB_QUEUED : JOB_FAILED);
        assert_true(outcome.delay_s == (i < 3 ? 0.5 * i : 0.0));
    }
    struct job_row row = service_fixture_row(f, id);
    assert_string_equal(row.error_code, "worker_lost");
    assert_non_null(strstr(row.error_text, "3 attempts were lost"));
    assert_non_null(strstr(row.error_text, "crashed with signal 11"));
    assert_non_null(strstr(row.error_text, "2.5 MB; its last output: the last line"));
}

/* The worker's own error is the job's, if it is of this attempt; the heartbeat likewise. */
static void test_status_of_this_attempt(void **state)
{
    static const char format[] = "{\"attempt\":%d,\"heartbeat_unix_s\":77.5,\"verdict\":"
                                 "{\"code\":\"good\",\"words\":\"good\",\"text\":\"Good.\"},"
                                 "\"error\":{\"code\":\"format\",\"field\":\"volume.files\",\"text\":\"page 2\"}}";
    struct service_fixture *f = *state;
    const struct worker_end failure = {.code = WORKER_FAILED};
    char id[STORE_ID_BYTES], text[300];
    for (int attempt = 1; attempt <= 2; attempt++) {
        struct attempt_outcome outcome = {0};
        struct attempt_request request;
        service_fixture_job(f, NULL, JOB_RUNNING, 0, id);
        snprintf(text, sizeof text, format, attempt);
        service_fixture_write(f, id, JOB_FILE_STATUS, text);
        assert_true(attempt_read_request(f->service, id, true, &request));
        assert_true(request.heartbeat_unix_s == (attempt == 1 ? 77.5 : 0.0) && !request.cancel && !request.deleted);
        assert_true(attempt_read_request(f->service, id, false, &request) && request.heartbeat_unix_s == 0);
        assert_int_equal(attempt_finish(f->service, id, "a-token", &failure, STOP_NONE, &outcome, NULL), STATUS_OK);
        struct job_row row = service_fixture_row(f, id);
        assert_string_equal(row.error_code, attempt == 1 ? "format" : "internal");
        assert_string_equal(row.error_field, attempt == 1 ? "volume.files" : "");
        if (attempt == 1) assert_string_equal(row.error_text, "page 2");
    }
    service_fixture_job(f, NULL, JOB_RUNNING, 0, id);
    snprintf(text, sizeof text, format, 1);
    service_fixture_write(f, id, JOB_FILE_STATUS, text);
    struct attempt_outcome outcome = {0};
    assert_int_equal(attempt_finish(f->service, id, "a-token", &success, STOP_NONE, &outcome, NULL), STATUS_OK);
    assert_string_equal(service_fixture_row(f, id).verdict, "good");
}

/* An attempt writes its number and token beside the document; after an edit it removes what an earlier one has made. */
static void test_the_folder_of_an_attempt(void **state)
{
    struct service_fixture *f = *state;
    char id[STORE_ID_BYTES], token[STORE_ID_BYTES], path[PATH_BYTES], want[200];
    size_t n;
    service_fixture_job(f, NULL, JOB_QUEUED, 0, id);
    assert_int_equal(attempt_prepare(f->service, id, token, NULL), STATUS_OK);
    path_join(path, f->settings.data, "jobs", id, JOB_FILE_ATTEMPT, NULL);
    char *text = scratch_read(path, &n);
    snprintf(want, sizeof want, "{\"attempt\":1,\"token\":\"%s\"}\n", token);
    assert_true(n == strlen(want) && memcmp(text, want, n) == 0 && strlen(token) == 32);
    free(text);
    struct job_row row = service_fixture_row(f, id);
    assert_true(row.generation == 1 && row.started_unix_s > 0);
    assert_int_equal(attempt_prepare(f->service, id, token, NULL), STATUS_CONFLICT); /* it runs already */
    service_fixture_write(f, id, JOB_FILE_SERIES, "x");
    const double started_unix_s = row.started_unix_s;
    for (int dirty = 0; dirty < 2; dirty++) {
        row = service_fixture_row(f, id);
        row.state = JOB_QUEUED;
        row.dirty = dirty == 1;
        service_fixture_update(f, &row);
        assert_int_equal(attempt_prepare(f->service, id, token, NULL), STATUS_OK);
        row = service_fixture_row(f, id);
        assert_true(row.generation == 1 + dirty && row.attempt == 2 + dirty && !row.dirty);
        assert_true(row.started_unix_s == started_unix_s);
        path_join(path, f->settings.data, "jobs", id, JOB_FILE_SERIES, NULL);
        assert_int_equal(access(path, F_OK), dirty ? -1 : 0);
    }
}

static void test_paused_jobs_are_queued(void **state)
{
    struct service_fixture *f = *state;
    char id[JOB_N_STATE][STORE_ID_BYTES];
    for (int s = 0; s < JOB_N_STATE; s++) service_fixture_job(f, NULL, (enum job_state)s, 0, id[s]);
    attempt_resume_paused(f->service);
    for (int s = 0; s < JOB_N_STATE; s++)
        assert_int_equal(service_fixture_row(f, id[s]).state, s == JOB_PAUSED ? JOB_QUEUED : s);
    assert_int_equal(attempt_fail(f->service, id[JOB_QUEUED], "it cannot start", NULL), STATUS_OK);
    struct job_row row = service_fixture_row(f, id[JOB_QUEUED]);
    assert_true(row.state == JOB_FAILED && strcmp(row.error_text, "it cannot start") == 0 && row.finished_unix_s > 0);
    assert_int_equal(attempt_fail(f->service, id[JOB_RUNNING], "it cannot start", NULL), STATUS_OK);
    assert_int_equal(service_fixture_row(f, id[JOB_RUNNING]).state, JOB_RUNNING);
}

int main(void)
{
#define WITH_SERVICE(test) cmocka_unit_test_setup_teardown(test, service_fixture_setup, service_fixture_teardown)
    const struct CMUnitTest tests[] = {
        WITH_SERVICE(test_the_token_decides),
        WITH_SERVICE(test_ends),
        WITH_SERVICE(test_lost_attempts),
        WITH_SERVICE(test_status_of_this_attempt),
        WITH_SERVICE(test_the_folder_of_an_attempt),
        WITH_SERVICE(test_paused_jobs_are_queued),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
