/* Paths that name a member of a document. */
#include "base/files/document_path.h"
#include "base/files/json_depth.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void expect(const char *document, const char *path, const char *value, const char *becomes)
{
    json_t *doc = json_loads(document, 0, NULL), *new = json_loads(value, JSON_DECODE_ANY, NULL);
    struct error err = {0};
    assert_int_equal(document_replace(doc, path, new, &err), becomes == NULL ? STATUS_INVALID : STATUS_OK);
    char *text = json_dumps(doc, JSON_COMPACT);
    if (becomes != NULL)
        assert_string_equal(text, becomes);
    else
        assert_true(err.text[0] != '\0');
    free(text);
    json_decref(doc);
    json_decref(new);
}

static void test_both_kinds_of_paths(void **state)
{
    (void)state;
    static const char *const both[][2] = {{"a", "/a"}, {"b.c", "/b/c"}, {"l[1].x", "/l/1/x"}, {"l[0]", "/l/0"}};
    static const char document[] = "{\"a\":1,\"b\":{\"c\":2},\"l\":[3,{\"x\":4}]}";
    static const char *const becomes[] = {
        "{\"a\":9,\"b\":{\"c\":2},\"l\":[3,{\"x\":4}]}", "{\"a\":1,\"b\":{\"c\":9},\"l\":[3,{\"x\":4}]}",
        "{\"a\":1,\"b\":{\"c\":2},\"l\":[3,{\"x\":9}]}", "{\"a\":1,\"b\":{\"c\":2},\"l\":[9,{\"x\":4}]}"};
    for (size_t i = 0; i < 4; i++)
        for (size_t k = 0; k < 2; k++) expect(document, both[i][k], "9", becomes[i]);
}

static void test_names_with_dots_and_slashes(void **state)
{
    (void)state;
    expect("{}", "/fit/start/C_R.g", "0.5", "{\"fit\":{\"start\":{\"C_R.g\":0.5}}}");
    expect("{}", "/a~1b~0c", "[]", "{\"a/b~c\":[]}");
    expect("{}", "fit.seed", "7", "{\"fit\":{\"seed\":7}}");
    expect("{\"a\":{\"\":1}}", "/a/", "2", "{\"a\":{\"\":2}}"); /* the empty name is one, too */
}

static void test_paths_that_lead_nowhere(void **state)
{
    (void)state;
    static const char *const bad[] = {"",      ".",     "a.",   "a..b",   "a[",    "a[]", "l[2]", "l[x]",
                                      "l[-1]", "a.b.c", "/l/2", "/a/b/c", "/~2/a", "/a~", "l[1]x"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) expect("{\"a\":1,\"l\":[3,{\"x\":4}]}", bad[i], "9", NULL);
}

static void test_long_paths_are_refused(void **state)
{
    (void)state;
    char path[2][2 * 7000 + 1];
    json_t *doc = json_object(), *value = json_true();
    for (size_t n_name = JSON_DEPTH_MOST; n_name <= 7000; n_name += 7000 - JSON_DEPTH_MOST) {
        for (size_t i = 0; i < n_name; i++) {
            memcpy(path[0] + 2 * i, "a.", 2);
            memcpy(path[1] + 2 * i, "/a", 2);
        }
        path[0][2 * n_name - 1] = path[1][2 * n_name] = '\0';
        for (size_t k = 0; k < 2; k++) {
            struct error err = {0};
            status s = document_replace(doc, path[k], value, &err);
            assert_int_equal(s, n_name == JSON_DEPTH_MOST ? STATUS_OK : STATUS_INVALID);
            if (s != STATUS_OK) assert_non_null(strstr(err.text, "more than 32 names"));
        }
    }
    json_decref(doc);
}

static void test_depth_of_texts(void **state)
{
    (void)state;
    static const struct {
        const char *begin, *inner, *end;
    } kind[] = {{"[", "1", "]"}, {"{\"a\":", "1", "}"}, {"[", "\"[[[{{\\\"[[\"", "]"}};
    for (size_t k = 0; k < 3; k++)
        for (int depth = JSON_DEPTH_MOST; depth <= JSON_DEPTH_MOST + 1; depth++) {
            char text[400] = "[[],{},";
            for (int i = 1; i < depth; i++) strcat(text, kind[k].begin);
            strcat(text, kind[k].inner);
            for (int i = 1; i < depth; i++) strcat(text, kind[k].end);
            strcat(text, "]");
            json_t *read = json_loads(text, 0, NULL);
            assert_non_null(read);
            json_decref(read);
            struct error err = {0};
            assert_int_equal(json_depth_check(text, strlen(text), "the body", &err),
                             depth > JSON_DEPTH_MOST ? STATUS_INVALID : STATUS_OK);
        }
    assert_int_equal(json_depth_check("]]]]\"\\", 6, "the body", NULL), STATUS_OK); /* no JSON: the parser says so */
}

static void test_number_of_values(void **state)
{
    (void)state;
    const size_t n_bytes = 3 * (JSON_VALUES_MOST / 2) + 2; /* "[[],[],...]": two values for 3 bytes */
    char *text = malloc(n_bytes + 1);
    assert_non_null(text);
    for (size_t i = 0; i < n_bytes; i++) text[i] = "[],"[i % 3];
    text[0] = '[';
    struct error err = {0};
    assert_int_equal(json_depth_check(text, n_bytes, "the body", &err), STATUS_INVALID);
    assert_string_equal(err.text, "the body has more than 1000000 values");
    assert_int_equal(json_depth_check(text, n_bytes / 2, "the body", &err), STATUS_OK);
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_both_kinds_of_paths),     cmocka_unit_test(test_names_with_dots_and_slashes),
        cmocka_unit_test(test_paths_that_lead_nowhere), cmocka_unit_test(test_long_paths_are_refused),
        cmocka_unit_test(test_depth_of_texts),          cmocka_unit_test(test_number_of_values),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
