/* JSON and files of somebody else: what is held of them, what is refused, and what counts as no file. */
#include "base/files/durable.h"
#include "base/files/foreign_file.h"
#include "base/files/foreign_json.h"
#include "base/files/json_member.h"
#include "tests/support/scratch_folder.h"

#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static const char *const wanted[] = {"a", "list", NULL};
static const struct foreign_bounds some = {4096, 4096, 8, wanted}, all = {4096, 4096, 8, NULL};

static status parse(const char *text, const struct foreign_bounds *bounds, char **out)
{
    json_t *j = NULL;
    struct error err = {0};
    status s = foreign_json_parse(text, strlen(text), bounds, NULL, &j, &err);
    if (out != NULL) *out = j == NULL ? NULL : json_dumps(j, JSON_COMPACT);
    assert_int_equal(s == STATUS_OK, j != NULL);
    assert_int_equal(s == STATUS_OK, err.text[0] == '\0');
    json_decref(j);
    return s;
}

static void test_only_members_asked_for_are_held(void **state)
{
    static const struct {
        const char *text, *held, *whole;
    } of[] = {
        {"{}", "{}", "{}"},
        {" {\"b\": {\"a\": 1}, \"a\" : [ 1, {\"a\":2} ] , \"c\":\"x\"} \n", "{\"a\":[1,{\"a\":2}]}",
         "{\"b\":{\"a\":1},\"a\":[1,{\"a\":2}],\"c\":\"x\"}"},
        {"{\"x\":\"} , \\\" ] \\\\\",\"list\":[],\"y\":[[\"a\"]],\"a\":\"\\\"a\\\\\"}",
         "{\"list\":[],\"a\":\"\\\"a\\\\\"}",
         "{\"x\":\"} , \\\" ] \\\\\",\"list\":[],\"y\":[[\"a\"]],\"a\":\"\\\"a\\\\\"}"},
        {"{\"aa\":1,\"lis\":2,\"list\":3}", "{\"list\":3}", "{\"aa\":1,\"lis\":2,\"list\":3}"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof of / sizeof of[0]; i++) {
        char *held = NULL, *whole = NULL;
        assert_int_equal(parse(of[i].text, &some, &held), STATUS_OK);
        assert_int_equal(parse(of[i].text, &all, &whole), STATUS_OK);
        assert_string_equal(held, of[i].held);
        assert_string_equal(whole, of[i].whole);
        free(held);
        free(whole);
    }
}

static void test_damaged_text_is_refused(void **state)
{
    static const char *const text[] = {"",
                                       "x",
                                       "1",
                                       "\"a\"",
                                       "{",
                                       "{\"a\":",
                                       "{\"a\":1",
                                       "{\"a\":\"x",
                                       "{\"a\":1}}",
                                       "{\"a\":1} x",
                                       "{\"a\":1,}",
                                       "{\"a\":[1}",
                                       "{\"a\":1,\"a\":2}",
                                       "{\"a\":\"\1\"}",
                                       "{\"b\":\"\1\"}",
                                       "{\"b\":\3}",
                                       "]"};
    (void)state;
    for (size_t i = 0; i < sizeof text / sizeof text[0]; i++) {
        if (parse(text[i], &all, NULL) != STATUS_FORMAT) fail_msg("taken: %s", text[i]);
        if (strcmp(text[i], "{\"a\":1,}") != 0 && parse(text[i], &some, NULL) != STATUS_FORMAT)
            fail_msg("taken in part: %s", text[i]);
    }
}

static char *repeated(const char *begin, const char *text, size_t n, const char *end)
{
    const size_t n_text = strlen(text), n_begin = strlen(begin);
    char *out = malloc(n_begin + n * n_text + strlen(end) + 1);
    assert_non_null(out);
    memcpy(out, begin, n_begin);
    for (size_t i = 0; i < n; i++) memcpy(out + n_begin + i * n_text, text, n_text);
    memcpy(out + n_begin + n * n_text, end, strlen(end) + 1);
    return out;
}

/* The same values in a member that nobody asks for cost nothing. */
static void test_values_that_would_take_much_memory(void **state)
{
    static const char *const value[] = {"[],", "{},", "1,", "\"\",", "{\"b\":1},"};
    char *text;
    (void)state;
    for (size_t i = 0; i < sizeof value / sizeof value[0]; i++) {
        text = repeated("{\"a\":[", value[i], 1000, "0]}");
        assert_int_equal(parse(text, &some, NULL), STATUS_TOO_LARGE);
        assert_int_equal(parse(text, &all, NULL), STATUS_TOO_LARGE);
        free(text);
        text = repeated("{\"other\":[", value[i], 1000, "0],\"a\":1}");
        assert_int_equal(parse(text, &some, NULL), STATUS_OK);
        assert_int_equal(parse(text, &all, NULL), STATUS_TOO_LARGE);
        free(text);
    }
    text = repeated("{\"a\":\"", "x", 5000, "\"}");
    assert_int_equal(parse(text, &some, NULL), STATUS_TOO_LARGE);
    free(text);
}

/* Also where they are passed over. */
static void test_nested_values_are_bounded(void **state)
{
    (void)state;
    for (size_t depth = 6; depth <= 9; depth++) {
        char *open = repeated("{\"b\":", "[", depth, ""), *text = repeated(open, "]", depth, "}");
        assert_int_equal(parse(text, &some, NULL), depth < 8 ? STATUS_OK : STATUS_TOO_LARGE);
        assert_int_equal(parse(text, &all, NULL), depth < 8 ? STATUS_OK : STATUS_TOO_LARGE);
        free(open);
        free(text);
    }
}

static status read_in(void **state, const char *name)
{
    json_t *j = NULL;
    status s = foreign_json_read(scratch_path(state, "."), name, &some, &j, NULL);
    json_decref(j);
    return s;
}

static void test_only_regular_files_are_read(void **state)
{
    char *text = repeated("{\"a\":1", " ", 5000, "}");
    scratch_write(scratch_path(state, "file"), "{\"a\":1}", 7);
    scratch_write(scratch_path(state, "list"), "[1]", 3);
    scratch_write(scratch_path(state, "large"), text, strlen(text));
    free(text);
    assert_int_equal(mkdir(scratch_path(state, "folder"), 0700), 0);
    scratch_write(scratch_path(state, "folder/file"), "{}", 2);
    assert_int_equal(symlink("file", scratch_path(state, "link")), 0);
    assert_int_equal(symlink("folder", scratch_path(state, "linked")), 0);
    assert_int_equal(symlink("/dev/zero", scratch_path(state, "zero")), 0);
    assert_int_equal(mkfifo(scratch_path(state, "pipe"), 0600), 0);
    assert_int_equal(read_in(state, "file"), STATUS_OK);
    assert_int_equal(read_in(state, "folder/file"), STATUS_OK);
    assert_int_equal(read_in(state, "list"), STATUS_FORMAT);
    assert_int_equal(read_in(state, "large"), STATUS_TOO_LARGE);
    static const char *const none[] = {"link", "linked/file", "zero", "pipe", "folder", "file/file", "absent", ""};
    for (size_t i = 0; i < sizeof none / sizeof none[0]; i++)
        if (read_in(state, none[i]) != STATUS_NOT_FOUND) fail_msg("read: %s", none[i]);
    uint64_t next;
    assert_int_equal(record_read(scratch_path(state, "link"), 0, NULL, NULL, &next, NULL), STATUS_NOT_FOUND);
    assert_int_equal(record_seek(scratch_path(state, "pipe"), NULL, NULL, &next, NULL), STATUS_NOT_FOUND);
}

static void test_files_are_written_where_something_else_was(void **state)
{
    static const char *const name[] = {"pipe", "link", "folder", "file", "new"};
    struct stat st;
    scratch_write(scratch_path(state, "target"), "kept", 4);
    scratch_write(scratch_path(state, "file"), "old", 3);
    assert_int_equal(mkfifo(scratch_path(state, "pipe"), 0600), 0);
    assert_int_equal(symlink("target", scratch_path(state, "link")), 0);
    assert_int_equal(mkdir(scratch_path(state, "folder"), 0700), 0);
    scratch_write(scratch_path(state, "folder/inside"), "x", 1);
    for (size_t i = 0; i < 5; i++) {
        const char *path = scratch_path(state, name[i]);
        assert_int_equal(foreign_file_replace(path, "new", 3, i % 2 == 0, NULL), STATUS_OK);
        assert_true(lstat(path, &st) == 0 && S_ISREG(st.st_mode) && st.st_size == 3);
    }
    char *text = scratch_read(scratch_path(state, "target"), NULL);
    assert_string_equal(text, "kept");
    free(text);
    assert_int_equal(symlink("/tmp", scratch_path(state, "linked")), 0);
    assert_int_equal(foreign_folder_clear(scratch_path(state, "linked"), NULL), STATUS_OK);
    assert_int_equal(lstat(scratch_path(state, "linked"), &st), -1);
}

struct count_of_records {
    size_t n;
};

static bool count_record(void *context, const char *json, size_t n_json)
{
    struct count_of_records *c = context;
    c->n += json[n_json] == '\0';
    return true;
}

static bool accept_record(void *context, const char *json, size_t n_json)
{
    (void)context, (void)json, (void)n_json;
    return true;
}

/* A line longer than a record may be ends the reading without being held; what is before it is read. */
static void test_lines_without_end_are_not_held(void **state)
{
    const char *path = scratch_path(state, "long.rec");
    const size_t n_long = RECORD_MOST_BYTES;
    struct error err = {0};
    uint64_t next = 0;
    char *json = malloc(n_long + 1);
    assert_non_null(json);
    memset(json, 'x', n_long);
    json[n_long] = '\0';
    assert_int_equal(record_append(path, "{}", false, NULL), STATUS_OK);
    assert_int_equal(record_append(path, json, false, &err), STATUS_TOO_LARGE);
    json[n_long - 10] = '\0'; /* the longest one */
    assert_int_equal(record_append(path, json, false, NULL), STATUS_OK);
    free(json);
    struct count_of_records c = {0};
    assert_int_equal(record_read(path, 0, count_record, &c, &next, NULL), STATUS_OK);
    assert_int_equal(c.n, 2);
    const uint64_t end = next;
    int fd = open(path, O_WRONLY | O_CLOEXEC);
    assert_int_equal(ftruncate(fd, (off_t)end + ((off_t)4 << 30)), 0);
    close(fd);
    c.n = 0;
    assert_int_equal(record_read(path, 0, count_record, &c, &next, NULL), STATUS_OK);
    assert_true(c.n == 2 && next == end);
    assert_int_equal(record_seek(path, accept_record, &c, &next, NULL), STATUS_OK);
    assert_true(next <= end);
}

static void test_members_of_the_wrong_kind_are_removed(void **state)
{
    static const struct json_member of[] = {
        {"text", JSON_IS_TEXT, false, 0, 0}, {"share", JSON_IS_NUMBER, true, 0, 1}, {"n", JSON_IS_WHOLE, false, 0, 10}};
    json_t *j = json_pack("{s:s,s:f,s:i,s:i}", "text", "x", "share", 0.5, "n", 3, "more", 1);
    (void)state;
    assert_true(json_members_keep(j, of, 3, false));
    assert_int_equal(json_object_size(j), 4);
    json_object_set_new(j, "n", json_integer(11));
    json_object_set_new(j, "share", json_null());
    json_object_set_new(j, "text", json_null());
    assert_false(json_members_keep(j, of, 3, true));
    assert_int_equal(json_object_size(j), 1);
    assert_non_null(json_object_get(j, "share"));
    assert_false(json_members_keep(NULL, of, 3, true));
    json_decref(j);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, scratch_folder_setup, scratch_folder_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(test_only_members_asked_for_are_held),    TEST(test_damaged_text_is_refused),
        TEST(test_values_that_would_take_much_memory), TEST(test_nested_values_are_bounded),
        TEST(test_only_regular_files_are_read),        TEST(test_files_are_written_where_something_else_was),
        TEST(test_lines_without_end_are_not_held),     TEST(test_members_of_the_wrong_kind_are_removed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
