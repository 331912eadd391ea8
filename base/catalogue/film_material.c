#include "base/catalogue/film_material.h"

#include <string.h>

/* Reflectance at normal incidence of evaporated metals at 630, 532 and 465 nm, from their complex index n + ik:
 * ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2). Indices after Palik 1985, "Handbook of Optical Constants of Solids". */
static const struct {
    const char *name;
    float color[3];
} metal[] = {{"silver", {0.971f, 0.959f, 0.914f}},
             {"gold", {0.955f, 0.714f, 0.313f}},
             {"copper", {0.955f, 0.637f, 0.538f}},
             {"aluminium", {0.912f, 0.914f, 0.920f}},
             {"steel", {0.550f, 0.540f, 0.535f}}};
enum { N_METAL = sizeof metal / sizeof metal[0] };

const char *const film_metal_names[] = {"silver", "gold", "copper", "aluminium", "steel", NULL};

const char *const film_surface_names[] = {"smooth", "noise", "brushed", "scratches", "flakes", NULL};

const char *const film_optics_names[] = {"rays", "ohs", "ghs", "r_ohs", "r_ghs", "kirchhoff", NULL};

bool film_metal_color(const char *name, float color[3])
{
    for (size_t i = 0; i < N_METAL; i++)
        if (strcmp(metal[i].name, name) == 0) {
            memcpy(color, metal[i].color, sizeof metal[i].color);
            return true;
        }
    return false;
}
