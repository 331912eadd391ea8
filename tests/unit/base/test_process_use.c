/* What a process has used: its own memory, and not that of the program that started it. */
#include "base/process.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

static const size_t many_bytes = (size_t)128 << 20;

/* Peak of this test's program, started anew by a process that holds many_bytes. */
static long long peak_of_a_child(void)
{
    int ends[2], code;
    char text[64] = "";
    assert_int_equal(pipe(ends), 0);
    const pid_t pid = fork();
    if (pid == 0) {
        dup2(ends[1], STDOUT_FILENO);
        execl("/proc/self/exe", "test_process_use", "peak", (char *)NULL);
        _exit(1);
    }
    close(ends[1]);
    assert_true(read(ends[0], text, sizeof text - 1) > 0);
    close(ends[0]);
    assert_int_equal(waitpid(pid, &code, 0), pid);
    assert_int_equal(code, 0);
    return atoll(text);
}

static void test_memory_is_that_of_the_program_itself(void **state)
{
    (void)state;
    char *held = malloc(many_bytes);
    assert_non_null(held);
    memset(held, 1, many_bytes);
    const long long child = peak_of_a_child();
    assert_true(process_use().peak_rss_bytes > (long long)many_bytes);
    assert_true(child > 0 && child < (long long)many_bytes / 2);
    free(held);
}

static void test_processor_time_rises(void **state)
{
    (void)state;
    const double before_s = process_use().cpu_s;
    volatile double sum = 0.0;
    while (process_use().cpu_s < before_s + 0.02) sum = sum + 1.0;
    assert_true(sum > 0.0);
}

int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "peak") == 0) return printf("%lld\n", (long long)process_use().peak_rss_bytes) < 0;
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_memory_is_that_of_the_program_itself),
                                       cmocka_unit_test(test_processor_time_rises)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
