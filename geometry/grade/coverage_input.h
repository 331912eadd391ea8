/* A scan and its traced fibers, as the coverage is measured from them (scan_coverage.h). */
#ifndef SELVEDGE_GEOMETRY_COVERAGE_INPUT_H
#define SELVEDGE_GEOMETRY_COVERAGE_INPUT_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/volume/volume.h"

/* Distance from the surface of every fiber from which on a voxel may be unexplained. */
#define COVERAGE_APART_VOXEL 1.5

struct coverage_input {
    const struct volume *v; /* densities in [0, 1] in cubic voxels */
    const struct fiber_set *f;
    double diameter_voxel, blur_voxel; /* of the fibers; standard deviation of the blur of their surfaces */
    double noise_sd; /* of the voxels, for scans whose void is too small to measure the noise of the means in */
};

#endif
