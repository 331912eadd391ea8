/* Arrays beyond the memory limit are kept in files. Their contents are the same after they leave memory, the resident
 * memory stays within the limit, and a disk that is too small gives an error. */
#include "base/files/scratch_space.h"
#include "tests/support/scan/scan_files.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>

#include <cmocka.h>

enum { MIB = 1 << 20 };

static size_t resident(void)
{
    unsigned long all = 0, pages = 0;
    FILE *f = fopen("/proc/self/statm", "r");
    assert_non_null(f);
    assert_int_equal(fscanf(f, "%lu %lu", &all, &pages), 2);
    fclose(f);
    return pages * 4096;
}

static void test_contents_survive(void **state)
{
    (void)state;
    char folder[64];
    struct scratch_space *space;
    void *array, *small;
    enum { N = 24 * MIB / 8 };
    test_make_folder(folder);
    assert_int_equal(scratch_space_new(folder, MIB, &space, NULL), STATUS_OK);
    assert_int_equal(scratch_new(space, 1000, "a few bytes", &small, NULL), STATUS_OK);
    assert_true(scratch_file_bytes(space) == 0);
    assert_int_equal(scratch_new(space, N * sizeof(uint64_t), "numbers", &array, NULL), STATUS_OK);
    assert_true(scratch_file_bytes(space) == N * sizeof(uint64_t));
    size_t before = resident();
    uint64_t *number = array;
    for (uint64_t i = 0; i < N; i++) {
        if (i % (MIB / 8) == 0) scratch_keep_within(space);
        assert_true(number[i] == 0);
        number[i] = i * 0x9e3779b97f4a7c15u;
    }
    assert_true(resident() < before + 4 * MIB); /* 24 MiB were written */
    for (uint64_t i = 0; i < N; i++) {
        if (i % (MIB / 8) == 0) scratch_keep_within(space);
        assert_true(number[i] == i * 0x9e3779b97f4a7c15u);
    }
    scratch_release(space, array);
    assert_true(scratch_file_bytes(space) == 0);
    scratch_space_free(space); /* also frees the remaining arrays */
}

static void test_without_space(void **state)
{
    (void)state;
    void *array;
    assert_int_equal(scratch_new(NULL, 100, "bytes", &array, NULL), STATUS_OK);
    for (int i = 0; i < 100; i++) assert_int_equal(((char *)array)[i], 0);
    scratch_keep_within(NULL);
    scratch_release(NULL, array);
    scratch_release(NULL, NULL);
    scratch_space_free(NULL);
}

static void test_errors(void **state)
{
    (void)state;
    char folder[64], missing[80];
    struct scratch_space *space;
    struct error err = {0};
    void *array;
    test_make_folder(folder);
    snprintf(missing, sizeof missing, "%s/missing", folder);
    assert_int_equal(scratch_space_new(folder, 1000, &space, &err), STATUS_INVALID);
    assert_int_equal(scratch_space_new(folder, MIB, &space, &err), STATUS_OK);
    struct rlimit old, tight = {4 * MIB, RLIM_INFINITY};
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &old), 0);
    tight.rlim_max = old.rlim_max;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &tight), 0);
    status s = scratch_new(space, 16 * MIB, "densities", &array,
                           &err); /* a full disk gives an error here, and no signal later */
    setrlimit(RLIMIT_FSIZE, &old);
    assert_int_equal(s, STATUS_IO);
    assert_null(array);
    assert_non_null(strstr(err.text, "cannot reserve 16 MB on disk for densities in"));
    assert_int_equal(scratch_new(space, 16 * MIB, "densities", &array, &err), STATUS_OK);
    scratch_space_free(space);
    assert_int_equal(scratch_space_new(missing, MIB, &space, &err), STATUS_OK);
    assert_int_equal(scratch_new(space, 16 * MIB, "densities", &array, &err), STATUS_NOT_FOUND);
    scratch_space_free(space);
}

int main(void)
{
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_contents_survive),
        cmocka_unit_test(test_without_space),
        cmocka_unit_test(test_errors),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
