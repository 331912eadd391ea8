/* The worker's status: many warnings, and texts that are not valid in JSON. */
#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/stages/run/worker_status.h"
#include "tests/support/scratch_folder.h"

#include <jansson.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct fixture {
    const char *folder;
    struct worker_folder hold;
    struct log *log;
    struct worker_status *status;
};

static void start(struct fixture *d, void **state)
{
    struct error err = {0};
    char path[512];
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGINT);
    sigprocmask(SIG_BLOCK, &set, NULL);
    d->folder = *state;
    assert_int_equal(worker_folder_open(&d->hold, d->folder, &err), STATUS_OK);
    snprintf(path, sizeof path, "%s/log.txt", d->folder);
    assert_int_equal(log_open(path, NULL, LOG_LEVEL_INFO, &d->log, &err), STATUS_OK);
    assert_int_equal(worker_status_start(&d->hold, d->log, JOB_FILE_STATUS, &d->status, &err), STATUS_OK);
}

/* Ends the status and returns status.json. */
static json_t *finish_as(struct fixture *d, const char *end, const struct error *error)
{
    struct error err = {0};
    char path[512];
    assert_int_equal(worker_status_finish(d->status, end, error, &err), STATUS_OK);
    snprintf(path, sizeof path, "%s/%s", d->folder, JOB_FILE_STATUS);
    json_t *json = json_load_file(path, 0, NULL);
    assert_non_null(json);
    worker_status_free(d->status);
    log_close(d->log);
    worker_folder_close(&d->hold);
    return json;
}

static json_t *finish(struct fixture *d, const struct error *error) { return finish_as(d, "failed", error); }

static void test_warnings_beyond_the_list_are_counted(void **state)
{
    struct fixture d = {0};
    char text[64];
    start(&d, state);
    for (int i = 0; i < 60; i++) {
        snprintf(text, sizeof text, "warning %d", i);
        worker_status_warn(d.status, "%s", text);
        worker_status_warn(d.status, "warning 0"); /* an equal warning is not counted again */
    }
    assert_int_equal(worker_status_n_warning(d.status), 50);
    assert_true(worker_status_warning(d.status, 48, text, sizeof text));
    assert_string_equal(text, "warning 48");
    assert_true(worker_status_warning(d.status, 49, text, sizeof text));
    assert_string_equal(text, "11 more warnings are in the job's log");
    assert_false(worker_status_warning(d.status, 50, text, sizeof text));
    json_decref(finish(&d, NULL));
}

static void test_texts_that_are_no_utf8(void **state)
{
    struct fixture d = {0};
    char longer[600];
    start(&d, state);
    memset(longer, 'x', sizeof longer);
    for (size_t i = 1; i + 2 < sizeof longer; i += 2) memcpy(longer + i, "\xc3\xa4", 2);
    longer[599] = '\0';
    struct error error = {.code = STATUS_FORMAT};
    snprintf(error.text, sizeof error.text, "x%s", longer);
    worker_status_warn(d.status, "%s",
                       error.text); /* the length limits of warnings and messages divide a character of two bytes */
    worker_status_warn(d.status, "gr\xf6\xdf"
                                 "e");
    json_t *json = finish(&d, &error);
    assert_string_equal(json_string_value(json_object_get(json, "state")), "failed");
    assert_int_equal(strlen(json_string_value(json_array_get(json_object_get(json, "warnings"), 0))), 511);
    assert_string_equal(json_string_value(json_array_get(json_object_get(json, "warnings"), 1)), "gr??e");
    assert_int_equal(strlen(json_string_value(json_object_get(json, "message"))), 299);
    json_decref(json);
}

/* While the job is read, before anything is planned, and while stages are planned one by one, nothing is stated as the
 * remaining time. */
static void test_a_part_of_the_plan_is_no_forecast(void **state)
{
    enum { READING, PLANNING, BEGUN, N_CASE };
    static const struct speed_book none = {.n = 0};
    for (int at = READING; at < N_CASE; at++) {
        struct fixture d = {0};
        start(&d, state);
        worker_status_stage(d.status, "volume", "Reading the job", 0, 8);
        if (at >= PLANNING) {
            worker_status_speeds(d.status, &none);
            worker_status_plan_own(d.status, 0, "volume", 1000.0);
        }
        if (at == BEGUN) worker_status_stage(d.status, "volume", "Reading the scan", 0, 8);
        json_t *json = finish_as(&d, "running", NULL), *eta = json_object_get(json, "eta_s");
        if (at == BEGUN)
            assert_true(json_number_value(eta) > 900.0);
        else
            assert_true(json_is_null(eta) && json_number_value(json_object_get(json, "fraction")) == 0.0);
        json_decref(json);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_warnings_beyond_the_list_are_counted, scratch_folder_setup,
                                        scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_a_part_of_the_plan_is_no_forecast, scratch_folder_setup,
                                        scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_texts_that_are_no_utf8, scratch_folder_setup, scratch_folder_teardown)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
