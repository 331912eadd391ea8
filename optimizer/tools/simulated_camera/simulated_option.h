/* The options of a simulated camera (simulated_camera.h). */
#ifndef SELVEDGE_OPTIMIZER_SIMULATED_OPTION_H
#define SELVEDGE_OPTIMIZER_SIMULATED_OPTION_H

#include "base/status.h"
#include "optimizer/tools/simulated_camera/sensor.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { SIMULATED_EXPOSURES = 3, SIMULATED_DARK = 8, SIMULATED_FLAT = 6 };

struct simulated_camera_option {
    const char *source;                     /* folder with photographs.json, truth.json and the renderings */
    const char *folder;                     /* created when it does not exist */
    size_t size_px[2];                      /* of the picture in cells of 2 x 2 photosites */
    double px_per_mm;                       /* such cells, at the orbit center */
    double crop_cm;                         /* of the job; the renderings show more */
    double exposure_s[SIMULATED_EXPOSURES]; /* from the shortest on */
    double exposure_error; /* true times are longer by this share for the first, third.. of exposure_s, else shorter */
    double chart_fall;     /* light at one end of the chart's length is less by this share than at the other */
    double chart_fall_phi_deg; /* direction from the dark end to the bright one */
    double chart_exposure_s, chart_light_theta_deg, chart_camera_theta_deg, chart_camera_phi_deg;
    double aim_mm;             /* largest distance by which the camera looks past the orbit center */
    bool cameras_from_markers; /* the rig does not say where the camera was */
    uint64_t seed;
    struct sensor sensor;
};

#endif
