#include "tests/support/drawn_cylinder.h"

#include "base/angle.h"

#include <math.h>
#include <stdlib.h>

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static void unit(double v[3])
{
    const double length = sqrt(dot(v, v));
    for (int k = 0; k < 3; k++) v[k] /= length;
}

void drawn_cylinder_place(double theta_deg, double phi_deg, double distance, double out[3])
{
    const double t = theta_deg * RAD_PER_DEG, p = phi_deg * RAD_PER_DEG;
    out[0] = distance * sin(t) * cos(p), out[1] = distance * sin(t) * sin(p), out[2] = distance * cos(t);
}

/* Where the ray from the eye meets the cylinder. */
bool drawn_cylinder_meet(double radius, const double eye[3], const double d[3], double p[3])
{
    const double z = eye[2] + radius, a = d[0] * d[0] + d[2] * d[2], b = eye[0] * d[0] + z * d[2],
                 c = eye[0] * eye[0] + z * z - radius * radius, root = b * b - a * c;
    if (root < 0.0) return false;
    const double t = (-b - sqrt(root)) / a;
    for (int k = 0; k < 3; k++) p[k] = eye[k] + t * d[k];
    return t > 0.0;
}

/* Radiance of the drawn cloth under unit irradiance of a lamp that it faces: brighter where the half vector lies along
 * the weft. In: unit vectors to lamp and eye, the normal and the weft. */
double drawn_cylinder_cloth(const double light[3], const double eye[3], const double normal[3], const double weft[3])
{
    double half[3];
    for (int k = 0; k < 3; k++) half[k] = light[k] + eye[k];
    unit(half);
    return fmax(0.0, dot(light, normal)) * (0.3 + 0.5 * dot(half, weft) * dot(half, weft));
}

/* Radiance that the eye sees at p under a small lamp that faces the orbit center and gives unit irradiance there. */
static double seen(const struct drawn_cylinder *d, const double p[3])
{
    const double normal[3] = {p[0] / d->radius, 0, (p[2] + d->radius) / d->radius}, axis[3] = {0, 1, 0};
    double around[3], weft[3], light[3], eye[3], lamp[3];
    cross(axis, normal, around);
    for (int k = 0; k < 3; k++) {
        weft[k] = cos(d->turn) * around[k] + sin(d->turn) * axis[k];
        light[k] = d->light[k] - p[k];
        eye[k] = d->eye[k] - p[k];
        lamp[k] = d->light[k];
    }
    const double nearer = dot(lamp, lamp) / dot(light, light);
    unit(light), unit(eye), unit(lamp);
    return nearer * dot(light, lamp) * drawn_cylinder_cloth(light, eye, normal, weft);
}

void drawn_cylinder_axes(const struct drawn_cylinder *d, double forward[3], double right[3], double down[3])
{
    const double axis[3] = {0, 1, 0};
    double r[3], u[3];
    for (int k = 0; k < 3; k++) forward[k] = -d->eye[k];
    unit(forward);
    cross(forward, axis, r);
    unit(r);
    cross(forward, r, u);
    for (int k = 0; k < 3; k++) {
        right[k] = cos(d->roll) * r[k] + sin(d->roll) * u[k];
        down[k] = cos(d->roll) * u[k] - sin(d->roll) * r[k];
    }
}

/* Light that the eye sees along a ray: the sheet, else the cylinder, else the background. */
static double seen_along(const struct drawn_cylinder *d, const double ray[3])
{
    double p[3];
    if (d->sheet != NULL && ray[2] < 0.0) {
        const double t = -d->eye[2] / ray[2], light = d->sheet(d->eye[0] + t * ray[0], d->eye[1] + t * ray[1]);
        if (!isnan(light)) return light;
    }
    return drawn_cylinder_meet(d->radius, d->eye, ray, p) ? seen(d, p) : d->background;
}

void drawn_cylinder_draw(const struct drawn_cylinder *d, struct image *im)
{
    enum { RAYS = 3 };
    double forward[3], right[3], down[3];
    const double focal = d->px_per_mm * sqrt(dot(d->eye, d->eye));
    drawn_cylinder_axes(d, forward, right, down);
    if (image_init(im, d->width, d->height, 3, NULL) != STATUS_OK) abort();
    for (size_t i = 0; i < d->width * d->height; i++) {
        double sum = 0.0;
        for (size_t k = 0; k < RAYS * RAYS; k++) {
            const double x = (double)(i % d->width) + ((double)(k % RAYS) + 0.5) / RAYS - 0.5 * (double)d->width,
                         y = (double)(i / d->width) + ((double)(k / RAYS) + 0.5) / RAYS - 0.5 * (double)d->height;
            double ray[3];
            for (int a = 0; a < 3; a++) ray[a] = forward[a] + x / focal * right[a] + y / focal * down[a];
            sum += seen_along(d, ray);
        }
        for (size_t c = 0; c < 3; c++) im->pixel[3 * i + c] = (float)(sum / (RAYS * RAYS) * (1.0 - 0.2 * (double)c));
    }
}
