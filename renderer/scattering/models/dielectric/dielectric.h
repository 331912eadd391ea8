/* dielectric.v1: a smooth round fiber of a clear, evenly dyed material, seen from afar, with rough lobes. Reciprocal;
 * lossless from both sides where C_T = 1.
 *
 *     S = a(th_i) a(th_o) sum over modes of M_p(th_i, th_o) N_p(th_d, ph)
 *     N_p = (1/2) integral over h of A_p(th_d, h) D(ph - Phi_p(th_d, h); sqrt(p + 1) gamma)       R, TT, TRT
 *     N_rest = A_rest(th_d) / (2 pi),  A_rest the mean over h                                    all longer paths
 *
 * d'Eon et al. 2011, "An Energy-Conserving Hair Reflectance Model": longitudinal lobes M of their equation 7
 * (cone_lobe.h), of widths beta (R), beta / 2 (TT) and 2 beta (TRT and the rest) as for Marschner et al. 2003; the
 * azimuthal integral over the offset h with a wrapped Gaussian D, their section 3.2. dielectric_ray.h defines
 * attenuations A, azimuths Phi and the rest, with absorption along the way of every single ray.
 * th_d = (th_i - th_o) / 2.
 *
 * As published, M is divided by cos th_i, which gains energy without bound for light along the fiber, and A is taken at
 * the difference angle, by which wide lobes gain up to a half at grazing angles. a(th) repairs both: it solves
 *     a(th_i) integral of a(th_o) [sum of M_p mean A_p at C_T = 1] cos^2 th_o dth_o = 1
 * (lobe_balance.h), so nothing is lost from either side, and S stays reciprocal.
 *
 * N is made as a Fourier series in ph, in which a wrapped Gaussian is a factor exp(-k^2 w^2 / 2), for N_ROW + 1 values
 * of cos th_d, and read between N_PHI + 1 azimuths by straight lines. Derivatives are exact for the tabulated function.
 */
#ifndef SELVEDGE_RENDERER_DIELECTRIC_H
#define SELVEDGE_RENDERER_DIELECTRIC_H

#include "renderer/scattering/models/dielectric/dielectric_along.h"
#include "renderer/scattering/models/dielectric/dielectric_ray.h"

enum {
    DIELECTRIC_N_PARAM = surface_dielectric_n_param,
    DIELECTRIC_P_C_T = 0,
    DIELECTRIC_P_ETA = 3,
    DIELECTRIC_P_BETA,
    DIELECTRIC_P_GAMMA
};
enum { DIELECTRIC_N_ROW = 64, DIELECTRIC_N_PHI = 180 };

/* N at one place of the table. The derivatives are of the values, not of their logarithms. */
struct dielectric_cell {
    float r, inner[2][3]; /* R; TT and TRT in rgb */
};
struct dielectric_slope {
    float r[2];           /* R by eta and by gamma */
    float inner[2][3][3]; /* TT and TRT: [mode][by C_T of the channel, by eta, by gamma][channel] */
};

/* By cos th_d. */
struct dielectric_row {
    float rest[3], d_rest[2][3];                            /* A_rest / (2 pi); by C_T of the channel and by eta */
    float energy[DIELECTRIC_N_MODE][3];                     /* mean A of each mode: for the choice of a mode */
    float density[DIELECTRIC_N_LOBE][DIELECTRIC_N_PHI + 1]; /* N of a mode, mean of the channels, with integral 1 over
                                                               [0, pi] */
    float below[DIELECTRIC_N_LOBE][DIELECTRIC_N_PHI + 1];   /* its integral from 0 */
};

struct scattering_state {
    struct dielectric_along along;
    struct dielectric_row row[DIELECTRIC_N_ROW + 1];
    struct dielectric_cell cell[DIELECTRIC_N_ROW + 1][DIELECTRIC_N_PHI + 1];
    struct dielectric_slope slope[DIELECTRIC_N_ROW + 1][DIELECTRIC_N_PHI + 1];
};

/* Fills in rows, cells and slopes. STATUS_NO_MEMORY. */
status dielectric_tables(struct scattering_state *s, const double *param, struct error *err);

#endif
