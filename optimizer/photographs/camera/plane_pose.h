/* The map from a plane to a picture by points that are known in both, and the camera's place that follows from it. */
#ifndef SELVEDGE_OPTIMIZER_PLANE_POSE_H
#define SELVEDGE_OPTIMIZER_PLANE_POSE_H

#include "base/status.h"

#include <stddef.h>

/* Projective map (row-major 3 x 3) from (x, y) of the plane to pixels through n >= 4 points, by the normalised direct
 * linear transform (Hartley and Zisserman 2004, 4.4). *rms_px: root mean square distance that is left. STATUS_NUMERIC
 * when the points lie on a line. */
status plane_map_fit(size_t n, const double (*plane)[2], const double (*pixel)[2], double map[9], double *rms_px,
                     struct error *err);
void plane_map_apply(const double map[9], const double plane[2], double pixel[2]);
/* Pixels per unit of the plane at a point, in the direction that is not foreshortened. */
double plane_map_scale(const double map[9], const double plane[2]);
/* The camera's center in the frame of the plane (z towards the camera) from the map and the lens' focal lengths and
 * center. STATUS_INVALID for a mirrored plane. */
status plane_map_camera(const double map[9], const double focal_px[2], const double center_px[2], double camera[3],
                        struct error *err);
/* Where a point (x, y, z) in the frame of the plane shows, by the same map and lens. STATUS_INVALID for a mirrored
 * plane and for a point behind the camera. */
status plane_map_project(const double map[9], const double focal_px[2], const double center_px[2],
                         const double point[3], double pixel[2], struct error *err);

#endif
