/* Point samples over (theta_o, azimuth) resampled to cells, each with a value at its middle and a standard error.
 *
 * A polynomial of degree two goes through the samples of a cell by least squares; its value in the middle counts. The
 * error follows from the scatter of the samples about it, as independent ones: it holds the noise of the pixels, the
 * roughness of the paint, and structure that a polynomial cannot follow. Differs from the fiber-scattering thesis
 * (4.6.3), which smooths by a Gaussian of 2 degrees: that has no error and flattens peaks. */
#ifndef SELVEDGE_OPTIMIZER_BOWL_CELLS_H
#define SELVEDGE_OPTIMIZER_BOWL_CELLS_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

enum { BOWL_N_TERM = 6, BOWL_LEAST_SAMPLE = 24 };

struct bowl_cell {
    size_t n;
    double xx[BOWL_N_TERM * BOWL_N_TERM], xy[3][BOWL_N_TERM], yy[3];
};

/* Cells of `step` degrees over theta_o -90..90 and azimuth 0..180. */
struct bowl_cells {
    double step_deg;
    size_t n_theta, n_azimuth;
    struct bowl_cell *cell; /* n_theta x n_azimuth */
};

status bowl_cells_init(struct bowl_cells *c, double step_deg, struct error *err);
void bowl_cells_release(struct bowl_cells *c);
/* Adds a sample of three channels. Samples outside of the range are left out. */
void bowl_cells_add(struct bowl_cells *c, double theta_deg, double azimuth_deg, const double value[3]);
/* Middle of cell i. */
void bowl_cells_middle(const struct bowl_cells *c, size_t i, double *theta_deg, double *azimuth_deg);
/* Values in the middle of cell i. False for fewer than BOWL_LEAST_SAMPLE samples, and for samples that lie to one side
 * of the middle, where the polynomial has more than 12 times the variance of a mean of as many samples. */
bool bowl_cells_value(const struct bowl_cells *c, size_t i, double value[3], double se[3]);

#endif
