/* fur.v1 and fur_near.v1: hair or wool with a medulla, a core that scatters, after Yan, Jensen and Ramamoorthi 2017,
 * "An Efficient and Practical Near and Far Field Fur Reflectance Model". Lossless where nothing absorbs.
 *
 *     S(wi, wo) = a(th_i) a(th_o) [ sum over R, TT, TRT of M_p(th_i, th_o) A_p D_p + M_TRT A_rest / (2 pi) ]
 *                 + b(th_i) b(th_o) M_s(th_i, th_o, ph) sum over TT^s, TRT^s of A_p C_p / B(th_d)
 *     D_p = wrapped Gaussian of ph - Phi_p, width sqrt(p + 1) gamma;    Phi_p = 2 p gamma_t - 2 x + p pi
 *     C_p = density of the medulla (medulla.h) at ph - Phi^s_p;  Phi^s_1 = gamma_t - x, Phi^s_2 = 3 gamma_t - x + pi
 *     M_p = (g(th_o + th_i - alpha_p; beta_p) + g(th_o + th_i + alpha_p; beta_p)) / 2, g a Gaussian
 *           alpha_p / alpha = 1, -1/2, -3/2    beta_p / beta = 1, 1/2, 3/2
 *     M_s = (1 - |ph| / pi) M_back + (|ph| / pi) M_through, the two longitudinal functions of the medulla (medulla.h)
 *     ph = ph_i - ph_o in [-pi, pi];  h = sin x, the offset of the view (near_field.h);  shares A of fur_ray.h at th_d
 *
 * fur_near.v1 takes h from the place of the fiber that is seen; fur.v1 is the mean over h.
 *
 * Differs from the publication, besides fur_ray.h: scales tilt light to both sides alike (tilted_lobe.h); a(th) takes
 * the place of 1 / cos^2 th_i. In the mean over h and without absorption the medulla scatters the share B(th) of light
 * from th, and b(th) balances M_s to this share: taken at th_d alone, as published, grazing light that a wide lobe
 * sends to the middle would be scattered as if it came from there, and fibers would give back more than they get. a(th)
 * balances R, TT, TRT and the rest to 1 - B(th), as in dielectric.v1. So nothing is lost or gained, and the mean is
 * reciprocal. For narrow lobes a a M_p is the published Gaussian over cos th_i cos th_o, and b b / B is 1. The optical
 * radius of the medulla around the fiber is kappa sigma_ms / cos th_t, the radius along it kappa sigma_ms, as the unit
 * circle demands (their text leaves kappa out).
 */
#ifndef SELVEDGE_RENDERER_FUR_H
#define SELVEDGE_RENDERER_FUR_H

#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/lobe_balance.h"
#include "renderer/scattering/models/fur/fur_mean.h"
#include "renderer/scattering/models/fur/fur_ray.h"
#include "renderer/scattering/models/fur/fur_rows.def"
#include "renderer/scattering/models/fur/medulla.h"
#include "renderer/scattering/scattering.h"
#include "renderer/scattering/tilted_lobe.h"

enum {
    FUR_P_C_T = 0,
    FUR_P_ETA = 3,
    FUR_P_KAPPA,
    FUR_P_LAYERS,
    FUR_P_ALPHA,
    FUR_P_BETA,
    FUR_P_GAMMA,
    FUR_P_MS,
    FUR_P_MA,
    FUR_P_G,
    FUR_N_PARAM
};
enum { FUR_N_LOBE = 3, FUR_N_SEGMENT = 2 };
/* Parameters that the scale a(th) depends on. */
enum fur_scale_by { FUR_S_ALPHA = FUR_N_MEAN_BY, FUR_S_BETA, FUR_N_SCALE }; /* numbered on from fur_mean_by */
enum { FUR_N_WIDE = 129 };

/* State of both models along the fiber. */
struct fur_along {
    struct fur_fiber fiber;
    struct tilted_lobe lobe[FUR_N_LOBE];
    struct medulla_along medulla;
    float scale[LOBE_BALANCE_N]; /* a by |th| */
    float d_ln_scale[FUR_N_SCALE][LOBE_BALANCE_N];
    float wide[FUR_N_WIDE], d_ln_wide[FUR_N_MEAN_BY][FUR_N_WIDE];      /* b(th) by |th| */
    float share[FUR_N_ROW + 1], d_share[FUR_N_MEAN_BY][FUR_N_ROW + 1]; /* B by cos th_d */
};

/* Shift and width of a lobe over alpha and beta. */
extern const double fur_shift[FUR_N_LOBE], fur_width[FUR_N_LOBE];

static inline struct fur_fiber fur_fiber_of(const double *param)
{
    return (struct fur_fiber){param[FUR_P_ETA], param[FUR_P_KAPPA], param[FUR_P_LAYERS], param[FUR_P_MS],
                              param[FUR_P_MA]};
}
/* The pool may be NULL. STATUS_NO_MEMORY. */
status fur_along_init(struct fur_along *s, const double *param, struct thread_pool *pool, struct error *err);

/* a(th); adds d ln a to d_ln. */
float fur_scale_at(const struct fur_along *s, float theta_rad, float d_ln[FUR_N_SCALE]);
/* b(th_i) b(th_o) / B(th_d), and its d ln. */
float fur_scattered_scale(const struct fur_along *s, const struct fiber_direction *in,
                          const struct fiber_direction *out, float cos_d, float d_ln[FUR_N_MEAN_BY]);

#endif
