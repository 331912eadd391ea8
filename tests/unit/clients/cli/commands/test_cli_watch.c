/* Watching a job while its server is unreachable at times. Server, clock and pictures are replaced by functions of this
 * test. */
#include "base/clock.h"

static double now_s;
#define clock_monotonic_s() now_s
#include "clients/cli/commands/cli_watch.c" /* NOLINT */

#include <setjmp.h>
#include <stdint.h>

#include <cmocka.h>

enum { CUT_OFF = -1, RUNNING = 200, SUCCEEDED = 1, DRAFT, CANCELLED, FAILED, N_ANSWER };

static const char *const body_of[N_ANSWER] = {
    [SUCCEEDED] = "{\"state\":\"succeeded\"}",
    [DRAFT] = "{\"state\":\"draft\"}",
    [CANCELLED] = "{\"state\":\"cancelled\"}",
    [FAILED] = "{\"state\":\"failed\",\"error\":{\"text\":\"too dark\",\"field\":\"lamp\"}}"};

/* The answers of the server, one for each call; the last one repeats. */
static const int *script;
static size_t n_script, i_script;

status http_call(struct http *http, const char *method, const char *path, const char *const *header, const void *body,
                 size_t n_body, struct http_reply *reply, struct error *err)
{
    (void)http, (void)method, (void)path, (void)header, (void)body, (void)n_body;
    int now = script[i_script];
    if (i_script + 1 < n_script) i_script++;
    *reply = (struct http_reply){.code = now > 0 && now < N_ANSWER ? 200 : now};
    if (now == CUT_OFF) {
        reply->cut_off = true;
        return error_set(err, STATUS_IO, "cut off");
    }
    if (reply->code == 200) {
        reply->body = strdup(now == RUNNING ? "{\"state\":\"running\"}" : body_of[now]);
        reply->n_body = strlen(reply->body);
    }
    return STATUS_OK;
}

status http_problem(const struct http_reply *reply, struct error *err)
{
    return error_set(err, STATUS_IO, "HTTP status %ld", reply->code);
}
void http_reply_release(struct http_reply *reply) { free(reply->body); }
const char *http_server(const struct http *http) { return (void)http, "http://server"; }
bool http_stopped(const struct http *http) { return (void)http, false; }
void http_sleep(const struct http *http, double seconds) { (void)http, now_s += seconds; }
status cli_job_path(const char *id, const char *tail, char *path, size_t n_path, struct error *err)
{
    (void)err;
    snprintf(path, n_path, "/v1/jobs/%s%s", id, tail);
    return STATUS_OK;
}
status cli_add_result(struct cli *cli, json_t *job, struct error *err)
{
    (void)cli, (void)job, (void)err;
    return STATUS_OK;
}
void report_view(const json_t *job, struct job_view *view)
{
    *view = (struct job_view){0};
    snprintf(view->state, sizeof view->state, "%s", json_string_value(json_object_get(job, "state")));
}
void report_result(const json_t *job, FILE *out) { (void)job, (void)out; }
void text_progress_plain(const struct job_view *v, char *out, size_t n_out) { snprintf(out, n_out, "%s", v->state); }
void text_progress(const struct job_view *v, size_t n_column, char *out, size_t n_out)
{
    (void)n_column;
    text_progress_plain(v, out, n_out);
}
void text_clean(const char *in, char *out, size_t n_out) { snprintf(out, n_out, "%s", in); }

/* Watches a job with these answers. The caller frees *said, the text that was printed. */
static status watch(const int *answer, size_t n, char **said, struct error *err)
{
    size_t n_said = 0;
    int exit_code = 0;
    FILE *note = open_memstream(said, &n_said), *out = fopen("/dev/null", "w");
    assert_non_null(note);
    assert_non_null(out);
    struct cli_args args = {0};
    struct cli cli = {.args = &args, .out = out, .note = note};
    script = answer;
    n_script = n;
    i_script = 0;
    now_s = 1000;
    status s = cli_watch_job(&cli, "j", &exit_code, err);
    fclose(note);
    fclose(out);
    return s;
}

static int count(const char *text, const char *part)
{
    int n = 0;
    for (const char *p = text; (p = strstr(p, part)) != NULL; p++) n++;
    return n;
}

static void test_a_server_that_comes_back(void **state)
{
    (void)state;
    static const int answer[] = {RUNNING, 503, CUT_OFF, 502, 504, 429, 503, 304, RUNNING, 502, SUCCEEDED};
    struct error err = {0};
    char *said = NULL;
    assert_int_equal(watch(answer, sizeof answer / sizeof answer[0], &said, &err), STATUS_OK);
    assert_int_equal(count(said, "trying again"), 2); /* once each time */
    assert_int_equal(count(said, "HTTP status 503; trying again"), 1);
    free(said);
}

static void test_a_server_that_stays_away(void **state)
{
    (void)state;
    static const int away[] = {429, 502, 503, 504, CUT_OFF};
    for (size_t i = 0; i < sizeof away / sizeof away[0]; i++) {
        const int answer[] = {RUNNING, away[i]};
        struct error err = {0};
        char *said = NULL;
        assert_int_equal(watch(answer, 2, &said, &err), STATUS_IO);
        assert_true(now_s - 1000 >= GONE_S && now_s - 1000 < GONE_S + 5);
        assert_int_equal(count(said, "trying again"), 1);
        free(said);
    }
}

static void test_other_answers_end_it(void **state)
{
    (void)state;
    static const int code[] = {404, 500, 507};
    for (size_t i = 0; i < sizeof code / sizeof code[0]; i++) {
        const int answer[] = {RUNNING, code[i]};
        struct error err = {0};
        char *said = NULL;
        assert_int_equal(watch(answer, 2, &said, &err), STATUS_IO);
        assert_true(now_s - 1000 < 5);
        free(said);
    }
}

/* How a watch ends by the state of the job. */
static void test_states(void **state)
{
    (void)state;
    static const struct {
        int answer;
        status result;
        const char *error, *note;
    } is[] = {{SUCCEEDED, STATUS_OK, "", "results: selvedge results j"},
              {CANCELLED, STATUS_OK, "", "`selvedge retry j` continues"},
              {DRAFT, STATUS_CONFLICT, "job j has not been started; start it with: selvedge submit --resume j", ""},
              {FAILED, STATUS_CONFLICT, "job j failed: too dark", ""}};
    for (size_t i = 0; i < sizeof is / sizeof is[0]; i++) {
        const int answer[] = {RUNNING, is[i].answer};
        struct error err = {0};
        char *said = NULL;
        assert_int_equal(watch(answer, 2, &said, &err), is[i].result);
        assert_string_equal(err.text, is[i].error);
        assert_string_equal(err.field, is[i].answer == FAILED ? "lamp" : "");
        assert_non_null(strstr(said, is[i].note));
        assert_true(now_s - 1000 < 5);
        free(said);
    }
}

int main(void)
{
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_a_server_that_comes_back),
        cmocka_unit_test(test_a_server_that_stays_away),
        cmocka_unit_test(test_other_answers_end_it),
        cmocka_unit_test(test_states),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
