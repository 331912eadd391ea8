/* Sections along lines with their errors, from the normal equations that the last round of a fit leaves
 * (axis_fit.h).
 *
 * Noise. The residuals of neighbouring voxels have a common part, from correlated noise or from details that the model
 * leaves out. It is in the gradients of single vertices, so their scatter is measured instead of counting voxels: sums
 * of gradients over pieces of a line have a variance of v times their information. Differences of order two (section:
 * pieces of half a diameter) and four (radius: pieces of a diameter) of neighbouring pieces give v without slow
 * variations. v is measured over all lines, or over a line itself where it is larger. The axes have a v of their own:
 * differences of order two of pieces of two diameters, because errors of the model at crossings and between touching
 * fibers are as long as that.
 *
 * Curvature. The weights of the fit fall with the residuals, so the gradient of a converged fit changes by less than
 * the N of the normal equations for a step of 1: by `slope` N, which stands for N below.
 *
 * Section. The fit has smoothed c and s (fiber_section.h) over one diameter by M = N + L D'D + hold. The covariance
 * of a smooth section is v M^-1 N M^-1, far from ends 3/4 v M^-1. A flatness of 0 is measured as more than 0, so the
 * variance of its component across is subtracted from its square.
 *
 * Radius. chi^2 of the radii of pieces of two diameters about the radius of the line says whether it varies. Where
 * it does, the radius follows the data by the same kind of equation.
 *
 * Lumen. The area of the lumen is measured like the radius, each from its gradient without the part that the other
 * explains. The width follows as the root of the area, so its error is a difference of roots: sqrt(a + e) - sqrt(a) for
 * an area a with the error e. Where that exceeds the standard deviation of widths that may be anything from 0 to 0.8,
 * the scan tells nothing, and width and error are 0. The variance has a part that all fibers share: density and blur of
 * the walls are not known beforehand, and walls that are thinner than the blur look like less dense ones.
 *
 * Errors of the model do not fall with the number of voxels, as noise does. With residuals e of weights w, and shared
 * variances C for a noise of 1, they shift a shared number by at most sqrt(C sum w e^2) (Cauchy and Schwarz). That is
 * added to the errors of the radii of all fibers and of the lumens, up to the standard deviation of any width. It is
 * small where lumens differ, which fixes the density of the walls, and dominates where they are alike. */
#ifndef SELVEDGE_GEOMETRY_SHAPE_MEASURE_H
#define SELVEDGE_GEOMETRY_SHAPE_MEASURE_H

#include "geometry/fibers/axes/axis_solve.h"
#include "geometry/fibers/axes/model/axis_lumen.h"
#include "geometry/fibers/axes/model/fiber_section.h"
#include "geometry/fibers/polyline.h"

/* The sums that the last round leaves. */
struct shape_sums {
    const struct axis_equation
        *equation; /* of each vertex; radius_normal and radius_gradient are of the segment after it */
    const struct section_equation *section; /* of each vertex */
    const struct fiber_section *sections;   /* as fitted */
    const struct lumen_equation *lumen;     /* of each vertex: of the segment after it; NULL: solid fibers */
    const float *area;                      /* of the lumen of each line, as fitted */
    double shared_area, shared_radius;      /* variances of a change of all areas, or of all radii, for a noise of 1 */
    double model_square; /* largest variance of a shared number by errors of the model, over the same; 0: none */
    double diameter, section_length, section_hold;
    double slope; /* share of N in the true curvature (axis_mean_slope) */
};

struct shape_measure {
    size_t n_varying; /* lines whose radius varies */
    size_t n_varying_lumen;
    double radius_noise, section_noise, lumen_noise, axis_noise; /* v, per (voxel density)^2 */
    double shared_radius_se;                                     /* voxels, of a change of all radii together */
};

/* Writes lines->shape, which is made first if it is NULL. Where the set has one, its radii are those that the gradients
 * belong to. STATUS_NO_MEMORY. */
status fiber_shapes_measure(struct polyline_set *lines, const struct shape_sums *sums, struct shape_measure *measure,
                            struct error *err);

#endif
