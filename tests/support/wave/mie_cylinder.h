/* Exact scattering of a plane wave by an infinite circular cylinder, the wave vector across its axis (Lorenz-Mie;
 * Bohren and Huffman 1983, "Absorption and Scattering of Light by Small Particles", section 8.4): the reference for
 * wave optics of fibers.
 *
 * Waves go with exp(-i omega t), so that an absorbing index has a positive imaginary part. x = 2 pi radius over the
 * wavelength; the index m is that of the cylinder over that of the medium. The field is along the axis (TM) or across
 * it (TE):
 *
 *     T(d) = t_0 + 2 sum over n of t_n cos(n d),   d from straight on
 *     Q_ext = 2 / x Re T(0),   Q_sca = 1 / (pi x) integral of |T|^2 dd
 *
 * t_n are b_n of case I (TM) and a_n of case II (TE). Efficiencies are cross-sections over the diameter.
 */
#ifndef SELVEDGE_TESTS_MIE_CYLINDER_H
#define SELVEDGE_TESTS_MIE_CYLINDER_H

#include <complex.h>
#include <stddef.h>

enum mie_field { MIE_ALONG, MIE_ACROSS }; /* TM, TE */

enum { MIE_MAX_ORDER = 4096 };

struct mie_cylinder {
    double x;
    size_t n_order;
    double complex t[MIE_MAX_ORDER];
};

/* Computes the coefficients; m = INFINITY is a perfect mirror. x is at most about 3900, so that they fit. Returns 0, or
 * -1 when x is too large. */
int mie_cylinder_init(struct mie_cylinder *c, double x, double complex m, enum mie_field field);
double mie_extinction(const struct mie_cylinder *c);
double mie_scattering(const struct mie_cylinder *c);
double complex mie_amplitude(const struct mie_cylinder *c, double angle_rad);

/* J_0(x) .. J_n(x): the recurrence downwards, which is stable, scaled by J_0 + 2 (J_2 + J_4 + ...) = 1. */
void mie_bessel_j(double x, size_t n, double *j);
/* D_k(z) = J_k'(z) / J_k(z) by the recurrence downwards. */
void mie_log_derivative(double complex z, size_t n, double complex *d);

/* Efficiencies by treams 0.4.7 (Beutel, Fernandez-Corbaton and Rockstuhl 2024, "treams - a T-matrix-based scattering
 * code for nanophotonics"; treams.coeffs.mie_cyl at kz = 0), which SciPy's Bessel functions in the formulas above
 * repeat to 1e-13. */
struct mie_published {
    double x, n, k;
    enum mie_field field;
    double extinction, scattering;
};
enum { MIE_N_PUBLISHED = 12 };
extern const struct mie_published mie_published[MIE_N_PUBLISHED];
/* Largest difference of an efficiency from its published value. */
double mie_published_error(void);

#endif
