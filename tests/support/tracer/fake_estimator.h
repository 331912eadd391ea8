/* A cloth without a cloth: nine parameters named like the two-lobe model's, 40 configurations, an analytic mean
 * radiance with analytic behaviour like that of real cloth (bright grazing highlights, colours that act through
 * multiple scattering), and noise with the heavy tail of a path tracer: most of the light comes from a few paths, and
 * the derivatives come from the same few. One path's relative standard deviation is about 5.
 */
#ifndef SELVEDGE_TESTS_FAKE_ESTIMATOR_H
#define SELVEDGE_TESTS_FAKE_ESTIMATOR_H

#include "optimizer/fit/descent/descent.h"
#include "optimizer/fit/photographs/observation.h"

enum { FAKE_N_PARAM = 9, FAKE_N_FIT = 16, FAKE_N_HELD_OUT = 24 };

extern const struct param_info fake_param[FAKE_N_PARAM];

struct fake_cloth {
    uint64_t seed;
    double noise; /* 1: as described; 0: exact means */
    size_t n_configuration;
    struct configuration configuration[FAKE_N_FIT + FAKE_N_HELD_OUT];
    size_t n_call;     /* estimates made so far */
    size_t fail_after; /* STATUS_CANCELLED from this call on; 0: never */
};

/* The 16 + 24 configurations of data/measured-reflectance. `n`: 16 for the fitted ones, 40 for all. */
void fake_cloth_init(struct fake_cloth *f, uint64_t seed, size_t n);
struct estimator fake_estimator(struct fake_cloth *f);
/* Exact mean radiance and derivatives (jac[3 * FAKE_N_PARAM], NULL if not wanted). Angles in radians, as inside. */
void fake_radiance(const struct configuration *c, const double *param, double rgb[3], double *jac);
/* Observations of the first n configurations at the true parameters, with a relative error of each number. */
status fake_observe(const struct fake_cloth *f, const double *param, double rel_noise, uint64_t seed,
                    struct observation_set *o);
/* File units to internal. */
void fake_param_set(const double file_unit[FAKE_N_PARAM], double param[FAKE_N_PARAM]);
/* sqrt(mean over rows and channels of ((R - M) / max(a, tau))^2) of exact means at param against those at truth. */
double fake_rel_rms(const struct fake_cloth *f, size_t first, size_t n, const double *param, const double *truth);

#endif
