/* One geometric configuration of lamp, camera and cloth: what a photograph was taken under.
 *
 * World frame: the orbit centre is the origin on the cloth's top surface, z the cloth normal, +x the weft at rotation
 * 0. theta is measured from the normal, phi from +x towards +y. Turning the cloth by cloth_rotation_rad turns it about
 * z, counter- clockwise seen from the camera side, under fixed lamp and camera.
 *
 * Radiance unit everywhere in Selvedge: the lamp is scaled so that a perfect white diffuser at the orbit centre FACING
 * the lamp would have radiance 1 (irradiance pi from a lamp at the same distance).
 */
#ifndef SELVEDGE_RENDERER_CONFIGURATION_H
#define SELVEDGE_RENDERER_CONFIGURATION_H

struct configuration {
    double light_theta_rad,
        light_phi_rad; /* light_theta in [0, pi/2) or, with no black sheet, (pi/2, pi] for back light */
    double camera_theta_rad, camera_phi_rad; /* camera_theta in [0, pi/2) */
    double cloth_rotation_rad;
    double light_distance_m;  /* 0.61 in the thesis: orbit centre to lamp centre */
    double lamp_side_m;       /* 0.10: square lamp, facing the orbit centre, one edge horizontal */
    double camera_distance_m; /* perspective camera; default 1.0 */
    double crop_m; /* 0.01: edge of the square crop, measured at the orbit centre perpendicular to the view */
};

#endif
