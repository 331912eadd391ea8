/* The analytic cloth: formulas in place of a cloth and a renderer, for fast tests of fits. It has nine parameters
 * with the names of the two-lobe model's, and 40 configurations. Its mean radiance behaves like that of real cloth:
 * it has bright highlights at grazing angles, and colours act through multiple scattering. Its noise has the heavy
 * tail of a path tracer: a few paths carry most of the light and most of the derivatives. The relative standard
 * deviation of one path is about 5.
 */
#ifndef SELVEDGE_TESTS_FAKE_ESTIMATOR_H
#define SELVEDGE_TESTS_FAKE_ESTIMATOR_H

#include "optimizer/fit/descent/descent.h"
#include "optimizer/photographs/rows/observation.h"

enum { FAKE_N_PARAM = 9, FAKE_N_FIT = 16, FAKE_N_HELD_OUT = 24 };

extern const struct param_info fake_param[FAKE_N_PARAM];

struct fake_cloth {
    uint64_t seed;
    double noise; /* 1: noise as described above; 0: exact means */
    /* configurations 2 i and 2 i + 1 have the same noise, with the paths of the one that asks for more */
    bool share_paths;
    size_t n_configuration;
    struct configuration configuration[FAKE_N_FIT + FAKE_N_HELD_OUT];
    size_t n_call;     /* estimates made so far */
    size_t fail_after; /* STATUS_CANCELLED from this call on; 0: never */
};

/* Uses the 16 + 24 configurations of the measured reflectance tables. n: 16 for the fitted ones, 40 for all. */
void fake_cloth_init(struct fake_cloth *f, uint64_t seed, size_t n);
struct estimator fake_estimator(struct fake_cloth *f);
/* Exact mean radiance and its derivatives (jac[3 * FAKE_N_PARAM], NULL if not wanted). param is in internal units. */
void fake_radiance(const struct configuration *c, const double *param, double rgb[3], double *jac);
/* Observations of all configurations at param. Each number has a relative error of standard deviation rel_noise. */
status fake_observe(const struct fake_cloth *f, const double *param, double rel_noise, uint64_t seed,
                    struct observation_set *o);
/* Converts parameters from file units to internal units. */
void fake_param_set(const double file_unit[FAKE_N_PARAM], double param[FAKE_N_PARAM]);
/* sqrt(mean over rows and channels of ((R - M) / max(a, tau))^2) of exact means at param against those at truth. */
double fake_rel_rms(const struct fake_cloth *f, size_t first, size_t n, const double *param, const double *truth);

#endif
