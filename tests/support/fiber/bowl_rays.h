/* Photographs of a bowl into which a single fiber scatters, by rays: what the camera of the device of the
 * fiber-scattering thesis (4.6) would take. It shares no formula with optimizer/photographs/profile: the camera looks
 * at a point, pixels have an area, the lit part of the fiber has a length, and light that the bowl throws onto itself
 * follows paths of matte reflections until they leave or end by chance.
 *
 * Lengths in mm, the center of the sphere is the origin, the fiber runs along x, z is up. */
#ifndef SELVEDGE_TESTS_BOWL_RAYS_H
#define SELVEDGE_TESTS_BOWL_RAYS_H

#include "renderer/image/image.h"
#include "renderer/scattering/scattering.h"

#include <stdbool.h>

struct bowl_device {
    double radius, height, reflectance;
    double fiber[3], lit_length; /* middle of the lit part, and its length at normal incidence */
    double lamp[3];              /* unit direction to the lamp */
    double camera[3], look_at[3], turn_rad, focal_px;
    size_t width, picture_height;
    const struct scattering_model *model;
    const struct scattering_state *state;
    double strength; /* width of the fiber times the lit length at normal incidence, mm^2, per irradiance */
    double
        background;   /* radiance of the bowl without the fiber in the middle of the picture; twice that at the right */
    double noise;     /* standard deviation of a pixel, additive */
    unsigned samples; /* of a pixel */
};

/* Renders rgb. with_fiber: false gives the background alone. */
status bowl_rays_photograph(const struct bowl_device *device, bool with_fiber, unsigned seed, struct image *im);
/* Where a place is seen. */
void bowl_rays_project(const struct bowl_device *device, const double at[3], double px[2]);

#endif
