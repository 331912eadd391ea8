#include "tests/support/tracer/naive_tracer.h"

#include "tests/support/tracer/reference_two_lobe.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

struct vec {
    double x, y, z;
};

static struct vec add(struct vec a, double t, struct vec b)
{
    return (struct vec){a.x + t * b.x, a.y + t * b.y, a.z + t * b.z};
}
static double dot(struct vec a, struct vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static struct vec cross(struct vec a, struct vec b)
{
    return (struct vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static struct vec unit(struct vec a) { return add((struct vec){0, 0, 0}, 1 / sqrt(dot(a, a)), a); }

struct hit {
    double t, radius;
    struct vec normal, tangent;
};

static struct vec vertex(const struct fiber_set *f, size_t v)
{
    const float *p = f->position_m + 3 * v;
    return (struct vec){(double)p[0], (double)p[1], (double)p[2]};
}

/* True when p is inside fiber k, the union of its cylinders and balls. A surface of one of them there is not a
 * surface of the fiber. */
static bool inside_fiber(const struct fiber_set *f, size_t k, struct vec p)
{
    double r = (double)f->radius_m[k] * (1 - 1e-6);
    for (size_t v = f->first_vertex[k]; v + 1 < f->first_vertex[k + 1]; v++) {
        struct vec a = vertex(f, v), axis = add(vertex(f, v + 1), -1, a), pa = add(p, -1, a);
        double t = fmin(fmax(dot(pa, axis) / dot(axis, axis), 0), 1);
        struct vec away = add(pa, -t, axis);
        if (dot(away, away) < r * r) return true;
    }
    return false;
}

/* True when the line of the ray misses a sphere about the middle of the segment a b that contains all its points. d
 * is a unit vector. The squared radius of the sphere is length^2 / 2 + 2 r^2 >= (length / 2 + r)^2. */
static bool passes_by(struct vec o, struct vec d, struct vec a, struct vec b, double r)
{
    struct vec axis = add(b, -1, a), to = add(add(a, 0.5, axis), -1, o);
    double along = dot(to, d);
    return dot(to, to) - along * along > 0.5 * dot(axis, axis) + 2 * r * r;
}

/* Finds the entry into the side of segment v of fiber k, or into the balls at its ends, between tnear and h->t. */
static void intersect_segment(const struct fiber_set *f, size_t k, size_t v, struct vec o, struct vec d, double tnear,
                              struct hit *h)
{
    struct vec a = vertex(f, v), b = vertex(f, v + 1), axis = add(b, -1, a), oa = add(o, -1, a);
    double length = sqrt(dot(axis, axis)), r = (double)f->radius_m[k];
    if (passes_by(o, d, a, b, r)) return;
    axis = unit(axis);
    for (int ball = 0; ball < 3; ball++) { /* cylinder, ball at a, ball at b */
        struct vec p = ball == 2 ? add(o, -1, b) : oa, dd = d, pp = p;
        if (ball == 0) {
            dd = add(d, -dot(d, axis), axis);
            pp = add(p, -dot(p, axis), axis);
        }
        double qa = dot(dd, dd), qb = dot(dd, pp), disc = qb * qb - qa * (dot(pp, pp) - r * r);
        if (disc < 0 || qa < 1e-14) continue;
        double t = (-qb - sqrt(disc)) / qa; /* only entries are hits, exits are ignored */
        if (t <= tnear || t >= h->t) continue;
        struct vec n = add(pp, t, dd);
        double along = dot(add(p, t, d), axis);
        if (ball == 0 && (along < 0 || along > length)) continue;
        if (inside_fiber(f, k, add(o, t, d))) continue;
        h->t = t;
        h->normal = unit(n);
        h->tangent = axis;
        h->radius = r;
    }
}

/* Intersects the part t0..t1 of the ray with all periodic copies of all fibers that it can meet. */
static void intersect_stretch(const struct fiber_set *f, struct vec o, struct vec d, double tnear, double t0, double t1,
                              struct hit *h)
{
    struct vec p = add(o, t0, d), q = add(o, t1, d);
    double margin = 0.3; /* largest distance of a vertex from its tile, in tiles */
    int i0 = (int)floor(fmin(p.x, q.x) / f->tile_size_m[0] - margin),
        i1 = (int)floor(fmax(p.x, q.x) / f->tile_size_m[0] + margin);
    int j0 = (int)floor(fmin(p.y, q.y) / f->tile_size_m[1] - margin),
        j1 = (int)floor(fmax(p.y, q.y) / f->tile_size_m[1] + margin);
    for (int i = i0; i <= i1; i++)
        for (int j = j0; j <= j1; j++) {
            struct vec local = {o.x - i * f->tile_size_m[0], o.y - j * f->tile_size_m[1], o.z};
            for (size_t k = 0; k < f->n_fiber; k++)
                for (size_t v = f->first_vertex[k]; v + 1 < f->first_vertex[k + 1]; v++)
                    intersect_segment(f, k, v, local, d, tnear, h);
        }
}

static bool intersect(const struct fiber_set *f, struct vec o, struct vec d, double tnear, double z_low, double z_high,
                      struct hit *h)
{
    double t_leave = d.z > 0 ? (z_high - o.z) / d.z : (z_low - o.z) / d.z, stretch = 0.5 * f->tile_size_m[0];
    h->t = INFINITY;
    for (double t0 = 0; t0 < t_leave && t0 < 1000 * stretch; t0 += stretch) {
        intersect_stretch(f, o, d, tnear, t0, fmin(t0 + stretch, t_leave), h);
        if (h->t <= t0 + stretch) return true;
    }
    return h->t < INFINITY;
}

/* Radiance of the lamp that arrives at o from direction d (orbit centre at z_top). The lamp's unit is defined by a
 * numerical integral over its square. */
static double lamp_radiance(const struct configuration *c, struct vec o, struct vec d)
{
    double phi = c->light_phi_rad - c->cloth_rotation_rad, th = c->light_theta_rad, side = c->lamp_side_m,
           dist = c->light_distance_m;
    struct vec to = {sin(th) * cos(phi), sin(th) * sin(phi), cos(th)}, centre = add((struct vec){0, 0, 0}, dist, to);
    double facing = dot(d, to);
    if (facing <= 0) return 0;
    double t = dot(add(centre, -1, o), to) / facing;
    struct vec p = add(add(o, t, d), -1, centre), e0 = {-sin(phi), cos(phi), 0};
    if (t <= 0 || fabs(dot(p, e0)) > side / 2 || fabs(dot(p, cross(to, e0))) > side / 2) return 0;
    double sum = 0;
    enum { N = 40 };
    for (int i = 0; i < N * N; i++) {
        double x = ((i % N + 0.5) / N - 0.5) * side, y = ((i / N + 0.5) / N - 0.5) * side,
               r2 = x * x + y * y + dist * dist;
        sum += dist * dist / (r2 * r2) * side * side / (N * N);
    }
    return M_PI / sum;
}

double naive_lamp_radiance(const struct configuration *c, const double from_m[3], const double d[3])
{
    return lamp_radiance(c, (struct vec){from_m[0], from_m[1], from_m[2]}, (struct vec){d[0], d[1], d[2]});
}

/* A point of the circumference about axis point p, with a density in proportion to the cosine between its normal and
 * d: a uniform place of the width that d sees. */
static struct vec facing_point(struct vec p, struct vec v, struct vec w, double radius, struct vec d, struct rng *r)
{
    double most = sqrt(dot(d, v) * dot(d, v) + dot(d, w) * dot(d, w));
    for (;;) {
        double angle = 2 * M_PI * rng_double(r);
        struct vec n = add(add((struct vec){0, 0, 0}, cos(angle), v), sin(angle), w);
        if (dot(n, d) > most * rng_double(r)) return add(p, radius, n);
    }
}

double naive_path(const struct fiber_set *f, const struct configuration *c, const double param[9], bool across_width,
                  struct rng *r)
{
    double z_low, z_high, throughput = 1, tnear = 0;
    fiber_set_z_range_m(f, &z_low, &z_high);
    double th = c->camera_theta_rad, phi = c->camera_phi_rad - c->cloth_rotation_rad;
    struct vec back = {sin(th) * cos(phi), sin(th) * sin(phi), cos(th)}, side = {-sin(phi), cos(phi), 0};
    struct vec eye = add((struct vec){0, 0, z_high}, c->camera_distance_m, back);
    struct vec target = add((struct vec){0, 0, z_high}, (rng_double(r) - 0.5) * c->crop_m, side);
    target = add(target, (rng_double(r) - 0.5) * c->crop_m, cross(back, side));
    struct vec d = unit(add(target, -1, eye)), o = add(eye, (z_high - eye.z) / d.z, d);
    for (;;) {
        struct hit h = {0};
        if (!intersect(f, o, d, tnear, z_low, z_high, &h))
            return d.z > 0 && tnear > 0 ? throughput * lamp_radiance(c, add(o, -z_high, (struct vec){0, 0, 1}), d) : 0;
        o = add(o, h.t, d);
        struct vec u = h.tangent,
                   v = unit(fabs(u.z) < 0.9 ? cross(u, (struct vec){0, 0, 1}) : cross(u, (struct vec){1, 0, 0})),
                   w = cross(u, v);
        double wo[3] = {-dot(d, u), -dot(d, v), -dot(d, w)};
        double a = rng_double(r), z = sqrt(a) * cos(2 * M_PI * rng_double(r)), az = 2 * M_PI * rng_double(r),
               cosine = sqrt(1 - z * z);
        double wi[3] = {z, cosine * cos(az), cosine * sin(az)}; /* probability density cos th / pi^2 */
        throughput *= reference_s(param, wi, wo, 0) * M_PI * M_PI;
        d = add(add(add((struct vec){0, 0, 0}, wi[0], u), wi[1], v), wi[2], w);
        tnear = 1e-3 * h.radius;
        if (across_width) {
            o = facing_point(add(o, -h.radius, h.normal), v, w, h.radius, d, r);
            continue;
        }
        double into = dot(d, h.normal), along = dot(d, u);
        if (into < 0) tnear += fmin(-2 * into / fmax(1 - along * along, 1e-6), 4) * h.radius;
    }
}
