/* A process that a reader crashes says which file it read, in a line and in a report. */
#include "base/files/reading_note.h"

#include <jansson.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

/* Crashes a child while it reads a file, and returns its output in text: of stderr and of stdout. */
static void crash(int number, bool as_report, const char *reader, const char *path, char text[2][2000])
{
    int out[2], err[2], how;
    assert_true(pipe(out) == 0 && pipe(err) == 0);
    fflush(stdout);
    pid_t pid = fork();
    if (pid == 0) {
        dup2(out[1], STDOUT_FILENO);
        dup2(err[1], STDERR_FILENO);
        reading_note_on_crash(as_report);
        reading_note_set(reader, path);
        if (number == SIGABRT) abort();
        raise(number);
        _exit(0);
    }
    close(out[1]);
    close(err[1]);
    const int from[2] = {err[0], out[0]};
    for (int i = 0; i < 2; i++) {
        ssize_t n = read(from[i], text[i], 1999);
        text[i][n > 0 ? n : 0] = '\0';
        close(from[i]);
    }
    assert_true(waitpid(pid, &how, 0) == pid && WIFSIGNALED(how) && WTERMSIG(how) == number);
}

static void test_crash(void **state)
{
    static const int number[] = {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT};
    char text[2][2000];
    (void)state;
#ifdef SELVEDGE_NO_SANDBOX
    skip();
#endif
    for (size_t i = 0; i < sizeof number / sizeof *number; i++) {
        crash(number[i], i % 2 == 0, "PNG photograph", "/a/b/my \"file\\\n.png", text);
        assert_non_null(strstr(text[0], "it crashed while it read 'my ?file??.png' (PNG photograph)\n"));
        json_t *report = json_loads(text[1], 0, NULL);
        assert_true((report != NULL) == (i % 2 == 0));
        if (report == NULL) continue;
        const json_t *fault = json_array_get(json_object_get(report, "faults"), 0);
        assert_string_equal(json_string_value(json_object_get(fault, "code")), "worker_lost");
        assert_non_null(
            strstr(json_string_value(json_object_get(fault, "detail")), "'my ?file??.png' (PNG photograph)"));
        json_decref(report);
    }
    crash(SIGSEGV, true, NULL, NULL, text);
    assert_string_equal(text[0], "selvedge-worker: it crashed\n");
}

static void test_text(void **state)
{
    (void)state;
    assert_string_equal(reading_note_text(), "");
    reading_note_set("OBJ mesh", "dress.obj");
    assert_string_equal(reading_note_text(), " while it read 'dress.obj' (OBJ mesh)");
    reading_note_set(NULL, NULL);
    assert_string_equal(reading_note_text(), "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_crash), cmocka_unit_test(test_text)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
