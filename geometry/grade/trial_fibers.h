/* The fibers of a trial (scan_trial.h): those that were traced in a part of a scan, with their measured sections. */
#ifndef SELVEDGE_GEOMETRY_TRIAL_FIBERS_H
#define SELVEDGE_GEOMETRY_TRIAL_FIBERS_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/grade/scan_trial.h"

/* The parts of the measured sections that a phantom keeps. Round solid fibers have ratios of the axes of up to 1.1,
 * which are noise. */
struct trial_sections {
    bool flat;   /* ratios of axes and turns; else sections are round */
    bool hollow; /* lumens; else fibers are solid */
    /* Width of the lumen over the fiber's, for hollow fibers if the scan tells the lumens of none. Where it tells some,
     * the others have their mean. */
    double lumen;
};

/* A box of n voxels, whose corner is at `from`. */
struct trial_box {
    size_t from[3], n[3];
    double voxel_size_m;
};

/* Makes `out` (initialised) the parts of f in the box, whose corner becomes the origin, cut at its faces. Radii vary
 * along fibers as in f. STATUS_NO_MEMORY. */
status trial_fibers_cut(const struct fiber_set *f, const struct trial_box *box, const struct trial_sections *sections,
                        struct fiber_set *out, struct error *err);
/* Writes spread of radii, ratios and lumens of the fibers into the trial. */
void trial_fibers_describe(const struct fiber_set *f, struct scan_trial *t);

#endif
