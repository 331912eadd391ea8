/* A plain surface reflectance that knows nothing of the cloth: the description that a user would take in place of a
 * twin. Every fit is compared with it, because a twin that predicts new views worse than twelve numbers is not worth
 * its price.
 *
 *   L = pi cos(theta_l) (diffuse f_d + f_s(F0) + sheen f_h)                    lamp in front of the cloth
 *   L = |cos(theta_l)| transmission                                            lamp behind it
 *
 * f_d: Lambert with the retro-reflection of Burley 2012, "Physically Based Shading at Disney", section 5.3; f_s: GGX
 * (Walter et al. 2007) with Schlick's Fresnel term and either masking of Heitz 2014, height-correlated or separable;
 * f_h: sheen of Estevez and Kulla 2017, "Production Friendly Microfacet Sheen BRDF". The lamp and the camera are taken
 * as points in their directions. Radiance unit: renderer/scene/configuration.h. The cloth's rotation has no effect.
 *
 * The colours enter linearly, so they are solved exactly within their ranges (diffuse, F0 and transmission in [0, 1],
 * sheen in [0, 2]) for every trial of the three shapes, and only these are searched: a grid first, then nlopt's Sbplx
 * from the best of its points. Both maskings are fitted and the one with the lower objective of the fitted rows is
 * kept. */
#ifndef SELVEDGE_OPTIMIZER_PLAIN_BRDF_H
#define SELVEDGE_OPTIMIZER_PLAIN_BRDF_H

#include "optimizer/photographs/rows/observation.h"

#include <stdbool.h>

struct plain_brdf {
    double diffuse_rgb[3], f0_rgb[3], sheen_rgb[3], transmission_rgb[3];
    double retro;           /* 0 to 2; 1 is Burley's term for a rough surface, scaled by roughness there */
    double roughness;       /* GGX alpha, 0.05 to 1 */
    double sheen_roughness; /* 0.05 to 1 */
    bool separable_masking;
};

/* True when the lamp is the only light of the configuration. The radiance under an environment is not computed. */
bool plain_brdf_applies(const struct configuration *c);

/* Mean radiance of a configuration, rgb. */
void plain_brdf_radiance(const struct plain_brdf *b, const struct configuration *c, double rgb[3]);

/* Fits all rows of `rows` by the objective of the cloth's own fit (objective.h); contrasts and rows of weight 0 are
 * left out. Takes milliseconds. STATUS_INVALID when no row is left, STATUS_NO_MEMORY. */
status plain_brdf_fit(const struct observation_set *rows, struct plain_brdf *b, struct error *err);

/* The same without the rows of one fold. fold: of each row (folds.h). */
status plain_brdf_fit_without(const struct observation_set *rows, const size_t *fold, size_t i_fold,
                              struct plain_brdf *b, struct error *err);

/* Relative RMS error by cross-validation over `rows`: fitted anew without the rows of each fold (folds.h), which it
 * then predicts. The counterpart of cross_validation.h, by the same folds. NaN with fewer than FOLDS_LEAST folds. Takes
 * FOLDS_MAX times as long as plain_brdf_fit at most. The errors of plain_brdf_fit. */
status plain_brdf_left_out(const struct observation_set *rows, double *rel_rms, struct error *err);

/* Relative RMS error over the rows of one set (objective.h); NaN when the set has none. */
double plain_brdf_rel_rms(const struct plain_brdf *b, const struct observation_set *rows, enum job_set set);

#endif
