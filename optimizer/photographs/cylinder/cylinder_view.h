/* The geometry of one photograph of a cloth on a cylinder: the angles that each column of the picture is lit and seen
 * at (fabric thesis, section 7.1; figures 5.22 to 5.24 have such photographs).
 *
 * Frame, in millimetres: the axis is parallel to y, the highest line of the cloth's outer side passes through the
 * orbit center (0, 0, 0), so the axis lies at z = -radius. The place at the angle a around the axis is
 * radius (sin a, 0, cos a - 1); its local frame is x' = (cos a, 0, -sin a), y, and the normal (sin a, 0, cos a). At
 * cloth_rotation 0 the weft runs along x', around the cylinder; at 90 it runs along the axis.
 *
 * Across the picture, s goes from -1 at the silhouette on the side of -x to +1 at the one on the side of +x. With D,
 * the distance of the camera from the axis in the plane across it, a ray at the angle beta from the axis meets the
 * cloth at the angle d from the camera's azimuth around the axis:
 *
 *   tan beta = s tan asin(radius / D),   radius sin(d + beta) = D sin beta.
 *
 * For a far-field camera, sin d = s. The picture's plane is perpendicular to the line from the camera to the orbit
 * center within some degrees, which changes s by less than the square of that angle. A cylinder is convex: no column
 * lies in the shadow of another. */
#ifndef SELVEDGE_OPTIMIZER_CYLINDER_VIEW_H
#define SELVEDGE_OPTIMIZER_CYLINDER_VIEW_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

/* A lamp or camera by its direction from the orbit center. */
struct cylinder_station {
    bool far; /* parallel light or parallel projection: no distance */
    double theta_rad, phi_rad, distance_mm;
};

struct cylinder_view {
    double radius_mm;
    struct cylinder_station light, camera;
    /* by cylinder_view_init: */
    double camera_azimuth_rad; /* around the axis, from +z towards +x */
    double axis_distance_mm;   /* D; infinite for a far-field camera */
    double edge_rad;           /* angle of the silhouettes from the camera's azimuth */
};

/* The angles of one place as a row of a fit has them, in the local frame. */
struct cylinder_angles {
    double light_theta_rad, light_phi_rad, light_distance_mm;
    double camera_theta_rad, camera_phi_rad, camera_distance_mm;
    double
        lamp_cos; /* cosine between the lamp's normal, which faces the orbit center, and the direction to the place */
};

/* Fills in the members that follow from the others. STATUS_INVALID for a camera or lamp that is nearer to the axis than
 * 1.2 radii. */
status cylinder_view_init(struct cylinder_view *v, struct error *err);
/* Where the place at the angle a_rad shows across the picture; at the silhouettes and beyond them -1 or 1. */
double cylinder_view_s(const struct cylinder_view *v, double a_rad);
/* The inverse, of s in [-1, 1]. */
double cylinder_view_angle(const struct cylinder_view *v, double s);
/* Mean over the pixels between s0 and s1 of the angle around the axis, with the weights of a column: 0 at its edges,
 * rising linearly to the middle (photograph.h). */
double cylinder_view_mean_angle(const struct cylinder_view *v, double s0, double s1);
/* The angles of the place at a_rad that shows at the height of the orbit center in the picture. */
void cylinder_view_angles(const struct cylinder_view *v, double a_rad, struct cylinder_angles *out);
/* Pixels that a millimetre along the axis has at the orbit center, when the silhouettes are width_px apart. */
double cylinder_view_px_per_mm(const struct cylinder_view *v, double width_px);
/* Pixels between the silhouettes by the focal length of the lens, whose axis points to the orbit center. The camera is
 * not a far-field one. */
double cylinder_view_width_px(const struct cylinder_view *v, double focal_px);

#endif
