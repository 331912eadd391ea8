#include "optimizer/report/export/cloth_directions.h"

#include <math.h>

static const double most_theta_rad = 75.0 * M_PI / 180.0, ratio = 1.1673039782614187;

void cloth_directions_make(const double tile_m[2], struct configuration c[CLOTH_N_DIRECTION])
{
    const double most = sin(most_theta_rad);
    for (int i = 0; i < CLOTH_N_DIRECTION; i++) {
        double u[4];
        for (int k = 0; k < 4; k++) u[k] = fmod(0.5 + (i + 1) / pow(ratio, k + 1), 1.0);
        c[i] = (struct configuration){.light = LIGHT_DIRECTIONAL,
                                      .light_theta_rad = asin(sqrt(u[0]) * most),
                                      .light_phi_rad = 2.0 * M_PI * u[1],
                                      .camera = CAMERA_FAR_FIELD,
                                      .camera_theta_rad = asin(sqrt(u[2]) * most),
                                      .camera_phi_rad = 2.0 * M_PI * u[3],
                                      .light_distance_m = 1.0,
                                      .lamp_side_m = 0.1,
                                      .camera_distance_m = 1.0,
                                      .crop_m = tile_m[0],
                                      .crop_aspect = tile_m[0] / tile_m[1]};
    }
}
