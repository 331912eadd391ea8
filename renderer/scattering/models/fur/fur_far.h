/* Tables of fur.v1, the far field (fur.h states the model): the mean over the offset h of the azimuthal functions of
 * fur_near.v1, at FUR_FAR_ROW + 1 values of cos th_d and FUR_N_PHI + 1 azimuths over half a turn, read by straight
 * lines.
 *
 * The means are sums over offsets as Fourier series in ph: a wrapped Gaussian is a factor exp(-k^2 w^2 / 2), and the
 * density of the medulla a factor of each of its functions of the azimuth. The publication integrates pieces between
 * few offsets in closed form, with shares and angles linear within each piece, which makes R too bright at the rim.
 * Derivatives are exact for the tabulated function.
 */
#ifndef SELVEDGE_RENDERER_FUR_FAR_H
#define SELVEDGE_RENDERER_FUR_FAR_H

#include "renderer/scattering/models/fur/fur.h"

enum { FUR_FAR_ROW = 32, FUR_N_PHI = 300 };
/* R, TT, TRT, and both scattered ones together; the rest has the lobe of TRT along the fiber. */
enum { FUR_FAR_S = FUR_N_LOBE, FUR_FAR_N_LOBE, FUR_FAR_REST = FUR_FAR_N_LOBE, FUR_FAR_N_MODE };
/* Derivatives that the tables hold; the first by C_T of the channel. */
enum fur_far_by { FUR_F_C, FUR_F_ETA, FUR_F_KAPPA, FUR_F_LAYERS, FUR_F_MS, FUR_F_MA, FUR_F_G, FUR_F_GAMMA, FUR_F_N };

struct fur_cell {
    float n[FUR_FAR_N_LOBE][3];
};
struct fur_slope {
    float n[FUR_FAR_N_LOBE][FUR_F_N][3];
};

/* By cos th_d. */
struct fur_row {
    float rest[3], d_rest[FUR_F_G][3];            /* A_rest / (2 pi) and its derivatives */
    float energy[FUR_FAR_N_MODE][3];              /* mean A of each mode: for the choice of a mode */
    float density[FUR_FAR_N_LOBE][FUR_N_PHI + 1]; /* of azimuths, integral 1 over [0, pi] */
    float below[FUR_FAR_N_LOBE][FUR_N_PHI + 1];   /* its integral from 0 */
};

struct scattering_state {
    struct fur_along along;
    struct fur_row row[FUR_FAR_ROW + 1];
    struct fur_cell cell[FUR_FAR_ROW + 1][FUR_N_PHI + 1];
    struct fur_slope slope[FUR_FAR_ROW + 1][FUR_N_PHI + 1];
};

/* Fills in rows, cells and slopes. The pool may be NULL. STATUS_NO_MEMORY. */
status fur_far_tables(struct scattering_state *s, const double *param, struct thread_pool *pool, struct error *err);

#endif
