/* The modes of a worker's sandbox, the state that is handed to the program that is executed again, and the sentences
 * about it. */
#include "optimizer/worker/sandbox/worker_confine.h"
#include "tests/support/scratch_folder.h"

#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#define OTHER "01234567-89ab-4def-8123-456789abcdef"
#define GEOMETRY_JOB "{\"sample\":\"a\",\"geometry\":{\"job\":\"" OTHER "\"},\"measurements\":{\"file\":\"rows.csv\"}}"

static void test_modes(void **state)
{
    (void)state;
    static const char *const name[] = {"off", "auto", "required"};
    static const enum confine_mode want[] = {CONFINE_OFF, CONFINE_AUTO, CONFINE_REQUIRED};
    for (size_t i = 0; i < 3; i++) {
        enum confine_mode mode = want[(i + 1) % 3];
        assert_true(confine_mode_parse(name[i], &mode) && mode == want[i]);
    }
    static const char *const bad[] = {"", "of", "offf", "Auto", "on", "require"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        enum confine_mode mode = CONFINE_AUTO;
        assert_false(confine_mode_parse(bad[i], &mode));
        assert_int_equal(mode, CONFINE_AUTO);
    }
}

/* The descriptors of the helpers for other programs are closed in programs that the worker executes. */
static void test_the_state_of_the_program(void **state)
{
    (void)state;
    struct confinement c;
    char text[40];
    int fd[2];
    for (int i = 0; i < 2; i++) {
        fd[i] = open("/dev/null", O_RDONLY);
        assert_int_equal(fcntl(fd[i], F_GETFD), 0);
    }
    snprintf(text, sizeof text, "7,1234,%d,56,%d", fd[0], fd[1]);
    assert_true(confinement_parse(text, &c));
    assert_true(c.executed && c.files_version == 7 && !c.calls);
    assert_true(c.helper.pdf.pid == 1234 && c.helper.pdf.order_fd == fd[0]);
    assert_true(c.helper.blend.pid == 56 && c.helper.blend.order_fd == fd[1]);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(fcntl(fd[i], F_GETFD), FD_CLOEXEC);
        close(fd[i]);
    }
    assert_true(confinement_parse("0,-1,-1,-1,-1", &c) && c.files_version == 0);
    assert_true(c.helper.pdf.order_fd == -1 && c.helper.blend.order_fd == -1);
    static const char *const bad[] = {"", "7", "7,1234", "7,1234,5", "7,1234,5,6,", "x,1,2,3,4"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) assert_false(confinement_parse(bad[i], &c));
}

static void test_sentences(void **state)
{
    (void)state;
    static const struct {
        enum confine_mode mode;
        int files_version;
        bool calls, whole;
        const char *text;
    } check[] = {
        {CONFINE_OFF, 0, false, true, "the worker runs without a sandbox"},
        {CONFINE_AUTO, 7, true, true, "the worker runs in a sandbox (Landlock 7, seccomp)"},
        {CONFINE_REQUIRED, 1, true, true, "the worker runs in a sandbox (Landlock 1, seccomp)"},
        {CONFINE_AUTO, 0, true, false, "lacks Landlock, so the worker's sandbox restricts system calls, but no files"},
        {CONFINE_AUTO, 2, false, false, "lacks seccomp, so the worker's sandbox restricts files, but no system calls"},
        {CONFINE_REQUIRED, 0, false, false, "lacks Landlock and seccomp, so the worker's sandbox restricts nothing"},
    };
    for (size_t i = 0; i < sizeof check / sizeof *check; i++) {
        struct confinement c = {.files_version = check[i].files_version, .calls = check[i].calls};
        char text[200];
        bool whole = confinement_describe(&c, check[i].mode, text, sizeof text);
        if (strstr(text, "which this build lacks") != NULL) skip();
        assert_int_equal(whole, check[i].whole);
        if (strstr(text, check[i].text) == NULL) fail_msg("'%s' lacks '%s'", text, check[i].text);
    }
}

/* Completes the sandbox in a process of its own. Returns the status; 100 more where the calls are restricted. */
static int complete(enum confine_mode mode, int files_version)
{
    int code = 0;
    pid_t pid = fork();
    if (pid == 0) {
        struct confinement c = {.files_version = files_version};
        struct error err = {0};
        status s = confinement_complete(&c, mode, &err);
        if (s == STATUS_UNSUPPORTED && strstr(err.text, "the settings require a sandbox, but this machine's") == NULL)
            _exit(99);
        _exit((int)s + (c.calls ? 100 : 0));
    }
    waitpid(pid, &code, 0);
    return WIFEXITED(code) ? WEXITSTATUS(code) : -1;
}

static void test_completion(void **state)
{
    (void)state;
    struct confinement none = {0};
    char text[200];
    confinement_describe(&none, CONFINE_AUTO, text, sizeof text);
    if (strstr(text, "which this build lacks") != NULL || complete(CONFINE_AUTO, 1) != 100) skip();
    assert_int_equal(complete(CONFINE_OFF, 0), STATUS_OK);
    assert_int_equal(complete(CONFINE_AUTO, 0), 100);
    assert_int_equal(complete(CONFINE_REQUIRED, 3), 100);
    assert_int_equal(complete(CONFINE_REQUIRED, 0), 100 + STATUS_UNSUPPORTED);
}

/* Files of the job whose geometry is taken over are linked before the worker is confined, because it cannot do so
 * afterwards: for reading only. */
static void test_a_geometry_is_linked(void **state)
{
    static const char *const file[] = {"job.json", "work/fibers/fibers.bin", "work/fibers.done"};
    struct confinement c;
    struct stat st;
    char path[400];
    static const char *const folder[] = {OTHER, OTHER "/work", OTHER "/work/fibers", "job", "job/adopted"};
    for (size_t i = 0; i < sizeof folder / sizeof *folder; i++)
        assert_int_equal(mkdir(scratch_path(state, folder[i]), 0700), 0);
    scratch_write(scratch_path(state, "job/job.json"), GEOMETRY_JOB, sizeof GEOMETRY_JOB - 1);
    for (size_t i = 0; i < 3; i++) {
        snprintf(path, sizeof path, OTHER "/%s", file[i]);
        scratch_write(scratch_path(state, path), "kept", 4);
    }
    worker_prepare(scratch_path(state, "job"), &c);
    for (size_t i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "job/adopted/%s", file[i]);
        assert_int_equal(stat(scratch_path(state, path), &st), 0);
        assert_true(st.st_nlink == 2 && (st.st_mode & 0777) == 0400);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_modes),
        cmocka_unit_test(test_the_state_of_the_program),
        cmocka_unit_test(test_sentences),
        cmocka_unit_test(test_completion),
        cmocka_unit_test_setup_teardown(test_a_geometry_is_linked, scratch_folder_setup, scratch_folder_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
