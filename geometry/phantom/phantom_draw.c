/* Draws fibers as chains of capsules; the shares of voxels are explained in phantom_raster.c. */
#include "geometry/phantom/phantom_draw.h"

#include <math.h>
#include <string.h>

struct capsule {
    double a[3], d[3], length2; /* voxels */
    struct ramp {
        double r, ramp, scale;         /* scale: below 1 for fibers thinner than the ramp */
    } ramp[2];                         /* at both ends, as the next */
    bool disc;                         /* all sections are full discs */
    struct phantom_section section[2]; /* its angles are in angle */
    double across[2][3];               /* frame of the section's angle */
    double angle[2];                   /* of the long axis */
    /* The ends of a fiber are flat, so that it joins its continuation in the next tile without a bulge. */
    double end[2][3], outward[2][3], end_reach;
};

/* q: offset of p from the nearest point of the axis. Returns its length. */
static double axis_distance(const struct capsule *c, const double p[3], double q[3], double *at)
{
    for (int a = 0; a < 3; a++) q[a] = p[a] - c->a[a];
    double t = (q[0] * c->d[0] + q[1] * c->d[1] + q[2] * c->d[2]) / c->length2;
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    for (int a = 0; a < 3; a++) q[a] -= t * c->d[a];
    *at = t;
    return sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
}

static bool behind_an_end(const struct capsule *c, const double p[3])
{
    for (int e = 0; e < 2; e++) {
        double along = 0.0, distance2 = 0.0;
        for (int a = 0; a < 3; a++) {
            double q = p[a] - c->end[e][a];
            along += q * c->outward[e][a];
            distance2 += q * q;
        }
        if (distance2 < 2.0 * c->end_reach * c->end_reach && (e == 0 ? along > 0.0 : along >= 0.0)) return true;
    }
    return false;
}

static void fiber_ends(struct capsule *c, const struct fiber_set *f, size_t i, double per_m)
{
    size_t first = f->first_vertex[i], last = f->first_vertex[i + 1] - 1;
    const size_t at[2] = {first, last}, inner[2] = {first + 1, last - 1};
    for (int e = 0; e < 2; e++)
        for (size_t a = 0; a < 3; a++) {
            c->end[e][a] = (double)f->position_m[3 * at[e] + a] * per_m;
            c->outward[e][a] = c->end[e][a] - (double)f->position_m[3 * inner[e] + a] * per_m;
        }
}

/* The nearest segment of a fiber decides about its share, because a section may be empty inside. */
static void add_share(struct phantom_slab *s, size_t at, uint32_t fiber, float share, float distance)
{
    if (s->owner[at] != fiber) {
        s->owner[at] = fiber;
        s->share[at] = 0.0f;
        if (s->apart != NULL) s->apart[at] = INFINITY;
    }
    if (s->apart == NULL ? share <= s->share[at] : distance >= s->apart[at]) return;
    s->drawn[at] += share - s->share[at];
    s->share[at] = share;
    if (s->apart != NULL) s->apart[at] = distance;
}

/* Share of a voxel whose centre is q from the axis, at a distance d from it and at the part t of the segment. */
static double share_at(const struct capsule *c, const double q[3], double d, double t)
{
    const struct ramp *p = c->ramp;
    const double ramp = p[0].ramp + t * (p[1].ramp - p[0].ramp), scale = p[0].scale + t * (p[1].scale - p[0].scale);
    if (c->disc) return scale * fmin(fmax(0.0, 0.5 + ramp - d), 1.0);
    struct phantom_section section = c->section[0];
    section.lumen += t * (c->section[1].lumen - section.lumen);
    section.aspect += t * (c->section[1].aspect - section.aspect);
    double x = 0.0, y = 0.0, angle = c->angle[0] + t * (c->angle[1] - c->angle[0]);
    for (int a = 0; a < 3; a++) {
        x += q[a] * c->across[0][a];
        y += q[a] * c->across[1][a];
    }
    return phantom_section_share(&section, p[0].r + t * (p[1].r - p[0].r), cos(angle) * x + sin(angle) * y,
                                 cos(angle) * y - sin(angle) * x);
}

static void draw_capsule(struct phantom_slab *s, const struct capsule *c, uint32_t fiber, long z_from, long z_to)
{
    long low[3], high[3], n[2] = {(long)s->n[0], (long)s->n[1]};
    const double r = fmax(c->ramp[0].r, c->ramp[1].r);
    const double reach = c->disc
                             ? fmax(c->ramp[0].ramp, c->ramp[1].ramp) + 0.5
                             : fmax(phantom_section_reach(&c->section[0], r), phantom_section_reach(&c->section[1], r));
    for (int a = 0; a < 3; a++) {
        low[a] = (long)floor(fmin(c->a[a], c->a[a] + c->d[a]) - reach - 0.5);
        high[a] = (long)ceil(fmax(c->a[a], c->a[a] + c->d[a]) + reach - 0.5);
    }
    low[2] = low[2] < z_from ? z_from : low[2];
    high[2] = high[2] >= z_to ? z_to - 1 : high[2];
    for (long k = low[2]; k <= high[2]; k++)
        for (long j = low[1]; j <= high[1]; j++)
            for (long i = low[0]; i <= high[0]; i++) {
                double p[3] = {(double)i + 0.5, (double)j + 0.5, (double)k + 0.5}, q[3], t;
                double d = axis_distance(c, p, q, &t);
                if (!(d < reach) || behind_an_end(c, p)) continue;
                size_t x = (size_t)((i % n[0] + n[0]) % n[0]), y = (size_t)((j % n[1] + n[1]) % n[1]);
                add_share(s, volume_index(s->n, x, y, (size_t)k - s->first), fiber, (float)share_at(c, q, d, t),
                          (float)d);
            }
}

/* The section at vertex k, without its angle. */
static struct phantom_section section_at(const struct fiber_set *f, size_t k)
{
    if (f->shape == NULL) return (struct phantom_section){.aspect = 1.0};
    return (struct phantom_section){.lumen = (double)f->shape[k].lumen, .aspect = (double)f->shape[k].ratio};
}

/* Takes the angles from the long axes at both ends, k and k + 1. An axis has no sign, so the turn between them is at
 * most a quarter. */
static void take_long_axes(struct capsule *c, const struct fiber_set *f, size_t k)
{
    for (size_t end = 0; end < 2; end++) {
        const float *l = f->shape != NULL ? f->shape[k + end].long_axis : NULL;
        double x = 0.0, y = 0.0;
        for (int a = 0; a < 3 && l != NULL; a++) {
            x += (double)l[a] * c->across[0][a];
            y += (double)l[a] * c->across[1][a];
        }
        c->angle[end] = x != 0.0 || y != 0.0 ? atan2(y, x) : 0.0;
    }
    c->angle[1] -= M_PI * round((c->angle[1] - c->angle[0]) / M_PI);
}

/* The frame of the section's angle (phantom_section.h), from the direction of the segment, and the sections at both
 * ends. along_m: of its first end on its fiber. */
static void set_sections(struct capsule *c, const struct phantom_slab *s, size_t i, size_t k, double along_m)
{
    double length = sqrt(c->length2), t[3];
    for (int a = 0; a < 3; a++) t[a] = c->d[a] / length;
    phantom_section_frame(t, s->f->axis_class[i], c->across);
    const struct phantom_section law = s->section != NULL ? phantom_section_of(s->section, i) : section_at(s->f, k);
    c->section[0] = law;
    c->section[1] = s->section != NULL ? law : section_at(s->f, k + 1);
    if (s->section == NULL) {
        take_long_axes(c, s->f, k);
        return;
    }
    c->angle[0] = law.angle_rad + along_m * law.turn_rad_per_m;
    c->angle[1] = law.angle_rad + (along_m + length * s->voxel_size_m) * law.turn_rad_per_m;
}

static struct ramp ramp_of(double r)
{
    struct ramp p = {r, sqrt(fmax(0.0, r * r - 1.0 / 12.0)), 1.0};
    if (p.ramp < 0.5) p = (struct ramp){r, 0.5, 3.0 * r * r};
    return p;
}

/* Distance from the axis of fiber i beyond which nothing is drawn, in voxels. */
static double largest_reach(const struct phantom_slab *s, size_t i, bool disc)
{
    const struct fiber_set *f = s->f;
    double r = 0.0;
    const size_t first = f->first_vertex[i];
    struct phantom_section widest = s->section != NULL ? phantom_section_of(s->section, i) : section_at(f, first);
    for (size_t k = first; k < f->first_vertex[i + 1]; k++) {
        r = fmax(r, (double)fiber_radius_m(f, i, k) / s->voxel_size_m);
        if (s->section == NULL) widest.aspect = fmax(widest.aspect, section_at(f, k).aspect);
    }
    return disc ? r + 1.0 : phantom_section_reach(&widest, r) + 0.5;
}

bool phantom_slab_is_disc(const struct phantom_slab *s)
{
    if (s->section != NULL) return phantom_section_is_disc(s->section);
    for (size_t k = 0; s->f->shape != NULL && k < s->f->n_vertex; k++)
        if (s->f->shape[k].ratio > 1.0f || s->f->shape[k].lumen > 0.0f) return false;
    return true;
}

static void draw_fiber(struct phantom_slab *s, size_t i, long z_from, long z_to)
{
    const struct fiber_set *f = s->f;
    struct capsule c = {.disc = s->apart == NULL};
    const double per_m = 1.0 / s->voxel_size_m, reach = largest_reach(s, i, c.disc);
    double along_m = 0.0;
    c.end_reach = reach;
    fiber_ends(&c, f, i, per_m);
    for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++) {
        const float *p = f->position_m + 3 * k;
        double z0 = (double)p[2] * per_m, z1 = (double)p[5] * per_m;
        c.length2 = 0.0;
        for (int a = 0; a < 3; a++) {
            c.a[a] = (double)p[a] * per_m;
            c.d[a] = (double)p[3 + a] * per_m - c.a[a];
            c.length2 += c.d[a] * c.d[a];
        }
        const double from_m = along_m;
        along_m += sqrt(c.length2) * s->voxel_size_m;
        bool here = fmax(z0, z1) + reach >= (double)z_from && fmin(z0, z1) - reach <= (double)z_to;
        if (!here || c.length2 <= 0.0) continue;
        for (size_t end = 0; end < 2; end++) c.ramp[end] = ramp_of((double)fiber_radius_m(f, i, k + end) * per_m);
        if (!c.disc) set_sections(&c, s, i, k, from_m);
        draw_capsule(s, &c, (uint32_t)i + 1, z_from, z_to);
    }
}

void phantom_slab_draw(struct phantom_slab *s, size_t from, size_t to)
{
    size_t at = volume_index(s->n, 0, 0, from), end = volume_index(s->n, 0, 0, to);
    memset(s->drawn + at, 0, (end - at) * sizeof *s->drawn);
    memset(s->owner + at, 0, (end - at) * sizeof *s->owner);
    for (size_t i = 0; i < s->f->n_fiber; i++) draw_fiber(s, i, (long)(s->first + from), (long)(s->first + to));
    for (; at < end; at++) s->drawn[at] = fminf(s->drawn[at], 1.0f);
}
