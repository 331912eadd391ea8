/* Fits the numbers of a surface model to the renderings of the fitted rows, so that the mean over the maps of a texture
 * set comes nearest to them. Programs interpolate between the pixels of maps, and so does this fit: normals between
 * pixels are flatter than normals at pixels. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_FIT_H
#define SELVEDGE_OPTIMIZER_TEXTURE_FIT_H

#include "optimizer/report/findings/report.h"
#include "optimizer/report/textures/texture_maps.h"

enum { TEXTURE_MAX_UNKNOWN = 9 };

/* A place between the pixels. tangent: across the fibers, where the surface is rougher; root_spread: square root of
 * the map of spreads. */
struct texture_sample {
    double tangent[3], bitangent[3], normal[3];
    double root_spread, coherence;
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
};

/* Reflected and transmitted shares of even light, means over the maps. */
struct texture_means {
    double albedo[3], transmission[3];
};

/* Leaves the best numbers in the surface. The errors are those over the fitted and over the held-out rows, relative
 * RMS in the measure of fits; NaN without such rows. STATUS_NO_MEMORY. */
status texture_fit_run(const struct texture_model *model, void *surface, const struct texture_maps *maps,
                       const struct texture_means *means, const struct report *report,
                       const struct pipeline_model *rendered, double rel_rms[2], struct error *err);

#endif
