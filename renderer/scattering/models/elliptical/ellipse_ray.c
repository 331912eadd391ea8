#include "renderer/scattering/models/elliptical/ellipse_ray.h"

#include <stdbool.h>
#include <stddef.h>

#define GRAZING 0.05    /* square of the cosine of an angle outside, 77 degrees */
#define LEAST_LEFT 2e-3 /* share of a ray's light below which its last exits are taken together */

static inline struct dual constant(double v) { return (struct dual){v, {0, 0}}; }

/* f(x) with the slope f'(x). */
static inline struct dual chain(double v, double slope, struct dual x)
{
    return (struct dual){v, {slope * x.d[0], slope * x.d[1]}};
}

/* f(x, y) with its slopes. */
static inline struct dual chain2(double v, double by_x, struct dual x, double by_y, struct dual y)
{
    return (struct dual){v, {by_x * x.d[0] + by_y * y.d[0], by_x * x.d[1] + by_y * y.d[1]}};
}

static inline struct dual add(struct dual x, double f, struct dual y) { return chain2(x.v + f * y.v, 1, x, f, y); }
static inline struct dual times(struct dual x, struct dual y) { return chain2(x.v * y.v, y.v, x, x.v, y); }
static inline struct dual over(struct dual x, struct dual y)
{
    double q = x.v / y.v;
    return chain2(q, 1 / y.v, x, -q / y.v, y);
}
static inline struct dual sine(struct dual x) { return chain(sin(x.v), cos(x.v), x); }
static inline struct dual cosine(struct dual x) { return chain(cos(x.v), -sin(x.v), x); }
static inline struct dual root(struct dual x)
{
    double r = sqrt(x.v);
    return chain(r, 0.5 / r, x);
}
static inline struct dual angle(struct dual y, struct dual x)
{
    double n = x.v * x.v + y.v * y.v;
    return chain2(atan2(y.v, x.v), x.v / n, y, -y.v / n, x);
}

double ellipse_cosine_outside(double square, double *slope)
{
    const double t = fmax(0.5 * (square / GRAZING + 1), 0), size = sqrt(GRAZING);
    const bool grazing = square < GRAZING;
    const double root = grazing ? size * t * t * t * (2 - t * t) : sqrt(square);
    if (slope != NULL) *slope = grazing ? size * t * t * (6 - 5 * t * t) / (2 * GRAZING) : 0.5 / root;
    return root;
}

static struct dual cosine_outside(struct dual square)
{
    double slope, v = ellipse_cosine_outside(square.v, &slope);
    return chain(v, slope, square);
}

struct ellipse ellipse_of(double eta, double ratio)
{
    struct dual r = {ratio, {0, 1}}, major = root(r);
    return (struct ellipse){{eta, {1, 0}}, major, over(constant(1), major)};
}

/* Azimuth of the outward normal at the point gamma. */
static struct dual normal_at(const struct ellipse *e, struct dual gamma)
{
    return angle(over(sine(gamma), e->minor), over(cosine(gamma), e->major));
}

/* The offset along (-sin phi, cos phi) of the point gamma is H sin(gamma - gamma_0), cos gamma_0 = B cos phi / H, sin
 * gamma_0 = A sin phi / H. */
struct ellipse_entry ellipse_enter(const struct ellipse *e, double phi, double x)
{
    struct dual s = times(e->major, constant(sin(phi))), c = times(e->minor, constant(cos(phi)));
    struct ellipse_entry y = {.phi = phi, .half_width = root(add(times(s, s), 1, times(c, c)))};
    y.gamma = add(angle(s, c), 1, constant(x));
    y.nu = normal_at(e, y.gamma);
    return y;
}

struct ellipse_wall ellipse_wall_at(const struct ellipse *e, double cos_theta)
{
    double sin2 = 1 - cos_theta * cos_theta;
    struct dual inside = root(add(times(e->eta, e->eta), -1, constant(sin2))); /* eta cos th_t */
    return (struct ellipse_wall){cos_theta, over(inside, constant(cos_theta)), over(e->eta, inside)};
}

struct dual ellipse_reflectance(struct dual cos_out, struct dual eta)
{
    struct dual sin2 = add(constant(1), -1, times(cos_out, cos_out));
    struct dual cos_in = root(add(constant(1), -1, over(sin2, times(eta, eta))));
    struct dual q = times(eta, cos_in), p = times(eta, cos_out);
    struct dual s = over(add(cos_out, -1, q), add(cos_out, 1, q)), t = over(add(p, -1, cos_in), add(p, 1, cos_in));
    return times(constant(0.5), add(times(s, s), 1, times(t, t)));
}

/* Length of the chord between two points of the section. */
static struct dual chord(const struct ellipse *e, struct dual from, struct dual to)
{
    struct dual x = times(e->major, add(cosine(to), -1, cosine(from)));
    struct dual y = times(e->minor, add(sine(to), -1, sine(from)));
    return root(add(times(x, x), 1, times(y, y)));
}

static struct dual turned(struct dual x)
{
    x.v = remainder(x.v, 2 * M_PI);
    return x;
}

void ellipse_follow(const struct ellipse *e, const struct ellipse_wall *w, const struct ellipse_entry *entry,
                    struct ellipse_path *path)
{
    struct dual gamma = entry->gamma, nu = entry->nu, i = turned(add(constant(entry->phi), -1, nu));
    struct dual f = ellipse_reflectance(times(constant(w->cos_theta), cosine(i)), e->eta),
                left = add(constant(1), -1, f);
    struct dual sine_in = over(sine(i), w->index), length = constant(0);
    struct dual t = angle(sine_in, root(add(constant(1), -1, times(sine_in, sine_in))));
    struct dual way = add(add(nu, 1, t), 1, constant(M_PI));
    path->share[0] = f;
    path->length[0] = length;
    path->azimuth[0] = add(add(nu, -1, i), -1, constant(entry->phi));
    for (path->n = 1; path->n < ELLIPSE_N_EXIT; path->n++) {
        struct dual delta = angle(over(sine(way), e->minor), over(cosine(way), e->major));
        struct dual next = add(add(times(constant(2), delta), -1, gamma), 1, constant(M_PI));
        length = add(length, 1, times(chord(e, gamma, next), w->unit_length));
        gamma = next;
        if (path->n >= ELLIPSE_N_MODE && left.v < LEAST_LEFT) break;
        nu = normal_at(e, gamma);
        struct dual j = turned(add(way, -1, nu)), sine_out = times(w->index, sine(j));
        way = add(add(nu, -1, j), 1, constant(M_PI));
        struct dual share = constant(0), azimuth = constant(nu.v - entry->phi);
        struct dual cos_out = cosine_outside(add(constant(1), -1, times(sine_out, sine_out)));
        if (cos_out.v > 0) { /* otherwise the reflection is total */
            f = ellipse_reflectance(times(constant(w->cos_theta), cos_out), e->eta);
            share = times(left, add(constant(1), -1, f));
            azimuth = add(add(nu, 1, angle(sine_out, cos_out)), -1, constant(entry->phi));
            left = times(left, f);
        }
        path->share[path->n] = share;
        path->length[path->n] = length;
        if (path->n < ELLIPSE_N_MODE) path->azimuth[path->n] = azimuth;
    }
    path->share[path->n] = left;
    path->length[path->n++] = length;
}
