#include "renderer/scene/configuration.h"
#include "base/angle.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>

void configuration_describe(const struct configuration *c, char text[CONFIGURATION_TEXT])
{
    const double degree = DEG_PER_RAD;
    int n = c->light == LIGHT_NO_LAMP ? snprintf(text, CONFIGURATION_TEXT, "no lamp")
                                      : snprintf(text, CONFIGURATION_TEXT, "lamp %.4g/%.4g",
                                                 degree * c->light_theta_rad, degree * c->light_phi_rad);
    snprintf(text + n, CONFIGURATION_TEXT - (size_t)n, ", camera %.4g/%.4g, cloth turned by %.4g",
             degree * c->camera_theta_rad, degree * c->camera_phi_rad, degree * c->cloth_rotation_rad);
}

static bool lights_make_sense(const struct configuration *c)
{
    bool lamp = c->light != LIGHT_SQUARE_LAMP || (c->light_distance_m > 0 && c->lamp_side_m > 0);
    bool environment = true;
    if (c->light == LIGHT_GAUSSIAN) lamp = c->light_sharpness >= 1 && c->light_sharpness <= 1e5;
    for (int k = 0; k < 3; k++) environment &= c->environment_rgb[k] >= 0 && isfinite(c->environment_rgb[k]);
    return lamp && environment && c->light <= LIGHT_NO_LAMP;
}

static bool camera_makes_sense(const struct configuration *c)
{
    return c->camera_theta_rad >= 0 && c->camera_theta_rad < M_PI_2 && c->camera <= CAMERA_FAR_FIELD &&
           (c->camera == CAMERA_FAR_FIELD || c->camera_distance_m > 0) && c->crop_m > 0 && c->blur_m >= 0 &&
           c->aperture_m >= 0 && c->focus_m >= 0 && (c->aperture_m == 0 || c->camera != CAMERA_FAR_FIELD) &&
           c->crop_aspect >= 0 && isfinite(c->crop_aspect) && c->contrast_cells != 1 &&
           c->contrast_cells <= CONFIGURATION_MAX_CELLS;
}

status configuration_check(const struct configuration *c, size_t n, struct error *err)
{
    if (n > CONFIGURATION_MAX_COUNT)
        return error_set_field(err, STATUS_INVALID, "n_configuration",
                               "cannot estimate %zu configurations: at most %d have random numbers of their own", n,
                               CONFIGURATION_MAX_COUNT);
    for (size_t i = 0; i < n; i++) {
        double sum = c[i].light_theta_rad + c[i].light_phi_rad + c[i].camera_theta_rad + c[i].camera_phi_rad +
                     c[i].cloth_rotation_rad;
        if (!isfinite(sum) || !lights_make_sense(&c[i]) || !camera_makes_sense(&c[i]))
            return error_set_field(err, STATUS_INVALID, "configuration",
                                   "cannot estimate configuration %zu: angles, distances or lights make no sense", i);
    }
    return STATUS_OK;
}
