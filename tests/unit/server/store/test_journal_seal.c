/* Seals of journals: who lacks the key makes none, and only sealed records say when a job was changed last. */
#include "optimizer/job/job_folder.h"
#include "server/store/job_journal.h"
#include "server/store/journal_seal.h"
#include "tests/support/scratch_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static const struct journal_key key = {.known = true, .bytes = "of the daemon"},
                                other = {.known = true, .bytes = "of a stranger"}, none = {.known = false};

static void test_keys_of_a_folder(void **state)
{
    struct journal_key made, read;
    size_t n;
    const char *path = scratch_path(state, "journal.key");
    assert_int_equal(journal_key_read(*state, false, &read, NULL), STATUS_OK);
    assert_false(read.known);
    assert_int_not_equal(access(path, F_OK), 0);
    assert_int_equal(journal_key_read(*state, true, &made, NULL), STATUS_OK);
    assert_true(made.known);
    for (int again = 0; again < 2; again++) { /* the same key from now on, whether one may be made or not */
        assert_int_equal(journal_key_read(*state, again == 1, &read, NULL), STATUS_OK);
        assert_true(read.known && memcmp(read.bytes, made.bytes, sizeof read.bytes) == 0);
    }
    char *text = scratch_read(path, &n);
    assert_true(n == JOURNAL_KEY_LENGTH && memcmp(text, made.bytes, n) == 0);
    scratch_write(path, text, n - 1); /* damaged */
    free(text);
    assert_int_equal(journal_key_read(*state, false, &read, NULL), STATUS_OK);
    assert_false(read.known);
    assert_int_equal(journal_key_read(*state, true, &read, NULL), STATUS_OK);
    assert_true(read.known && memcmp(read.bytes, made.bytes, sizeof read.bytes) != 0);
    unlink(path);
    assert_int_equal(mkdir(path, 0700), 0);
    assert_int_equal(mkdir(scratch_path(state, "journal.key/x"), 0700), 0);
    assert_int_not_equal(journal_key_read(*state, true, &read, NULL), STATUS_OK);
    assert_false(read.known);
    char far[5000];
    memset(far, 'x', sizeof far - 1);
    far[sizeof far - 1] = '\0';
    assert_int_equal(journal_key_read(far, true, &read, NULL), STATUS_INVALID);
}

static void test_seals(void **state)
{
    static const char object[] = "{\"a\":1}";
    (void)state;
    char *text = journal_seal(&key, object);
    const size_t n = strlen(text);
    assert_true(n > strlen(object) && strncmp(text, "{\"a\":1,\"seal\":\"", 15) == 0 && text[n - 1] == '}');
    assert_true(journal_sealed(&key, text, n));
    assert_false(journal_sealed(&other, text, n) || journal_sealed(&none, text, n));
    for (size_t i = 0; i < n; i++) { /* every byte counts */
        text[i] ^= 1;
        assert_false(journal_sealed(&key, text, n));
        text[i] ^= 1;
        assert_false(journal_sealed(&key, text, i));
    }
    free(text);
    char *plain = journal_seal(&none, object), *empty = journal_seal(&key, "{}");
    assert_string_equal(plain, object);
    assert_string_equal(empty, "{}");
    assert_false(journal_sealed(&key, plain, strlen(plain)));
    free(plain);
    free(empty);
    char *least = journal_seal(&key, "{1}");
    assert_true(journal_sealed(&key, least, strlen(least)));
    free(least);
}

static void append(void **state, const struct journal_key *k, const char *id, double updated_unix_s)
{
    struct job_row row = {.state = JOB_DRAFT, .updated_unix_s = updated_unix_s};
    snprintf(row.id, sizeof row.id, "%s", id);
    assert_int_equal(job_journal_append(k, *state, &(struct journal_entry){.job = &row}, false, NULL), STATUS_OK);
}

static void append_text(void **state, const char *text)
{
    FILE *f = fopen(scratch_path(state, JOB_FILE_JOURNAL), "a");
    fputs(text, f);
    fclose(f);
}

static void cut_one_byte(const char *path)
{
    struct stat st;
    assert_int_equal(stat(path, &st), 0);
    assert_int_equal(truncate(path, st.st_size - 1), 0);
}

static double sealed(void **state) { return job_journal_sealed_unix_s(&key, *state, "me"); }

static void test_the_last_sealed_change(void **state)
{
    assert_true(sealed(state) == 0); /* there is no journal */
    append(state, &other, "me", 5);
    assert_true(sealed(state) == 0);
    append(state, &key, "you", 6);
    assert_true(sealed(state) == 0);
    append(state, &key, "me", 7.5);
    assert_true(sealed(state) == 7.5);
    assert_true(job_journal_sealed_unix_s(&other, *state, "me") == 5 &&
                job_journal_sealed_unix_s(&none, *state, "me") == 0);
    append(state, &none, "me", 9);
    append(state, &other, "me", 10);
    append_text(state, "\nx\nnonsense that is longer than any checksum\n");
    assert_true(sealed(state) == 7.5);
    append(state, &key, "me", 8.5);
    assert_true(sealed(state) == 8.5);
    append(state, &key, "me", 11);
    cut_one_byte(scratch_path(state, JOB_FILE_JOURNAL));
    assert_true(sealed(state) == 8.5); /* a line without an end is no record */
    for (int i = 0; i < 3000; i++) append_text(state, "a line of nothing, many times over\n");
    assert_true(sealed(state) == 0); /* only the last records are looked at */
    append(state, &key, "me", 12);
    assert_true(sealed(state) == 12);
}

static void test_links_are_not_followed(void **state)
{
    append(state, &key, "me", 3);
    assert_int_equal(rename(scratch_path(state, JOB_FILE_JOURNAL), scratch_path(state, "real")), 0);
    assert_int_equal(symlink("real", scratch_path(state, JOB_FILE_JOURNAL)), 0);
    assert_true(sealed(state) == 0);
    assert_int_equal(unlink(scratch_path(state, JOB_FILE_JOURNAL)), 0);
    assert_int_equal(mkfifo(scratch_path(state, JOB_FILE_JOURNAL), 0600), 0);
    assert_true(sealed(state) == 0);
}

int main(void)
{
#define WITH_FOLDER(test) cmocka_unit_test_setup_teardown(test, scratch_folder_setup, scratch_folder_teardown)
    const struct CMUnitTest tests[] = {WITH_FOLDER(test_keys_of_a_folder), cmocka_unit_test(test_seals),
                                       WITH_FOLDER(test_the_last_sealed_change),
                                       WITH_FOLDER(test_links_are_not_followed)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
