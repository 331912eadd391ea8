/* Common part of the models of smooth round dielectric fibers along the fiber: the longitudinal lobes of d'Eon et al.
 * 2011 and the scale a(th) that balances them (dielectric.h states the equation). R has the width beta, TT beta / 2,
 * TRT and all longer paths 2 beta.
 */
#ifndef SELVEDGE_RENDERER_DIELECTRIC_ALONG_H
#define SELVEDGE_RENDERER_DIELECTRIC_ALONG_H

#include "base/status.h"
#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/cone_lobe.h"
#include "renderer/scattering/fiber_direction.h"
#include "renderer/scattering/lobe_balance.h"
#include "renderer/scattering/models/dielectric/dielectric_rows.def"
#include "renderer/scattering/scattering.h"

enum { DIELECTRIC_N_LOBE = 3 };

struct dielectric_along {
    struct cone_lobe longitudinal[DIELECTRIC_N_LOBE]; /* R, TT, TRT; the rest uses the lobe of TRT */
    float scale[LOBE_BALANCE_N];                      /* a by |th| */
    float d_ln_scale[2][LOBE_BALANCE_N];              /* d ln a by eta and by beta (rad) */
};

/* Width of a mode's longitudinal lobe over beta: R, TT, TRT. */
extern const double dielectric_width[DIELECTRIC_N_LOBE];

/* Sets lobes and scale for an index of refraction and a width in rad. STATUS_NO_MEMORY. */
status dielectric_along_init(struct dielectric_along *s, double eta, double beta_rad, struct error *err);

/* a(th), and d ln a by eta and by beta. */
static inline float dielectric_scale_at(const struct dielectric_along *s, float theta_rad, float d_ln[2])
{
    int i;
    float t = table_position(fabsf(theta_rad) * (float)((LOBE_BALANCE_N - 1) / M_PI_2), LOBE_BALANCE_N - 1, &i);
    for (int k = 0; k < 2; k++) {
        const float *d = s->d_ln_scale[k];
        d_ln[k] = d[i] + t * (d[i + 1] - d[i]);
    }
    return s->scale[i] + t * (s->scale[i + 1] - s->scale[i]);
}

/* M of each lobe, and d ln M / d beta when wanted. */
static inline void dielectric_longitudinal(const struct dielectric_along *s, float sin_i, float cos_i, float sin_o,
                                           float cos_o, float m[DIELECTRIC_N_LOBE], float *d_beta)
{
    for (int p = 0; p < DIELECTRIC_N_LOBE; p++) {
        m[p] = cone_lobe_eval(&s->longitudinal[p], sin_i, cos_i, sin_o, cos_o, d_beta != NULL ? &d_beta[p] : NULL);
        if (d_beta != NULL) d_beta[p] *= (float)dielectric_width[p];
    }
}

#endif
