/* Tables over the unit square that depend on the direction of the light, and the warp that makes such a density
 * uniform: the adaptive parameterization of measured BRDFs (Dupuy and Jakob 2018, "An Adaptive Parameterization
 * for Efficient Material Acquisition and Rendering", section 4). Values between samples are bilinear, those
 * between directions of the light bilinear in azimuth and elevation. */
#ifndef SELVEDGE_OPTIMIZER_BRDF_WARP_H
#define SELVEDGE_OPTIMIZER_BRDF_WARP_H

#include <stddef.h>

/* n_slice pictures of height x width samples, at the borders of the square and evenly between them. */
struct warp_table {
    size_t width, height, n_slice;
    float *value;
};

/* The directions of the light around the wanted one, and their weights. */
struct warp_mix {
    size_t slice[4];
    double weight[4];
};

/* Directions of a table: rising azimuths and elevations; slice = i_phi n_theta + i_theta. Outside the range the nearest
 * direction counts. */
struct warp_axes {
    size_t n_phi, n_theta;
    double *phi_rad, *theta_rad;
};

void warp_mix_at(const struct warp_axes *axes, double phi_rad, double theta_rad, struct warp_mix *mix);
/* Value at u in [0, 1]^2; u[0] runs along the width. A mix of NULL takes the first slice. */
double warp_table_value(const struct warp_table *t, const struct warp_mix *mix, const double u[2]);
/* Scales every slice to integral 1; a slice that is 0 everywhere becomes even. */
void warp_table_normalize(struct warp_table *t);
/* The place in the square that the sampling of the density (first u[1] from its marginal, then u[0] from the
 * conditional) maps to u. */
void warp_table_invert(const struct warp_table *t, const struct warp_mix *mix, const double u[2], double out[2]);

#endif
