/* Texts that the command line client shows. The source file is included here, because the parts of the client are in no
 * library. */
#include "clients/cli/text/cli_text.c" /* NOLINT */

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

static void test_sizes(void **state)
{
    (void)state;
    static const struct {
        double n;
        const char *text;
    } golden[] = {{0, "0 B"},           {999, "999 B"},      {1000, "1.00 kB"}, {999499, "999 kB"}, {999600, "1.00 MB"},
                  {1234567, "1.23 MB"}, {45.6e6, "45.6 MB"}, {100e9, "100 GB"}, {-1, "?"},          {(double)NAN, "?"}};
    char out[CLI_SHORT_TEXT];
    for (size_t i = 0; i < sizeof golden / sizeof golden[0]; i++) {
        text_size(golden[i].n, out);
        assert_string_equal(out, golden[i].text);
    }
}

static void test_durations(void **state)
{
    (void)state;
    char out[CLI_SHORT_TEXT];
    text_duration(0.2, out);
    assert_string_equal(out, "0:00");
    text_duration(83.4, out);
    assert_string_equal(out, "1:23");
    text_duration(3599.6, out);
    assert_string_equal(out, "1:00:00");
    text_duration(7500, out);
    assert_string_equal(out, "2:05:00");
    text_duration((double)NAN, out);
    assert_string_equal(out, "-");
    text_duration((double)INFINITY, out);
    assert_string_equal(out, "-");
}

static void test_bars(void **state)
{
    (void)state;
    char out[16];
    text_bar(0.5, 12, out, sizeof out);
    assert_string_equal(out, "[#####-----]");
    text_bar((double)NAN, 5, out, sizeof out);
    assert_string_equal(out, "[---]");
    text_bar(7.0, 5, out, sizeof out);
    assert_string_equal(out, "[###]");
    text_bar(1.0, 1000, out, sizeof out); /* never longer than its buffer */
    assert_int_equal(strlen(out), sizeof out - 1);
    text_bar(1.0, 10, out, 2);
    assert_string_equal(out, "");
}

static void test_errors_decide_digits(void **state)
{
    (void)state;
    char out[CLI_SHORT_TEXT];
    text_with_error(0.023567, 0.00082, out);
    assert_string_equal(out, "0.02357 +- 0.00082");
    text_with_error(12.34567, 1.3, out);
    assert_string_equal(out, "12.3 +- 1.3");
    text_with_error(1234.5, 210.0, out);
    assert_string_equal(out, "1234 +- 210");
    text_with_error(0.85, 0.0, out);
    assert_string_equal(out, "0.85");
    text_with_error(0.85, (double)NAN, out);
    assert_string_equal(out, "0.85");
    text_with_error((double)NAN, 1.0, out);
    assert_string_equal(out, "-");
    text_with_error(1.0, 1e-12, out);
    assert_string_equal(out, "1 +- 1e-12");
}

static void test_no_terminal_escapes(void **state)
{
    (void)state;
    char out[32];
    text_clean("twill\x1b[2J\r\n\x7f", out, sizeof out);
    assert_string_equal(out, "twill?[2J???");
    text_clean("K\xc3\xb6per \xc2\x9b", out, sizeof out); /* UTF-8 is kept, the C1 control character is removed */
    assert_string_equal(out, "K\xc3\xb6per ??");
    text_clean("\xc3", out, sizeof out);
    assert_string_equal(out, "?");
    text_clean("\xf5\x80\x80\x80", out, sizeof out);
    assert_string_equal(out, "????");
    text_clean("a\xc3\xb6", out, 3); /* no incomplete character at the end */
    assert_string_equal(out, "a");
}

static void test_progress_line(void **state)
{
    (void)state;
    struct job_view v = {.state = "running",
                         .stage = "fit",
                         .fraction = 0.5,
                         .eta_s = 65,
                         .eta_low_s = (double)NAN,
                         .eta_high_s = (double)NAN,
                         .objective = 0.0236,
                         .objective_se = 0.0008,
                         .step = 7,
                         .i_stage = 5,
                         .n_stage = 8};
    char out[256];
    text_progress(&v, 200, out, sizeof out);
    assert_non_null(strstr(out, " 50 %"));
    assert_non_null(strstr(out, "fit (6/8)"));
    assert_non_null(strstr(out, "ETA 1:05"));
    assert_non_null(strstr(out, "step 7  squared errors 0.02360 +- 0.00080"));
    v.eta_low_s = 50;
    v.eta_high_s = 130;
    text_progress(&v, 200, out, sizeof out);
    if (strstr(out, "ETA 0:50") == NULL || strstr(out, "2:10") == NULL)
        fail_msg("no range of remaining time: '%s'", out);
    text_progress(&v, 40, out, sizeof out);
    assert_int_equal(strlen(out), 40);
    v = (struct job_view){.state = "queued",
                          .fraction = (double)NAN,
                          .eta_s = (double)NAN,
                          .eta_low_s = (double)NAN,
                          .eta_high_s = (double)NAN,
                          .objective = (double)NAN,
                          .step = -1,
                          .i_stage = -1};
    text_progress_plain(&v, out, sizeof out);
    assert_string_equal(out, "  0 %  queued  ETA -");
}

int main(void)
{
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_durations),
        cmocka_unit_test(test_bars),
        cmocka_unit_test(test_errors_decide_digits),
        cmocka_unit_test(test_no_terminal_escapes),
        cmocka_unit_test(test_progress_line),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
