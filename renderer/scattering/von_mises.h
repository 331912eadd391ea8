/* The azimuthal lobe f(ph; 0, s) = exp(s^-2 cos ph) / (2 pi I0(s^-2)): constants, density, exact sampling.
 * Everything uses I0 scaled by exp(-x): for narrow lobes s^-2 exceeds 3000.
 *
 * Sampling: u -> normal quantile z -> K(z), where K solves F(K) = Phi(z) (F, Phi the two distribution functions). K is
 * smooth and nearly linear, so 512 cubic pieces reproduce it to float precision.
 */
#ifndef SELVEDGE_RENDERER_VON_MISES_H
#define SELVEDGE_RENDERER_VON_MISES_H

enum { VON_MISES_N_PIECE = 512 };
#define VON_MISES_Z_MAX 5.75f

struct von_mises {
    float kappa;                          /* s^-2 */
    float norm;                           /* 1 / (2 pi exp(-kappa) I0(kappa)): the density at its peak */
    float score_at_peak;                  /* d ln f / d s at ph = 0 */
    float score_slope;                    /* decrease of d ln f / d s per unit of 1 - cos ph */
    float node[VON_MISES_N_PIECE + 1][2]; /* K and dK/dz times the step */
};

/* exp(-x) I0(x) and 1 - I1(x) / I0(x) for x >= 0. */
double bessel_i0_scaled(double x);
double bessel_i1_over_i0_deficit(double x);

/* s in radians, 0.005 <= s <= 3. */
void von_mises_init(struct von_mises *v, double s_rad);
/* Angle in [-pi, pi] for u in [0, 1), symmetric about 0. */
float von_mises_sample(const struct von_mises *v, float u);

/* Inverse error function in float (M. Giles 2010, "Approximating the erfinv function"), clamped to |x| < 1 - 2^-24. */
float erf_inverse(float x);

#endif
