/* Drafts of weavers' programs: the weaves that they state, and broken files. */
#include "geometry/weave/weave_wif.h"
#include "tests/support/scratch_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define HEAD "[WIF]\nVersion=1.1\nSource Program=Loom 3\n[CONTENTS]\nTHREADING=true\n"
#define STRAIGHT "[THREADING]\n1=1\n2=2\n3=3\n4=4\n"
#define TREADLED "[TIEUP]\n1=1,2\n2=2,3\n3=3,4\n4=1,4\n[TREADLING]\n1=1\n2=2\n3=3\n4=4\n"
#define PLANNED "[LIFTPLAN]\n1=1,2\n2=2,3\n3=3,4\n4=4,1\n"
/* Two treadles of a pick add up: a tie-up of single shafts. */
#define SKELETON "[TIEUP]\n1=1\n2=2\n3=3\n4=4\n[TREADLING]\n1=1,2\n2=2,3\n3=3,4\n4=4,1\n"

static status read_wif(void **state, const char *text, struct weave_wif *w, struct file_ledger *ledger,
                       struct error *err)
{
    const char *path = scratch_path(state, "a.wif");
    scratch_write(path, text, strlen(text));
    return weave_wif_read(path, w, ledger, err);
}

static void expect_rows(void **state, const char *text, const char *rows)
{
    struct weave_wif w;
    struct error err = {0};
    char got[2000] = "";
    if (read_wif(state, text, &w, NULL, &err) != STATUS_OK) fail_msg("%s", err.text);
    for (size_t j = 0; j < w.n_weft; j++)
        snprintf(got + strlen(got), sizeof got - strlen(got), "%s%s", j == 0 ? "" : " ", w.row[j]);
    assert_string_equal(got, rows);
}

/* The first thread is the right column. A twill by treadles, by a lift plan, by a skeleton tie-up; a sinking shed. */
static void weaves_are_read(void **state)
{
    static const char twill[] = "0011 0110 1100 1001";
    expect_rows(state, HEAD STRAIGHT TREADLED, twill);
    expect_rows(state, HEAD STRAIGHT PLANNED, twill);
    expect_rows(state, HEAD STRAIGHT SKELETON, twill);
    expect_rows(state, HEAD STRAIGHT TREADLED PLANNED, twill);
    expect_rows(state, "\xef\xbb\xbf" HEAD "[WEAVING]\nShafts=4 ; all\nRising Shed=yes\n" STRAIGHT TREADLED, twill);
    expect_rows(state, HEAD "[weaving]\nrising shed=False\n" STRAIGHT TREADLED, "1100 1001 0011 0110");
    expect_rows(state, "[WIF]\r\n[THREADING]\r\n1=1\r\n2=2\r\n[LIFTPLAN]\r\n1 = 1\r\n2 = 2\r\n", "01 10");
    expect_rows(state, HEAD "; sections in another order\n" TREADLED STRAIGHT, twill);
    expect_rows(state, HEAD "[THREADING]\n1=1\n2=2\n3=1,2\n[LIFTPLAN]\n1=1\n2=2\n3=0\n4=1,2\n", "101 110 000 111");
}

/* Six repeats of four threads and two more are one repeat; a palindrome is as long as it is. */
static void the_repeat_is_found(void **state)
{
    char text[4000];
    snprintf(text, sizeof text, "%s[THREADING]\n", HEAD);
    for (int i = 0; i < 26; i++) snprintf(text + strlen(text), sizeof text - strlen(text), "%d=%d\n", i + 1, i % 4 + 1);
    snprintf(text + strlen(text), sizeof text - strlen(text), "[LIFTPLAN]\n");
    for (int i = 0; i < 101; i++)
        snprintf(text + strlen(text), sizeof text - strlen(text), "%d=%d,%d\n", i + 1, i % 4 + 1, (i + 1) % 4 + 1);
    expect_rows(state, text, "0011 0110 1100 1001");
    expect_rows(state, HEAD "[THREADING]\n1=1\n2=2\n3=3\n4=2\n5=1\n[LIFTPLAN]\n1=1,2\n2=3\n", "11011 00100");
}

static void statements_are_listed(void **state)
{
    struct weave_wif w;
    struct file_ledger ledger = {0};
    assert_int_equal(read_wif(state, HEAD STRAIGHT TREADLED "[WARP COLORS]\n1=2\n2=3\n[WEFT]\nSpacing=0.2\nColor=3\n",
                              &w, &ledger, NULL),
                     STATUS_OK);
    assert_string_equal(file_ledger_find(&ledger, "threads")->value, "4 warps and 4 wefts");
    assert_int_equal(file_ledger_find(&ledger, "weave")->use, FILE_STATEMENT_APPLIED);
    assert_int_equal(file_ledger_find(&ledger, "warp colors")->use, FILE_STATEMENT_NOT_USED);
    assert_string_equal(file_ledger_find(&ledger, "weft spacing")->value, "0.2");
    assert_non_null(file_ledger_find(&ledger, "weft color"));
    assert_string_equal(file_ledger_find(&ledger, "program")->value, "Loom 3");
}

static void broken_files_are_named(void **state)
{
    static const struct {
        const char *text, *says;
    } bad[] = {
        {"", "line 1: it does not begin with the section [WIF]"},
        {"[THREADING]\n1=1\n", "line 1: it does not begin"},
        {"\x89PNG\n", "does not begin"},
        {"[WIF\n", "line 1: a section has no ']'"},
        {HEAD, "no [THREADING]"},
        {HEAD "[COLOR TABLE]\n1=0,0,0\n", "a file of colors alone"},
        {HEAD STRAIGHT, "no [TREADLING] and no [LIFTPLAN]"},
        {HEAD "[THREADING]\n1=1\n3=2\n" PLANNED, "warp thread 2 has no shaft"},
        {HEAD "[THREADING]\n1=1\n2=\n" PLANNED, "warp thread 2 has no shaft"},
        {HEAD "[WARP]\nThreads=6\n" STRAIGHT PLANNED, "warp thread 5 has no shaft"},
        {HEAD "[WARP]\nThreads=3\n" STRAIGHT PLANNED, "it states 3 threads, but [THREADING] has number 4"},
        {HEAD "[WEFT]\nThreads=5\n" STRAIGHT TREADLED, "pick 5 has no treadle"},
        {HEAD "[WEAVING]\nShafts=3\n" STRAIGHT TREADLED, "warp thread 4 names shaft 4, but there are 3"},
        {HEAD "[WEAVING]\nTreadles=3\n" STRAIGHT TREADLED, "pick 4 names treadle 4, but there are 3"},
        {HEAD STRAIGHT "[TIEUP]\n1=1\n[TREADLING]\n1=1\n2=2\n", "pick 2 uses treadle 2, which is tied to no shaft"},
        {HEAD STRAIGHT TREADLED "[LIFTPLAN]\n1=1\n2=2\n3=3\n4=4\n", "pick 1 the lift plan lifts other shafts"},
        {HEAD STRAIGHT "1=2\n" PLANNED, "line 11: this number was stated before"},
        {HEAD "[THREADING]\n0=1\n", "line 7: a list needs a number"},
        {HEAD "[THREADING]\n1=x\n", "whole numbers up to 512"},
        {HEAD "[THREADING]\n1=513\n", "whole numbers up to 512"},
        {HEAD "[THREADING]\n1=99999999999999999999999\n", "whole numbers up to 512"},
        {HEAD "[THREADING]\n1=1 2\n", "no comma"},
        {HEAD "[THREADING]\n5000=1\n", "of a thread that a loom can have"},
        {HEAD "[WARP]\nThreads=many\n", "is a whole number above 0"},
        {HEAD "[WARP]\nThreads=100000\n", "more than 4096"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct weave_wif w;
        struct error err = {0};
        const status s = read_wif(state, bad[i].text, &w, NULL, &err);
        if (s != STATUS_FORMAT && s != STATUS_TOO_LARGE) fail_msg("%zu: %d", i, (int)s);
        if (strstr(err.text, bad[i].says) == NULL) fail_msg("%zu: '%s' does not say '%s'", i, err.text, bad[i].says);
    }
    struct weave_wif w;
    struct error err = {0};
    const char *path = scratch_path(state, "utf16.wif");
    scratch_write(path, "\xff\xfe[\0W\0", 6);
    assert_int_equal(weave_wif_read(path, &w, NULL, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "UTF-16"));
}

/* 40 warps that never repeat: each pick lifts one of them. */
static void a_long_repeat_is_refused(void **state)
{
    char text[4000];
    struct weave_wif w;
    struct error err = {0};
    snprintf(text, sizeof text, "%s[THREADING]\n", HEAD);
    for (int i = 1; i <= 40; i++) snprintf(text + strlen(text), sizeof text - strlen(text), "%d=%d\n", i, i);
    snprintf(text + strlen(text), sizeof text - strlen(text), "[LIFTPLAN]\n1=1,7\n2=40\n");
    assert_int_equal(read_wif(state, text, &w, NULL, &err), STATUS_TOO_LARGE);
    assert_non_null(strstr(err.text, "40 warps and 2 wefts does not repeat within 32 warps"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(weaves_are_read),          cmocka_unit_test(the_repeat_is_found),
        cmocka_unit_test(statements_are_listed),    cmocka_unit_test(broken_files_are_named),
        cmocka_unit_test(a_long_repeat_is_refused),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
