/* The place on the bowl that a pixel of a photograph sees, the direction in which the fiber lit it, and its radiance
 * over the fiber's radiance (fiber-scattering thesis, 4.6.1: a point sample of the scattered light).
 *
 * The lit part of the fiber, short against the radius R, has the radiance L(theta_o, phi) and shows the width D and the
 * length l cos theta_o. A place at the distance r, at which light arrives at the angle alpha from the normal, gets the
 * irradiance E = L D l cos theta_o cos alpha / r^2, and reflects rho E / pi to everywhere. So L is the pixel's value
 * times
 *
 *     r^2 / (R^2 cos alpha cos theta_o)                        up to a constant
 *
 * The thesis compares pixels with direct measurements that it divides by cos theta_o, and leaves out cos theta_o of the
 * bowl (equation 4.6), which is at least 0.9 in the part that it compares. A beam of fixed width lights a length of l /
 * cos theta_i, which is removed as well.
 *
 * Azimuths are measured about the fiber from +y, the rim, through the bowl: 90 degrees is its lowest point. */
#ifndef SELVEDGE_OPTIMIZER_BOWL_PLACE_H
#define SELVEDGE_OPTIMIZER_BOWL_PLACE_H

#include "optimizer/photographs/profile/bowl_camera.h"

struct bowl_place {
    double theta_o_rad, azimuth_rad;
    double factor; /* from a value to L; only where `counts` is true */
    double area;   /* of the bowl that the pixel sees, mm^2 times the square of the focal length in pixels */
    bool counts;   /* it gives a sample; others are of the rim */
};

/* False where the pixel does not see the inside of the bowl, or sees the fiber in front of it. */
bool bowl_place_at(const struct job_bowl *bowl, const struct bowl_camera *camera, const double px[2],
                   struct bowl_place *place);

#endif
