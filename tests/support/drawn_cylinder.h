/* Pictures of a cloth on a cylinder, drawn by rays of a pinhole camera with vectors alone, as an oracle of
 * optimizer/photographs/cylinder. Places are in millimetres in the frame of cylinder_view.h. */
#ifndef SELVEDGE_TESTS_DRAWN_CYLINDER_H
#define SELVEDGE_TESTS_DRAWN_CYLINDER_H

#include "renderer/image/image.h"

#include <stdbool.h>

struct drawn_cylinder {
    double radius, light[3], eye[3], turn; /* turn: of the cloth about its normal, in radians */
    double px_per_mm, roll;                /* roll: of the camera about its axis */
    double background;
    size_t width, height;
    double (*sheet)(double x,
                    double y); /* light of a sheet in the plane z = 0, NaN where it has a hole; NULL: no sheet */
};

/* The place at a distance in the direction (theta, phi) from the orbit center. */
void drawn_cylinder_place(double theta_deg, double phi_deg, double distance, double out[3]);
/* Finds where the ray from the eye meets the cylinder. */
bool drawn_cylinder_meet(double radius, const double eye[3], const double d[3], double p[3]);
/* Radiance of the drawn cloth, which is brighter where the half vector lies along the weft. In: unit vectors. */
double drawn_cylinder_cloth(const double light[3], const double eye[3], const double normal[3], const double weft[3]);
/* Unit axes of the camera, which looks at the orbit center. */
void drawn_cylinder_axes(const struct drawn_cylinder *d, double forward[3], double right[3], double down[3]);
/* Makes the picture, whose green and blue are 0.8 and 0.6 of its red. The caller releases it. */
void drawn_cylinder_draw(const struct drawn_cylinder *d, struct image *im);

#endif
