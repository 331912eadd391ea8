#include "tests/support/glint/wave_oracle.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void *memory(size_t n_byte)
{
    void *p = calloc(1, n_byte);
    if (p == NULL) {
        fprintf(stderr, "wave_oracle: out of memory\n");
        exit(1);
    }
    return p;
}

void wave_oracle_fourier(double complex *x, size_t n, int sign)
{
    for (size_t i = 1, j = 0; i < n; i++) {
        size_t bit = n >> 1;
        for (; (j & bit) != 0; bit >>= 1) j ^= bit;
        j ^= bit;
        if (i < j) {
            const double complex t = x[i];
            x[i] = x[j];
            x[j] = t;
        }
    }
    for (size_t size = 2; size <= n; size *= 2)
        for (size_t k = 0; k < size / 2; k++) {
            const double complex turn = cexp(I * (sign * 2 * M_PI * (double)k / (double)size));
            for (size_t i = k; i < n; i += size) {
                const double complex a = x[i], b = turn * x[i + size / 2];
                x[i] = a + b;
                x[i + size / 2] = a - b;
            }
        }
}

/* Rows, then columns. */
static void fourier_2d(double complex *x, size_t n, int sign)
{
    double complex *column = memory(n * sizeof *column);
    for (size_t j = 0; j < n; j++) wave_oracle_fourier(x + j * n, n, sign);
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) column[j] = x[j * n + i];
        wave_oracle_fourier(column, n, sign);
        for (size_t j = 0; j < n; j++) x[j * n + i] = column[j];
    }
    free(column);
}

void wave_oracle_init(struct wave_oracle *o, const struct wave_height *h, size_t factor)
{
    const size_t n = h->n, fine = n * factor;
    double complex *wave = memory(n * n * sizeof *wave), *more = memory(fine * fine * sizeof *more);
    *o = (struct wave_oracle){fine, (double)h->texel_um / (double)factor, memory(fine * fine * sizeof *o->height_um)};
    for (size_t i = 0; i < n * n; i++) wave[i] = (double)h->height_um[i];
    fourier_2d(wave, n, -1);
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            if (i == n / 2 || j == n / 2) continue; /* the highest wave, which no smooth field has */
            const size_t to_i = i < n / 2 ? i : fine - n + i, to_j = j < n / 2 ? j : fine - n + j;
            more[to_j * fine + to_i] = wave[j * n + i] / (double)(n * n);
        }
    fourier_2d(more, fine, 1);
    for (size_t i = 0; i < fine * fine; i++) o->height_um[i] = creal(more[i]);
    free(wave);
    free(more);
}

void wave_oracle_release(struct wave_oracle *o) { free(o->height_um); }

/* Place of sample i relative to the middle of the window, in the nearest tile: texels' middles are at half texels. */
static double place(const struct wave_oracle *o, size_t factor_of_half, size_t i, double center_um)
{
    const double side = (double)o->n * o->step_um;
    const double x = (double)i * o->step_um + 0.5 * (double)factor_of_half * o->step_um - center_um;
    return x - side * round(x / side);
}

/* Samples for each texel of 1 um; the tests use such texels only. */
static size_t per_texel(const struct wave_oracle *o) { return (size_t)lround(1 / o->step_um); }

static double window_at(const struct wave_oracle_window *w, double x, double y)
{
    const double r2 = (x * x + y * y) / (w->sd_um * w->sd_um);
    return r2 <= 9 ? exp(-r2 / 2) : 0;
}

void wave_oracle_lobe(const struct wave_oracle *o, const struct wave_oracle_window *w, double xi_3,
                      double wavelength_um, double *power)
{
    const size_t n = o->n;
    double complex *r = memory(n * n * sizeof *r);
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            const double x = place(o, per_texel(o), i, w->center_um[0]), y = place(o, per_texel(o), j, w->center_um[1]);
            const double a = window_at(w, x, y);
            if (a > 0) r[j * n + i] = a * cexp(-I * 2 * M_PI * xi_3 * o->height_um[j * n + i] / wavelength_um);
        }
    fourier_2d(r, n, -1);
    const double area2 = pow(o->step_um, 4);
    for (size_t i = 0; i < n * n; i++) power[i] = area2 * pow(cabs(r[i]), 2);
    free(r);
}

double wave_oracle_sum(const struct wave_oracle *o, const struct wave_oracle_window *w, double xi_3,
                       const double psi[2], double per_psi_n, double wavelength_um)
{
    const size_t n = o->n;
    double complex sum = 0;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            const double x = place(o, per_texel(o), i, w->center_um[0]), y = place(o, per_texel(o), j, w->center_um[1]);
            const double a = window_at(w, x, y);
            if (!(a > 0)) continue;
            const double *h = o->height_um;
            const double slope_u = (h[j * n + (i + 1) % n] - h[j * n + (i + n - 1) % n]) / (2 * o->step_um);
            const double slope_v = (h[(j + 1) % n * n + i] - h[(j + n - 1) % n * n + i]) / (2 * o->step_um);
            const double tilt = 1 - (psi[0] * slope_u + psi[1] * slope_v) * per_psi_n;
            sum += a * tilt * cexp(-I * 2 * M_PI / wavelength_um * (xi_3 * h[j * n + i] + psi[0] * x + psi[1] * y));
        }
    return pow(o->step_um, 4) * pow(cabs(sum), 2);
}
