/* microfacet_ellipse.v1: a dielectric fiber with an elliptical section and a rough wall of tilted facets, seen from
 * afar and turned at random about its axis. Reciprocal; lossless from both sides where C_T = 1.
 *
 * After Huang, Hullin and Hanika 2022, "A Microfacet-based Hair Scattering Model". One roughness r of the wall and the
 * tilt tau of its scales make the widths and shifts of all lobes, along the fiber and around it:
 *
 *     S = a(th_i) a(th_o) [ R + sum over TT, TRT of N_p(th_d, ph) M_p(x; th_d, ph) + N_rest(th_d) M_rest(x; th_d) ]
 *     x = th_i + th_o,   M = (g(x - mu; sigma) + g(x + mu; sigma)) / 2,   mu = tan(tau) kappa
 *
 * R is the sum over the facets that mirror wi to wo, in closed form (microfacet_surface.h). N_p is the density of the
 * azimuth of the light that leaves, weighted by absorption; sigma^2 and kappa are the mean of x^2 there and the mean of
 * d x / d k for a mean slope k of the wall. All are means over N_DRAW paths (microfacet_walk.h) of a lattice that
 * depends on no parameter, over the section's orientation, the place across its width and the facets that are met, at
 * N_ROW + 1 values of cos th_d; densities are blurred by a Gaussian of r / 4 (TT) and r / 2 (TRT) and read between
 * N_PHI + 1 azimuths by straight lines. Light that TRT leaves inside goes across the section once more and leaves at
 * any azimuth. Absorption takes C_T^l, l in units of 2 sqrt(A B), the diameter of a round fiber of the same section.
 *
 * Differs from the publication: a lattice takes the place of random facets inside, so that value, density and
 * derivatives are functions of the parameters; R has 1 / (cos th_i cos th_o), and the published form lacks one cosine;
 * a(th) balances the lobes as in dielectric.v1 and takes the place of this factor, so that S is reciprocal and light
 * that facets hide from each other is not lost; the section's orientation and the direction of the scales are averaged
 * over; facets have the slopes of Beckmann's distribution, and scales add a mean slope to them.
 *
 * kappa takes the derivative of a mean by a mean of slopes: d <x> / d k = <x sum of p> / <p^2>.
 *
 * The sums over paths are rough functions of eta, a and r where rays begin to be reflected totally, and their slopes
 * would be noise. So N, mu and sigma are made at nodes of a grid of ln eta, ln a and ln r, some 3, 8 and 15 % apart,
 * and are linear in between, over the four corners of a simplex. R and the shadowing of its facets depend on the
 * parameters themselves. Derivatives are exact for the tabulated function, and the derivatives by eta, a and r step
 * between simplices.
 */
#ifndef SELVEDGE_RENDERER_MICROFACET_H
#define SELVEDGE_RENDERER_MICROFACET_H

#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/lobe_balance.h"
#include "renderer/scattering/models/microfacet/microfacet_rows.def"
#include "renderer/scattering/models/microfacet/microfacet_surface.h"
#include "renderer/scattering/models/microfacet/microfacet_walk.h"
#include "renderer/scattering/scattering.h"

enum {
    MICROFACET_P_C_T = 0,
    MICROFACET_P_ETA = 3,
    MICROFACET_P_RATIO,
    MICROFACET_P_ROUGHNESS,
    MICROFACET_P_TAU,
    MICROFACET_N_PARAM
};
enum { MICROFACET_N_SEEN = 200 };
enum { MICROFACET_N_ROW = 24, MICROFACET_N_PHI = 180, MICROFACET_N_SCALE_NODE = 129 };
enum {
    MICROFACET_N_DRAW = 2039,
    MICROFACET_DRAW_STEP = 850 /* of the lattice: the least P2 in the dimensions of a draw */
};
#define MICROFACET_DIFFERENCE 1e-5

/* Lobes in samples: R, TT, TRT, the rest. */
enum { MICROFACET_R, MICROFACET_INNER, MICROFACET_REST = MICROFACET_INNER + MICROFACET_N_INNER, MICROFACET_N_LOBE };
/* Derivatives that tables hold besides the one by C_T, and derivatives of the scale a(th). */
enum { MICROFACET_BY_ETA, MICROFACET_BY_RATIO, MICROFACET_BY_ROUGHNESS, MICROFACET_N_BY };
enum { MICROFACET_BY_TAU = MICROFACET_N_BY, MICROFACET_N_SCALE };

/* At one place of the table. */
struct microfacet_cell {
    float n[MICROFACET_N_INNER][3], shift[MICROFACET_N_INNER], width[MICROFACET_N_INNER]; /* N, mu, sigma */
};
struct microfacet_slope {
    float n[MICROFACET_N_INNER][MICROFACET_N_BY][3], by_c_t[MICROFACET_N_INNER][3];
    float shift[MICROFACET_N_INNER][MICROFACET_N_SCALE], width[MICROFACET_N_INNER][MICROFACET_N_BY];
};

/* By cos th_d. */
struct microfacet_row {
    float rest[3], by_c_t[3], d_rest[MICROFACET_N_BY][3];               /* N_rest */
    float width, d_width[MICROFACET_N_BY];                              /* of M_rest */
    float seen[MICROFACET_N_SEEN + 1], d_seen[MICROFACET_N_SEEN + 1];   /* V by cos alpha from -1 to 1, and d V / d r */
    float energy[MICROFACET_N_LOBE][3];                                 /* of each lobe: for the choice of a lobe */
    float density[MICROFACET_REST][MICROFACET_N_PHI + 1];               /* of azimuths, integral 1 over [0, pi] */
    float below[MICROFACET_REST][MICROFACET_N_PHI + 1];                 /* its integral from 0 */
    float shift_r[MICROFACET_N_PHI + 1], width_r[MICROFACET_N_PHI + 1]; /* samples of R along the fiber */
};

struct scattering_state {
    struct microfacet_surface surface;
    float scale[MICROFACET_N_SCALE_NODE]; /* a by |th| */
    float d_ln_scale[MICROFACET_N_SCALE][MICROFACET_N_SCALE_NODE];
    struct microfacet_row row[MICROFACET_N_ROW + 1];
    struct microfacet_cell cell[MICROFACET_N_ROW + 1][MICROFACET_N_PHI + 1];
    struct microfacet_slope slope[MICROFACET_N_ROW + 1][MICROFACET_N_PHI + 1];
};

/* Share of the facets of R that both directions see, between a row and the next, and its derivative by r. */
static inline float microfacet_seen_at(const struct microfacet_row *row, float x, const float cos_alpha[2], float *d)
{
    float sum = -1;
    *d = 0;
    for (int k = 0; k < 2; k++) {
        int i;
        const float y = table_position((1 + cos_alpha[k]) * (0.5f * MICROFACET_N_SEEN), MICROFACET_N_SEEN, &i);
        sum += table_mix(table_mix(row[0].seen[i], row[0].seen[i + 1], y),
                         table_mix(row[1].seen[i], row[1].seen[i + 1], y), x);
        *d += table_mix(table_mix(row[0].d_seen[i], row[0].d_seen[i + 1], y),
                        table_mix(row[1].d_seen[i], row[1].d_seen[i + 1], y), x);
    }
    if (sum > 0) return sum;
    *d = 0;
    return 0;
}

/* N without absorption, and its derivatives, which the balance needs. */
struct microfacet_clear {
    double n[MICROFACET_N_INNER][MICROFACET_N_PHI + 1], d[MICROFACET_N_BY][MICROFACET_N_INNER][MICROFACET_N_PHI + 1];
    double rest, d_rest[MICROFACET_N_BY];
};

/* Fills in rows, cells and slopes, and the rows without absorption. The surface is set. STATUS_NO_MEMORY. */
status microfacet_tables(struct scattering_state *s, const double *param,
                         struct microfacet_clear clear[MICROFACET_N_ROW + 1], struct error *err);
/* Fills in the scale; the tables are made. STATUS_NO_MEMORY. */
status microfacet_balance(struct scattering_state *s, const struct microfacet_clear clear[MICROFACET_N_ROW + 1],
                          struct error *err);

#endif
