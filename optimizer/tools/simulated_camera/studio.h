/* The scene before a simulated camera, as a function of the ray: a piece of cloth that has been rendered, in the middle
 * of a white sheet with square markers, or a ColorChecker on its dark board.
 *
 * Frame: the frame of the cloth at rest, millimetres from the orbit center: x along the weft, y along the warp, z up.
 * The rendering shows the square of its crop about the orbit center, perpendicular to the view
 * (renderer/transport/camera.h); around it the cloth continues as its mirror image. Sheet and chart are Lambert
 * reflectors under the lamp. Markers and chart do not cast shadows. */
#ifndef SELVEDGE_OPTIMIZER_STUDIO_H
#define SELVEDGE_OPTIMIZER_STUDIO_H

#include "base/status.h"
#include "optimizer/photographs/camera/marker_board.h"
#include "renderer/image/image.h"

#include <stdbool.h>
#include <stdint.h>

enum { STUDIO_MARKER_PX = 60 };

struct studio {
    struct marker_board board;
    double cloth_half_mm;                                            /* half the edge of the piece of cloth */
    uint8_t marker[MARKER_MAX][STUDIO_MARKER_PX * STUDIO_MARKER_PX]; /* drawings of the board's markers */
    double chart_mm_per_unit, chart_turn_rad;                        /* a patch has an edge of 2.5 units */
    double chart_fall, chart_fall_phi_rad; /* simulated_option.h; the middle has the light of even lamps */
};

/* A camera that looks past the orbit center by aim_mm, measured there along its right and its lower edge. */
struct studio_camera {
    double eye_mm[3], forward[3], right[3], down[3]; /* axes of the camera */
    double crop_right[3], crop_up[3];                /* of the rendering */
};

/* One picture: cloth, or a chart in its place (cloth NULL). */
struct studio_scene {
    const struct studio *studio;
    const struct image *cloth;
    double cloth_crop_mm; /* edge of the rendered area */
    double cos_light;     /* of the lamp's angle from the normal */
};

/* Four markers in the corners of the sheet, which no view of the builtin table hides. STATUS_NO_MEMORY. */
status studio_init(struct studio *s, struct error *err);
void studio_camera_init(struct studio_camera *c, double theta_rad, double phi_rad, double distance_mm,
                        const double aim_mm[2]);
/* Radiance that comes along the ray from the camera's eye; d need not be a unit vector. */
void studio_radiance(const struct studio_scene *k, const struct studio_camera *c, const double d[3], double rgb[3]);

#endif
