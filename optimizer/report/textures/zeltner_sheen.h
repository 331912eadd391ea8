/* Sheen by a layer of fine fibers: Zeltner, Burley and Chiang 2022, "Practical Multiple-Scattering Sheen Using Linearly
 * Transformed Cosines", with the rational functions by which MaterialX 1.39 replaces the tables of the paper. It is the
 * fuzz of OpenPBR. */
#ifndef SELVEDGE_OPTIMIZER_ZELTNER_SHEEN_H
#define SELVEDGE_OPTIMIZER_ZELTNER_SHEEN_H

/* Share of the light from a direction of this cosine that a white layer scatters back. roughness in [0.01, 1]. */
double zeltner_sheen_albedo(double cosine, double roughness);
/* Density over solid angle of the light that goes from wo to wi, cosine of wi included; times the share above it is
 * the layer's. Unit vectors in a frame whose z is the normal. */
double zeltner_sheen_density(const double wi[3], const double wo[3], double roughness);

#endif
