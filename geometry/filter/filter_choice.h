/* The parameters of the line filter (line_filter.h) where the job does not give them. */
#ifndef SELVEDGE_GEOMETRY_FILTER_CHOICE_H
#define SELVEDGE_GEOMETRY_FILTER_CHOICE_H

#include "base/progress.h"
#include "base/thread_pool.h"
#include "geometry/grade/reconstruct_option.h"
#include "geometry/volume/volume.h"

/* J of solid material, a block of density 1. */
double filter_solid_j(double s, double t, size_t h);
/* Fills in s where it is not given, for fibers so thin that they are found in an interpolated volume (trace_grid.h);
 * filter_choose does the rest. */
void filter_choose_thin(struct reconstruct_option *o, double diameter_voxel);
/* Chooses s and h for fibers of a strongly blurred scan, unless they are given. */
void filter_choose_blurred(struct reconstruct_option *o, double diameter_voxel);
/* Fills in the options s, t, h, eps_d and eps_j that are not given (NaN; h: 0), from the fiber diameter and the
 * volume. */
void filter_choose(struct reconstruct_option *o, const struct volume *v, double diameter_voxel);
/* STATUS_INVALID unless t > s / 2: only then is J of solid material below J of void, which is 0. A job may give one of
 * the two, and the other is then chosen. */
status filter_check(const struct reconstruct_option *o, struct error *err);

#endif
