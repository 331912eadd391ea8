/* What a job asks of Slurm: its memory and cores, the options of sbatch, the script. */
#include "server/workers/backends/slurm_request.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define MIB (INT64_C(1) << 20)

static struct settings defaults(void)
{
    struct settings s;
    settings_init(&s);
    snprintf(s.data, sizeof s.data, "%s", "/shared/it's here");
    return s;
}

static bool has(const struct slurm_request *q, const char *argument)
{
    for (size_t i = 0; q->argument[i] != NULL; i++)
        if (strcmp(q->argument[i], argument) == 0) return true;
    return false;
}

static bool begins(const struct slurm_request *q, const char *text)
{
    for (size_t i = 0; q->argument[i] != NULL; i++)
        if (strncmp(q->argument[i], text, strlen(text)) == 0) return true;
    return false;
}

static void make(const struct settings *s, const char *sample, struct slurm_request *q)
{
    struct job_row row = {.id = "5e0c", .attempt = 3};
    snprintf(row.sample, sizeof row.sample, "%s", sample);
    const struct slurm_submission m = {
        .sbatch = "/usr/bin/sbatch", .program = "/opt/worker", .row = &row, .need = {4, 700 * MIB + 1}};
    assert_int_equal(slurm_request_make(s, &m, q, NULL), STATUS_OK);
}

static void test_the_request(void **state)
{
    (void)state;
    struct settings s = defaults();
    struct slurm_request *q = malloc(sizeof *q);
    assert_int_equal(settings_set(&s, "slurm.partition", "cloth", NULL), STATUS_OK);
    assert_int_equal(settings_set(&s, "slurm.time_limit_s", "90", NULL), STATUS_OK);
    assert_int_equal(settings_set(&s, "slurm.warn_s", "30", NULL), STATUS_OK);
    assert_int_equal(settings_set(&s, "slurm.extra_arguments", "--nice=10  --exclusive", NULL), STATUS_OK);
    assert_int_equal(slurm_request_check(&s, NULL), STATUS_OK);
    make(&s, "blue twill; rm -rf *", q);
    assert_string_equal(q->argument[0], "/usr/bin/sbatch");
    assert_true(has(q, "--job-name=selvedge-blue_twill__rm_-rf__"));
    assert_true(has(q, "--comment=selvedge:5e0c:3"));
    assert_true(has(q, "--no-requeue") && has(q, "--parsable") && has(q, "--partition=cloth"));
    assert_true(has(q, "--ntasks=1") && has(q, "--cpus-per-task=4") && has(q, "--mem=701M"));
    assert_true(has(q, "--time=1:30") && has(q, "--signal=B:TERM@30"));
    assert_true(has(q, "--output=/shared/it's here/jobs/5e0c/console.txt"));
    assert_true(has(q, "--nice=10") && has(q, "--exclusive"));
    assert_false(begins(q, "--account") || begins(q, "--qos"));
    assert_non_null(strstr(q->script, "exec '/opt/worker' "));
    assert_non_null(strstr(q->script, "'--threads' '4'"));
    assert_non_null(strstr(q->script, "--start \"slurm-$SLURM_JOB_ID.${SLURM_RESTART_COUNT:-0}\" "
                                      "'/shared/it'\\''s here/jobs/5e0c'\n"));
    free(q);
}

static void test_ranks(void **state)
{
    (void)state;
    struct settings s = defaults();
    struct slurm_request *q = malloc(sizeof *q);
    s.slurm_ranks = 7;
    assert_int_equal(settings_set(&s, "slurm.mpi", "pmix", NULL), STATUS_OK);
    make(&s, "twill", q);
    assert_true(has(q, "--ntasks=7") && has(q, "--mem-per-cpu=176M") && !begins(q, "--mem=") && !begins(q, "--nodes"));
    /* srun's steps get the signal, which the script's shell would not pass on */
    assert_true(has(q, "--signal=TERM@120") && !begins(q, "--time"));
    assert_non_null(strstr(q->script, "exec 'srun' --mpi=pmix --kill-on-bad-exit=0 '/opt/worker' "));
    assert_int_equal(settings_set(&s, "slurm.commands", "/opt/it's slurm", NULL), STATUS_OK);
    make(&s, "twill", q);
    assert_non_null(strstr(q->script, "exec '/opt/it'\\''s slurm/srun' --mpi=pmix "));
    free(q);
}

static void test_paths_that_do_not_fit(void **state)
{
    (void)state;
    struct settings s = defaults();
    struct job_row row = {.id = "5e0c", .sample = "twill"};
    struct slurm_request *q = malloc(sizeof *q);
    char *program = calloc(1, 8 * PATH_BYTES);
    struct error err = {0};
    memset(program, 'x', 8 * PATH_BYTES - 1);
    const struct slurm_submission m = {.sbatch = "sbatch", .program = program, .row = &row, .need = {1, MIB}};
    assert_int_equal(slurm_request_make(&s, &m, q, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "too long"));
    free(program);
    free(q);
}

static void refuses(const char *key, const char *value, const char *field)
{
    struct settings s = defaults();
    struct error err = {0};
    assert_int_equal(settings_set(&s, key, value, NULL), STATUS_OK);
    assert_int_equal(slurm_request_check(&s, &err), STATUS_INVALID);
    assert_string_equal(err.field, field);
}

static void test_settings_that_slurm_would_take_otherwise(void **state)
{
    (void)state;
    static const char *const extra[] = {
        "--wrap=sh", "-p cloth", "--array=1-9",    "--arr=1-9",        "--output=/etc/passwd", "--requeue",
        "script",    "--",       "--clusters=all", "--nice=1 --uid=0", "--nice --parsable"};
    for (size_t i = 0; i < sizeof extra / sizeof *extra; i++)
        refuses("slurm.extra_arguments", extra[i], "slurm.extra_arguments");
    refuses("slurm.partition", "a b", "slurm.partition");
    refuses("slurm.account", "--uid=0", "slurm.account");
    refuses("slurm.qos", "x;y", "slurm.qos");
    refuses("slurm.mpi", "$(id)", "slurm.mpi");
    refuses("server.data", "/shared/100%", "server.data");
    refuses("slurm.time_limit_s", "60", "slurm.warn_s");
}

static void test_the_need(void **state)
{
    (void)state;
    struct settings s = defaults();
    struct file_row file[3] = {{.role = "volume", .size_bytes = 10 * MIB},
                               {.role = "photograph", .size_bytes = 3 * MIB},
                               {.role = "photograph", .size_bytes = 2 * MIB}};
    const struct slurm_memory unknown = {0}, planned = {.planned_bytes = 200 * MIB}, more = {.least_bytes = 5000 * MIB};
    struct slurm_need none = slurm_need_of(&s, NULL, 0, unknown), need = slurm_need_of(&s, file, 3, unknown);
    assert_int_equal(none.cores, 4);
    assert_int_equal(none.memory_bytes, (256 + 4 * 32) * MIB);
    assert_int_equal(need.memory_bytes, none.memory_bytes + 10 * MIB * 88 + 5 * MIB * 16);
    /* a scan takes no more than volume_memory_bytes; the rest is in files */
    file[0].size_bytes = INT64_C(1) << 40;
    assert_int_equal(slurm_need_of(&s, file, 1, planned).memory_bytes, none.memory_bytes + 300 * MIB);
    assert_int_equal(slurm_need_of(&s, file, 1, unknown).memory_bytes, none.memory_bytes + s.volume_memory_bytes);
    assert_int_equal(slurm_need_of(&s, NULL, 0, more).memory_bytes, 5000 * MIB);
    s.slurm_memory_bytes = 900 * MIB;
    assert_int_equal(slurm_need_of(&s, file, 3, unknown).memory_bytes, 900 * MIB);
    s.resident_limit_bytes = 800 * MIB;
    s.threads = 2;
    assert_int_equal(slurm_need_of(&s, file, 3, more).memory_bytes, 800 * MIB);
    assert_int_equal(slurm_need_of(&s, file, 3, unknown).cores, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_request),
        cmocka_unit_test(test_ranks),
        cmocka_unit_test(test_paths_that_do_not_fit),
        cmocka_unit_test(test_settings_that_slurm_would_take_otherwise),
        cmocka_unit_test(test_the_need),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
