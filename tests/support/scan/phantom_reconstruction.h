/* A phantom, its scan, the reconstruction of it and a comparison with the truth, for accuracy tests and benchmarks. */
#ifndef SELVEDGE_TESTS_PHANTOM_RECONSTRUCTION_H
#define SELVEDGE_TESTS_PHANTOM_RECONSTRUCTION_H

#include "geometry/grade/compare_directions.h"
#include "geometry/grade/scan_grade.h"
#include "geometry/phantom/compare.h"
#include "geometry/phantom/phantom.h"
#include "geometry/reconstruct/reconstruct.h"

struct phantom_reconstruction {
    struct volume v; /* the scan with densities mapped to [0, 1] */
    struct fiber_set truth, found;
    struct compare_report compare;
    struct direction_compare filtered, redirected, transferred; /* the direction volume before and after the transfer */
    struct scan_grade grade;
    struct reconstruct_option option;
    double slice_voxel; /* spacing of the scan's slices in voxels, as thick as that: 0 (1), or a multiple of 0.5 */
    struct reconstruct_report report;
    double volume_ratio;  /* sum of the densities after the transfer over the volume of the true fibers */
    double wall_s, cpu_s; /* of the reconstruction, without the comparisons */
};

/* Options for a cloth whose fibers are diameter_voxel voxels of 2 um thick: the default phantom of the weave with all
 * lengths scaled to the diameter. The tile holds at least 38 fibers, or 60 pieces of fiber. */
void phantom_cloth_of_diameter(struct phantom_option *o, enum phantom_weave weave, double diameter_voxel);
/* Makes the phantom, scans it with a blur of 0.7 voxels and Gaussian noise, and reconstructs it with r->option, which
 * the caller sets before (reconstruct_option_default). */
status phantom_reconstruct(const struct phantom_option *o, double snr, struct phantom_reconstruction *r,
                           struct error *err);
/* The same with all options of the scan; its voxel size and sections are those of o. */
status phantom_reconstruct_scan(const struct phantom_option *o, const struct phantom_scan_option *scan,
                                struct phantom_reconstruction *r, struct error *err);
void phantom_reconstruction_release(struct phantom_reconstruction *r);

#endif
