/* The inputs that a job folder's files belong to: other inputs empty the folder, but only for the worker that holds the
 * present attempt. */
#include "optimizer/job/job_folder.h"
#include "optimizer/stages/run/worker_folder.h"
#include "tests/support/scratch_folder.h"

#include <fcntl.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

#include <cmocka.h>

static void write_attempt(const char *folder, const char *text)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, JOB_FILE_ATTEMPT);
    scratch_write(path, text, strlen(text));
}

static void write_result(const struct worker_folder *f)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(f, JOB_FOLDER_RESULTS, "picture.png", path);
    scratch_write(path, "x", 1);
    assert_int_equal(worker_folder_mark_stage(f, "trace", NULL), STATUS_OK);
}

static bool has_result(const struct worker_folder *f)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(f, JOB_FOLDER_RESULTS, "picture.png", path);
    return access(path, F_OK) == 0;
}

static void test_other_inputs_empty_the_folder(void **state)
{
    struct worker_folder f;
    bool changed = true;
    assert_int_equal(worker_folder_open(&f, *state, NULL), STATUS_OK);
    write_result(&f); /* of inputs that nobody knows */
    assert_int_equal(worker_folder_match_inputs(&f, 1, &changed, NULL), STATUS_OK);
    assert_false(changed || has_result(&f) || worker_folder_stage_done(&f, "trace"));
    write_result(&f);
    assert_int_equal(worker_folder_match_inputs(&f, 1, &changed, NULL), STATUS_OK);
    assert_true(!changed && has_result(&f) && worker_folder_stage_done(&f, "trace"));
    assert_int_equal(worker_folder_match_inputs(&f, 2, &changed, NULL), STATUS_OK);
    assert_true(changed && !has_result(&f) && !worker_folder_stage_done(&f, "trace"));
    worker_folder_close(&f);
}

static void test_a_worker_of_an_old_attempt_removes_nothing(void **state)
{
    struct worker_folder f;
    struct error err = {0};
    bool changed;
    write_attempt(*state, "{\"attempt\": 1, \"token\": \"one\"}");
    assert_int_equal(worker_folder_open(&f, *state, NULL), STATUS_OK);
    assert_int_equal(worker_folder_match_inputs(&f, 1, &changed, NULL), STATUS_OK);
    write_result(&f);
    write_attempt(*state, "{\"attempt\": 2, \"token\": \"two\"}");
    assert_int_equal(worker_folder_match_inputs(&f, 2, &changed, &err), STATUS_STALE);
    assert_true(has_result(&f) && worker_folder_stage_done(&f, "trace"));
    worker_folder_close(&f);
}

/* It writes neither results nor marks, and removes no mark. The files that are there stay as they are. */
static void test_a_worker_of_an_old_attempt_writes_nothing(void **state)
{
    static const char *const other[] = {"{\"attempt\": 2, \"token\": \"one\"}", "{\"attempt\": 1, \"token\": \"two\"}"};
    for (size_t i = 0; i < sizeof other / sizeof *other; i++) {
        struct worker_folder f;
        struct error err = {0};
        char path[WORKER_PATH_BYTES];
        size_t n;
        write_attempt(*state, "{\"attempt\": 1, \"token\": \"one\"}");
        assert_int_equal(worker_folder_open(&f, *state, NULL), STATUS_OK);
        worker_folder_path(&f, JOB_FOLDER_RESULTS, "kept.txt", path);
        assert_int_equal(worker_folder_replace(&f, path, "of the first", 12, NULL), STATUS_OK);
        assert_int_equal(worker_folder_mark_stage(&f, "trace", NULL), STATUS_OK);
        write_attempt(*state, other[i]);
        assert_int_equal(worker_folder_replace(&f, path, "of no one", 9, &err), STATUS_STALE);
        assert_non_null(strstr(err.text, "attempt 1 of this job is no longer current"));
        assert_int_equal(worker_folder_mark_stage(&f, "fit", NULL), STATUS_STALE);
        assert_int_equal(worker_folder_unmark_stage(&f, "trace", NULL), STATUS_STALE);
        assert_true(worker_folder_stage_done(&f, "trace") && !worker_folder_stage_done(&f, "fit"));
        char *kept = scratch_read(path, &n);
        assert_true(n == 12 && memcmp(kept, "of the first", 12) == 0);
        free(kept);
        worker_folder_close(&f);
    }
}

/* Opens the folder while another process holds its lock for so long. */
static status open_while_held(const char *folder, int how, unsigned held_us)
{
    struct worker_folder f;
    char path[512], byte = 0;
    int begun[2];
    snprintf(path, sizeof path, "%s/%s", folder, JOB_FILE_LOCK);
    assert_int_equal(pipe(begun), 0);
    const pid_t pid = fork();
    if (pid == 0) {
        const int fd = open(path, O_RDWR | O_CREAT, 0600);
        if (flock(fd, how) != 0 || write(begun[1], &byte, 1) != 1) _exit(1);
        usleep(held_us);
        _exit(0);
    }
    close(begun[1]);
    assert_int_equal(read(begun[0], &byte, 1), 1);
    const status s = worker_folder_open(&f, folder, NULL);
    if (s == STATUS_OK) worker_folder_close(&f);
    kill(pid, SIGKILL);
    waitpid(pid, NULL, 0);
    close(begun[0]);
    return s;
}

static void test_a_look_at_the_lock_stops_no_worker(void **state)
{
    assert_int_equal(open_while_held(*state, LOCK_SH, 30000), STATUS_OK);
    assert_int_equal(open_while_held(*state, LOCK_EX, 10000000), STATUS_STALE);
}

/* That there is no mark is no error; a mark that cannot be removed is one. */
static void test_marks_are_removed(void **state)
{
    struct worker_folder f;
    struct error err = {0};
    char path[WORKER_PATH_BYTES];
    assert_int_equal(worker_folder_open(&f, *state, NULL), STATUS_OK);
    assert_int_equal(worker_folder_mark_stage(&f, "trace", NULL), STATUS_OK);
    assert_int_equal(worker_folder_unmark_stage(&f, "trace", NULL), STATUS_OK);
    assert_false(worker_folder_stage_done(&f, "trace"));
    assert_int_equal(worker_folder_unmark_stage(&f, "trace", NULL), STATUS_OK);
    worker_folder_path(&f, JOB_FOLDER_WORK, "trace.done", path);
    assert_int_equal(mkdir(path, 0700), 0);
    assert_int_not_equal(worker_folder_unmark_stage(&f, "trace", &err), STATUS_OK);
    assert_non_null(strstr(err.text, "trace.done"));
    worker_folder_close(&f);
}

/* The fingerprint is that of the document and of the program that works on it. */
static void test_fingerprint(void **state)
{
    (void)state;
    uint64_t a = document_fingerprint("{\"a\": 1}", 8);
    assert_true(a == document_fingerprint("{\"a\": 1}", 8));
    assert_true(a != document_fingerprint("{\"a\": 2}", 8));
    assert_true(a != crc32_z(0, (const void *)"{\"a\": 1}", 8));
}

/* Of two starts with one token, one has the attempt, even where locks do not reach. */
static void test_one_start_has_the_attempt(void **state)
{
    const char *folder = *state;
    struct worker_folder first, second;
    struct error err = {0};
    char path[WORKER_PATH_BYTES];
    assert_int_equal(worker_folder_open(&first, folder, NULL), STATUS_OK);
    assert_int_equal(worker_folder_claim(&first, "slurm-7.0", NULL), STATUS_OK); /* made by hand: no token */
    worker_folder_close(&first);
    write_attempt(folder, "{\"attempt\":3,\"token\":\"abc\"}");
    assert_int_equal(worker_folder_open(&first, folder, NULL), STATUS_OK);
    second = first; /* on another node, without the lock */
    assert_int_equal(worker_folder_claim(&first, "slurm-7.0", NULL), STATUS_OK);
    assert_int_equal(worker_folder_claim(&second, "slurm-7.1", &err), STATUS_STALE);
    assert_non_null(strstr(err.text, "slurm-7.0"));
    assert_int_equal(worker_folder_claim(&first, "slurm-7.0", NULL), STATUS_OK); /* its own request, repeated */
    /* the next attempt has another token, and removes the claim of this one */
    write_attempt(folder, "{\"attempt\":4,\"token\":\"def\"}");
    assert_int_equal(worker_folder_claim(&first, "slurm-7.2", NULL), STATUS_STALE);
    worker_folder_close(&first);
    assert_int_equal(worker_folder_open(&second, folder, NULL), STATUS_OK);
    assert_int_equal(worker_folder_claim(&second, "slurm-8.0", NULL), STATUS_OK);
    worker_folder_path(&second, JOB_CLAIM_PREFIX "abc", NULL, path);
    assert_int_not_equal(access(path, F_OK), 0);
    worker_folder_path(&second, JOB_CLAIM_PREFIX "def", NULL, path);
    assert_int_equal(access(path, F_OK), 0);
    worker_folder_close(&second);
    write_attempt(folder, "{\"attempt\":5,\"token\":\"../../x\"}");
    assert_int_equal(worker_folder_open(&first, folder, NULL), STATUS_OK);
    assert_int_equal(worker_folder_claim(&first, "slurm-9.0", NULL), STATUS_FORMAT);
    worker_folder_close(&first);
}

/* A claim that cannot be written refuses nobody, once there is room again. */
static void test_a_full_disk_leaves_no_claim(void **state)
{
    struct worker_folder f;
    struct rlimit before, nothing;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    nothing = before;
    nothing.rlim_cur = 0;
    signal(SIGXFSZ, SIG_IGN);
    write_attempt(*state, "{\"attempt\":1,\"token\":\"abc\"}");
    assert_int_equal(worker_folder_open(&f, *state, NULL), STATUS_OK);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &nothing), 0);
    status s = worker_folder_claim(&f, "slurm-7.0", NULL);
    setrlimit(RLIMIT_FSIZE, &before);
    assert_int_not_equal(s, STATUS_OK);
    assert_int_equal(worker_folder_claim(&f, "slurm-7.0", NULL), STATUS_OK);
    worker_folder_close(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_other_inputs_empty_the_folder, scratch_folder_setup,
                                        scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_a_worker_of_an_old_attempt_removes_nothing, scratch_folder_setup,
                                        scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_a_worker_of_an_old_attempt_writes_nothing, scratch_folder_setup,
                                        scratch_folder_teardown),
        cmocka_unit_test(test_fingerprint),
        cmocka_unit_test_setup_teardown(test_one_start_has_the_attempt, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_a_full_disk_leaves_no_claim, scratch_folder_setup,
                                        scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_a_look_at_the_lock_stops_no_worker, scratch_folder_setup,
                                        scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_marks_are_removed, scratch_folder_setup, scratch_folder_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
