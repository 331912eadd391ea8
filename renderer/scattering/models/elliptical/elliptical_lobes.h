/* Common part of elliptical.v1 and elliptical_oriented.v1: their parameters, their lobes along the fiber, and the
 * balance of these. elliptical.h states the lobes. */
#ifndef SELVEDGE_RENDERER_ELLIPTICAL_LOBES_H
#define SELVEDGE_RENDERER_ELLIPTICAL_LOBES_H

#include "renderer/scattering/lobe_balance.h"
#include "renderer/scattering/models/elliptical/ellipse_ray.h"
#include "renderer/scattering/models/elliptical/elliptical_rows.def"
#include "renderer/scattering/scattering.h"
#include "renderer/scattering/tilted_lobe.h"

#include "base/status.h"

enum {
    ELLIPTICAL_P_C_T = 0,
    ELLIPTICAL_P_ETA = 3,
    ELLIPTICAL_P_RATIO,
    ELLIPTICAL_P_ALPHA,
    ELLIPTICAL_P_BETA,
    ELLIPTICAL_P_GAMMA,
    ELLIPTICAL_N_PARAM
};
enum {
    ELLIPTICAL_N_ROW = 32,
    ELLIPTICAL_N_LOBE = ELLIPSE_N_MODE, /* R, TT, TRT, TRRT; the rest has the lobe of TRRT along the fiber */
    ELLIPTICAL_REST = ELLIPTICAL_N_LOBE,
    ELLIPTICAL_N_MODE = ELLIPTICAL_N_LOBE + 1,
    ELLIPTICAL_N_INNER = ELLIPTICAL_N_LOBE - 1 /* lobes with a color */
};

/* Derivatives that the tables hold, and derivatives of the scale a(th). */
enum { ELLIPTICAL_D_C_T, ELLIPTICAL_D_ETA, ELLIPTICAL_D_RATIO, ELLIPTICAL_D_GAMMA, ELLIPTICAL_N_SLOPE };
enum { ELLIPTICAL_S_ETA, ELLIPTICAL_S_RATIO, ELLIPTICAL_S_ALPHA, ELLIPTICAL_S_BETA, ELLIPTICAL_N_SCALE };

/* N at one place of the table, and its derivatives. */
struct elliptical_cell {
    float n[ELLIPTICAL_N_LOBE][3];
};
struct elliptical_slope {
    float n[ELLIPTICAL_N_LOBE][ELLIPTICAL_N_SLOPE][3];
};

/* Mean shares of the modes without absorption, and their derivatives by eta and by the ratio, at each row. */
struct elliptical_energies {
    struct dual share[ELLIPTICAL_N_ROW + 1][ELLIPTICAL_N_MODE];
};

/* Shift and width of a lobe over alpha and beta. */
extern const double elliptical_shift[ELLIPTICAL_N_LOBE], elliptical_width[ELLIPTICAL_N_LOBE];

/* a by |th|, and its derivatives. */
struct elliptical_scale {
    float a[LOBE_BALANCE_N], d_ln[ELLIPTICAL_N_SCALE][LOBE_BALANCE_N];
};

void elliptical_lobes_set(struct tilted_lobe along[ELLIPTICAL_N_LOBE], const double *param);
/* Weight times share times absorption of one exit in one channel, and its derivatives by C_T, eta and the ratio. The
 * way inside is in radii, C_T of a diameter. */
enum { ELLIPTICAL_VALUE, ELLIPTICAL_BY_C_T, ELLIPTICAL_BY_ETA, ELLIPTICAL_BY_RATIO, ELLIPTICAL_N_SUM };
void elliptical_absorbed(struct dual share, struct dual length, double c_t, double out[ELLIPTICAL_N_SUM]);
static inline struct dual elliptical_weighted(struct dual w, struct dual x)
{
    return (struct dual){w.v * x.v, {w.v * x.d[0] + w.d[0] * x.v, w.v * x.d[1] + w.d[1] * x.v}};
}

/* Fills in the scale. STATUS_NO_MEMORY. */
status elliptical_balance(const struct tilted_lobe along[ELLIPTICAL_N_LOBE], const struct elliptical_energies *energies,
                          struct elliptical_scale *scale, struct error *err);

/* a(th); adds d ln a to d_ln. */
static inline float elliptical_scale_at(const struct elliptical_scale *s, float theta_rad,
                                        float d_ln[ELLIPTICAL_N_SCALE])
{
    int i;
    float t = table_position(fabsf(theta_rad) * (float)((LOBE_BALANCE_N - 1) / M_PI_2), LOBE_BALANCE_N - 1, &i);
    for (int k = 0; k < ELLIPTICAL_N_SCALE; k++) d_ln[k] += table_mix(s->d_ln[k][i], s->d_ln[k][i + 1], t);
    return table_mix(s->a[i], s->a[i + 1], t);
}

/* M of each lobe at th_i + th_o = x, and its derivatives by shift and width when wanted. */
static inline void elliptical_along(const struct tilted_lobe along[ELLIPTICAL_N_LOBE], float x,
                                    float m[ELLIPTICAL_N_LOBE], float (*d)[2])
{
    for (int p = 0; p < ELLIPTICAL_N_LOBE; p++) m[p] = tilted_lobe_eval(&along[p], x, d != NULL ? d[p] : NULL);
}

#endif
