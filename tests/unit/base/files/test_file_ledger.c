/* Ledgers of files: entries, overflow, foreign text, and the sentences for people. */
#include "base/files/file_ledger_json.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void test_entries_and_their_use(void **state)
{
    (void)state;
    struct file_ledger l = {0};
    file_ledger_add(&l, "voxel size", NULL, "%g x %g um", 2.0, 2.5);
    file_ledger_add(&l, "orientation", "turned by hand", "%d", 6);
    file_ledger_add(&l, "orientation", "", "%d", 8); /* the same again: one entry */
    file_ledger_add(NULL, "orientation", "", "%d", 8);
    assert_int_equal(l.n, 2);
    assert_string_equal(file_ledger_find(&l, "voxel size")->value, "2 x 2.5 um");
    assert_string_equal(file_ledger_find(&l, "orientation")->value, "8");
    assert_int_equal(file_ledger_find(&l, "orientation")->use, FILE_STATEMENT_APPLIED);
    file_ledger_settle(&l, "voxel size", "the document says 3 um");
    assert_int_equal(file_ledger_find(&l, "voxel size")->use, FILE_STATEMENT_NOT_USED);
    assert_null(file_ledger_find(&l, "channels"));
}

static void test_foreign_text_and_overflow(void **state)
{
    (void)state;
    struct file_ledger l = {0};
    char name[16], longer[500];
    memset(longer, 'x', sizeof longer - 1);
    longer[sizeof longer - 1] = '\0';
    file_ledger_add(&l, "profile", NULL, "%s", "a\n\x1b[31mb\xff");
    assert_string_equal(l.item[0].value, "a  [31mb?");
    file_ledger_add(&l, "comment", NULL, "%s", longer);
    assert_int_equal(strlen(l.item[1].value), FILE_STATEMENT_BYTES - 1);
    for (int i = 0; i < 40; i++) {
        snprintf(name, sizeof name, "name %d", i);
        file_ledger_add(&l, name, NULL, "%d", i);
    }
    assert_int_equal(l.n, FILE_LEDGER_MAX);
    assert_string_equal(l.item[FILE_LEDGER_MAX - 1].name, "further statements");
    assert_string_equal(l.item[FILE_LEDGER_MAX - 1].value, "19"); /* 42 statements, of which 23 have a place */
}

static void expect_sentence(const json_t *list, size_t i, const char *text)
{
    assert_string_equal(json_string_value(json_array_get(list, i)), text);
}

static void test_sentences(void **state)
{
    (void)state;
    json_t *files = json_array();
    for (int i = 0; i < 3; i++) {
        struct file_ledger l = {0};
        char name[8];
        snprintf(name, sizeof name, "%c.jpg", 'a' + i);
        file_ledger_add(&l, "exposure time", NULL, "%g s", i == 0 ? 0.1 : 0.4);
        file_ledger_add(&l, "orientation", "the crop is of the stored rows", "6");
        file_ledger_append(files, name, &l);
        file_ledger_append(files, name, &l); /* a file is listed once */
    }
    assert_int_equal(json_array_size(files), 3);
    json_t *list = file_ledger_sentences(files);
    assert_int_equal(json_array_size(list), 2);
    expect_sentence(list, 0, "a.jpg and 2 other files state orientation 6: not used, the crop is of the stored rows");
    expect_sentence(list, 1, "a.jpg and 2 other files state exposure time 0.1 s (others state other values): applied");
    json_decref(list);
    json_decref(files);
}

static void test_foreign_lists(void **state)
{
    (void)state;
    json_t *files = json_loads("[{\"file\":\"a\",\"statements\":[{\"name\":\"n\",\"value\":\"v\",\"use\":\"applied\","
                               "\"reason\":\"\",\"more\":1},{\"name\":1},7]},{\"file\":3},\"x\"]",
                               0, NULL);
    file_ledgers_keep(files);
    char *text = json_dumps(files, JSON_COMPACT | JSON_SORT_KEYS);
    assert_string_equal(text, "[{\"file\":\"a\",\"statements\":[{\"name\":\"n\",\"reason\":\"\",\"use\":\"applied\","
                              "\"value\":\"v\"}]}]");
    free(text);
    json_decref(files);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_entries_and_their_use),
        cmocka_unit_test(test_foreign_text_and_overflow),
        cmocka_unit_test(test_sentences),
        cmocka_unit_test(test_foreign_lists),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
