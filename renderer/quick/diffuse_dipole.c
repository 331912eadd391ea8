#include "renderer/quick/diffuse_dipole.h"

#include <math.h>

/* Height of the virtual source over the depth of the real one: 1 + 4/3 A. */
static const double virtual_height = 7.0 / 3.0;

static double reflectance_of(double s) { return (1.0 - s * s / 3.0) / 2.0 * (exp(-s) + exp(-virtual_height * s)); }

static struct diffuse_dipole of_decay(double s, double depth_mm)
{
    return (struct diffuse_dipole){.albedo = 1.0 - s * s / 3.0, .depth_mm = depth_mm, .decay_per_mm = s / depth_mm};
}

struct diffuse_dipole diffuse_dipole_of(double absorption_per_mm, double scattering_per_mm)
{
    double extinction = absorption_per_mm + scattering_per_mm;
    return of_decay(sqrt(3.0 * absorption_per_mm / extinction), 1.0 / extinction);
}

struct diffuse_dipole diffuse_dipole_match(double reflectance, double mean_square_mm2)
{
    double low = 0.0, high = sqrt(3.0); /* the reflectance falls with s */
    for (int i = 0; i < 60; i++) {
        double s = 0.5 * (low + high);
        if (reflectance_of(s) > reflectance)
            low = s;
        else
            high = s;
    }
    /* light that is hardly lost goes arbitrarily far */
    struct diffuse_dipole d = of_decay(fmax(low, 1e-6), 1.0);
    double depth = sqrt(mean_square_mm2 / diffuse_dipole_mean_square_mm2(&d));
    d.depth_mm *= depth;
    d.decay_per_mm /= depth;
    return d;
}

/* What a source at the height z adds to R_d / albedo. */
static double source_at(double z, double decay, double r)
{
    double d = sqrt(r * r + z * z);
    return z * (1.0 + decay * d) * exp(-decay * d) / (4.0 * M_PI * d * d * d);
}

double diffuse_dipole_at(const struct diffuse_dipole *d, double r_mm)
{
    return d->albedo * (source_at(d->depth_mm, d->decay_per_mm, r_mm) +
                        source_at(virtual_height * d->depth_mm, d->decay_per_mm, r_mm));
}

double diffuse_dipole_reflectance(const struct diffuse_dipole *d)
{
    return reflectance_of(d->decay_per_mm * d->depth_mm);
}

double diffuse_dipole_mean_square_mm2(const struct diffuse_dipole *d)
{
    double s = d->decay_per_mm * d->depth_mm, near = exp(-s), far = exp(-virtual_height * s);
    return 2.0 * d->depth_mm * d->depth_mm * (near + virtual_height * far) / (s * (near + far));
}

/* Of a source at z, the share z / d exp(-decay (d - z)) of the light leaves farther than d from it: d is found by
 * Newton's method for y = ln d in y + decay exp(y) = ln(z / u) + decay z, which is increasing and convex. */
double diffuse_dipole_sample(const struct diffuse_dipole *d, double u_source, double u_distance)
{
    double s = d->decay_per_mm * d->depth_mm, near = exp(-s), far = exp(-virtual_height * s);
    double z = u_source * (near + far) < near ? d->depth_mm : virtual_height * d->depth_mm, k = d->decay_per_mm;
    double u = fmax(1.0 - u_distance, 1e-12), wanted = log(z / u) + k * z, y = wanted;
    for (int i = 0; i < 60; i++) {
        double e = k * exp(y), step = (y + e - wanted) / (1.0 + e);
        y -= step;
        if (fabs(step) < 1e-12) break;
    }
    double distance = exp(y);
    return sqrt(fmax(0.0, distance * distance - z * z));
}
