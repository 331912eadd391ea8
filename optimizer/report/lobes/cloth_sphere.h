/* A picture of a sphere that is wrapped in a cloth, from mean radiances of flat cloth. */
#ifndef SELVEDGE_OPTIMIZER_CLOTH_SPHERE_H
#define SELVEDGE_OPTIMIZER_CLOTH_SPHERE_H

#include "renderer/estimate/estimate.h"
#include "renderer/image/image.h"

struct sphere_request {
    struct radiance_input input;
    const struct configuration *row; /* lamp, distances and rotation; the camera counts for nothing */
    bool black_sheet;                /* no light comes through from behind */
    size_t px, n_path;               /* edge of the picture; paths of all places */
    uint64_t seed;
};

/* im: rgb, initialised here, 0 beside the sphere; released on failure. *noise: standard error of a place before places
 * are smoothed, as a root mean square over the mean radiance; NaN for a black sphere. Errors of estimate_run. */
status cloth_sphere_render(const struct sphere_request *q, struct thread_pool *pool, const struct progress *progress,
                           struct image *im, double *noise, struct error *err);

#endif
