/* Speckle: the random pattern of bright and dark directions that a single rough fiber scatters, as a factor f on
 * the mean that a scattering model states. f has the mean 1 over fibers, so it changes no mean; it is for pictures
 * alone.
 *
 *     f = |sum over b of weight_b A_b(2^b y)|^2,   y_c = cells_c (wi + wo),   sum of weight_b^2 = 1
 *
 * A are bands of complex noise, Re and Im normally distributed and independent. Then f = Re^2 + Im^2 is fully
 * developed speckle: it has an exponential distribution with the mean and the standard deviation 1 (Goodman 2007,
 * "Speckle Phenomena in Optics"; equations 14 to 16 of Xia et al. 2023, "A Practical Wave Optics Reflection Model
 * for Hair and Fur"). The weights are fitted to simulated fibers (speckle_tables_main.c).
 *
 * wi, wo: unit vectors away from the fiber in a frame that turns with it, u along the fiber. Their sum is the half
 * vector times 2 cos th_d: k (wi + wo) is the change of the wave vector, and places of the pattern stay there when
 * light and camera move so that it stays (memory effect). A longer wave makes the pattern larger about 0, where
 * light goes straight on, by a power of its length.
 *
 * Differs from the publication (README.md has the measurements): fields are added up and not intensities (its equation
 * 17), whose sum varies less than the light of the simulated fibers does; it has the angles of the half vector alone,
 * which jump where light goes straight on; a fiber has a pattern of its own in place of an offset in one pattern.
 *
 * A is a lattice of random complex numbers, read by a quadratic B-spline in each axis and divided by the root of
 * the sum of the squares of the spline's weights: its variance is the same everywhere.
 */
#ifndef SELVEDGE_RENDERER_SPECKLE_H
#define SELVEDGE_RENDERER_SPECKLE_H

#include <stdint.h>

enum { SPECKLE_N_BAND = 4, SPECKLE_N_SIZE = 1024, SPECKLE_N_TURN = 256 };

struct speckle_table {
    float cells[3]; /* of band 0 for a unit of wi + wo, by channel */
    float weight[SPECKLE_N_BAND];
};

/* Complex numbers with a normal distribution, by size and angle. Immutable after its init. */
struct speckle_numbers {
    float size[SPECKLE_N_SIZE];
    float turn[SPECKLE_N_TURN][2];
};
void speckle_numbers_init(struct speckle_numbers *n);

struct speckle {
    const struct speckle_table *table;
    const struct speckle_numbers *numbers;
    uint64_t seed; /* the same seed gives every fiber the same pattern */
};

/* f of one fiber in rgb. */
void speckle_factor(const struct speckle *s, uint32_t i_fiber, const float wi[3], const float wo[3], float rgb[3]);
/* A of one band at a place in its own cells. */
void speckle_amplitude(const struct speckle *s, uint32_t i_fiber, uint32_t i_band, const float place[3],
                       float re_im[2]);

/* Returns the correlation of f at two places across the fiber, as a mean over places and directions. distance: in cells
 * of band 0. */
double speckle_correlation(const float weight[SPECKLE_N_BAND], double distance);
/* Returns the correlation of A at two places: 1 at the distance 0, and 0 from 4.3 on. distance: in cells of the band.
 */
double speckle_band_correlation(double distance);

#endif
