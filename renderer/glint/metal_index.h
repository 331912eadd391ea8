/* Complex index of refraction of metals, and the reflectance that follows from it.
 *
 * Sources: silver, gold and copper from Johnson and Christy 1972, "Optical Constants of the Noble Metals"; aluminium
 * from Smith, Shiles and Inokuti 1985, as in the CRC Handbook. Both at photon energies, between which the index is
 * interpolated linearly. */
#ifndef SELVEDGE_RENDERER_METAL_INDEX_H
#define SELVEDGE_RENDERER_METAL_INDEX_H

#include <stdbool.h>

enum metal { METAL_SILVER, METAL_GOLD, METAL_COPPER, METAL_ALUMINIUM, METAL_N };

/* "silver", "gold", "copper", "aluminium" */
const char *metal_name(enum metal metal);
/* Returns whether there is such a metal. */
bool metal_find(const char *name, enum metal *metal);

/* n and k of the index n + i k, for 360 to 830 nm. */
void metal_index(enum metal metal, double wavelength_nm, double n_k[2]);
/* Reflectance of unpolarised light by a conductor, by the exact equations of Fresnel. cos_i in 0..1. */
double conductor_reflectance(const double n_k[2], double cos_i);
/* The same in linear sRGB under D65 (observer_weights.h); a perfect mirror has 1 in all channels. */
void metal_reflectance_rgb(enum metal metal, double cos_i, double rgb[3]);

#endif
