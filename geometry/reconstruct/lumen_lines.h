/* Whether the fibers of a scan are hollow, by lines that are traced in a part of it.
 *
 * Enclosed void that was filled looks like lumens where fibers touch, cross or are tilted, because the gaps between
 * them are enclosed too (lumen_evidence.h). Lines tell them apart. The axis of a hollow fiber runs through its lumen,
 * which is darker than the wall on all sides of it. The axis of a solid fiber is its densest place, and lines that run
 * through gaps have little of the mass. */
#ifndef SELVEDGE_GEOMETRY_LUMEN_LINES_H
#define SELVEDGE_GEOMETRY_LUMEN_LINES_H

#include "base/thread_pool.h"
#include "geometry/grade/reconstruct_report.h"
#include "geometry/volume/volume.h"

/* Traces lines in the fullest box of a volume whose enclosed void was filled. Sets e->hollow_share to the share of
 * their mass (length times square of the radius) that has a dark axis in the scan before it was filled, and
 * e->radius_spread. Both are NaN if no lines were found. diameter_voxel: of the fibers in v; report: of the steps
 * before. STATUS_CANCELLED, STATUS_NO_MEMORY; with a scratch space also STATUS_DISK_FULL. */
status lumen_lines_measure(const struct volume *v, double diameter_voxel, struct thread_pool *pool,
                           const struct reconstruct_report *report, struct lumen_evidence *e, struct error *err);

#endif
