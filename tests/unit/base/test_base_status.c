/* Status names and error records. */
#include "base/status.h"
#include "base/utf8.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static void test_every_code_has_its_own_name(void **state)
{
    (void)state;
    for (int i = 0; i < STATUS_COUNT; i++) {
        assert_string_not_equal(status_name((status)i), "");
        assert_string_not_equal(status_name((status)i), "unknown");
        for (int j = 0; j < i; j++) assert_string_not_equal(status_name((status)i), status_name((status)j));
    }
    assert_string_equal(status_name(STATUS_CHECKSUM), "checksum");
    assert_string_equal(status_name(STATUS_DISK_FULL), "disk_full");
    assert_string_equal(status_name((status)999), "unknown");
    assert_string_equal(status_name((status)-1), "unknown");
}

static status fails(struct error *err) { return error_set(err, STATUS_FORMAT, "page %d is %s", 211, "8-bit"); }

static void test_error_says_where(void **state)
{
    (void)state;
    struct error err = {0};
    assert_int_equal(fails(&err), STATUS_FORMAT);
    assert_int_equal(err.code, STATUS_FORMAT);
    assert_string_equal(err.where, "fails");
    assert_string_equal(err.text, "page 211 is 8-bit");
    assert_string_equal(err.field, "");
    assert_int_equal(fails(NULL), STATUS_FORMAT);
    assert_int_equal(error_set_field(&err, STATUS_INVALID, "lamp.side_cm", "too large"), STATUS_INVALID);
    assert_string_equal(err.field, "lamp.side_cm");
}

static void test_error_may_quote_itself(void **state)
{
    (void)state;
    struct error err = {0};
    error_set(&err, STATUS_IO, "inner");
    error_set_field(&err, STATUS_IO, "f", "outer (%s)", err.text);
    assert_string_equal(err.text, "outer (inner)");
    assert_int_equal(error_prefix(&err, STATUS_IO, "file %d", 7), STATUS_IO);
    assert_string_equal(err.text, "file 7: outer (inner)");
    assert_int_equal(error_prefix(NULL, STATUS_IO, "file %d", 7),
                     STATUS_IO); /* without an error record only the code is returned */
    error_set_field(&err, STATUS_IO, err.field, "again");
    assert_string_equal(err.field, "f");
}

static void test_errno_becomes_a_code(void **state)
{
    (void)state;
    static const struct {
        int value;
        status code;
    } golden[] = {{ENOSPC, STATUS_DISK_FULL}, {EDQUOT, STATUS_DISK_FULL}, {ENOMEM, STATUS_NO_MEMORY},
                  {ENOENT, STATUS_NOT_FOUND}, {EIO, STATUS_IO},           {EACCES, STATUS_IO}};
    for (size_t i = 0; i < sizeof golden / sizeof golden[0]; i++) {
        struct error err = {0};
        errno = golden[i].value;
        assert_int_equal(error_set_errno(&err, "cannot write '%s'", "a"), golden[i].code);
        assert_int_equal(err.errno_value, golden[i].value);
        assert_memory_equal(err.text, "cannot write 'a': ", 18);
        assert_non_null(strstr(err.text, strerror(golden[i].value)));
    }
    errno = ENOSPC;
    assert_int_equal(error_set_errno(NULL, "x"), STATUS_DISK_FULL);
}

static void test_long_texts_are_cut(void **state)
{
    (void)state;
    struct error err = {0};
    char longer[2000];
    memset(longer, 'x', sizeof longer - 1);
    longer[sizeof longer - 1] = '\0';
    error_set_field(&err, STATUS_INVALID, longer, "%s", longer);
    assert_int_equal(strlen(err.text), sizeof err.text - 1);
    assert_int_equal(strlen(err.field), sizeof err.field - 1);
    error_prefix(&err, STATUS_INVALID, "%s", longer);
    assert_int_equal(strlen(err.text), sizeof err.text - 1);
    errno = EIO;
    error_set_errno(&err, "%s", longer);
    assert_int_equal(strlen(err.text), sizeof err.text - 1);
}

static void test_texts_are_utf8(void **state)
{
    (void)state;
    struct error err = {0};
    error_set_field(&err, STATUS_FORMAT, "f\xfc",
                    "column 'gr\xf6\xdf"
                    "e' of '\xc3\xa4\xe2\x82\xac\xf0\x9f\xa7\xb5'");
    assert_string_equal(err.text, "column 'gr??e' of '\xc3\xa4\xe2\x82\xac\xf0\x9f\xa7\xb5'");
    assert_string_equal(err.field, "f?");
    error_set(&err, STATUS_FORMAT, "'%.3s' is cut", "\xc3\xa4\xc3\xa4");
    assert_string_equal(err.text, "'\xc3\xa4?' is cut");
    error_prefix(&err, STATUS_FORMAT,
                 "gr\xf6\xdf"
                 "e");
    assert_string_equal(err.text, "gr??e: '\xc3\xa4?' is cut");
    errno = EIO;
    error_set_errno(&err, "\xff");
    assert_int_equal(err.text[0], '?');
}

static void test_what_is_no_utf8(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        size_t n;
    } golden[] = {{"", 1},
                  {"a", 1},
                  {"\x7f", 1},
                  {"\x80", 0},
                  {"\xc0\x80", 0},
                  {"\xc2\x80", 2},
                  {"\xc3", 0},
                  {"\xc3"
                   "a",
                   0},
                  {"\xe0\x9f\xbf", 0},
                  {"\xe0\xa0\x80", 3},
                  {"\xe2\x82", 0},
                  {"\xed\x9f\xbf", 3},
                  {"\xed\xa0\x80", 0},
                  {"\xf0\x8f\xbf\xbf", 0},
                  {"\xf0\x90\x80\x80", 4},
                  {"\xf0\x9f", 0},
                  {"\xf4\x8f\xbf\xbf", 4},
                  {"\xf4\x90\x80\x80", 0},
                  {"\xf5\x80\x80\x80", 0},
                  {"\xff", 0}};
    for (size_t i = 0; i < sizeof golden / sizeof golden[0]; i++)
        assert_int_equal(utf8_sequence_bytes(golden[i].text), golden[i].n);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_code_has_its_own_name),
        cmocka_unit_test(test_error_says_where),
        cmocka_unit_test(test_error_may_quote_itself),
        cmocka_unit_test(test_errno_becomes_a_code),
        cmocka_unit_test(test_long_texts_are_cut),
        cmocka_unit_test(test_texts_are_utf8),
        cmocka_unit_test(test_what_is_no_utf8),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
