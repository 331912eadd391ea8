/* Where the camera of a bowl's photographs is, from places on the bowl that are known in the picture, as the device of
 * the fiber-scattering thesis (4.6.3) has it: the model of the bowl is aligned with the photograph.
 *
 * Frame of the bowl, mm: the center of the sphere, x along the fiber, z up to the camera. Pixels: the upper left corner
 * of the picture is (0, 0). Pinhole: a place p is seen at center + focal (q_0 / q_2, q_1 / q_2), q = A (p - position).
 */
#ifndef SELVEDGE_OPTIMIZER_BOWL_CAMERA_H
#define SELVEDGE_OPTIMIZER_BOWL_CAMERA_H

#include "optimizer/photographs/camera/lens.h"

struct job_bowl;

struct bowl_camera {
    double position_mm[3], axis[3][3]; /* rows of A: to the right and down in the picture, and away from the camera */
    double focal_px, center_px[2];
    double rms_px; /* of the marks */
};

/* Fits the camera to the marks by damped Gauss-Newton steps, from a camera above the bowl; the focal length too where
 * the job does not state it. width, height: of the photographs. lens: its distortion is taken from the marks.
 * STATUS_INVALID with the field of the option at fault: marks that contradict each other by more than 1 % of the width,
 * which names the worst one; marks that do not determine the focal length within 5 %; a camera below the rim. */
status bowl_camera_fit(const struct job_bowl *bowl, const struct lens *lens, size_t width, size_t height,
                       struct bowl_camera *camera, struct error *err);
/* False for a place behind the camera. */
bool bowl_camera_project(const struct bowl_camera *camera, const double at_mm[3], double px[2]);
/* Unit direction that a point of the picture sees. */
void bowl_camera_ray(const struct bowl_camera *camera, const double px[2], double direction[3]);

#endif
