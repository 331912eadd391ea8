/* Fits the numbers of a surface model to the radiances of a target, so that the mean over the maps of a texture set
 * comes nearest to them. Programs interpolate between the pixels of maps, and so does this fit: normals between pixels
 * are flatter than normals at pixels. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_FIT_H
#define SELVEDGE_OPTIMIZER_TEXTURE_FIT_H

#include "optimizer/report/textures/least_squares.h"
#include "optimizer/report/textures/texture_maps.h"
#include "optimizer/report/textures/texture_target.h"

#include <stdbool.h>

enum { TEXTURE_MAX_UNKNOWN = LEAST_SQUARES_MAX_UNKNOWN };

/* A place between the pixels. tangent: across the fibers, where the surface is rougher; root_spread: square root of
 * the map of spreads. */
struct texture_sample {
    double tangent[3], bitangent[3], normal[3];
    double root_spread, coherence;
    double share[3]; /* brightness of the surface under even light, over the mean of the map */
    double opacity;  /* 1 without cut_out */
};

struct texture_model {
    size_t n_unknown, n_start;
    const double *lower, *upper;                /* n_unknown each */
    const double (*start)[TEXTURE_MAX_UNKNOWN]; /* n_start points from which the search begins */
    /* Sets the numbers. */
    void (*take)(void *surface, const double *x);
    /* Called for each direction to the camera, before the samples are. */
    void (*look)(void *surface, const double wo[3]);
    /* Radiance of a sample for a lamp of irradiance pi. */
    void (*reflect)(const void *surface, const struct texture_sample *s, const double wi[3], const double wo[3],
                    double rgb[3]);
    /* Factor on the slopes of the map of normals; NULL: 1. */
    double (*normal_scale)(const void *surface);
    bool has_afar; /* fitted from afar, too, where programs see the mean of each map: its flat normal */
};

/* Reflected and transmitted shares of even light, means over the maps. */
struct texture_means {
    double albedo[3], transmission[3];
};

/* Distance of the radiances of a surface from the target: differences over the mean of the target's channels,
 * or over 0.02 where that is darker, as errors of fits (optimizer/fit/objective/objective.h). Root mean squares; NaN
 * where there is nothing to compare. */
struct texture_error {
    double rel_rms, heldout_rel_rms; /* over the fitted and the held-out rows of the job */
    double row_rel_rms;              /* over both */
    double hemisphere_rel_rms;       /* over directions of the hemisphere that were not fitted */
    double afar_rel_rms;             /* over all rows, with the means of the maps */
    double *row_rel_error;           /* of each row of the job; owned */
};

/* The place in the middle of pixel i, with slopes of the normal times normal_scale. */
struct texture_sample texture_pixel_sample(const struct texture_maps *maps, size_t i, double normal_scale);

/* Leaves the best numbers in the surface, and fills *error. STATUS_NO_MEMORY. */
status texture_fit_run(const struct texture_model *model, void *surface, const struct texture_maps *maps,
                       const struct texture_means *means, const struct texture_target *target,
                       struct texture_error *error, struct error *err);
void texture_error_release(struct texture_error *error);

#endif
