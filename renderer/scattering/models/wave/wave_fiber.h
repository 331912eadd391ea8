/* wave_silk.v2, wave_trilobal.v2, wave_cotton.v2: fibers of a few micrometers whose sections scatter light as waves,
 * seen from afar and turned at random about their axes. Reciprocal; lossless from both sides where C_T = 1.
 *
 *     S = a(th_i) a(th_o) g(th_i + th_o; beta) N(ph; C_T, th_d, gamma)
 *
 * after Xia et al. 2020, "A Wave Optics Based Fiber Scattering Model". N is the table of the section (wave_table.h),
 * made by a solver of Maxwell's equations for waves at the angle th_d to the plane across the fiber, and blurred by a
 * wrapped Gaussian D of the width gamma, which multiplies the Fourier coefficient k by exp(-k^2 gamma^2 / 2). g is a
 * Gaussian, and a(th) balances it (lobe_balance.h).
 *
 * Approximations: light off the cone of the mirror, where th_i = -th_o = th_d, has the azimuths of this cone; one lobe
 * along the fiber serves all light.
 *
 * v1 had tables of light across the fiber alone: as much went back at every angle along it.
 *
 * Differs from the publication: the orientation of the section, the size and the wavelengths of a channel are averaged
 * over; the forward lobe of diffraction is taken away (wave_mean.h), so that fibers are met within their own width and
 * none has to be widened; a table holds 14580 numbers in place of 6.5e8; a(th) takes the place of 1 / cos th.
 *
 * N is tabulated for N_ROW + 1 values of cos th_d and read between N_PHI + 1 azimuths by straight lines. Derivatives
 * are exact for the tabulated function.
 */
#ifndef SELVEDGE_RENDERER_WAVE_FIBER_H
#define SELVEDGE_RENDERER_WAVE_FIBER_H

#include "base/status.h"
#include "renderer/scattering/lobe_balance.h"
#include "renderer/scattering/models/wave/wave_rows.def"
#include "renderer/scattering/models/wave/wave_table.h"
#include "renderer/scattering/scattering.h"
#include "renderer/scattering/tilted_lobe.h"

enum { WAVE_P_C_T = 0, WAVE_P_BETA = 3, WAVE_P_GAMMA, WAVE_N_PARAM };
enum { WAVE_N_ROW = 32, WAVE_N_PHI = 180 };
enum { WAVE_D_C_T, WAVE_D_GAMMA, WAVE_N_SLOPE };

/* N at one node of the table, and its derivatives. The derivative by C_T is taken by the channel's own C_T. */
struct wave_cell {
    float n[3], d[WAVE_N_SLOPE][3];
};

/* The sampling tables for one cos th_d. A sample chooses a channel, then an azimuth by the density of this channel. */
struct wave_row {
    float energy[3][3]; /* light of each channel that leaves, on the diagonal */
    float density[3][WAVE_N_PHI + 1], below[3][WAVE_N_PHI + 1];
};

struct scattering_state {
    struct tilted_lobe along;                                /* without a shift */
    float scale[LOBE_BALANCE_N], d_ln_scale[LOBE_BALANCE_N]; /* a by |th|, and by beta */
    struct wave_row row[WAVE_N_ROW + 1];
    struct wave_cell cell[WAVE_N_ROW + 1][WAVE_N_PHI + 1];
};

/* Fills in rows and cells. STATUS_NO_MEMORY. */
status wave_fiber_tables(struct scattering_state *s, const struct wave_table *table, const double *param,
                         struct error *err);

#endif
