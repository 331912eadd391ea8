#include "geometry/filter/filter_choice.h"
#include "base/option_id.h"
#include "geometry/volume/density_map.h"

#include <math.h>

double filter_solid_j(double s, double t, size_t h) { return (-2.0 * M_PI / s + M_PI / t) * (double)h; }

/* J over J of solid material is 0.9 on axes of fibers, 0.5 on axes of thin and blurred fibers, and below 0.2 for noise
 * in void. */
static const double EPS_J_SHARE = 0.35;

/* s times the squared radius in voxels: over the six fabrics of thesis Table 5.2 it is between 0.7 and 11, with a
 * geometric mean of about 4. Fibers so thin that voxels are interpolated have no valley to their neighbours, so that a
 * filter as wide as the fiber sees a row of touching fibers as one; they need the narrowest. */
static const double USUAL_S = 4.0, THIN_S = 11.0;

/* In strongly blurred scans fibers have no valley to their neighbours either: the filter is for this share of the
 * diameter, in width and length. */
static const double BLURRED_SHARE = 0.6;

static double s_of(double share, double diameter_voxel)
{
    const double radius = 0.5 * diameter_voxel;
    return fmin(2.0, share / (radius * radius));
}

void filter_choose_thin(struct reconstruct_option *o, double diameter_voxel)
{
    if (isnan(o->s)) o->s = s_of(THIN_S, diameter_voxel);
}

/* Edge of the filter's cube for a diameter in voxels: a line must be some diameters long, because a shorter one fits
 * into a fiber in many directions. */
static size_t length_of(double diameter_voxel)
{
    const size_t h = 2 * (size_t)lrint(1.4 * diameter_voxel) + 1;
    return h < 9 ? 9 : h > 41 ? 41 : h;
}

void filter_choose_blurred(struct reconstruct_option *o, double diameter_voxel)
{
    if (isnan(o->s)) o->s = s_of(USUAL_S, BLURRED_SHARE * diameter_voxel);
    if (o->h == 0) o->h = length_of(BLURRED_SHARE * diameter_voxel);
}

/* For most of the fabrics of Table 5.2 t is twice s. h is about 2.8 diameters. */
void filter_choose(struct reconstruct_option *o, const struct volume *v, double diameter_voxel)
{
    struct density_modes modes;
    if (isnan(o->s)) o->s = s_of(USUAL_S, diameter_voxel);
    if (isnan(o->t)) o->t = 2.0 * o->s;
    if (o->h == 0) o->h = length_of(diameter_voxel);
    if (isnan(o->eps_d)) /* half way between the modes of void and of material */
        o->eps_d = density_modes_find(v, &modes, NULL) == STATUS_OK ? fmin(0.6, fmax(0.25, modes.half)) : 0.5;
    if (isnan(o->eps_j)) o->eps_j = EPS_J_SHARE * filter_solid_j(o->s, o->t, o->h);
}

status filter_check(const struct reconstruct_option *o, struct error *err)
{
    if (o->t > 0.5 * o->s) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, OPTION_FILTER_T,
                           "cannot find fibers: the direction filter's t, %g, must be above half of its s, %g", o->t,
                           o->s);
}
