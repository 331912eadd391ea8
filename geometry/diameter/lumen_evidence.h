/* Whether the fibers of a scan look hollow, before any of them is traced. Where they do, a few are traced
 * (reconstruct/lumen_lines.h).
 *
 * Lumens are filled in a copy of the middle of the scan (lumen_fill.h). Enclosed gaps between solid fibers are filled
 * too, but only a filled lumen is then the middle of a fiber, where the scale-normalised Laplacian of the scan is large
 * at the scale of a fiber (Lindeberg 1998). The scale follows from the width of the filled space, not from a measured
 * diameter, which may belong to walls or to a bundle. */
#ifndef SELVEDGE_GEOMETRY_LUMEN_EVIDENCE_H
#define SELVEDGE_GEOMETRY_LUMEN_EVIDENCE_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

struct lumen_evidence {
    double enclosed_share; /* filled voxels over material voxels */
    double width_voxel;    /* of the filled space, if it were round tubes; 0: nothing was filled */
    double middle_share;   /* filled voxels in the middle of a fiber over material voxels */
    double hollow_share;   /* of lines that were traced (reconstruct/lumen_lines.h); NaN: none were */
    double radius_spread;  /* of the radii of these lines, over their mean; NaN: there are none */
};

/* The verdict on the evidence. Some scans of solid fibers have a middle_share of 0.001 to 0.02 that is 0.015 of
 * enclosed_share, and lumens of 0.3 and 0.4 of the width at 7 voxels and signal-to-noise 3 have 0.0018 and more, so
 * lines decide there: solid fibers have a hollow_share of at most 0.05, hollow ones of at least 0.27. Without lines a
 * middle_share of 0.002 is clear. At signal-to-noise 2, and at 4 voxels, most lumens cannot be told from gaps between
 * solid fibers (geometry/NOTES.md). */
enum lumen_verdict { LUMENS_NOT_SEEN, LUMENS_POSSIBLE, LUMENS_CLEAR };
enum lumen_verdict lumen_evidence_judge(const struct lumen_evidence *e);

/* Whether the evidence would be clear, or at least possible, if the fibers had lumens of 0.3 of their width or more.
 * Such lumens were seen in all phantoms of 6 voxels and more whose noise, measured as here, is at most 0.36, or 0.13
 * where it is correlated by a Gaussian of more than 0.6 voxel (geometry/NOTES.md, "Where lumens are seen"). noise_sd:
 * of a voxel of the scan, over the step from void to material; noise_blur_voxel: of grade/scan_noise.h. */
bool lumen_evidence_would_show(double diameter_voxel, double noise_sd, double noise_blur_voxel);

/* v: densities in [0, 1]; noise_sd: of a voxel. At most 160 voxels along each axis are looked at, with 60 MB of memory.
 * STATUS_CANCELLED, STATUS_NO_MEMORY; with a scratch space also STATUS_DISK_FULL. */
status lumen_evidence_measure(const struct volume *v, double noise_sd, struct thread_pool *pool,
                              struct lumen_evidence *e, struct error *err);

#endif
