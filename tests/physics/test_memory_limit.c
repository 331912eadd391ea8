/* The resident memory of a reconstruction stays under its limit when the arrays of the volume need several times as
 * much. */
#include "geometry/reconstruct/reconstruct.h"
#include "tests/support/scan/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

enum { N = 224, N_CYLINDER = 7 };
static const size_t LIMIT_BYTES = (size_t)120 << 20; /* 18 bytes a voxel are 202 MB */

static const struct test_cylinder cylinder[N_CYLINDER] = {
    {{0.0, 60.0, 30.0}, {1.0, 0.0, 0.0}, 3.5},    {{0.0, 67.5, 30.0}, {1.0, 0.0, 0.0}, 3.5},
    {{0.0, 120.0, 110.0}, {1.0, 0.1, 0.05}, 3.5}, {{60.0, 0.0, 60.0}, {0.1, 1.0, 0.0}, 3.5},
    {{150.0, 0.0, 150.0}, {0.0, 1.0, 0.1}, 3.5},  {{110.0, 112.0, 112.0}, {0.6, 0.0, 0.8}, 3.5},
    {{40.0, 170.0, 200.0}, {0.5, 0.8, 0.0}, 3.5},
};

/* Returns the exit status of the process: 0 when the fibers were found. */
static int reconstruct(const char *folder)
{
    const size_t n[3] = {N, N, N};
    struct reconstruct_option o;
    struct reconstruct_report r = {0};
    struct scratch_space *space;
    struct thread_pool *pool;
    struct volume v;
    struct direction_volume d;
    struct fiber_set f;
    reconstruct_option_default(&o);
    if (thread_pool_new(2, &pool, NULL) != STATUS_OK ||
        scratch_space_new(folder, LIMIT_BYTES, &space, NULL) != STATUS_OK)
        return 1;
    if (volume_init_in(&v, n, (const double[3]){2e-6, 2e-6, 2e-6}, space, NULL) != STATUS_OK) return 2;
    test_fill_cylinders(&v, cylinder, N_CYLINDER, 0.1, 3);
    fiber_set_init(&f);
    status s = reconstruct_orientation(&v, &o, pool, NULL, &d, &r, NULL);
    bool in_files = scratch_file_bytes(space) > 0;
    if (s == STATUS_OK) s = reconstruct_fibers(&v, &d, &o, pool, NULL, &f, &r, NULL);
    if (s == STATUS_OK) s = reconstruct_transfer(&f, &d, pool, NULL, &r, NULL);
    fprintf(stderr, "%zu fibers, %.0f um long in all\n", f.n_fiber, 1e6 * r.total_length_m);
    return s != STATUS_OK ? 3 : !in_files ? 4 : f.n_fiber < N_CYLINDER ? 5 : 0;
}

static void test_resident_memory(void **state)
{
    (void)state;
    char folder[64];
    int how;
    struct rusage usage;
    test_make_folder(folder);
    fflush(NULL);
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (pid == 0) _exit(reconstruct(folder));
    assert_true(wait4(pid, &how, 0, &usage) == pid);
    print_message("peak %.1f MiB of %zu MiB\n", (double)usage.ru_maxrss / 1024.0, LIMIT_BYTES >> 20);
    assert_true(WIFEXITED(how));
    assert_int_equal(WEXITSTATUS(how), 0);
#if !defined(__SANITIZE_ADDRESS__) /* its shadow memory would count as resident memory */
    assert_true((size_t)usage.ru_maxrss * 1024 < LIMIT_BYTES);
#endif
}

int main(void)
{
    const struct CMUnitTest test[] = {cmocka_unit_test(test_resident_memory)};
    return cmocka_run_group_tests(test, NULL, NULL);
}
