/* Tables of the command line client: columns by width, words in colors. The source files are included here, because the
 * parts of the client are in no library. */
#include "clients/cli/text/cli_text.c" /* NOLINT */

#include "clients/cli/text/text_table.c" /* NOLINT */

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

static const char *const head[] = {"id", "*state", ">done", "sample", NULL};

/* Prints the rows, `n_first` of them before the others. */
static char *printed(bool colored, const char *const (*row)[4], size_t n, size_t n_first)
{
    char *out = NULL;
    size_t n_out = 0;
    FILE *f = open_memstream(&out, &n_out);
    struct text_table t = {.head = head, .colored = colored};
    assert_non_null(f);
    for (size_t i = 0; i < n; i++) {
        if (i == n_first) text_table_print(&t, f);
        text_table_add(&t, row[i]);
    }
    text_table_print(&t, f);
    fclose(f);
    return out;
}

static void check(char *got, const char *expected)
{
    assert_string_equal(got, expected);
    free(got);
}

static void test_columns_are_as_wide_as_their_texts(void **state)
{
    (void)state;
    static const char *const row[][4] = {{"1", "failed", "9 %", "a long name"},
                                         {"22", "running", "100 %",
                                          "Gew\xc3\xb6"
                                          "be"}};
    check(printed(false, row, 2, 2), "id  state     done  sample\n"
                                     "1   failed     9 %  a long name\n"
                                     "22  running  100 %  Gew\xc3\xb6"
                                     "be\n");
    check(printed(false, row, 0, 0), "");
}

/* What has two bytes and is one character takes one column, and a terminal gets no escapes of others. */
static void test_characters_and_escapes(void **state)
{
    (void)state;
    static const char *const row[][4] = {{"\xc3\xb6", "a", "1", "x"}, {"o", "b\033[1m", "2", "y"}};
    check(printed(false, row, 2, 2), "id  state  done  sample\n"
                                     "\xc3\xb6   a         1  x\n"
                                     "o   b?[1m     2  y\n");
}

/* A later piece keeps the columns of the one before, and has no titles. */
static void test_pieces(void **state)
{
    (void)state;
    static const char *const row[][4] = {{"a-long-id", "failed", "9 %", "x"}, {"b", "running", "1 %", "y"}};
    check(printed(false, row, 2, 1), "id         state   done  sample\n"
                                     "a-long-id  failed   9 %  x\n"
                                     "b          running   1 %  y\n");
}

/* Colors stand around words of a meaning only, and change no width. */
static void test_colors(void **state)
{
    (void)state;
    static const char *const row[][4] = {{"failed", "failed", "9 %", "failed"}, {"b", "unknown", "1 %", "y"}};
    check(printed(true, row, 2, 2), "\033[2mid      state    done  sample\033[0m\n"
                                    "failed  \033[31mfailed\033[0m    9 %  failed\n"
                                    "b       unknown   1 %  y\n");
}

static void test_a_file_has_no_colors(void **state)
{
    (void)state;
    FILE *f = tmpfile();
    assert_non_null(f);
    assert_false(text_colored(f));
    fclose(f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_columns_are_as_wide_as_their_texts),
        cmocka_unit_test(test_characters_and_escapes),
        cmocka_unit_test(test_pieces),
        cmocka_unit_test(test_colors),
        cmocka_unit_test(test_a_file_has_no_colors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
