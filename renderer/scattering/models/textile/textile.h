/* textile.v3: a fiber with a surface lobe R between rough and smooth, a transmitted lobe TT, and scattering inside,
 * whose section may be flat.
 * Reciprocal; lossless from both sides where C_TT = 1.
 *
 *     d     = (th_i - th_o) / 2,  ph = ph_o - ph_i       difference angle and relative azimuth
 *     N(ph) = (1 - s) / (2 pi) + s cos(ph / 2) / 4       azimuth of R: uniform, or as of a smooth cylinder
 *     k     = (1 - cos d cos(ph / 2))^5                  Schlick's rise at the half angle of both directions
 *     K(d)  = integral of N k dph                        a polynomial in cos d
 *     R  = a(th_i) a(th_o) g(th_o; -th_i, beta_R) N(ph) (C_R + (1 - C_R) k)
 *     v(ph) = sqrt(f^2 + (1 - f^2) cos^2 ph)             width of the section seen from ph over its largest width
 *     TT = b(th_i) b(th_o) g(th_o; -th_i, beta_TT) (1 - K(d)) t(ph_i) t(ph_o) f(ph_o; ph_i + pi, gamma_TT)
 *     D  = q(th_i) q(th_o) / Z v(ph_i) v(ph_o) / (mean of v) (1 - (2 h - 1) cos ph),  q = 1 - rho
 *     S  = R + C_TT (1 - C_R) (TT + w D)
 *
 * ph = 0 and ph = pi are the normals of the flat section, an ellipse of height over width f; for a flat fiber in a
 * cloth they lie as near to the cloth's normal as the fiber's direction lets them (fiber_frame.h). The tube that stands
 * for the fiber in the scene is as wide as the ellipse: of the light from ph, the share w v(ph) meets it and is
 * scattered inside, and the rest goes on in TT. t solves t(ph) (f * t)(ph) = 1 - w v(ph) (textile_section.c), so both
 * take all light that R leaves. A round section has f = 1, v = 1 and t = sqrt(1 - w). v has the period pi, so that the
 * mean of v cos ph is 0, and h takes light from one side of the fiber to the other without loss: h = 1/2 scatters alike
 * to all sides, and h < 1/2 scatters more towards where the light came from.
 *
 * Light enters the fiber at a random place of its width (scattering_model.across_width).
 *
 * a, b and rho solve the equations of two_lobe_balanced.c with K in place of its k; Z = 2 pi times the integral of
 * q cos^2 th. R takes C_R + (1 - C_R) rho of the light at any angle, TT and D each return the light that is left. cos d
 * cos(ph/2) is the cosine of the half angle between wi and wo where th_o = -th_i: N for a smooth cylinder and the half
 * angle follow Marschner et al. 2003, "Light Scattering from Human Hair Fibers", section 5.
 */
#ifndef SELVEDGE_RENDERER_TEXTILE_H
#define SELVEDGE_RENDERER_TEXTILE_H

#include "renderer/scattering/models/textile/textile_rows.def"
#include "renderer/scattering/models/two_lobe/two_lobe_core.h"

enum {
    TEXTILE_N_PARAM = surface_textile_n_param,
    TEXTILE_P_W = TWO_LOBE_N_PARAM, /* the parameters of two_lobe.v1 come first */
    TEXTILE_P_S,
    TEXTILE_P_F,
    TEXTILE_P_H
};
enum { TEXTILE_DEGREE = 5, TEXTILE_N_SECTION = 64 };
enum textile_section_slope { TEXTILE_BY_GAMMA, TEXTILE_BY_W, TEXTILE_BY_F, TEXTILE_N_SLOPE };

struct textile_entry { /* by |th| */
    float q;           /* 1 - rho */
    float d_q[2];      /* d ln q by beta_R and by s, each with half of d ln (1 / Z) */
    float cross_s;     /* d ln b / d s */
};

struct textile_section_entry {     /* by |cos ph| */
    float t, d_t[TEXTILE_N_SLOPE]; /* not of ln t: the slope of t as it is interpolated */
};

struct textile_state {
    struct scattering_state lobes; /* scales, sampling tables and TT's azimuth; cross: d ln b / d beta_R */
    float w, s, f, forward;        /* forward: 2 h - 1 */
    float share[TEXTILE_DEGREE + 1],
        d_share[TEXTILE_DEGREE + 1]; /* coefficients of K and of dK / ds in powers of 1 - cos d */
    float inv_z;
    struct textile_entry entry[TWO_LOBE_N_TABLE + 1];
    float inv_mean_v, d_ln_mean_v; /* of v over ph, and by f */
    struct textile_section_entry section[TEXTILE_N_SECTION + 1];
};

/* Fills in everything that needs the balanced scales. lobes, w and s are set. STATUS_NO_MEMORY. */
status textile_balance(struct textile_state *t, const double *param, struct error *err);
/* Fills in the mean of v and the table of t. lobes.azimuth, w and f are set. */
void textile_section(struct textile_state *t);

/* K or dK / ds from its coefficients. */
static inline float textile_polynomial(const float c[TEXTILE_DEGREE + 1], float cos_d)
{
    float sum = c[TEXTILE_DEGREE];
    for (int i = TEXTILE_DEGREE - 1; i >= 0; i--) sum = sum * (1 - cos_d) + c[i];
    return sum;
}

#endif
