/* elliptical_oriented.v1: the rough dielectric fiber of elliptical.v1 with its section as it is turned: v of the fiber
 * frame is along the short axis. Reciprocal with the projected widths.
 *
 *     S = a(th_i) a(th_o) m(th_i, ph_i) m(th_o, ph_o) / H(ph_i)
 *         times the sum over R, TT, TRT and TRRT with the rest of M_p(th_i, th_o) F_p(th_d, ph_i, ph_o)
 *     F_p = mean over the azimuths of the section and over the width that it shows of A_p K(ph_i - ph) K(ph_o - ph_e);
 *           K: Gaussian of width sqrt((p + 1) / 2) gamma
 *     F_rest = rho(ph_i) rho(ph_o) / (2 pi mean rho), rho the light beyond TRRT by the azimuth it came from
 *     H = sqrt(a cos^2 + sin^2 / a) of the azimuth from the short axis: projected width over the diameter of the round
 *         fiber of equal area
 *
 * F is symmetric, as rays can be traced back, so S H(ph_i) is the same when both directions are exchanged. a(th)
 * balances the mean over all azimuths as in elliptical.v1. The scale m makes a m the positive solution x of
 * x (M F x) = H for C_T = 1, over both angles at once: all light of every direction leaves, although K blurs the widths
 * too (the thesis divides by the blurred width), and lobes of different widths end at the pole. docs/model.md states
 * the error that remains between the nodes of m.
 *
 * Symmetry: F is even and of period pi in psi = (ph_i + ph_o) / 2 from the long axis, and even and of period 2 pi in
 * Delta = ph_o - ph_i. Tables hold a quarter: psi in [0, pi / 2], Delta in [0, pi], 3.75 degrees apart in Delta.
 *
 * Fabric thesis, section 4.4 and appendix A. Its tables of 128 x 256 x 256 x 3 values a mode have 403 MB and no
 * derivatives; these have 22 MB with all of them.
 *
 * In a scene of round tubes the tube has both projected widths, so they drop out of the light that leaves along wo
 * (thesis, equation 2.11): the light that leaves a fiber towards each side is right, and its shadows are the tube's. In
 * a scene of elliptical sections (scene_option.sections) their ratio is a factor (path_scatter.h). */
#ifndef SELVEDGE_RENDERER_ELLIPTICAL_ORIENTED_H
#define SELVEDGE_RENDERER_ELLIPTICAL_ORIENTED_H

#include "renderer/scattering/models/elliptical/elliptical_lobes.h"

enum {
    ORIENTED_N = 48,                    /* steps of psi and of Delta */
    ORIENTED_N_TURN = 24,               /* steps of an azimuth over a quarter turn; as wide as the steps of Delta */
    ORIENTED_N_AROUND = 2 * ORIENTED_N, /* steps of Delta over a turn */
    ORIENTED_N_THETA = 64,              /* steps of |th| in m */
    ORIENTED_N_RAY = 2584,              /* of the lattice over a quarter turn, numbers of Fibonacci */
    ORIENTED_RAY_STEP = 1597
};
/* Derivatives of m. */
enum { ORIENTED_M_ETA, ORIENTED_M_RATIO, ORIENTED_M_ALPHA, ORIENTED_M_BETA, ORIENTED_M_GAMMA, ORIENTED_N_M };

/* Distributions from which samples are drawn: by cos th_d and by the azimuth of wo from the long axis. */
struct oriented_view {
    float energy[ELLIPTICAL_N_LOBE][3];
    float density[ELLIPTICAL_N_LOBE][ORIENTED_N_AROUND + 1]; /* by (Delta + pi) / 2, integral 1 over [0, pi] */
    float below[ELLIPTICAL_N_LOBE][ORIENTED_N_AROUND + 1];
};

struct oriented_scale {
    float m, d_ln[ORIENTED_N_M];
};

struct scattering_state {
    struct tilted_lobe along[ELLIPTICAL_N_LOBE];
    struct elliptical_scale scale;
    float ratio;
    struct oriented_scale balance[ORIENTED_N_THETA + 1][ORIENTED_N_TURN + 1];
    struct oriented_view view[ELLIPTICAL_N_ROW + 1][ORIENTED_N_TURN + 1];
    struct elliptical_cell cell[ELLIPTICAL_N_ROW + 1][ORIENTED_N + 1][ORIENTED_N + 1]; /* by psi and Delta */
    struct elliptical_slope slope[ELLIPTICAL_N_ROW + 1][ORIENTED_N + 1][ORIENTED_N + 1];
};

/* F of C_T = 1 at two azimuths, which are folded to a quarter turn, and its derivatives by eta, the ratio and gamma. */
enum { ORIENTED_VALUE, ORIENTED_BY_ETA, ORIENTED_BY_RATIO, ORIENTED_BY_GAMMA, ORIENTED_N_PART };
typedef double oriented_folded[ORIENTED_N_TURN + 1][ORIENTED_N_TURN + 1];
struct oriented_row {
    oriented_folded f[ELLIPTICAL_N_LOBE][ORIENTED_N_PART];
};

/* H and its derivative by the ratio, at the square of the cosine to the long axis. */
static inline double oriented_width(double ratio, double cos2_long, double *by_ratio)
{
    double s = (1 - cos2_long) * ratio + cos2_long / ratio, h = sqrt(s);
    *by_ratio = 0.5 * (1 - cos2_long - cos2_long / (ratio * ratio)) / h;
    return h;
}
/* The index within 0 .. half of a table that is even and has a period of 2 half. */
static inline int oriented_fold(int i, int half)
{
    i = ((i % (2 * half)) + 2 * half) % (2 * half);
    return i > half ? 2 * half - i : i;
}

typedef double oriented_plane[ORIENTED_N + 1][ORIENTED_N + 1]; /* by psi and Delta */
/* Fills in cells, slopes, views, the rows and the energies; threads of the pool, which may be NULL, share the rows.
 * STATUS_NO_MEMORY. */
status oriented_tables(struct scattering_state *s, const double *param, struct thread_pool *pool,
                       struct oriented_row *row, struct elliptical_energies *energies, struct error *err);
/* Folds a plane of F. */
void oriented_fold_plane(oriented_plane plane, oriented_folded out);
/* Fills in m; lobes, scale and ratio are set. STATUS_NO_MEMORY. */
status oriented_balance(struct scattering_state *s, struct oriented_row *row, struct error *err);

#endif
