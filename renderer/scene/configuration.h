/* One geometric configuration of lamp, camera and cloth: what a photograph was taken under. Fields that a caller leaves
 * zero below the crop mean a square lamp, no other light and a perspective camera.
 *
 * World frame: the orbit centre is the origin on the cloth's top surface, z the cloth normal, +x the weft at rotation
 * 0. theta is measured from the normal, phi from +x towards +y. Turning the cloth by cloth_rotation_rad turns it about
 * z, counter- clockwise seen from the camera side, under fixed lamp and camera.
 *
 * Radiance unit everywhere in Selvedge: the lamp is scaled so that a perfect white diffuser at the orbit centre FACING
 * the lamp would have radiance 1 (irradiance pi from a lamp at the same distance). Environments are plain radiance in
 * that unit.
 */
#ifndef SELVEDGE_RENDERER_CONFIGURATION_H
#define SELVEDGE_RENDERER_CONFIGURATION_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

struct environment; /* renderer/transport/environment.h */

enum configuration_light {
    LIGHT_SQUARE_LAMP = 0,
    LIGHT_DIRECTIONAL, /* parallel light from (light_theta, light_phi) with irradiance pi; no distance, no side */
    LIGHT_GAUSSIAN,    /* from around (light_theta, light_phi), infinitely far: a spherical Gaussian of light_sharpness,
                          with irradiance pi on a surface that faces it; no distance, no side */
    LIGHT_NO_LAMP      /* only the environment, if any */
};

enum {
    CONFIGURATION_MAX_CELLS = 32,
    CONFIGURATION_MAX_COUNT = 4096, /* of one estimate: so many have random numbers of their own; a mean over rotations
                                       counts as many times as it has rotations */
    CONFIGURATION_ALL_ROTATIONS =
        9 /* n_rotation of a measurement that is a mean over all: odd, so that a weave, which looks nearly
                                       the same after a quarter turn, is seen every 10 degrees */
};

enum configuration_camera {
    CAMERA_PERSPECTIVE = 0,
    CAMERA_FAR_FIELD /* orthographic: every ray runs along the view direction; no distance */
};

struct configuration {
    double light_theta_rad,
        light_phi_rad; /* light_theta in [0, pi/2) or, with no black sheet, (pi/2, pi] for back light */
    double camera_theta_rad, camera_phi_rad; /* camera_theta in [0, pi/2) */
    double cloth_rotation_rad;
    double light_distance_m;  /* 0.61 in the thesis: orbit centre to lamp centre */
    double lamp_side_m;       /* 0.10: square lamp, facing the orbit centre, one edge horizontal */
    double camera_distance_m; /* perspective camera; default 1.0 */
    double crop_m; /* 0.01: edge of the square crop, measured at the orbit centre perpendicular to the view */

    double blur_m;      /* standard deviation of the camera's Gaussian blur, measured like crop_m; 0: a sharp camera */
    double aperture_m;  /* diameter of a thin lens in the place of the perspective camera; 0: everything is sharp */
    double focus_m;     /* distance from the lens of the plane that is sharp; 0: the orbit centre lies in it */
    double crop_aspect; /* width over height of the crop, whose width is crop_m; 0: 1 */
    double environment_rgb[3];             /* radiance of a constant environment, besides the lamp; 0: none */
    const struct environment *environment; /* an image around the scene, fixed to the world (not turned with the cloth),
                                              besides the lamp; not owned; NULL: none */
    bool unseen_lights; /* camera rays that miss the cloth meet neither lamp nor environment: they see 0 */
    enum configuration_light light;
    double light_sharpness; /* of LIGHT_GAUSSIAN: radiance falls as exp(sharpness (cos - 1)); 1 to 100,000 */
    enum configuration_camera camera;
    uint32_t contrast_cells; /* 0: estimates are of the crop's mean radiance; 2 or more: of the contrast between so many
                                equal parts of the crop a side (transport/estimate/contrast_blocks.h) */
    uint32_t n_rotation; /* 0 or 1: the cloth lies at cloth_rotation_rad; more: estimates are of the mean over so many
                                rotations, equally spaced from there on (rotation_mean.h; pictures show the first) */
};

/* For messages, in degrees: "lamp 45/0, camera 45/180, cloth turned by 90". */
enum { CONFIGURATION_TEXT = 128 };
void configuration_describe(const struct configuration *c, char text[CONFIGURATION_TEXT]);

/* STATUS_INVALID for more than CONFIGURATION_MAX_COUNT configurations (field "n_configuration"), and for one whose
 * angles, distances or lights make no sense (field "configuration"). */
status configuration_check(const struct configuration *c, size_t n, struct error *err);

#endif
