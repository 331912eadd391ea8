/* The log: one call writes one line, whatever the text contains. */
#include "base/log.h"
#include "tests/support/scratch_folder.h"

#include <ctype.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static size_t count_lines(const char *text)
{
    size_t n = 0;
    for (; *text != '\0'; text++) n += *text == '\n';
    return n;
}

static void test_form_of_a_line(void **state)
{
    const char *path = scratch_path(state, "log.txt");
    struct log *log;
    assert_int_equal(log_open(path, NULL, LOG_LEVEL_INFO, &log, NULL), STATUS_OK);
    log_info(log, "two\nlines\r\nbecome %s", "one");
    log_write(log, LOG_LEVEL_DEBUG, "too quiet");
    log_warning(log, "w");
    log_error(log, "e");
    log_close(log);
    char *text = scratch_read(path, NULL);
    assert_int_equal(count_lines(text), 3);
    /* 2026-11-21T10:20:30.123Z INFO text */
    static const char form[] = "dddd-dd-ddTdd:dd:dd.dddZ INFO two lines  become one\n";
    for (size_t i = 0; i < 25; i++)
        if (form[i] == 'd')
            assert_true(isdigit((unsigned char)text[i]));
        else
            assert_int_equal(text[i], form[i]);
    assert_memory_equal(text + 24, form + 24, sizeof form - 1 - 24);
    assert_non_null(strstr(text, "Z WARNING w\n"));
    assert_non_null(strstr(text, "Z ERROR e\n"));
    free(text);
}

static void test_appends_and_cuts_long_texts(void **state)
{
    const char *path = scratch_path(state, "long.txt");
    struct log *log;
    char longer[5000];
    memset(longer, 'x', sizeof longer - 1);
    longer[sizeof longer - 1] = '\0';
    for (int i = 0; i < 2; i++) {
        assert_int_equal(log_open(path, NULL, LOG_LEVEL_DEBUG, &log, NULL), STATUS_OK);
        log_info(log, "%s", longer);
        log_close(log);
    }
    size_t n;
    char *text = scratch_read(path, &n);
    assert_int_equal(count_lines(text), 2);
    assert_true(n <= 2 * 2048 && n > 2 * 2000);
    assert_int_equal(text[n - 1], '\n');
    free(text);
}

static void test_stream_null_and_failure(void **state)
{
    struct log *log;
    struct error err;
    char *text = NULL;
    size_t n = 0;
    FILE *stream = open_memstream(&text, &n);
    assert_int_equal(log_open(NULL, stream, LOG_LEVEL_INFO, &log, NULL), STATUS_OK);
    log_info(log, "seen");
    log_close(log);
    fclose(stream);
    assert_non_null(strstr(text, "INFO seen\n"));
    free(text);
    log_info(NULL, "nobody listens");
    log_close(NULL);
    assert_int_equal(log_open(scratch_path(state, "no/such/folder/log.txt"), NULL, LOG_LEVEL_INFO, &log, &err),
                     STATUS_NOT_FOUND);
    assert_non_null(strstr(err.text, "no/such/folder"));
}

enum { LINES_PER_THREAD = 500, N_THREAD = 4 };

static void *write_lines(void *log)
{
    for (int i = 0; i < LINES_PER_THREAD; i++) log_info(log, "line %d of a thread", i);
    return NULL;
}

static void test_threads_do_not_mix_lines(void **state)
{
    const char *path = scratch_path(state, "threads.txt");
    struct log *log;
    pthread_t thread[N_THREAD];
    assert_int_equal(log_open(path, NULL, LOG_LEVEL_INFO, &log, NULL), STATUS_OK);
    for (int i = 0; i < N_THREAD; i++) assert_int_equal(pthread_create(&thread[i], NULL, write_lines, log), 0);
    for (int i = 0; i < N_THREAD; i++) pthread_join(thread[i], NULL);
    log_close(log);
    char *text = scratch_read(path, NULL);
    size_t n = 0;
    for (char *line = text, *end; (end = strchr(line, '\n')) != NULL; line = end + 1, n++) {
        *end = '\0';
        assert_non_null(strstr(line, "Z INFO line "));
        assert_string_equal(end - 12, " of a thread");
    }
    assert_int_equal(n, LINES_PER_THREAD * N_THREAD);
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_form_of_a_line),
        cmocka_unit_test(test_appends_and_cuts_long_texts),
        cmocka_unit_test(test_stream_null_and_failure),
        cmocka_unit_test(test_threads_do_not_mix_lines),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
