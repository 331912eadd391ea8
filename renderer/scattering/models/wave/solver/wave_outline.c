#include "renderer/scattering/models/wave/solver/wave_outline.h"

#include "renderer/scattering/models/wave/solver/complex_parts.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { N_EXTENT = 2048, N_CHECK = 720 };

void wave_outline_ellipse(struct wave_outline *o, double a, double b) { wave_outline_bean(o, a, b, 0); }

void wave_outline_bean(struct wave_outline *o, double a, double b, double bean)
{
    *o = (struct wave_outline){.n_wave = 2};
    o->forward[1] = 0.5 * (a + b);
    o->backward[1] = 0.5 * (a - b);
    o->forward[2] = o->backward[2] = 0.25 * bean * a * I; /* x = a cos t: x^2 / a - a / 2 = a cos(2 t) / 2 */
}

void wave_outline_lobed(struct wave_outline *o, double radius, int n_lobe, double depth)
{
    *o = (struct wave_outline){.n_wave = n_lobe + 1};
    o->forward[1] = radius;
    o->forward[n_lobe + 1] += 0.5 * depth * radius;
    if (n_lobe > 1) o->backward[n_lobe - 1] += 0.5 * depth * radius;
}

void wave_outline_scale(struct wave_outline *o, double factor)
{
    for (int k = 0; k <= o->n_wave; k++) {
        o->forward[k] *= factor;
        o->backward[k] *= factor;
    }
}

void wave_outline_turn_quarter(struct wave_outline *o)
{
    static const double complex turn[4] = {1, I, -1, -I};
    for (int k = 0; k <= o->n_wave; k++) {
        o->forward[k] *= -I * turn[k % 4];
        o->backward[k] *= -I * conj(turn[k % 4]);
    }
}

double complex wave_outline_at(const struct wave_outline *o, double t, double complex *first, double complex *second)
{
    const double complex turn = complex_of(cos(t), sin(t));
    double complex z = 0, d = 0, dd = 0, wave = 1;
    for (int k = 1; k <= o->n_wave; k++) {
        wave *= turn;
        const double complex a = o->forward[k] * wave, b = o->backward[k] * conj(wave);
        z += a + b;
        d += I * (double)k * (a - b);
        dd -= (double)k * k * (a + b);
    }
    if (first != NULL) *first = d;
    if (second != NULL) *second = dd;
    return z;
}

double wave_outline_area(const struct wave_outline *o)
{
    double sum = 0;
    for (int k = 1; k <= o->n_wave; k++) sum += k * (pow(cabs(o->forward[k]), 2) - pow(cabs(o->backward[k]), 2));
    return M_PI * sum;
}

double wave_outline_length(const struct wave_outline *o)
{
    double sum = 0;
    for (int i = 0; i < N_EXTENT; i++) {
        double complex d;
        wave_outline_at(o, 2 * M_PI * i / N_EXTENT, &d, NULL);
        sum += cabs(d);
    }
    return sum * 2 * M_PI / N_EXTENT;
}

/* Component of z to the left of the direction. */
static double across(double complex z, double angle_rad)
{
    return cimag(z * complex_of(cos(angle_rad), -sin(angle_rad)));
}

void wave_outline_extent(const struct wave_outline *o, double angle_rad, double range[2])
{
    double t_at[2] = {0, 0};
    range[0] = INFINITY;
    range[1] = -INFINITY;
    for (int i = 0; i < N_EXTENT; i++) {
        const double t = 2 * M_PI * i / N_EXTENT, y = across(wave_outline_at(o, t, NULL, NULL), angle_rad);
        for (int side = 0; side < 2; side++) {
            if (side == 0 ? y >= range[0] : y <= range[1]) continue;
            range[side] = y;
            t_at[side] = t;
        }
    }
    for (int side = 0; side < 2; side++) { /* one step of Newton to where the outline runs along the direction */
        double complex d, dd;
        wave_outline_at(o, t_at[side], &d, &dd);
        const double slope = across(d, angle_rad), bend = across(dd, angle_rad);
        if (fabs(bend) * (2 * M_PI / N_EXTENT) < fabs(slope)) continue;
        range[side] = across(wave_outline_at(o, t_at[side] - slope / bend, NULL, NULL), angle_rad);
    }
}

/* Twice the area of the triangle a, b, c, which is positive when they run counter-clockwise. */
static double triangle(double complex a, double complex b, double complex c) { return cimag(conj(b - a) * (c - a)); }

static bool cross(const double complex a[2], const double complex b[2])
{
    return triangle(a[0], a[1], b[0]) * triangle(a[0], a[1], b[1]) < 0 &&
           triangle(b[0], b[1], a[0]) * triangle(b[0], b[1], a[1]) < 0;
}

/* Two sides of a closed polygon that cross. */
static bool meets_itself(const double complex *at, size_t n)
{
    for (size_t i = 0; i < n; i++)
        for (size_t j = i + 2; j < n; j++) {
            const double complex a[2] = {at[i], at[i + 1]}, b[2] = {at[j], at[(j + 1) % n]};
            if ((j + 1) % n != i && cross(a, b)) return true;
        }
    return false;
}

status wave_outline_check(const struct wave_outline *o, struct error *err)
{
    double complex at[N_CHECK];
    for (int i = 0; i < N_CHECK; i++) at[i] = wave_outline_at(o, 2 * M_PI * i / N_CHECK, NULL, NULL);
    if (!(wave_outline_area(o) > 0))
        return error_set_field(err, STATUS_INVALID, "points", "the outline does not run counter-clockwise");
    if (meets_itself(at, N_CHECK)) return error_set_field(err, STATUS_INVALID, "points", "the outline meets itself");
    return STATUS_OK;
}

/* Adds one side of the polygon, which is straight between the lengths s and e of a total of 1, to the wave k: the
 * integral of z(s) exp(-2 pi i k s), by parts. */
static double complex side_wave(double complex a, double complex b, double s, double e, int k)
{
    const double w = 2 * M_PI * k, h = e - s;
    const double complex u = cexp(-I * w * s), v = cexp(-I * w * e), slope = (b - a) / h;
    return (b * v - a * u) / (-I * w) + slope * (v - u) / (w * w);
}

static void fit_waves(struct wave_outline *o, const double complex *at, size_t n, double length)
{
    double s = 0;
    for (size_t i = 0; i < n; i++) {
        const double complex a = at[i], b = at[(i + 1) % n];
        const double e = i + 1 < n ? s + cabs(b - a) / length : 1;
        for (int k = 1; k <= o->n_wave && e > s; k++) {
            const double x = M_PI * k / (o->n_wave + 1), factor = sin(x) / x;
            o->forward[k] += factor * side_wave(a, b, s, e, k);
            o->backward[k] += factor * side_wave(a, b, s, e, -k);
        }
        s = e;
    }
}

status wave_outline_from_points(struct wave_outline *o, const double *xy, size_t n, int n_wave, struct error *err)
{
    if (n < 3) return error_set_field(err, STATUS_INVALID, "points", "an outline needs 3 points, not %zu", n);
    if (n_wave < 1 || n_wave > WAVE_OUTLINE_MAX)
        return error_set_field(err, STATUS_INVALID, "points", "an outline has 1 to %d waves, not %d", WAVE_OUTLINE_MAX,
                               n_wave);
    double complex *at = malloc(n * sizeof *at);
    if (at == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot hold the outline: out of memory");
    double area = 0, length = 0;
    status st = STATUS_OK;
    for (size_t i = 0; i < n; i++) at[i] = complex_of(xy[2 * i], xy[2 * i + 1]);
    for (size_t i = 0; i < n; i++) {
        area += 0.5 * cimag(conj(at[i]) * at[(i + 1) % n]);
        length += cabs(at[(i + 1) % n] - at[i]);
    }
    for (size_t i = 0; i < n / 2 && area < 0; i++) {
        const double complex keep = at[i];
        at[i] = at[n - 1 - i];
        at[n - 1 - i] = keep;
    }
    *o = (struct wave_outline){.n_wave = n_wave};
    if (!isfinite(length))
        st = error_set_field(err, STATUS_INVALID, "points", "a point of the outline is not finite");
    else if (fabs(area) < 1e-6 * length * length)
        st = error_set_field(err, STATUS_INVALID, "points", "the outline has no area");
    else if (meets_itself(at, n))
        st = error_set_field(err, STATUS_INVALID, "points", "the outline meets itself");
    if (st == STATUS_OK) {
        fit_waves(o, at, n, length);
        st = wave_outline_check(o, err);
    }
    free(at);
    return st;
}
