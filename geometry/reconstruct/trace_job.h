/* How lines are traced on one grid: chains of centers, their repair, and the fits between (geometry/fibers). The order
 * of the steps (trace_steps.c) is in trace_lines.c. All lengths are in voxels of the grid. The steps return
 * STATUS_CANCELLED, STATUS_NO_MEMORY and, with a scratch space, STATUS_DISK_FULL. */
#ifndef SELVEDGE_GEOMETRY_TRACE_JOB_H
#define SELVEDGE_GEOMETRY_TRACE_JOB_H

#include "base/angle.h"
#include "base/progress.h"
#include "base/thread_pool.h"
#include "geometry/fibers/axes/model/axis_profile.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/fibers/lines/joining.h"
#include "geometry/grade/reconstruct_option.h"
#include "geometry/grade/reconstruct_report.h"
#include "geometry/volume/volume.h"

enum {
    TRACE_MIN_PIECE = 4,  /* least number of centers in a chain before joining */
    TRACE_MAX_GROWTH = 64 /* voxels by which an end may grow */
};
#define TRACE_SETTLED_END 0.57  /* of the progress of the step "fibers", where lines are settled */
#define TRACE_FINISHED_END 0.67 /* where lines are finished */
#define TRACE_LUMENS_END 0.85   /* where lumens are measured */
#define TRACE_END_DIAMETERS 1.0 /* length at an end, in diameters, that may be wrong */
/* Spread of the radii of single fibers, over their mean: below the first, fibers are alike and all found at first (0.04
 * and less); above the second, lines come from a scan that does not resolve its fibers: yarns have 0.1 to 0.25,
 * weave-ct 0.39. */
#define TRACE_LEAST_SPREAD 0.1
#define TRACE_MOST_SPREAD 0.3
/* Angle between a line and the direction of its voxels from which on it may be wrong. */
#define TRACE_DISAGREEMENT_RAD (30.0 * RAD_PER_DEG)

/* A volume that was made from a scan by volume_rescale. A step may use its array for other densities, if it makes it
 * anew afterwards (volume_rescale_again). */
struct trace_grid {
    const struct volume *scan;
    struct volume *v;
    double edge;
};

struct trace_job {
    const struct volume *v;
    const struct trace_grid *grid; /* of v; NULL: v must stay as it is */
    const struct direction_volume *d;
    struct reconstruct_option *o;
    struct thread_pool *pool;
    struct reconstruct_report *report;
    struct progress inner;
    struct progress_part part;   /* progress that inner reports to */
    double diameter;             /* voxels */
    bool hollow;                 /* the scan has lumens that were filled */
    bool flat;                   /* the first fit of whole lines has found flat fibers (flat_fit.h) */
    double independent;          /* of the voxels of v (axis_profile.h) */
    struct axis_profile profile; /* of the lines so far */
    double shared_radius_se;     /* voxels, with lumens that were measured: of all radii together (shape_measure.h) */
};

typedef status trace_find(struct trace_job *job, bool finish, struct polyline_set *lines, struct error *err);

/* Sets the members that follow from others at the start: whether fibers are hollow, the diameter of the report, and a
 * profile. */
void trace_job_start(struct trace_job *job);
/* States which part of the progress of the step "fibers" comes next. */
void trace_enter_part(struct trace_job *job, double from, double to);
/* A profile to start a fit from. */
struct axis_profile trace_start_profile(const struct trace_job *job);
/* Writes the results of a fit for all fibers into the report. */
void trace_state_profile(const struct trace_job *job, const struct axis_profile *profile);
/* Sets the class of each line: the axis along which it extends most. */
void trace_classify(struct polyline_set *lines);
/* Finds chains of fiber centers in slices of nine directions. Counts them in the report. */
status trace_chains(struct trace_job *job, struct polyline_set *chains, struct error *err);
/* One pass over the pieces: cuts duplicates, lets the ends grow, and joins ends that meet. touching: joining.h. `in` is
 * emptied. */
status trace_repair(struct trace_job *job, struct polyline_set *in, bool grow, double touching,
                    struct polyline_set *out, struct join_counts *counts, struct error *err);
/* Joins the ends of lines that were fitted and cut, where the scan shows one fiber (join_evidence.h); before that, lets
 * them grow. Adds to the counts of the report. */
status trace_join(struct trace_job *job, struct polyline_set *lines, bool grow, struct error *err);
/* Moves lines that are still in pieces towards their axes, and finds their radii, by n_round rounds of fitting. */
status trace_center(struct trace_job *job, struct polyline_set *lines, int n_round, struct error *err);
/* Adds lines to fibers that have none, in the scan without `lines` (trace_leftover.c), where radii differ. The report
 * has their spread. */
status trace_leftover(struct trace_job *job, struct polyline_set *lines, struct error *err);
/* Finds lines and repairs them, until only the last fit is left, which trace_finish makes: it drops parts that
 * deviate. */
status trace_lines(struct trace_job *job, struct polyline_set *lines, struct error *err);
status trace_finish(struct trace_job *job, struct polyline_set *lines, struct error *err);
/* Repeats the last fit of trace_finish. */
status trace_refit(struct trace_job *job, struct polyline_set *lines, struct error *err);
/* In place of trace_finish where lines need not be exact: one round of its repairs. */
status trace_settle(struct trace_job *job, struct polyline_set *lines, struct error *err);
/* Finds lines by `find` in a scan some voxels of which are unknown (volume_unknown.h): in a copy whose densities
 * continue there. Keeps the parts of lines in known voxels, and fits finished ones once more to these alone, but not
 * where voxels are interpolated. */
status trace_known(struct trace_job *job, bool finish, trace_find *find, struct polyline_set *lines, struct error *err);
/* Finds the lines of a scan (trace_scan.c), to the end (finish) or until they are settled. They are in voxels of the
 * scan. */
status trace_scan(struct trace_job *job, bool finish, struct polyline_set *lines, struct error *err);
/* Makes fibers of the lines that were found in v. f: initialised. STATUS_NO_MEMORY. */
status trace_fiber_set(const struct volume *v, const struct polyline_set *lines, struct fiber_set *f,
                       struct error *err);
/* Marks the voxels in the inner parts of fibers (trace_lumens.c), in a volume of n. Voxels that have a mark keep it. */
void trace_mark_cores(const struct polyline_set *lines, double diameter, const size_t n[3], uint8_t value,
                      uint8_t *mark);
/* Where lumens were filled, fits the finished lines once more to the scan as it was, with a lumen for each
 * (hollow_fit.h); not where fibers are so thin that they were traced in an interpolated volume. */
status trace_lumens(struct trace_job *job, struct polyline_set *lines, struct error *err);

#endif
