/* The reconstruction of fibers from a scan, in the steps that the pipeline runs and checkpoints (fabric thesis,
 * section 5.6). Step functions take the options of the job and fill a part of the quality report.
 *
 * Volumes and all arrays of their size come from the scratch space given to reconstruct_read (v->space). The steps
 * process them in slabs and keep the process within its memory limit. Results do not depend on the limit. */
#ifndef SELVEDGE_GEOMETRY_RECONSTRUCT_H
#define SELVEDGE_GEOMETRY_RECONSTRUCT_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/grade/reconstruct_option.h"
#include "geometry/grade/reconstruct_report.h"
#include "geometry/volume/format/volume_info.h"
#include "geometry/volume/volume.h"

#include "base/progress.h"
#include "base/thread_pool.h"
#include "base/warning.h"

#include <stdbool.h>

struct scan_look;

/* Memory, or space in files, that all steps together need for a voxel of the scan, and of a scan with padding. */
enum { SCAN_BYTES_PER_VOXEL = 22, SCAN_BYTES_PER_PADDED_VOXEL = 26 };

/* Settles the statements of a scan's files against the options: each is applied (an option that was left out takes
 * its value), or its entry in the ledger, a copy of info->ledger, says why it is not used. STATUS_INVALID, with the
 * option in the field, names a statement that the options contradict, with both values and a way out, and asks about a
 * voxel size that shows no fiber. */
status reconstruct_settle(const struct volume_source_info *info, struct reconstruct_option *o,
                          struct file_ledger *ledger, struct error *err);
/* Enters the padding that was found, and a stated one that was not. */
void reconstruct_state_padding(const struct volume_source_info *info, const struct scan_look *look,
                               struct file_ledger *ledger);
/* Opens a scan, settles its statements, and looks at some of its slices: everything that can be said before it is read.
 * Errors as of volume_source_open_declared and reconstruct_settle; STATUS_FORMAT for voxels without numbers, or of one
 * value. */
status reconstruct_examine(const char *const *path, size_t n_path, struct reconstruct_option *o,
                           struct file_ledger *ledger, struct error *err);

/* Step "volume": reads the files, applies axes, matrix and crop, maps densities to [0, 1], and fills enclosed lumens.
 * Where any were filled, reconstruct_refill_lumens follows. path: as for volume_source_open_declared. space NULL:
 * memory without a limit. Errors name the file and the option that is wrong: STATUS_FORMAT (incomplete file, pages of
 * different size or depth), STATUS_INVALID (NaN voxels, constant, or empty: nothing above the threshold),
 * STATUS_CANCELLED, STATUS_NO_MEMORY, STATUS_DISK_FULL (scratch space; in all steps), STATUS_TOO_LARGE (the scan needs
 * more than the scratch space may hold, by the numbers above). Padding is entered in v->unknown: the steps below find
 * fibers in known voxels only (volume_unknown.h). */
status reconstruct_read(const char *const *path, size_t n_path, struct reconstruct_option *o,
                        struct scratch_space *space, struct thread_pool *pool, const struct progress *progress,
                        struct volume *v, struct reconstruct_report *report, struct error *err);

/* The part of the step "volume" that looks for lumens and fills what is enclosed. v: densities in [0, 1]; report->noise
 * is known. STATUS_CANCELLED, STATUS_NO_MEMORY; with a scratch space also STATUS_DISK_FULL. */
status reconstruct_lumens(struct volume *v, struct reconstruct_option *o, struct thread_pool *pool,
                          struct reconstruct_report *report, struct error *err);
/* The part after it, where anything was filled and the lines that showed lumens have not shown that fibers are alike
 * (reconstruct_refills): traces fibers, and where their diameters differ fills their inner parts as well. Otherwise v
 * stays as it is. Measures the seams of the volume anew. Errors as before. */
status reconstruct_refill_lumens(struct volume *v, const struct reconstruct_option *o, struct thread_pool *pool,
                                 const struct progress *progress, struct reconstruct_report *report, struct error *err);
bool reconstruct_refills(const struct volume *v, const struct reconstruct_report *report);

/* Changes report->lumens from LUMENS_NONE to LUMENS_UNKNOWN where lumens would not have been seen
 * (lumen_evidence_would_show), and where the grade is GRADE_UNRESOLVED. v: as it was traced; report: with its grade. */
void reconstruct_tell_lumens(const struct volume *v, struct reconstruct_report *report);

/* Step "orientation": computes directions d from v by the line filter (orientation/line_filter.h), which starts from
 * the structure tensor and refines J locally. STATUS_INVALID when no voxel is kept: field OPTION_FILTER_DENSITY if
 * none is dense enough, else OPTION_FILTER_ANSWER. */
status reconstruct_orientation(const struct volume *v, struct reconstruct_option *o, struct thread_pool *pool,
                               const struct progress *progress, struct direction_volume *d,
                               struct reconstruct_report *report, struct error *err);

/* The same by the diameter in the options, which was found before and is not compared with the scan's. */
status reconstruct_orientation_again(const struct volume *v, struct reconstruct_option *o, struct thread_pool *pool,
                                     const struct progress *progress, struct direction_volume *d,
                                     struct reconstruct_report *report, struct error *err);

/* The part of the step "orientation" after it, in noisy scans and where many lines in a part of the scan have lost
 * their fibers (reconstruct_redirects): traces lines twice, or once where voxels are interpolated, and voxels within a
 * diameter of one take its direction. d stays as it is in other scans, in noise where voxels are interpolated, and
 * where radii of lines differ so much that the scan does not resolve its fibers. Errors as those of
 * reconstruct_fibers. */
status reconstruct_redirect(const struct volume *v, struct direction_volume *d, const struct reconstruct_option *o,
                            struct thread_pool *pool, const struct progress *progress,
                            const struct reconstruct_report *report, struct error *err);
bool reconstruct_redirects(const struct reconstruct_report *report);
/* Share of the progress of the step "orientation" before it. reconstruct_orientation reports no more than this share if
 * only the lines in a part of the scan, which it traces, show that this part follows. */
#define RECONSTRUCT_FILTER_SHARE 0.2

/* Step "fibers": subvolumes, fiber centers, linking, smoothing and radius. STATUS_INVALID when no fiber is found. */
status reconstruct_fibers(const struct volume *v, const struct direction_volume *d, struct reconstruct_option *o,
                          struct thread_pool *pool, const struct progress *progress, struct fiber_set *f,
                          struct reconstruct_report *report, struct error *err);

/* Last part of the step "fibers": grades the lines against the scan, into report->grade, and sorts them into
 * report->kinds. safe: a share of safe length
 * for each fiber, or NULL. STATUS_NO_MEMORY, STATUS_DISK_FULL, STATUS_CANCELLED. */
status reconstruct_grade(const struct volume *v, const struct fiber_set *f, struct thread_pool *pool,
                         struct reconstruct_report *report, float *safe, struct error *err);
/* The input of scan_coverage_measure for fibers of this report. */
struct coverage_input reconstruct_coverage_input(const struct volume *v, const struct fiber_set *f,
                                                 const struct reconstruct_report *report);

/* Optional part of the step "fibers": scans a phantom of the fibers f with the noise (its strength and its correlation)
 * and the blur of the scan v, reconstructs it, and writes into report->trial how well f is found again. At most
 * SCAN_TRIAL_VOXELS from the middle of the scan are tried. report: as filled by reconstruct_fibers. The phantom's
 * fibers have the radii, sections and lumens that were measured along f (grade/trial_fibers.h); sections that are no
 * ellipses, such as beans, become ellipses. What cannot be reconstructed is no error: the trial then is not made. */
status reconstruct_trial(const struct volume *v, const struct fiber_set *f, const struct reconstruct_option *option,
                         struct thread_pool *pool, const struct progress *progress, struct reconstruct_report *report,
                         struct error *err);

/* Step "directions": voxels within 2r of a polyline get its tangent as direction (thesis 5.6.7). Then the density of
 * voxels in and beside fibers becomes the share of the voxel that they fill (line_densities.h), but for scans whose
 * grade is GRADE_UNRESOLVED. */
status reconstruct_transfer(const struct fiber_set *f, struct direction_volume *d, struct thread_pool *pool,
                            const struct progress *progress, struct reconstruct_report *report, struct error *err);

/* In place of that step: leaves directions and densities as the filter found them. The report states what the step
 * would have changed (direction_change_mean_deg, dice), and the noise of the filter's directions twice. */
status reconstruct_keep_directions(const struct fiber_set *f, struct direction_volume *d, struct thread_pool *pool,
                                   const struct progress *progress, struct reconstruct_report *report,
                                   struct error *err);

/* Send warnings about everything a user should know about the geometry that does not stop the job. They depend only on
 * the report, so a report read from its file gives the same warnings. f: the fibers in use. */
void reconstruct_warn_volume(const struct reconstruct_option *o, const struct reconstruct_report *r,
                             const struct warning_sink *warn);
void reconstruct_warn_fibers(const struct reconstruct_report *r, const struct fiber_set *f,
                             const struct warning_sink *warn);

/* Draws slice i_slice perpendicular to axis (0 x, 1 y, 2 z) in grey, with red crosses where fibers cross it. y or z
 * points up, x or y to the right. *rgb has 3 bytes per pixel, *width x *height pixels; the caller frees it.
 * STATUS_INVALID, STATUS_NO_MEMORY. */
status reconstruct_slice_picture(const struct volume *v, const struct fiber_set *f, int axis, size_t i_slice,
                                 uint8_t **rgb, size_t *width, size_t *height, struct error *err);

#endif
