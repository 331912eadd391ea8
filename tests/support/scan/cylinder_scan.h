/* A small scan of straight fibers whose axes are known, and its whole reconstruction. */
#ifndef SELVEDGE_TESTS_CYLINDER_SCAN_H
#define SELVEDGE_TESTS_CYLINDER_SCAN_H

#include "geometry/reconstruct/reconstruct.h"
#include "tests/support/scan/scan_files.h"

enum { CYLINDER_NX = 72, CYLINDER_NY = 64, CYLINDER_NZ = 48, CYLINDER_N = 5 };

/* The fibers: points and radii in voxels. */
extern const struct test_cylinder cylinder_scan_axis[CYLINDER_N];

struct cylinder_result {
    struct volume v;
    struct direction_volume d;
    struct fiber_set f;
    struct reconstruct_option o;
    struct reconstruct_report r;
};

/* Writes the scan as 16-bit pages of a TIFF: one layer along x and two fibers across it; noise 0.2. */
void cylinder_scan_write(const char *path);
/* Reconstructs the file at `path` in arrays of `space`, or in memory when that is NULL. */
void cylinder_scan_run_in(struct scratch_space *space, const char *path, const struct reconstruct_option *o,
                          size_t n_thread, struct cylinder_result *x);
/* The same with default options, voxels of 2 um, and axes such as "xyz". */
void cylinder_scan_run_axes(struct scratch_space *space, const char *path, const char *axes, size_t n_thread,
                            struct cylinder_result *x);
void cylinder_result_release(struct cylinder_result *x);

#endif
