/* Amplitudes of the oblique solver for a circle against the exact ones. */
#ifndef SELVEDGE_TESTS_CIRCLE_AMPLITUDES_H
#define SELVEDGE_TESTS_CIRCLE_AMPLITUDES_H

#include "renderer/scattering/models/wave/solver/oblique_solver.h"
#include "tests/support/wave/mie_oblique.h"

#include <math.h>

/* Largest difference over all directions and pairs of fields, over the largest amplitude. angle: of the light that the
 * solver was solved for, in rad. */
static inline double circle_amplitude_error(const struct oblique_solver *s, const struct mie_oblique *mie, double angle)
{
    enum { N_ANGLE = 360, N_PAIR = WAVE_N_FIELD * WAVE_N_FIELD };
    double off = 0, top = 0;
    for (int j = 0; j < N_ANGLE; j++) {
        double complex t[N_PAIR];
        oblique_solver_towards(s, 2 * M_PI * j / N_ANGLE, t);
        for (int pair = 0; pair < N_PAIR; pair++) {
            const double complex want =
                mie_oblique_amplitude(mie, (enum mie_field)(pair / WAVE_N_FIELD), (enum mie_field)(pair % WAVE_N_FIELD),
                                      2 * M_PI * j / N_ANGLE - angle);
            off = fmax(off, cabs(t[pair] - want));
            top = fmax(top, cabs(want));
        }
    }
    return off / top;
}

#endif
