#include "base/catalogue/film_material.h"

#include <math.h>
#include <string.h>

/* Brushed films have waves that are longer along the film by this factor, up to the tile. */
#define BRUSHED_RATIO 12.0
#define WAVE_TILE_UM 1024.0

void film_waves_of(const struct film_material *m, struct film_waves *w)
{
    const double grain = fmin(fmax((double)m->grain_um, FILM_LEAST_WAVE_GRAIN_UM), FILM_MOST_WAVE_GRAIN_UM),
                 slope = fmin((double)m->roughness, FILM_MOST_SLOPE),
                 along = m->surface == FILM_BRUSHED ? fmin(BRUSHED_RATIO * grain, WAVE_TILE_UM) : grain;
    *w = (struct film_waves){.rms_um = slope / (M_SQRT2 * hypot(1 / along, 1 / grain)), .length_um = {along, grain}};
    if (m->surface != FILM_SCRATCHES) return;
    w->rms_um *= 0.5;
    w->scratch_width_um = fmax(grain / 6, 1.5);
    w->scratch_depth_um = slope * w->scratch_width_um;
}

bool film_waves_are_low(const struct film_waves *w)
{
    return w->rms_um <= FILM_MOST_WAVE_HEIGHT_UM && w->scratch_depth_um <= FILM_MOST_WAVE_HEIGHT_UM;
}

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
