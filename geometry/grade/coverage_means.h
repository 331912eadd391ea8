/* Mean densities away from the fibers, and the background that material stands out of (used only in this folder). */
#ifndef SELVEDGE_GEOMETRY_COVERAGE_MEANS_H
#define SELVEDGE_GEOMETRY_COVERAGE_MEANS_H

#include "geometry/grade/coverage_input.h"
#include "geometry/grade/line_distance.h"

/* Means over cubes of 2 reach + 1 voxels. Voxels less than COVERAGE_APART_VOXEL from a fiber, and unknown ones, have no
 * mean and no part in others. */
struct coverage_means {
    const struct volume *v;
    const uint8_t *code; /* line_distance.h */
    size_t reach;
    double noise_sd; /* of a voxel */
    float rim[256];  /* density of the rim of a fiber, by code */
    float *work;     /* of each thread: 4 slices */
    size_t slice_floats;
};

/* STATUS_NO_MEMORY; the caller releases also then. */
status coverage_means_init(struct coverage_means *m, const struct coverage_input *in, const uint8_t *code,
                           struct thread_pool *pool, struct error *err);
void coverage_means_release(struct coverage_means *m);
/* The means of slice k, row by row; NaN where there is none. They are the thread's until it calls again. */
const float *coverage_means_of_slice(const struct coverage_means *m, size_t k, size_t i_thread);

/* The background in blocks of columns, and the noise of the means. */
struct coverage_background {
    size_t n[2], edge; /* blocks along x and y, and the edge of a block in voxels */
    double *level;
    double noise_sd;
};

/* Errors as above, and STATUS_CANCELLED. */
status coverage_background_measure(const struct coverage_means *m, struct thread_pool *pool,
                                   struct coverage_background *b, struct error *err);
void coverage_background_release(struct coverage_background *b);
/* The background of a column of voxels, interpolated between the middles of blocks. */
double coverage_background_at(const struct coverage_background *b, size_t i, size_t j);

#endif
