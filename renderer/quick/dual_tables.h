/* Tables of dual scattering for a kind of fiber: averages of its scattering model (Zinke, Yuksel, Weber and Keyser
 * 2008, "Dual Scattering Approximation for Fast Multiple Scattering in Hair"; dissertation of Yan, section 2.5,
 * equations 2.18 to 2.20): how much light goes on forwards and comes back, and how far it spreads along the fiber.
 *
 * theta: angle of a direction from the plane across the fiber, in [-pi/2, pi/2]; phi: azimuth between the directions to
 * the light and to the eye, 0 where both lie on the same side. The averages hold for round fibers, whose scattering
 * depends on the difference of azimuths only and is the same for phi and -phi. */
#ifndef SELVEDGE_RENDERER_DUAL_TABLES_H
#define SELVEDGE_RENDERER_DUAL_TABLES_H

#include "base/thread_pool.h"
#include "renderer/scattering/scattering.h"
#include "renderer/scene/scene.h"

enum { DUAL_N_THETA = 46, DUAL_N_PHI = 9, DUAL_N_SPREAD = 10 };

/* Of light from one theta. The fractions are shares of the light that meets the fiber, for each channel; shifts and
 * variances belong to theta_o + theta_i, weighted by the energy of all channels. */
struct dual_average {
    float forward[3];  /* fraction scattered into the half away from the light: a_f of equation 2.18 */
    float backward[3]; /* into the half on the light's side: a_b */
    float shift_forward_rad, shift_backward_rad, var_forward_rad2, var_backward_rad2;
    float deep[3];                       /* fraction that comes back from the fibers behind: A_b = A_1 + A_3 */
    float shift_deep_rad, var_deep_rad2; /* Delta_b and sigma_b squared */
};

struct dual_tables {
    size_t n_set;
    struct dual_average *average; /* n_set x DUAL_N_THETA, theta of the light */
    /* S averaged over the azimuths of half a turn about phi, and over theta_i by a Gaussian about theta_d:
     * n_set x DUAL_N_SPREAD (standard deviation) x DUAL_N_THETA (theta_o) x DUAL_N_THETA (theta_d) x DUAL_N_PHI x 3,
     * per steradian. What fibers in front do to the directions of light (M^G N^G of equation 2.20). */
    float *blurred;
    float *norm; /* DUAL_N_SPREAD x DUAL_N_THETA: integral of a Gaussian about theta times cos^2 */
};

/* param: max(n_set, 1) * model->n_param. Some tenths of a second for each set. STATUS_INVALID for a model whose fibers
 * are flat (field "model"), or a parameter (field: its name); STATUS_NO_MEMORY, STATUS_CANCELLED. Release in any
 * case. */
status dual_tables_init(struct dual_tables *t, const struct scene *scene, const struct scattering_model *model,
                        const double *param, size_t n_set, struct thread_pool *pool, const struct progress *progress,
                        struct error *err);
void dual_tables_release(struct dual_tables *t);

/* Linear between the table's angles. */
void dual_average_at(const struct dual_tables *t, size_t i_set, float theta_rad, struct dual_average *out);
/* The blurred S of light about theta_d with a variance of theta, per steradian. */
void dual_blurred_at(const struct dual_tables *t, size_t i_set, float theta_d_rad, float theta_o_rad, float phi_rad,
                     float var_rad2, float s_rgb[3]);
/* The lobe of light that comes back from the fibers behind (equation 2.19) with `var_rad2` added to its variance, for
 * the light of average `a`; without the indicator of the half that it goes to, over which it is the same. Its energy
 * over that half is a->deep. */
void dual_deep_lobe(const struct dual_tables *t, const struct dual_average *a, float theta_i_rad, float theta_o_rad,
                    float var_rad2, float s_rgb[3]);

/* A_1 + A_3 for fractions forward and backward: light that comes back after one and after three turns. */
float dual_deep_fraction(float forward, float backward);

/* How a radiance source renders by dual scattering. */
struct dual_option {
    const struct dual_tables *tables;
    /* Shares of light that is scattered by fibers in front and that comes back from fibers behind: 0.6 to 0.8 for hair
     * as published, 1 for cloth (fabric thesis, section 6.6), whose fibers lie closer. */
    float density_forward, density_backward;
};

#endif
