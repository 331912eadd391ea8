#include "tests/support/fiber/fiber_rays.h"
#include "base/angle.h"
#include "base/rng.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

enum { N_THETA = 21, N_PHI = 45, MOST_EVENTS = 20000 };
static const double first_theta_deg = 10, theta_step_deg = 2, first_phi_deg = -20, phi_step_deg = 5;

const char *const published_fiber_name[PUBLISHED_N_FIBER] = {"bobcat", "cat",     "deer",    "dog",       "mouse",
                                                             "rabbit", "raccoon", "red fox", "springbok", "human"};
static const struct ray_fiber published_deg[PUBLISHED_N_FIBER] = {
    {1.69, .88, .47, 5.48, 11.64, 7.49, 1.69, .17, .44, .64}, {1.36, .87, .44, 3.65, 5.66, 1.34, 2.47, .12, .60, .06},
    {1.60, .91, .45, 3.52, 7.00, 4.53, 2.51, .09, .46, 1.39}, {1.58, .68, .60, 2.94, 5.77, 18.94, 2.44, .00, .26, .01},
    {1.35, .66, 2.36, .55, 8.39, 2.80, 1.34, .06, .36, .04},  {1.47, .79, 1.03, 3.14, 11.91, 10.52, .78, .10, .12, .24},
    {1.19, .65, 2.00, 1.81, 7.44, 6.88, 2.30, .14, .08, .25}, {1.49, .86, .68, 2.64, 9.45, 17.63, 3.15, .21, .79, .39},
    {1.48, .82, .46, 4.61, 8.02, 11.46, 2.45, .31, .19, .32}, {1.20, .36, 1.79, .70, 2.05, 3.75, 3.49, .00, .28, .41}};

struct ray_fiber published_fiber(int i)
{
    struct ray_fiber f = published_deg[i];
    f.alpha_rad *= RAD_PER_DEG;
    f.beta_rad *= RAD_PER_DEG;
    f.gamma_rad *= RAD_PER_DEG;
    return f;
}

/* x along the fiber, y and z across. Lengths are those of the path in three dimensions. */
struct ray {
    double p[3], d[3];
    bool in_medulla;
};

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void move(struct ray *r, double length)
{
    for (int k = 0; k < 3; k++) r->p[k] += length * r->d[k];
}

/* Lengths at which the line of a ray meets a cylinder of that radius about the axis; false: it does not. */
static bool meet(const struct ray *r, double radius, double length[2])
{
    const double a = r->d[1] * r->d[1] + r->d[2] * r->d[2], b = r->p[1] * r->d[1] + r->p[2] * r->d[2],
                 c = r->p[1] * r->p[1] + r->p[2] * r->p[2] - radius * radius, root = b * b - a * c;
    if (!(root > 0) || !(a > 1e-18)) return false;
    length[0] = (-b - sqrt(root)) / a;
    length[1] = (-b + sqrt(root)) / a;
    return true;
}

/* Reflectance of the cuticle for light that meets the outside at that cosine. */
static double reflectance(const struct ray_fiber *f, double cos_out, double cos_in)
{
    const double s = (cos_out - f->eta * cos_in) / (cos_out + f->eta * cos_in),
                 p = (f->eta * cos_out - cos_in) / (f->eta * cos_out + cos_in),
                 one = 0.5 * (s * s / (1 + s * s) + p * p / (1 + p * p));
    return f->layers * one / (1 + (f->layers - 1) * one);
}

/* The normal of the wall at the ray, to the outside, with scales and roughness. */
static void wall_normal(const struct ray_fiber *f, const struct ray *r, struct rng *rng, double n[3])
{
    double u[2];
    rng_normal_pair(rng, u);
    const double along = 0.5 * (f->alpha_rad + f->beta_rad * u[0]), around = 0.5 * f->gamma_rad * u[1],
                 azimuth = atan2(r->p[2], r->p[1]) + around;
    n[0] = sin(along);
    n[1] = cos(along) * cos(azimuth);
    n[2] = cos(along) * sin(azimuth);
}

/* Direction after reflection (ratio 0) or refraction by n, which the ray meets at that cosine against the normal. */
static void turn(struct ray *r, const double n[3], double cosine, double ratio, double cos_after)
{
    for (int k = 0; k < 3; k++)
        r->d[k] = ratio > 0 ? ratio * r->d[k] + (ratio * cosine - cos_after) * n[k] : r->d[k] + 2 * cosine * n[k];
    const double size = sqrt(dot(r->d, r->d));
    for (int k = 0; k < 3; k++) r->d[k] /= size;
}

/* A meeting with the wall. Returns whether the ray is outside afterwards. A rough normal that would leave it on the
 * wrong side is replaced by the smooth one. */
static bool meet_wall(const struct ray_fiber *f, struct ray *r, bool from_inside, struct rng *rng)
{
    const double smooth[3] = {0, r->p[1], r->p[2]}, before[3] = {r->d[0], r->d[1], r->d[2]}, chance = rng_double(rng);
    double n[3];
    wall_normal(f, r, rng, n);
    for (int attempt = 0; attempt < 2; attempt++) {
        for (int k = 0; k < 3; k++) {
            if (attempt > 0) n[k] = smooth[k];
            r->d[k] = before[k];
        }
        const double against = from_inside ? dot(before, n) : -dot(before, n);
        if (!(against > 0)) continue;
        const double ratio = from_inside ? f->eta : 1 / f->eta, sine = 1 - ratio * ratio * (1 - against * against),
                     after = sine > 0 ? sqrt(sine) : 0;
        const bool reflected =
            !(sine > 0) || chance < reflectance(f, from_inside ? after : against, from_inside ? against : after);
        double m[3];
        for (int k = 0; k < 3; k++) m[k] = from_inside ? -n[k] : n[k];
        turn(r, m, against, reflected ? 0 : ratio, after);
        const bool outside = dot(r->d, smooth) > 0;
        if (outside == (reflected != from_inside)) return outside;
    }
    return dot(r->d, smooth) > 0;
}

static double free_length(double sigma, struct rng *rng)
{
    return sigma > 0 ? -log1p(-rng_double(rng)) / sigma : INFINITY;
}

/* A new direction by Henyey and Greenstein. */
static void scatter(struct ray *r, double g, struct rng *rng)
{
    const double u = 2 * rng_double(rng) - 1, v = (1 - g * g) / (1 + g * u),
                 cosine = fabs(g) < 1e-6 ? u : fmin(fmax((1 + g * g - v * v) / (2 * g), -1), 1),
                 sine = sqrt(1 - cosine * cosine), phi = 2 * M_PI * rng_double(rng);
    double a[3] = {0, 0, 0}, b[3], size = 0;
    a[fabs(r->d[0]) < 0.6 ? 0 : 1] = 1;
    for (int k = 0; k < 3; k++) size += r->d[k] * a[k];
    for (int k = 0; k < 3; k++) a[k] -= size * r->d[k];
    size = sqrt(dot(a, a));
    for (int k = 0; k < 3; k++) a[k] /= size;
    for (int k = 0; k < 3; k++) b[k] = r->d[(k + 1) % 3] * a[(k + 2) % 3] - r->d[(k + 2) % 3] * a[(k + 1) % 3];
    for (int k = 0; k < 3; k++) r->d[k] = cosine * r->d[k] + sine * (cos(phi) * a[k] + sin(phi) * b[k]);
    size = sqrt(dot(r->d, r->d));
    for (int k = 0; k < 3; k++) r->d[k] /= size;
}

enum fate { GOES_ON, ABSORBED, AT_WALL };

static enum fate cross_medulla(const struct ray_fiber *f, struct ray *r, struct rng *rng)
{
    double length[2];
    const double to_event = free_length(f->sigma_ms + f->sigma_ma, rng);
    if (!meet(r, f->kappa, length) || length[1] <= to_event) {
        move(r, meet(r, f->kappa, length) ? length[1] : 0);
        r->in_medulla = false;
        return GOES_ON;
    }
    move(r, to_event);
    if (rng_double(rng) * (f->sigma_ms + f->sigma_ma) < f->sigma_ma) return ABSORBED;
    scatter(r, f->g, rng);
    return GOES_ON;
}

static enum fate cross_cortex(const struct ray_fiber *f, struct ray *r, struct rng *rng)
{
    double medulla[2], wall[2];
    const double to_event = free_length(f->sigma_ca, rng), least = 1e-9;
    const bool enters = meet(r, f->kappa, medulla) && medulla[0] > least;
    if (!meet(r, 1, wall)) return ABSORBED; /* along the axis: it never leaves */
    const double to_next = enters ? medulla[0] : fmax(wall[1], 0);
    if (to_event < to_next) return ABSORBED;
    move(r, to_next);
    r->in_medulla = enters;
    return enters ? GOES_ON : AT_WALL;
}

/* Follows one ray from its first meeting with the wall. Returns whether it leaves the fiber. */
static bool follow(const struct ray_fiber *f, struct ray *r, struct rng *rng)
{
    if (meet_wall(f, r, false, rng)) return true;
    for (int event = 0; event < MOST_EVENTS; event++) {
        const enum fate fate = r->in_medulla ? cross_medulla(f, r, rng) : cross_cortex(f, r, rng);
        if (fate == ABSORBED) return false;
        if (fate == AT_WALL && meet_wall(f, r, true, rng)) return true;
    }
    return false;
}

/* The bin of a direction, or -1. */
static int bin_of(const double *d)
{
    const double theta = asin(fmin(fmax(d[0], -1), 1)) * DEG_PER_RAD;
    double phi = atan2(d[2], d[1]) * DEG_PER_RAD;
    if (phi < first_phi_deg - 0.5 * phi_step_deg) phi += 360;
    const int i = (int)floor((theta - first_theta_deg) / theta_step_deg + 0.5),
              j = (int)floor((phi - first_phi_deg) / phi_step_deg + 0.5);
    return i >= 0 && i < N_THETA && j >= 0 && j < N_PHI ? i * N_PHI + j : -1;
}

double fiber_rays_profile(const struct ray_fiber *fiber, double theta_i_rad, uint32_t n_ray, uint64_t seed,
                          struct fiber_profile *profile)
{
    const struct rng_key key = {.seed = seed};
    double count[N_THETA * N_PHI] = {0}, n_left = 0;
    for (uint32_t i = 0; i < n_ray; i++) {
        struct rng rng;
        rng_start(&rng, &key, i, 0);
        const double h = 2 * rng_double(&rng) - 1;
        struct ray_fiber f = *fiber;
        if (f.either_way && rng_double(&rng) < 0.5) f.alpha_rad = -f.alpha_rad;
        struct ray r = {{0, sqrt(1 - h * h), h}, {-sin(theta_i_rad), -cos(theta_i_rad), 0}, false};
        if (!follow(&f, &r, &rng)) continue;
        n_left++;
        const int bin = bin_of(r.d);
        if (bin >= 0) count[bin]++;
    }
    *profile = (struct fiber_profile){.n = N_THETA * N_PHI, .n_channel = 1, .has_se = true};
    profile->row = calloc(profile->n, sizeof *profile->row);
    for (int i = 0; i < N_THETA * N_PHI && profile->row != NULL; i++) {
        const double theta = (first_theta_deg + i / N_PHI * theta_step_deg) * RAD_PER_DEG,
                     half = 0.5 * theta_step_deg * RAD_PER_DEG,
                     solid = (sin(theta + half) - sin(theta - half)) * phi_step_deg * RAD_PER_DEG,
                     one = cos(theta_i_rad) / (cos(theta) * solid * n_ray);
        profile->row[i] = (struct profile_row){.theta_i_rad = theta_i_rad,
                                               .theta_o_rad = theta,
                                               .phi_rad = (first_phi_deg + i % N_PHI * phi_step_deg) * RAD_PER_DEG,
                                               .radiance = {one * count[i]},
                                               .se = {one * sqrt(fmax(count[i], 1))}};
    }
    return n_left / n_ray;
}

void fiber_rays_print(const struct fiber_profile *profile, FILE *out)
{
    fputs("theta_o_deg,phi_deg,radiance,radiance_se\n", out);
    for (size_t i = 0; i < profile->n; i++)
        fprintf(out, "%.4g,%.4g,%.6g,%.3g\n", profile->row[i].theta_o_rad * DEG_PER_RAD,
                profile->row[i].phi_rad * DEG_PER_RAD, profile->row[i].radiance[0], profile->row[i].se[0]);
}
