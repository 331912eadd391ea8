/* How clearly a scan shows the fibers that were traced in it.
 *
 * Where the scan shows a fiber, densities around its axis are those that fibers of the traced radii at the traced
 * places would have: high within them, low between them. `contrast` is the slope of the measured on these expected
 * densities, over windows of GRADE_WINDOW_DIAMETERS along a fiber, because single voxels are noisy: near 1 where the
 * scan shows the fibers, and near 0 where it shows material but no single fibers, so that lines there are invented.
 * `valley_depth` is easier to see in a picture: from the axis of a fiber to the axis of its nearest neighbour the
 * density falls by this share. It is small also where fibers are pressed together. */
#ifndef SELVEDGE_GEOMETRY_SCAN_GRADE_H
#define SELVEDGE_GEOMETRY_SCAN_GRADE_H

#include "base/thread_pool.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/grade/fiber_likeness.h"
#include "geometry/grade/scan_coverage.h"
#include "geometry/grade/section_misfit.h"
#include "geometry/volume/volume.h"

enum { GRADE_WINDOW_DIAMETERS = 4 };
/* Contrast from which on a window is safe, and shares of safe length for the verdicts. */
#define GRADE_SAFE_CONTRAST 0.5
#define GRADE_RESOLVED_SHARE 0.85
#define GRADE_UNRESOLVED_SHARE 0.5

/* Faults of the lines that contrast does not show, and their limits. GRADE_KIND_SHARE: share of the material from which
 * on a kind of material (scan_coverage.h) has to be explained by itself. */
enum grade_fault {
    GRADE_UNEXPLAINED = 1,
    GRADE_PARTICLES = 2,
    GRADE_DOUBLED = 4,
    GRADE_PIECES = 8,
    GRADE_SEVERAL = 16
};
#define GRADE_LEAST_EXPLAINED 0.93
#define GRADE_KIND_SHARE 0.05
#define GRADE_LEAST_KIND 0.8
#define GRADE_MOST_PARTICLES 0.05
#define GRADE_MOST_DOUBLED 0.06
#define GRADE_MOST_FRAGMENTS 1.4
#define GRADE_MOST_SEVERAL 0.05 /* share of the length in lines that hold several fibers */
/* Score below which the lines do not describe the cloth. */
#define GRADE_LEAST_SCORE 0.5

enum grade_verdict { GRADE_NONE, GRADE_RESOLVED, GRADE_PARTLY, GRADE_UNRESOLVED };

struct scan_grade {
    enum grade_verdict verdict;    /* GRADE_NONE: not measured */
    double contrast;               /* median over windows; NaN without fibers */
    double valley_depth;           /* median over windows beside a neighbour; NaN if no fiber has one */
    double beside_share;           /* share of the length that lies beside a neighbour */
    double safe_share;             /* share of the length in windows with a contrast of at least GRADE_SAFE_CONTRAST */
    double double_share;           /* share of the length that has another line nearer than fibers can be */
    struct section_misfit section; /* of the lines from round fibers; NaN: not measured */
    struct scan_coverage coverage;
    struct fiber_likeness likeness;
    /* Estimate of the smaller of recall and precision of the lines: the smaller of the explained share, and of the
     * share of the length that is neither particles nor doubled, less a little for pieces, and much for lines that
     * hold several fibers. NaN: not measured. */
    double score;
    unsigned faults;  /* of enum grade_fault */
    size_t n_dropped; /* fibers that scan_grade_sort has put last; 0 after measuring */
};

/* "none", "resolved", "partly" or "unresolved". */
const char *grade_verdict_name(enum grade_verdict v);
/* v: densities in [0, 1] in cubic voxels. safe: n_fiber shares of safe length, or NULL. The result does not depend on
 * the number of threads. STATUS_NO_MEMORY, STATUS_CANCELLED. */
status scan_grade_measure(const struct volume *v, const struct fiber_set *f, struct thread_pool *pool,
                          const struct progress *progress, struct scan_grade *grade, float *safe, struct error *err);
/* Measures the coverage, looks at lines that may be no fibers, and sets score and faults. Call it after
 * scan_grade_measure, with the same v, f, and safe. in: v, f, and their diameter, blur and noise. Errors as there, and
 * STATUS_DISK_FULL. */
status scan_grade_explain(const struct coverage_input *in, struct thread_pool *pool, struct scan_grade *grade,
                          float *safe, struct error *err);
/* Writes the contrast at every vertex, measured in the window around it: how clearly the scan shows the fiber there.
 * Below GRADE_SAFE_CONTRAST the scan does not show it, and the line is filled in. contrast: n_vertex; NaN for a fiber
 * too short to have a window. Else as scan_grade_measure. */
status scan_grade_contrast(const struct volume *v, const struct fiber_set *f, struct thread_pool *pool,
                           const struct progress *progress, float *contrast, struct error *err);
/* Puts the fibers that are safe over less than half of their length behind the others, and counts them in the grade as
 * to be dropped; counts none if all fibers are such. safe: as measured. STATUS_NO_MEMORY. */
status scan_grade_sort(struct fiber_set *f, const float *safe, struct scan_grade *grade, struct error *err);
/* Drops those fibers. */
void scan_grade_drop(struct fiber_set *f, const struct scan_grade *grade);

#endif
