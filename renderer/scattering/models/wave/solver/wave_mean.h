/* How a fiber of one size scatters unpolarised light of one wavelength and one angle to its axis in the mean over all
 * orientations of its section, with the shadow taken away, as a model of a fiber of the section's own width needs it.
 *
 * A large body extinguishes twice the light that falls on it: half is diffracted into a narrow forward lobe, which is
 * the light that is missing in the shadow (Babinet). Where fibers are met by rays within their width, that half is
 * light that goes on. The lobe has the amplitude of a dark strip of the width that the section shows,
 *
 *     T_s(d) = k / 2 w(d) integral over the width of exp(-i k y sin d) dy,   w = exp(-(d x^(1/3) / 1.8)^2)
 *
 * d from straight on in the plane of the section, k the wave number in this plane, x = k times half of the width. The
 * remaining light is the sum of |T - T_s|^2 over both fields of either incident field, T_s = 0 between them. Amplitudes
 * are subtracted and not powers, because the lobe interferes with light that is refracted straight on. The factor w
 * ends the lobe where the penumbra of a round edge does, whose angle goes with x^(-1/3) (Fock); a knife's edge would
 * diffract further. 1.8 leaves the least power of circles that absorb all that they do not reflect, of x = 27, 55 and
 * 109.
 *
 * The remaining and the absorbed light together are the light that the fiber meets: 1.03 to 1.08 of its width at these
 * sizes across the fiber, as waves reach beyond an edge, and more in oblique light. Shares refer to this light, so
 * energy is exact.
 */
#ifndef SELVEDGE_RENDERER_WAVE_MEAN_H
#define SELVEDGE_RENDERER_WAVE_MEAN_H

#include "renderer/scattering/models/wave/solver/oblique_solver.h"

enum {
    WAVE_MEAN_N_TURN = 77, /* orientations: no two are alike for sections that two or three turns repeat */
    WAVE_MEAN_N_ANGLE = 8 * WAVE_MEAN_N_TURN, /* of scattering */
    WAVE_MEAN_N_EXACT = 96 /* waves of the density whose integrals are exact: an amplitude has about as many waves as k
                              times the largest distance from the center, its square twice as many */
};

struct wave_mean {
    double density[WAVE_MEAN_N_ANGLE]; /* per radian, by the angle from straight on, even; integral 1 - absorbed */
    double absorbed;                   /* share */
    double met;                        /* light that the fiber meets, over that which falls on its width */
    double extinction;                 /* over the same: about 2 */
};

/* T_s at the angle d from straight on, |d| <= pi, for the wave number k in the plane of the section and a shadow of
 * this range across the direction of travel (wave_outline_extent). */
double complex wave_shadow_amplitude(double k, const double range[2], double d);

/* Each orientation has the weight of the width that it shows. Errors of oblique_solver.h; STATUS_INVALID with the field
 * "k" when there are too few angles for so short a wave. */
status wave_mean_over_turns(const struct oblique_problem *problem, struct wave_mean *mean, struct error *err);

#endif
