#include "tests/support/fiber/section_rays.h"
#include "base/angle.h"
#include "base/rng.h"
#include "tests/support/model/space_ray.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_EXIT = 12, N_PHI = 72 };
static const double reach = 4.5; /* standard deviations of a Gaussian that count */

/* One set of rays: of one exit, light and azimuth of the light. */
struct light {
    const struct section_fiber *fiber;
    double axes[2]; /* of the section of area pi: short along v, long along w */
    double theta_i_rad, phi_rad, blur_rad;
    int exit;
};

/* Share of the light per azimuth, summed over rays, at the rows of one azimuth of the light. */
struct view {
    size_t n;
    const double *phi_o_rad;
    double *sum;
};

/* The quantile of a normal distribution, by Newton's steps on erf. */
static double normal_quantile(double share)
{
    double x = 0;
    for (int i = 0; i < 60; i++) {
        const double off = 0.5 * (1 + erf(x / M_SQRT2)) - share, slope = exp(-0.5 * x * x) / sqrt(2 * M_PI);
        x -= fmin(fmax(off / fmax(slope, 1e-12), -0.5), 0.5);
    }
    return x;
}

static void spread(const struct light *l, const struct view *v, double power, const double d[3])
{
    const double phi_e = atan2(d[2], d[1]);
    for (size_t k = 0; k < v->n; k++) {
        const double off = remainder(v->phi_o_rad[k] - phi_e, 2 * M_PI) / l->blur_rad;
        if (fabs(off) < reach) v->sum[k] += power * exp(-0.5 * off * off) / (sqrt(2 * M_PI) * l->blur_rad);
    }
}

/* A ray from the azimuth phi at the offset `across`, within -1..1, of the width that the section shows. */
static void trace(const struct light *l, double phi, double across, double weight, const struct view *v)
{
    const double half = hypot(l->axes[0] * sin(phi), l->axes[1] * cos(phi)), c = cos(l->theta_i_rad);
    double d[3] = {-sin(l->theta_i_rad), -c * cos(phi), -c * sin(phi)}, at[3], n[3], inside[3], leaving[3];
    space_enter(l->axes, phi, across * half, at);
    space_normal(l->axes, at, n);
    double f = space_refract(d, n, 1, l->fiber->eta, inside), left = weight * half * (1 - f);
    if (l->exit == 0) {
        space_reflect(d, n, leaving);
        spread(l, v, weight * half * f, leaving);
        return;
    }
    for (int k = 1; k <= l->exit; k++) {
        double turned[3];
        left *= pow(l->fiber->c_t, 0.5 * space_cross(l->axes, inside, at));
        space_normal(l->axes, at, n);
        for (int i = 0; i < 3; i++) n[i] = -n[i];
        f = space_refract(inside, n, l->fiber->eta, 1, leaving);
        if (k == l->exit && f < 1) spread(l, v, left * (1 - f), leaving);
        left *= f;
        space_reflect(inside, n, turned);
        for (int i = 0; i < 3; i++) inside[i] = turned[i];
    }
}

/* The two tilted lobes along the fiber of an exit. */
static double along(const struct section_fiber *f, int exit, double x_rad)
{
    static const double shift[4] = {1, 0.5, 1.5, 2.5}, width[4] = {1, 0.5, 2, 2};
    const int k = exit < 3 ? exit : 3;
    const double s = shift[k] * f->alpha_rad, w = width[k] * f->beta_rad;
    return 0.5 * (exp(-0.5 * pow((x_rad - s) / w, 2)) + exp(-0.5 * pow((x_rad + s) / w, 2))) / (sqrt(2 * M_PI) * w);
}

static void add_exit(struct light *l, uint32_t n_ray, const struct view *v)
{
    l->blur_rad = sqrt(0.5 * (l->exit + 1)) * l->fiber->gamma_rad;
    for (uint32_t i = 0; i < n_ray; i++) {
        const double u = (i + 0.5) / n_ray, across = 2 * fmod(0.5 + i * 0.6180339887498949, 1.0) - 1;
        trace(l, l->phi_rad + l->blur_rad * normal_quantile(u), across, 1.0 / n_ray, v);
    }
}

/* The rows from `first` to before `end` have one theta_i and phi_i. */
static void add_light(const struct section_fiber *f, int mode, uint32_t n_ray, struct profile_row *row, size_t n)
{
    double *phi_o = calloc(n, sizeof *phi_o), *sum = calloc(n, sizeof *sum);
    struct light l = {.fiber = f,
                      .axes = {1 / sqrt(f->ratio), sqrt(f->ratio)},
                      .theta_i_rad = row->theta_i_rad,
                      .phi_rad = row->phi_i_rad - f->turn_rad};
    if (phi_o == NULL || sum == NULL) abort();
    for (size_t k = 0; k < n; k++) phi_o[k] = row[k].phi_i_rad + row[k].phi_rad - f->turn_rad;
    for (l.exit = 0; l.exit <= MOST_EXIT; l.exit++) {
        if (mode >= 0 && (l.exit != mode && !(mode == 3 && l.exit > 3))) continue;
        for (size_t k = 0; k < n; k++) sum[k] = 0;
        add_exit(&l, n_ray, &(struct view){n, phi_o, sum});
        for (size_t k = 0; k < n; k++)
            row[k].radiance[0] += sum[k] * along(f, l.exit, row[k].theta_i_rad + row[k].theta_o_rad) *
                                  cos(row[k].theta_i_rad) / pow(cos(row[k].theta_o_rad), 2);
    }
    free(phi_o);
    free(sum);
}

void section_rays_add(const struct section_fiber *fiber, int mode, uint32_t n_ray, struct fiber_profile *profile)
{
    for (size_t first = 0, end; first < profile->n; first = end) {
        const struct profile_row *r = &profile->row[first];
        for (end = first; end < profile->n; end++)
            if (fabs(profile->row[end].theta_i_rad - r->theta_i_rad) > 1e-9 ||
                fabs(profile->row[end].phi_i_rad - r->phi_i_rad) > 1e-9)
                break;
        add_light(fiber, mode, n_ray, &profile->row[first], end - first);
    }
}

void section_rays_rows(size_t n_phi_i, double turn_rad, struct fiber_profile *profile)
{
    static const double theta_i_deg[3] = {0, -30, -60};
    *profile = (struct fiber_profile){.n = 3 * n_phi_i * N_PHI, .n_channel = 1, .has_phi_i = true};
    profile->row = calloc(profile->n, sizeof *profile->row);
    if (profile->row == NULL) abort();
    for (size_t i = 0; i < profile->n; i++) {
        const double theta_i = theta_i_deg[i / (n_phi_i * N_PHI)] * RAD_PER_DEG;
        profile->row[i] =
            (struct profile_row){.theta_i_rad = theta_i,
                                 .theta_o_rad = -theta_i,
                                 .phi_i_rad = turn_rad + 2 * M_PI * (double)(i / N_PHI % n_phi_i) / (double)n_phi_i,
                                 .phi_rad = 2 * M_PI * (double)(i % N_PHI) / N_PHI};
    }
}

void section_rays_noise(struct fiber_profile *profile, uint64_t seed)
{
    double most = 0;
    for (size_t i = 0; i < profile->n; i++) most = fmax(most, profile->row[i].radiance[0]);
    profile->has_se = true;
    for (size_t i = 0; i < profile->n; i++) {
        struct profile_row *row = &profile->row[i];
        struct rng r;
        double u[2];
        rng_start(&r, &(struct rng_key){.seed = seed}, (uint32_t)i, 0);
        rng_normal_pair(&r, u);
        row->se[0] = 0.03 * row->radiance[0] + 0.01 * most;
        row->radiance[0] += u[0] * row->se[0];
    }
}
