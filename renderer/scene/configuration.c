#include "renderer/scene/configuration.h"

#include <math.h>
#include <stdio.h>

void configuration_describe(const struct configuration *c, char text[CONFIGURATION_TEXT])
{
    const double degree = 180.0 / M_PI;
    int n = c->light == LIGHT_NO_LAMP ? snprintf(text, CONFIGURATION_TEXT, "no lamp")
                                      : snprintf(text, CONFIGURATION_TEXT, "lamp %.4g/%.4g",
                                                 degree * c->light_theta_rad, degree * c->light_phi_rad);
    snprintf(text + n, CONFIGURATION_TEXT - (size_t)n, ", camera %.4g/%.4g, cloth turned by %.4g",
             degree * c->camera_theta_rad, degree * c->camera_phi_rad, degree * c->cloth_rotation_rad);
}
