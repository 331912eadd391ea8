/* Replacement of whole files, and record files: which data survive a failure, and which damage is detected. */
#include "base/files/durable.h"
#include "tests/support/scratch_folder.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cmocka.h>

/* Functions in place of those of the C library: they record what is synced, and can fail. */
static struct watched_syncs {
    int n_data, n_folder, fail_with;
} watch;

static int watched_sync(int fd, long call)
{
    struct stat st;
    assert_int_equal(fstat(fd, &st), 0);
    S_ISDIR(st.st_mode) ? watch.n_folder++ : watch.n_data++;
    errno = watch.fail_with;
    return watch.fail_with != 0 ? -1 : (int)syscall(call, fd);
}

int fsync(int fd) { return watched_sync(fd, SYS_fsync); }
int fdatasync(int fd) { return watched_sync(fd, SYS_fdatasync); }

static void check_content(const char *path, const char *want)
{
    char *text = scratch_read(path, NULL);
    assert_string_equal(text, want);
    free(text);
}

static void test_replace(void **state)
{
    assert_int_equal(durable_make_folder(scratch_path(state, "replace"), NULL), STATUS_OK);
    const char *path = scratch_path(state, "replace/file");
    assert_int_equal(durable_replace(path, "first", 5, NULL), STATUS_OK);
    check_content(path, "first");
    assert_int_equal(durable_replace(path, "second, longer", 14, NULL), STATUS_OK);
    check_content(path, "second, longer");
    assert_int_equal(durable_replace_volatile(path, "", 0, NULL), STATUS_OK);
    check_content(path, "");
    assert_int_equal(scratch_count_entries(scratch_path(state, "replace")), 1);
}

static void test_failed_replace_leaves_nothing_behind(void **state)
{
    struct error err;
    assert_int_equal(durable_replace(scratch_path(state, "none/file"), "x", 1, &err), STATUS_NOT_FOUND);
    assert_non_null(strstr(err.text, "none/file"));
    /* the target is a folder: the temporary file is written, and then the rename fails */
    const char *inner = scratch_path(state, "outer/inner");
    assert_int_equal(durable_make_folder(inner, NULL), STATUS_OK);
    assert_int_equal(durable_replace(inner, "x", 1, &err), STATUS_IO);
    assert_int_equal(scratch_count_entries(scratch_path(state, "outer")), 1);
    char longer[5000];
    memset(longer, 'x', sizeof longer - 1);
    longer[sizeof longer - 1] = '\0';
    assert_int_equal(durable_replace(longer, "x", 1, &err), STATUS_INVALID);
}

static void test_make_folder(void **state)
{
    struct stat st;
    const char *path = scratch_path(state, "a/b//c/d");
    assert_int_equal(durable_make_folder(path, NULL), STATUS_OK);
    assert_int_equal(stat(path, &st), 0);
    assert_true(S_ISDIR(st.st_mode));
    assert_int_equal(st.st_mode & 0777, 0700);
    assert_int_equal(durable_make_folder(path, NULL), STATUS_OK);
    assert_int_equal(durable_make_folder(scratch_path(state, "a/"), NULL), STATUS_OK);
    scratch_write(scratch_path(state, "a/file"), "x", 1);
    struct error err = {0};
    assert_int_not_equal(durable_make_folder(scratch_path(state, "a/file/under"), NULL), STATUS_OK);
    assert_int_equal(durable_make_folder(scratch_path(state, "a/file"), &err),
                     STATUS_EXISTS); /* the name exists, but it is no folder */
    assert_non_null(strstr(err.text, "a/file': a file of that name"));
    assert_int_equal(symlink("b", scratch_path(state, "a/link")), 0);
    assert_int_equal(durable_make_folder(scratch_path(state, "a/link/d"), NULL), STATUS_OK);
    assert_int_equal(durable_make_folder("", &err), STATUS_INVALID);
}

static void test_read_all(void **state)
{
    const char *path = scratch_path(state, "read");
    char *data;
    size_t n;
    struct error err;
    scratch_write(path, "a\0b", 3);
    assert_int_equal(file_read_all(path, 3, &data, &n, NULL), STATUS_OK);
    assert_int_equal(n, 3);
    assert_memory_equal(data, "a\0b\0", 4);
    free(data);
    assert_int_equal(file_read_all(path, 2, &data, &n, &err), STATUS_TOO_LARGE);
    scratch_write(path, "", 0);
    assert_int_equal(file_read_all(path, 0, &data, NULL, NULL), STATUS_OK);
    assert_string_equal(data, "");
    free(data);
    assert_int_equal(file_read_all(scratch_path(state, "absent"), 9, &data, &n, &err), STATUS_NOT_FOUND);
    assert_int_equal(file_read_all(*state, 9, &data, &n, &err), STATUS_INVALID);
    const char *fifo = scratch_path(state, "fifo");
    assert_int_equal(mkfifo(fifo, 0600), 0);
    alarm(20); /* a reader that waits for a writer is killed */
    assert_int_equal(file_read_all(fifo, 9, &data, &n, &err), STATUS_INVALID);
    alarm(0);
    unlink(fifo);
}

static void test_name_without_folders(void **state)
{
    (void)state;
    assert_string_equal(path_file_name("/var/lib/scan.tif"), "scan.tif");
    assert_string_equal(path_file_name("scan.tif"), "scan.tif");
    assert_string_equal(path_file_name("folder/"), "folder/"); /* there is nothing after the slash, so all of it */
}

struct seen {
    size_t n, stop_after;
    char last[64];
};

static bool visit(void *context, const char *json, size_t n_json)
{
    struct seen *s = context;
    assert_int_equal(strlen(json), n_json);
    snprintf(s->last, sizeof s->last, "%s", json);
    return ++s->n != s->stop_after;
}

/* Three records; offset[i] is where record i begins, offset[3] the length. */
static const char *three_records(void **state, const char *name, uint64_t offset[4])
{
    static const char *const json[] = {"{\"step\":0}", "{\"step\":1,\"text\":\"\u00e9\"}", "{}"};
    const char *path = scratch_path(state, name);
    struct stat st;
    offset[0] = 0;
    for (size_t i = 0; i < 3; i++) {
        assert_int_equal(record_append(path, json[i], i == 1, NULL), STATUS_OK);
        assert_int_equal(stat(path, &st), 0);
        offset[i + 1] = (uint64_t)st.st_size;
    }
    return path;
}

static void test_records_come_back(void **state)
{
    uint64_t offset[4], next = 99;
    const char *path = three_records(state, "whole.rec", offset);
    struct seen seen = {0};
    assert_int_equal(record_read(path, 0, visit, &seen, &next, NULL), STATUS_OK);
    assert_int_equal(seen.n, 3);
    assert_string_equal(seen.last, "{}");
    assert_int_equal(next, offset[3]);
    seen = (struct seen){0};
    assert_int_equal(record_read(path, offset[2], visit, &seen, &next, NULL), STATUS_OK);
    assert_int_equal(seen.n, 1);
    seen = (struct seen){.stop_after = 1};
    assert_int_equal(record_read(path, 0, visit, &seen, &next, NULL), STATUS_OK);
    assert_int_equal(next, offset[1]);
    assert_int_equal(record_read(path, offset[3], visit, &seen, &next, NULL), STATUS_OK);
    assert_int_equal(next, offset[3]);
    assert_int_equal(record_read(scratch_path(state, "absent.rec"), 0, visit, &seen, &next, NULL), STATUS_NOT_FOUND);
}

static void test_every_torn_tail_is_noticed(void **state)
{
    uint64_t offset[4], next;
    const char *path = three_records(state, "torn.rec", offset);
    size_t n;
    char *whole = scratch_read(path, &n);
    for (size_t keep = 0; keep < n; keep++) {
        scratch_write(path, whole, keep);
        struct seen seen = {0};
        size_t n_good = keep >= offset[2] ? 2 : keep >= offset[1] ? 1 : 0;
        assert_int_equal(record_read(path, 0, visit, &seen, &next, NULL), STATUS_OK);
        assert_int_equal(seen.n, n_good);
        assert_int_equal(next, offset[n_good]);
        /* truncate and continue */
        assert_int_equal(record_truncate(path, next, NULL), STATUS_OK);
        assert_int_equal(record_append(path, "{\"again\":true}", false, NULL), STATUS_OK);
        seen.n = 0;
        assert_int_equal(record_read(path, 0, visit, &seen, &next, NULL), STATUS_OK);
        assert_int_equal(seen.n, n_good + 1);
        assert_string_equal(seen.last, "{\"again\":true}");
    }
    free(whole);
}

static void test_every_flipped_bit_is_noticed(void **state)
{
    uint64_t offset[4], next;
    const char *path = three_records(state, "flipped.rec", offset);
    size_t n;
    char *whole = scratch_read(path, &n);
    for (size_t bit = 0; bit < 8 * n; bit++) {
        whole[bit / 8] = (char)(whole[bit / 8] ^ (1 << bit % 8));
        scratch_write(path, whole, n);
        whole[bit / 8] = (char)(whole[bit / 8] ^ (1 << bit % 8));
        struct seen seen = {0};
        size_t i_record = bit / 8 >= offset[2] ? 2 : bit / 8 >= offset[1] ? 1 : 0;
        assert_int_equal(record_read(path, 0, visit, &seen, &next, NULL), STATUS_OK);
        assert_int_equal(seen.n, i_record);
        assert_int_equal(next, offset[i_record]);
    }
    free(whole);
}

static void test_what_is_no_record_is_refused(void **state)
{
    const char *path = scratch_path(state, "lines.rec");
    struct error err = {0};
    assert_int_equal(record_append(path, "{}\n{}", false, &err), STATUS_INVALID); /* would be two lines, and torn */
    assert_int_equal(record_append(path, "", false, &err), STATUS_INVALID);
    assert_int_equal(access(path, F_OK), -1);
}

static void test_new_record_file_is_synced_with_its_folder(void **state)
{
    const char *path = scratch_path(state, "new.rec");
    watch = (struct watched_syncs){0};
    assert_int_equal(record_append(path, "{}", true, NULL), STATUS_OK);
    assert_int_equal(watch.n_data, 1);
    assert_int_equal(watch.n_folder,
                     1); /* otherwise a power loss can remove the file, although its content is synced */
    assert_int_equal(record_append(path, "{}", true, NULL), STATUS_OK);
    assert_int_equal(watch.n_data, 2);
    assert_int_equal(watch.n_folder, 1);
    assert_int_equal(record_append(scratch_path(state, "volatile.rec"), "{}", false, NULL), STATUS_OK);
    assert_int_equal(watch.n_data + watch.n_folder, 3);
}

static void test_failed_sync_keeps_the_old_content(void **state)
{
    struct error err = {0};
    assert_int_equal(durable_make_folder(scratch_path(state, "sync"), NULL), STATUS_OK);
    const char *path = scratch_path(state, "sync/file"), *record = scratch_path(state, "sync/file.rec");
    assert_int_equal(durable_replace(path, "old", 3, NULL), STATUS_OK);
    assert_int_equal(record_append(record, "{}", false, NULL), STATUS_OK);
    char *before = scratch_read(record, NULL);
    watch = (struct watched_syncs){.fail_with = EIO};
    assert_int_equal(durable_replace(path, "new", 3, &err), STATUS_IO);
    assert_int_equal(err.errno_value, EIO);
    assert_int_equal(record_append(record, "{\"lost\":1}", true, &err), STATUS_IO);
    watch.fail_with = 0;
    check_content(path, "old");
    check_content(record, before);
    assert_int_equal(scratch_count_entries(scratch_path(state, "sync")), 2);
    free(before);
}

static void test_full_disk_is_told(void **state)
{
    (void)state;
    struct error err;
    if (access("/dev/full", W_OK) != 0) skip();
    assert_int_equal(record_append("/dev/full", "{}", false, &err), STATUS_DISK_FULL);
    assert_int_equal(record_truncate(scratch_path(state, "absent.rec"), 0, NULL), STATUS_OK);
}

/* ---- record_seek ---- */

enum { N_ORDERED = 400 };

struct looking {
    size_t wanted, n_asked, n_bytes;
};

static bool is_before(void *context, const char *json, size_t n_json)
{
    struct looking *l = context;
    size_t number;
    l->n_asked++;
    l->n_bytes += n_json;
    assert_int_equal(sscanf(json, "{\"n\":%zu", &number), 1);
    return number < l->wanted;
}

struct reading_on {
    size_t first, n, n_bytes;
    size_t stop;
};

static bool read_on(void *context, const char *json, size_t n_json)
{
    struct reading_on *r = context;
    size_t number;
    assert_int_equal(sscanf(json, "{\"n\":%zu", &number), 1);
    if (r->n++ == 0) r->first = number;
    if (number < r->stop) r->n_bytes += n_json;
    return number < r->stop;
}

/* Records of 20 bytes to 200 kB. Each is found with few reads, and reading starts only a little before it. A torn last
 * record is not returned. */
static void test_seek(void **state)
{
    const char *path = scratch_path(state, "ordered.rec");
    char *text = malloc(200100);
    uint64_t from, next;
    for (size_t i = 0; i < N_ORDERED; i++) {
        size_t n = (size_t)snprintf(text, 100, "{\"n\":%zu,\"fill\":\"", i), fill = i % 7 == 3 ? 200000 : i % 5 * 900;
        memset(text + n, 'x', fill);
        memcpy(text + n + fill, "\"}", 3);
        assert_int_equal(record_append(path, text, false, NULL), STATUS_OK);
    }
    free(text);
    FILE *torn = fopen(path, "ab");
    assert_non_null(torn);
    fputs("0123abcd {\"n\":999", torn);
    fclose(torn);
    for (size_t wanted = 0; wanted <= N_ORDERED + 1; wanted++) {
        struct looking l = {.wanted = wanted};
        assert_int_equal(record_seek(path, is_before, &l, &from, NULL), STATUS_OK);
        struct reading_on r = {.stop = wanted};
        assert_int_equal(record_read(path, from, read_on, &r, &next, NULL), STATUS_OK);
        assert_true(r.n > 0 && (from == 0 ? r.first == 0 : r.first < wanted));
        assert_true(l.n_asked < 40 && r.n_bytes < 64 * 1024 + 2 * 200100);
    }
    assert_int_equal(record_seek(scratch_path(state, "absent.rec"), is_before, NULL, &from, NULL), STATUS_NOT_FOUND);
    scratch_write(scratch_path(state, "empty.rec"), "", 0);
    assert_int_equal(record_seek(scratch_path(state, "empty.rec"), is_before, NULL, &from, NULL), STATUS_OK);
    assert_int_equal(from, 0);
}

/* Renames a file that another writer made. Its content must be on disk before it gets its name, and the name must be
 * on disk before the call returns. */
static void test_rename(void **state)
{
    char temporary[4096];
    struct error err;
    snprintf(temporary, sizeof temporary, "%s", scratch_path(state, "picture.part"));
    const char *path = scratch_path(state, "picture.png");
    scratch_write(temporary, "pixels", 6);
    watch = (struct watched_syncs){0};
    assert_int_equal(durable_rename(temporary, path, NULL), STATUS_OK);
    assert_true(watch.n_data == 1 && watch.n_folder == 1);
    assert_true(access(temporary, F_OK) != 0 && access(path, F_OK) == 0);
    assert_int_equal(durable_rename(temporary, path, &err),
                     STATUS_NOT_FOUND); /* without a file to rename, the target is unchanged */
    assert_int_equal(access(path, F_OK), 0);
    scratch_write(temporary, "pixels", 6);
    watch = (struct watched_syncs){.fail_with = EIO};
    assert_int_equal(durable_rename(temporary, path, &err), STATUS_IO);
    watch = (struct watched_syncs){0};
    assert_true(access(temporary, F_OK) != 0 && access(path, F_OK) == 0 && strstr(err.text, "picture") != NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_replace),
        cmocka_unit_test(test_failed_replace_leaves_nothing_behind),
        cmocka_unit_test(test_make_folder),
        cmocka_unit_test(test_read_all),
        cmocka_unit_test(test_records_come_back),
        cmocka_unit_test(test_every_torn_tail_is_noticed),
        cmocka_unit_test(test_every_flipped_bit_is_noticed),
        cmocka_unit_test(test_what_is_no_record_is_refused),
        cmocka_unit_test(test_new_record_file_is_synced_with_its_folder),
        cmocka_unit_test(test_failed_sync_keeps_the_old_content),
        cmocka_unit_test(test_name_without_folders),
        cmocka_unit_test(test_full_disk_is_told),
        cmocka_unit_test(test_seek),
        cmocka_unit_test(test_rename),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
