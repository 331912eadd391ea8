/* What a near field says of a view, added up over places of the fiber's width. */
#ifndef SELVEDGE_TESTS_NEAR_VIEW_SUM_H
#define SELVEDGE_TESTS_NEAR_VIEW_SUM_H

#include "renderer/scattering/scattering.h"
#include "tests/support/model/fiber_angles.h"

/* Adds S for the view at the azimuth `place` about the normal; theta: of light and view, phi: between them. */
static inline void near_at(const struct scattering_model *m, const struct scattering_state *s, const double theta[2],
                           double phi, double place, double sum[3])
{
    float wi[3], wo[3], rgb[3];
    direction(theta[1], place, wo);
    direction(theta[0], place + phi, wi);
    m->eval(s, wi, wo, rgb, NULL);
    for (int c = 0; c < 3; c++) sum[c] += (double)rgb[c];
}

#endif
