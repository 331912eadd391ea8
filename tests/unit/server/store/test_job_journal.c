/* The journal of a job: everything that is written comes back, later records replace earlier ones, and damage, links
 * and values that no daemon writes do no harm. */
#include "optimizer/job/job_folder.h"
#include "server/store/job_journal.h"
#include "tests/support/scratch_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <cmocka.h>

static const struct journal_key key = {.known = true, .bytes = "not so secret"};
static const struct job_row whole = {.id = "an-id",
                                     .sample = "silk \"A\"",
                                     .document = (char *)(uintptr_t) "abc",
                                     .state = JOB_CANCELLED,
                                     .attempt = 3,
                                     .lost_attempts = 2,
                                     .generation = 5,
                                     .token = "secret",
                                     .created_unix_s = 1.5,
                                     .updated_unix_s = 2.5,
                                     .queued_unix_s = 3.5,
                                     .started_unix_s = 4.5,
                                     .finished_unix_s = 5.5,
                                     .error_code = "format",
                                     .error_field = "volume.files",
                                     .error_text = "page 2",
                                     .peak_rss_bytes = 1LL << 40,
                                     .owner = "ann",
                                     .priority = -10,
                                     .tags = " a b ",
                                     .verdict = "good",
                                     .batch = "a-batch",
                                     .batch_place = 7,
                                     .batch_name = "night"};

static void append(const char *folder, const struct journal_entry *entry)
{
    assert_int_equal(job_journal_append(&key, folder, entry, true, NULL), STATUS_OK);
}

static void assert_whole(const struct job_row *a, const struct job_row *b)
{
    assert_string_equal(a->id, b->id);
    assert_string_equal(a->sample, b->sample);
    assert_int_equal(a->state, b->state);
    assert_true(a->cancel_requested == b->cancel_requested && a->dirty == b->dirty && a->deleted == b->deleted);
    assert_true(a->attempt == b->attempt && a->lost_attempts == b->lost_attempts && a->generation == b->generation);
    assert_true(a->created_unix_s == b->created_unix_s && a->updated_unix_s == b->updated_unix_s);
    assert_true(a->queued_unix_s == b->queued_unix_s && a->started_unix_s == b->started_unix_s);
    assert_true(a->finished_unix_s == b->finished_unix_s && a->peak_rss_bytes == b->peak_rss_bytes);
    assert_string_equal(a->error_code, b->error_code);
    assert_string_equal(a->error_field, b->error_field);
    assert_string_equal(a->error_text, b->error_text);
    assert_string_equal(a->owner, b->owner);
    assert_int_equal(a->priority, b->priority);
    assert_string_equal(a->tags, b->tags);
    assert_string_equal(a->verdict, b->verdict);
    assert_string_equal(a->batch, b->batch);
    assert_string_equal(a->batch_name, b->batch_name);
    assert_int_equal(a->batch_place, b->batch_place);
}

static void test_every_column(void **state)
{
    struct job_journal j;
    for (int flag = 0; flag < 3; flag++) {
        struct job_row row = whole;
        row.cancel_requested = flag == 0;
        row.dirty = flag == 1;
        row.deleted = flag == 2;
        append(*state, &(struct journal_entry){.job = &row, .document = true});
        assert_int_equal(job_journal_read(*state, &j, NULL), STATUS_OK);
        assert_true(j.has_job && j.n_damaged == 0 && j.n_file == 0 && j.key[0] == '\0' && j.job.token[0] == '\0');
        assert_whole(&j.job, &row);
        /* SHA-256 of "abc", of FIPS 180-2 */
        assert_string_equal(j.document_hash, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
        job_journal_release(&j);
    }
}

static void test_parts(void **state)
{
    struct job_journal j;
    struct file_row file[3] = {{.id = "1", .name = "a.tif", .role = "volume", .size_bytes = 5, .sha256 = "aa"},
                               {.id = "2", .name = "b.tif", .role = "volume", .size_bytes = 1LL << 40},
                               {.id = "3", .name = "c.csv", .role = "measurements", .size_bytes = 7}};
    append(*state, &(struct journal_entry){.idempotency_key = "key", .body_hash = "hash"});
    append(*state, &(struct journal_entry){.file = file, .n_file = 3});
    assert_int_equal(job_journal_read(*state, &j, NULL), STATUS_OK);
    assert_true(!j.has_job && j.n_file == 3 && strcmp(j.key, "key") == 0 && strcmp(j.body_hash, "hash") == 0);
    for (size_t i = 0; i < 3; i++) {
        assert_string_equal(j.file[i].id, file[i].id);
        assert_string_equal(j.file[i].name, file[i].name);
        assert_string_equal(j.file[i].role, file[i].role);
        assert_string_equal(j.file[i].sha256, file[i].sha256);
        assert_true(j.file[i].size_bytes == file[i].size_bytes);
    }
    job_journal_release(&j);
    assert_true(j.file == NULL && j.n_file == 0);
    append(*state, &(struct journal_entry){.removed = "a.tif"});
    append(*state, &(struct journal_entry){.removed = "none"});
    file[1].size_bytes = 9;
    append(*state, &(struct journal_entry){.file = &file[1], .n_file = 1});
    assert_int_equal(job_journal_read(*state, &j, NULL), STATUS_OK);
    assert_true(j.n_file == 2 && strcmp(j.file[0].name, "b.tif") == 0 && strcmp(j.file[1].name, "c.csv") == 0);
    assert_true(j.file[0].size_bytes == 9);
    job_journal_release(&j);
    append(*state, &(struct journal_entry){.file = file, .n_file = 1, .removed = "c.csv"}); /* both in one record */
    assert_int_equal(job_journal_read(*state, &j, NULL), STATUS_OK);
    assert_true(j.n_file == 2 && strcmp(j.file[1].name, "a.tif") == 0);
    job_journal_release(&j);
}

/* Appends a line with the checksum of its text, as a record file has it. */
static void append_line(void **state, const char *text)
{
    FILE *f = fopen(scratch_path(state, JOB_FILE_JOURNAL), "a");
    fprintf(f, "%08lx %s\n", crc32_z(0, (const void *)text, strlen(text)), text);
    fclose(f);
}

/* Records that are whole and say what no daemon would: none of them becomes part of the job. */
static void test_strange_records(void **state)
{
    static const char *const none[] = {"{\"job\":{\"id\":\"x\"}}", "{\"job\":{\"id\":\"x\",\"state\":\"flying\"}}",
                                       "{\"job\":{\"state\":\"draft\",\"attempt\":-1}}",
                                       "{\"job\":{\"state\":\"draft\",\"lost_attempts\":-1}}",
                                       "{\"job\":{\"state\":\"draft\",\"generation\":-1}}"};
    struct job_journal j;
    append(*state, &(struct journal_entry){.job = &whole});
    for (size_t i = 0; i < sizeof none / sizeof *none; i++) append_line(state, none[i]);
    assert_int_equal(job_journal_read(*state, &j, NULL), STATUS_OK);
    assert_whole(&j.job, &whole);
    job_journal_release(&j);
    static const struct {
        int priority, want;
    } check[] = {{-11, 0}, {-10, -10}, {10, 10}, {11, 0}};
    for (size_t i = 0; i < 4; i++) {
        char text[200];
        snprintf(text, sizeof text,
                 "{\"job\":{\"state\":\"queued\",\"priority\":%d,\"created_unix_s\":-5,\"queued_unix_s\":7}}",
                 check[i].priority);
        append_line(state, text);
        assert_int_equal(job_journal_read(*state, &j, NULL), STATUS_OK);
        assert_true(j.job.state == JOB_QUEUED && j.job.priority == check[i].want && j.job.id[0] == '\0');
        assert_true(j.job.created_unix_s == 0 && j.job.queued_unix_s == 7);
        assert_int_equal(j.n_damaged, 0);
        job_journal_release(&j);
    }
    append_line(state, "[1]"); /* a record that is no object counts as damage */
    assert_int_equal(job_journal_read(*state, &j, NULL), STATUS_OK);
    assert_true(j.n_damaged == 1 && j.has_job);
    job_journal_release(&j);
}

/* A damaged line costs itself alone; a line that a power cut left incomplete does not swallow the next record. */
static void test_damage(void **state)
{
    struct job_journal j;
    const char *path = scratch_path(state, JOB_FILE_JOURNAL);
    append(*state, &(struct journal_entry){.job = &whole});
    FILE *f = fopen(path, "a");
    fputs("00000000 {\"job\":{\"state\":\"draft\"}}\n", f); /* a wrong checksum */
    fputs("this is no record\n12345678 {\"half", f);
    fclose(f);
    append(*state, &(struct journal_entry){.removed = "x", .idempotency_key = "k", .body_hash = "h"});
    assert_int_equal(job_journal_read(*state, &j, NULL), STATUS_OK);
    assert_true(j.has_job && j.n_damaged == 3 && strcmp(j.key, "k") == 0);
    assert_whole(&j.job, &whole);
    job_journal_release(&j);
    f = fopen(path, "a");
    fputs("12345678 {\"half", f);
    fclose(f);
    assert_int_equal(job_journal_read(*state, &j, NULL), STATUS_OK); /* an unfinished end is no record yet */
    assert_true(j.has_job);
    job_journal_release(&j);
}

/* No more than 256 MiB of a journal are read, which counts as a damaged place. */
static void test_a_journal_that_is_too_large(void **state)
{
    struct job_journal j;
    struct job_row row = whole;
    append(*state, &(struct journal_entry){.job = &row});
    assert_int_equal(truncate(scratch_path(state, JOB_FILE_JOURNAL), 256 << 20), 0);
    assert_int_equal(job_journal_read(*state, &j, NULL), STATUS_OK);
    assert_true(j.has_job && j.n_damaged == 1);
    job_journal_release(&j);
    assert_int_equal(truncate(scratch_path(state, JOB_FILE_JOURNAL), (256 << 20) + 1), 0);
    assert_int_equal(job_journal_read(*state, &j, NULL), STATUS_OK);
    assert_true(j.has_job && j.n_damaged == 2);
    job_journal_release(&j);
}

static void test_no_journal(void **state)
{
    struct job_journal j;
    struct error err = {0};
    const char *path = scratch_path(state, JOB_FILE_JOURNAL);
    assert_int_equal(job_journal_read(*state, &j, &err), STATUS_NOT_FOUND);
    scratch_write(path, "", 0);
    assert_int_equal(job_journal_read(*state, &j, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "no whole record"));
    scratch_write(path, "nonsense\n", 9);
    assert_int_equal(job_journal_read(*state, &j, &err), STATUS_FORMAT);
    job_journal_release(&j);
}

/* In place of the journal a worker may put a link or a pipe: it is not read, and the next record replaces it. */
static void test_links_and_pipes(void **state)
{
    const char *path = scratch_path(state, JOB_FILE_JOURNAL), *victim = scratch_path(state, "victim");
    for (int pipe = 0; pipe < 2; pipe++) {
        struct job_journal j;
        struct error err = {0};
        size_t n;
        unlink(path);
        scratch_write(victim, "untouched", 9);
        assert_int_equal(pipe ? mkfifo(path, 0600) : symlink(victim, path), 0);
        assert_int_equal(job_journal_read(*state, &j, &err), STATUS_NOT_FOUND);
        append(*state, &(struct journal_entry){.job = &whole});
        assert_int_equal(job_journal_read(*state, &j, NULL), STATUS_OK);
        assert_true(j.has_job);
        job_journal_release(&j);
        char *text = scratch_read(victim, &n);
        assert_true(n == 9 && memcmp(text, "untouched", 9) == 0);
        free(text);
    }
    unlink(path);
    assert_int_equal(mkdir(path, 0700), 0); /* a folder makes way */
    struct job_journal j;
    append(*state, &(struct journal_entry){.job = &whole});
    assert_int_equal(job_journal_read(*state, &j, NULL), STATUS_OK);
    assert_true(j.has_job);
    job_journal_release(&j);
}

int main(void)
{
#define WITH_FOLDER(test) cmocka_unit_test_setup_teardown(test, scratch_folder_setup, scratch_folder_teardown)
    const struct CMUnitTest tests[] = {
        WITH_FOLDER(test_every_column),    WITH_FOLDER(test_parts),      WITH_FOLDER(test_strange_records),
        WITH_FOLDER(test_damage),          WITH_FOLDER(test_no_journal), WITH_FOLDER(test_a_journal_that_is_too_large),
        WITH_FOLDER(test_links_and_pipes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
