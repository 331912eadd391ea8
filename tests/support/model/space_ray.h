/* Rays with vectors in space at a smooth dielectric wall: an implementation of Snell's and Fresnel's laws of its own,
 * for tests of fibers. */
#ifndef SELVEDGE_TESTS_SPACE_RAY_H
#define SELVEDGE_TESTS_SPACE_RAY_H

#include <math.h>

static inline double space_dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Snell's law for a unit ray d that meets a wall with the unit normal n, which points towards where it comes from, by
 * amplitudes of both polarisations. Returns the reflectance, 1 for total reflection, where out is 0. */
static inline double space_refract(const double d[3], const double n[3], double n1, double n2, double out[3])
{
    double c1 = -space_dot(d, n), k = n1 / n2, c2 = 1 - k * k * (1 - c1 * c1);
    if (c2 <= 0) {
        for (int i = 0; i < 3; i++) out[i] = 0;
        return 1;
    }
    c2 = sqrt(c2);
    for (int i = 0; i < 3; i++) out[i] = k * d[i] + (k * c1 - c2) * n[i];
    double rs = (n1 * c1 - n2 * c2) / (n1 * c1 + n2 * c2), rp = (n2 * c1 - n1 * c2) / (n2 * c1 + n1 * c2);
    return 0.5 * (rs * rs + rp * rp);
}

static inline void space_reflect(const double d[3], const double n[3], double out[3])
{
    double c = space_dot(d, n);
    for (int i = 0; i < 3; i++) out[i] = d[i] - 2 * c * n[i];
}

/* Outward normal of an elliptical cylinder along x at a point of its surface. */
static inline void space_normal(const double axes[2], const double at[3], double n[3])
{
    double v = at[1] / (axes[0] * axes[0]), w = at[2] / (axes[1] * axes[1]), size = sqrt(v * v + w * w);
    n[0] = 0;
    n[1] = v / size;
    n[2] = w / size;
}

/* Where a ray from the azimuth phi at the offset s along (-sin phi, cos phi) meets the cylinder first. */
static inline void space_enter(const double axes[2], double phi, double s, double at[3])
{
    double a = pow(cos(phi) / axes[0], 2) + pow(sin(phi) / axes[1], 2);
    double b = s * sin(phi) * cos(phi) * (1 / (axes[1] * axes[1]) - 1 / (axes[0] * axes[0]));
    double c = s * s * (pow(sin(phi) / axes[0], 2) + pow(cos(phi) / axes[1], 2)) - 1;
    double t = (-b + sqrt(fmax(b * b - a * c, 0))) / a;
    at[0] = 0;
    at[1] = -s * sin(phi) + t * cos(phi);
    at[2] = s * cos(phi) + t * sin(phi);
}

/* Moves a point of the surface along d, which points inwards, to the surface again. Returns the way. */
static inline double space_cross(const double axes[2], const double d[3], double at[3])
{
    double q[2] = {d[1] / axes[0], d[2] / axes[1]}, o[2] = {at[1] / axes[0], at[2] / axes[1]};
    double way = -2 * (q[0] * o[0] + q[1] * o[1]) / (q[0] * q[0] + q[1] * q[1]);
    for (int i = 0; i < 3; i++) at[i] += way * d[i];
    return way;
}

#endif
