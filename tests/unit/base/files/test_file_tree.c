/* Removal of folders that a hostile program has filled. */
#include "base/files/file_tree.h"
#include "tests/support/scratch_folder.h"

#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static void write_at(int folder, const char *name)
{
    int fd = openat(folder, name, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    assert_true(fd >= 0);
    close(fd);
}

/* Nests folders; each has a file, a link to `linked`, an empty folder and, where `branches`, a second folder with a
 * file. `locked`: the owner's permissions are taken away afterwards. */
static void nest(const char *path, int depth, const char *linked, bool branches, bool locked)
{
    assert_int_equal(mkdir(path, 0700), 0);
    int at = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    for (int i = 0; i < depth; i++) {
        write_at(at, "moved-1"); /* a name that removal itself would give */
        assert_int_equal(symlinkat(linked, at, "link"), 0);
        assert_int_equal(mkdirat(at, "empty", 0700), 0);
        if (branches) {
            assert_int_equal(mkdirat(at, "moved-2", 0700), 0);
            int side = openat(at, "moved-2", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
            write_at(side, "file");
            close(side);
        }
        assert_int_equal(mkdirat(at, "deeper", 0700), 0);
        int next = openat(at, "deeper", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        assert_true(next >= 0);
        if (locked) assert_int_equal(fchmod(at, 0), 0);
        close(at);
        at = next;
    }
    close(at);
}

static void expect_removed(void **state, int depth, bool branches, bool locked)
{
    struct error err = {0};
    struct stat st;
    const char *tree = scratch_path(state, "tree"), *kept = scratch_path(state, "kept"),
               *file = scratch_path(state, "kept/file");
    assert_int_equal(mkdir(kept, 0700), 0);
    scratch_write(file, "x", 1);
    nest(tree, depth, kept, branches, locked);
    if (file_tree_remove(tree, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(lstat(tree, &st), -1);
    assert_int_equal(errno, ENOENT);
    assert_int_equal(lstat(file, &st), 0); /* links are not followed */
}

static void test_folders_nested_deeper_than_any_path(void **state) { expect_removed(state, 5000, false, false); }
static void test_many_branches(void **state) { expect_removed(state, 300, true, false); }
static void test_folders_without_permissions(void **state) { expect_removed(state, 100, true, true); }

static void test_files_and_missing_folders(void **state)
{
    struct stat st;
    const char *file = scratch_path(state, "file");
    assert_int_equal(file_tree_remove(file, NULL), STATUS_OK);
    scratch_write(file, "x", 1);
    assert_int_equal(file_tree_remove(file, NULL), STATUS_OK);
    assert_int_equal(lstat(file, &st), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_folders_nested_deeper_than_any_path, scratch_folder_setup,
                                        scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_many_branches, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_folders_without_permissions, scratch_folder_setup,
                                        scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_files_and_missing_folders, scratch_folder_setup, scratch_folder_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
