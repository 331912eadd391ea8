/* Exponential and sine of vectors of floats, for the sums of wave optics. */
#ifndef SELVEDGE_RENDERER_WAVE_LANES_H
#define SELVEDGE_RENDERER_WAVE_LANES_H

#include "base/lanes.h"

/* Nearest integers of |x| < 2^22: the sum has no room for a fraction. */
static inline lanes lanes_nearest(lanes x)
{
    const float big = 0x1.8p23F;
    return (x + big) - big;
}

/* exp(x) for x <= 0; below -80 it is exp(-80). Relative error 3e-7: 2^n times the series of exp to the sixth order at
 * most ln(2) / 2 from 0. */
static inline lanes lanes_exp_negative(lanes x)
{
    static const float part[] = {1 / 6.0F, 1 / 5.0F, 1 / 4.0F, 1 / 3.0F, 1 / 2.0F, 1};
    x = lanes_choose((lane_mask)(x > -80.0F), x, (lanes){0} - 80.0F);
    const lanes n = lanes_nearest(x * 1.44269504F), y = (x - n * 0.693359375F) + n * 2.12194440e-4F;
    lanes e = (lanes){0} + 1.0F;
    for (int k = 0; k < 6; k++) e = 1.0F + e * y * part[k];
    return e * (lanes)((__builtin_convertvector(n, lane_mask) + 127) << 23);
}

/* Cosine and sine of 2 pi x for |x| < 2^22, with an absolute error of 4e-7 besides the rounding of x: the series at
 * half of the angle, doubled. */
static inline void lanes_turn(lanes x, lanes *cosine, lanes *sine)
{
    const lanes y = (x - lanes_nearest(x)) * 3.14159265F, q = y * y; /* y in -pi / 2..pi / 2 */
    lanes s = (lanes){0} + 1.0F, c = (lanes){0} + 1.0F;
    static const float per_sine[] = {156, 110, 72, 42, 20, 6}, per_cosine[] = {182, 132, 90, 56, 30, 12, 2};
    for (int k = 0; k < 6; k++) s = 1.0F - s * q * (1 / per_sine[k]);
    for (int k = 0; k < 7; k++) c = 1.0F - c * q * (1 / per_cosine[k]);
    s *= y;
    *cosine = 1.0F - 2.0F * s * s;
    *sine = 2.0F * s * c;
}

#endif
