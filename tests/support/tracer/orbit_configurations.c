#include "tests/support/tracer/orbit_configurations.h"
#include "base/angle.h"

#include <math.h>

void orbit_configurations_16(struct configuration c[16])
{
    static const double theta_deg[4][2] = {{0, 30}, {30, 60}, {60, 30}, {64, 64}}; /* camera, light */
    for (int i = 0; i < 16; i++) {
        int pair = i % 4, rotated = i / 4 % 2, out_of_plane = i / 8;
        c[i] = (struct configuration){.light_theta_rad = theta_deg[pair][1] * RAD_PER_DEG,
                                      .light_phi_rad = (out_of_plane ? 90 : 180) * RAD_PER_DEG,
                                      .camera_theta_rad = theta_deg[pair][0] * RAD_PER_DEG,
                                      .camera_phi_rad = 0,
                                      .cloth_rotation_rad = rotated * M_PI / 2,
                                      .light_distance_m = 0.61,
                                      .lamp_side_m = 0.10,
                                      .camera_distance_m = 1.0,
                                      .crop_m = 0.01};
    }
}
