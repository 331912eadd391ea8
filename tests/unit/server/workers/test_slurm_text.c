/* What Slurm's commands print, recorded from Slurm 22.05.8 of Debian 12 with two virtual nodes, and what it means. */
#include "optimizer/job/job_folder.h"
#include "server/workers/backends/slurm_text.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* squeue --noheader --states=all --Format=SLURM_COLUMNS */
static const char queue[] = "2|CANCELLED|768|None|n2|selvedge:abc-2:1|\n"
                            "5|CANCELLED|0|PartitionConfig||(null)|\n"
                            "1|FAILED|1792|NonZeroExitCode|n1|selvedge:abc-1:1|\n"
                            "4|FAILED|1|BadConstraints||(null)|\n"
                            "8|FAILED|9|RaisedSignal:9(Killed)|n1|selvedge:abc-4:2|\n"
                            "3|PENDING|0|Resources||selvedge:abc-3:1|\n"
                            "7|RUNNING|0|None|n1|selvedge:0123456789-0123456789-0123456789-0123456789:12|\n";

static const struct slurm_job *find(const struct slurm_job *job, size_t n, const char *id)
{
    for (size_t i = 0; i < n; i++)
        if (strcmp(job[i].id, id) == 0) return &job[i];
    fail_msg("job %s was not read", id);
    return NULL;
}

static void test_the_queue(void **state)
{
    (void)state;
    struct slurm_job *job = NULL;
    struct worker_end end;
    size_t n = 0;
    assert_int_equal(slurm_parse_jobs(queue, &job, &n, NULL), STATUS_OK);
    assert_int_equal(n, 7);
    const struct slurm_job *waiting = find(job, n, "3"), *running = find(job, n, "7");
    assert_string_equal(waiting->reason, "Resources");
    assert_string_equal(waiting->nodes, "");
    assert_int_equal(slurm_phase_of(waiting, false, &end), BACKEND_WAITS);
    assert_string_equal(running->comment, "selvedge:0123456789-0123456789-0123456789-0123456789:12");
    assert_string_equal(running->reason, "");
    assert_string_equal(running->nodes, "n1");
    assert_int_equal(slurm_phase_of(running, false, &end), BACKEND_RUNS);
    assert_int_equal(slurm_phase_of(find(job, n, "1"), false, &end), BACKEND_ENDED);
    assert_true(end.cause == WORKER_ENDED && !end.by_signal && end.code == 7);
    assert_int_equal(slurm_phase_of(find(job, n, "8"), false, &end), BACKEND_ENDED);
    assert_true(end.cause == WORKER_ENDED && end.by_signal && end.code == SIGKILL);
    assert_int_equal(slurm_phase_of(find(job, n, "4"), false, &end), BACKEND_ENDED);
    assert_int_equal(end.cause, WORKER_REFUSED);
    assert_non_null(strstr(end.why, "BadConstraints"));
    assert_int_equal(slurm_phase_of(find(job, n, "2"), false, &end), BACKEND_ENDED);
    assert_int_equal(end.cause, WORKER_CANCELLED_OUTSIDE);
    free(job);
}

static void test_lines_that_are_no_jobs(void **state)
{
    (void)state;
    static const char *const text[] = {"",
                                       "\n\n",
                                       "slurm_load_jobs error: Invalid job id specified\n",
                                       "1|RUNNING|0|None|n1|\n",
                                       "1|RUNNING|0|None|n1|c|more|\n",
                                       "x|RUNNING|0|None|n1|c|\n",
                                       "1||0|None|n1|c|\n",
                                       "||||||",
                                       "|||||||||||||\n"};
    for (size_t i = 0; i < sizeof text / sizeof *text; i++) {
        struct slurm_job *job = NULL;
        size_t n = 9;
        assert_int_equal(slurm_parse_jobs(text[i], &job, &n, NULL), STATUS_OK);
        assert_int_equal(n, 0);
        free(job);
    }
}

static void test_states(void **state)
{
    (void)state;
    static const struct {
        const char *state;
        int wait_status;
        bool ranks;
        enum backend_phase phase;
        enum worker_cause cause;
        bool by_signal;
        int code;
    } row[] = {{"CONFIGURING", 0, false, BACKEND_WAITS, 0, false, 0},
               {"SUSPENDED", 0, false, BACKEND_WAITS, 0, false, 0},
               {"COMPLETING", 0, false, BACKEND_RUNS, 0, false, 0},
               {"A_STATE_OF_THE_FUTURE", 0, false, BACKEND_RUNS, 0, false, 0},
               {"COMPLETED", 0, false, BACKEND_ENDED, WORKER_ENDED, false, WORKER_SUCCEEDED},
               {"FAILED", WORKER_FAILED << 8, false, BACKEND_ENDED, WORKER_ENDED, false, WORKER_FAILED},
               {"FAILED", WORKER_CANCELLED << 8, false, BACKEND_ENDED, WORKER_INTERRUPTED, false, WORKER_CANCELLED},
               {"FAILED", WORKER_STALE << 8, false, BACKEND_ENDED, WORKER_ENDED, false, WORKER_STALE},
               {"FAILED", (128 + SIGKILL) << 8, true, BACKEND_ENDED, WORKER_INTERRUPTED, true, SIGKILL},
               {"FAILED", (128 + SIGSYS) << 8, true, BACKEND_ENDED, WORKER_ENDED, true, SIGSYS},
               {"FAILED", WORKER_LOST << 8, true, BACKEND_ENDED, WORKER_INTERRUPTED, false, WORKER_LOST},
               {"FAILED", WORKER_FAILED << 8, true, BACKEND_ENDED, WORKER_ENDED, false, WORKER_FAILED},
               {"FAILED", 139 << 8, false, BACKEND_ENDED, WORKER_ENDED, false, 139},
               {"PREEMPTED", 0, false, BACKEND_ENDED, WORKER_INTERRUPTED, false, 0},
               {"TIMEOUT", 15, false, BACKEND_ENDED, WORKER_OUT_OF_TIME, true, 15},
               {"NODE_FAIL", 0, false, BACKEND_ENDED, WORKER_NODE_LOST, false, 0},
               {"OUT_OF_MEMORY", 125 << 8, false, BACKEND_ENDED, WORKER_OUT_OF_MEMORY, false, 125}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        struct slurm_job job = {.id = "1", .nodes = "n1", .wait_status = row[i].wait_status};
        struct worker_end end;
        snprintf(job.state, sizeof job.state, "%s", row[i].state);
        assert_int_equal(slurm_phase_of(&job, row[i].ranks, &end), row[i].phase);
        assert_int_equal(end.cause, row[i].cause);
        assert_int_equal(end.by_signal, row[i].by_signal);
        assert_int_equal(end.code, row[i].code);
        assert_true(end.cause == WORKER_ENDED || end.why[0] != '\0');
    }
}

static void test_numbers_of_jobs(void **state)
{
    (void)state;
    char id[SLURM_ID_BYTES];
    assert_true(slurm_parse_id("17\n", id));
    assert_string_equal(id, "17");
    assert_true(slurm_parse_id("18;other\n", id));
    assert_string_equal(id, "18");
    assert_false(slurm_parse_id("", id));
    assert_false(slurm_parse_id("Submitted batch job 17\n", id));
    assert_false(slurm_parse_id("17 18\n", id));
    assert_false(slurm_parse_id("123456789012345678901234567890\n", id));
}

/* sacct --noheader --parsable2 --allocations, as slurmdbd 22.05 documents it; the cluster of the tests keeps no
 * accounts. */
static void test_accounts(void **state)
{
    (void)state;
    static const char text[] =
        "16|COMPLETED|0:0|n1\n17|CANCELLED by "
        "1000|0:15|n2\n18|TIMEOUT|0:0|n1\n19|FAILED|3:0|n2\n20|RUNNING|0:0|n1\n21|PENDING|0:0|None assigned\n";
    struct slurm_job job;
    struct worker_end end;
    assert_true(slurm_parse_account(text, "17", &job));
    assert_string_equal(job.state, "CANCELLED");
    assert_string_equal(job.nodes, "n2");
    assert_int_equal(slurm_phase_of(&job, false, &end), BACKEND_ENDED);
    assert_true(end.by_signal && end.code == 15 && end.cause == WORKER_CANCELLED_OUTSIDE);
    assert_true(slurm_parse_account(text, "19", &job));
    assert_int_equal(slurm_phase_of(&job, false, &end), BACKEND_ENDED);
    assert_true(!end.by_signal && end.code == 3 && end.cause == WORKER_INTERRUPTED);
    /* accounts that never got the job's end */
    assert_false(slurm_parse_account(text, "20", &job) || slurm_parse_account(text, "21", &job));
    assert_false(slurm_parse_account(text, "1", &job));
    assert_false(slurm_parse_account("", "1", &job));
}

static void test_failures(void **state)
{
    (void)state;
    static const struct {
        int code;
        const char *text;
        enum slurm_failure kind;
    } row[] = {
        {1,
         "sbatch: error: invalid partition specified: nope; sbatch: error: Batch job submission failed: Invalid "
         "partition name specified",
         SLURM_REFUSED},
        {1,
         "sbatch: error: Memory specification can not be satisfied; sbatch: error: Batch job submission failed: "
         "Requested node configuration is not available",
         SLURM_REFUSED},
        {1, "sbatch: error: Batch job submission failed: Unable to contact slurm controller (connect failure)",
         SLURM_AWAY},
        {1, "slurm_load_jobs error: Unable to contact slurm controller (connect failure)", SLURM_AWAY},
        {1, "sbatch: error: Batch job submission failed: Socket timed out on send/recv operation", SLURM_UNCERTAIN},
        {1, "sbatch: error: Batch job submission failed: Zero Bytes were transmitted or received", SLURM_UNCERTAIN},
        {1, "sbatch: error: Batch job submission failed: Slurm temporarily unable to accept job, sleeping and retrying",
         SLURM_FULL},
        {1,
         "sbatch: error: Slurm temporarily unable to accept job, sleeping and retrying; sbatch: error: Batch job "
         "submission failed: Socket timed out on send/recv operation",
         SLURM_UNCERTAIN},
        {1,
         "sbatch: error: QOSMaxSubmitJobPerUserLimit; sbatch: error: Batch job submission failed: Job violates "
         "accounting/QOS policy (job submit limit, user's size and/or time limits)",
         SLURM_FULL},
        {1,
         "sbatch: error: AssocMaxSubmitJobLimit; sbatch: error: Batch job submission failed: Job violates "
         "accounting/QOS policy (job submit limit, user's size and/or time limits)",
         SLURM_FULL},
        {1,
         "sbatch: error: QOSMaxWallDurationPerJobLimit; sbatch: error: Batch job submission failed: Job violates "
         "accounting/QOS policy (job submit limit, user's size and/or time limits)",
         SLURM_REFUSED},
        {-1, "the command gave no answer in time and was ended", SLURM_UNCERTAIN},
        {-1,
         "sbatch: error: Slurm temporarily unable to accept job, sleeping and retrying; the command gave no answer in "
         "time and was ended",
         SLURM_UNCERTAIN},
        {1, "", SLURM_REFUSED}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        struct slurm_output output = {.code = row[i].code};
        snprintf(output.error, sizeof output.error, "%s", row[i].text);
        assert_int_equal(slurm_failure_of(&output), row[i].kind);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_queue), cmocka_unit_test(test_lines_that_are_no_jobs),
        cmocka_unit_test(test_states),    cmocka_unit_test(test_numbers_of_jobs),
        cmocka_unit_test(test_accounts),  cmocka_unit_test(test_failures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
