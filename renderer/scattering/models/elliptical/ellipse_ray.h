/* Geometric optics of a smooth dielectric fiber with an elliptical section. One ray enters at a given offset; its exits
 * follow by exact hops in the section (Khungurn and Marschner 2017, "Azimuthal Scattering from Elliptical Hair Fibers";
 * fabric thesis, section 4.4). Each quantity carries its derivatives by the index of refraction and by the ratio of
 * axes.
 *
 * Section: semi-axes A = sqrt(a), B = 1 / sqrt(a) along v and w, so its area is pi and lengths are in units of the root
 * of the product of both semi-axes. A ray comes from the azimuth phi at the offset H sin x, where H is half of the
 * section's width as seen from phi. In the plane of the section the ray is refracted by Snell's law with Bravais' index
 * eta' = sqrt(eta^2 - sin^2 th) / cos th; reflectances are taken at the true angles in space.
 *
 *     hop     from the point (A cos g, B sin g) along the direction t: delta = atan2(sin t / B, cos t / A), next point
 *             g' = 2 delta - g + pi */
#ifndef SELVEDGE_RENDERER_ELLIPSE_RAY_H
#define SELVEDGE_RENDERER_ELLIPSE_RAY_H

#include <math.h>

/* A number and its derivatives by eta and by the ratio of axes. */
struct dual {
    double v, d[2];
};

enum { ELLIPSE_BY_ETA, ELLIPSE_BY_RATIO };
/* ELLIPSE_N_EXIT: the exits that are followed. ELLIPSE_N_MODE: the first exits, R, TT, TRT and TRRT, whose azimuth the
 * model uses. */
enum { ELLIPSE_N_EXIT = 12, ELLIPSE_N_MODE = 4 };

struct ellipse {
    struct dual eta, major, minor; /* A and B */
};

/* The point where a ray meets the section, the same for all longitudinal angles. */
struct ellipse_entry {
    double phi;             /* azimuth that it comes from */
    struct dual gamma, nu;  /* parameter of the point, azimuth of the normal there */
    struct dual half_width; /* H */
};

/* At one longitudinal angle. */
struct ellipse_wall {
    double cos_theta;
    struct dual index, unit_length; /* eta'; true length of a unit of length in the section, 1 / cos th_t */
};

/* Shares of a ray's light by exits 0 (R), 1 (TT), ... without absorption; the last has all that is left. */
struct ellipse_path {
    int n;
    struct dual share[ELLIPSE_N_EXIT + 1], length[ELLIPSE_N_EXIT + 1]; /* true length of the way inside */
    struct dual azimuth[ELLIPSE_N_MODE]; /* azimuth of the exit minus azimuth of the ray, plus any number of turns */
};

struct ellipse ellipse_of(double eta, double ratio);
struct ellipse_entry ellipse_enter(const struct ellipse *e, double phi, double x);
/* cos_theta > 0. */
struct ellipse_wall ellipse_wall_at(const struct ellipse *e, double cos_theta);
void ellipse_follow(const struct ellipse *e, const struct ellipse_wall *w, const struct ellipse_entry *entry,
                    struct ellipse_path *path);

/* Unpolarised reflectance by the cosine of the angle outside, > 0. */
struct dual ellipse_reflectance(struct dual cos_out, struct dual eta);
/* Cosine of the angle outside from its square, which is negative where the reflection is total, and its slope when
 * wanted. The root has an infinite slope at 0, so the derivatives of a sum over rays would be noisy. Between -G and G,
 * the square of the cosine of 77 degrees, root(G) (2 t^3 - t^5) takes its place, t = (square / G + 1) / 2. It has value
 * and slope 0 at -G, value and slope of the root at G, and the integral of the root. */
double ellipse_cosine_outside(double square, double *slope);

#endif
