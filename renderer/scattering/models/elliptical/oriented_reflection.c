#include "renderer/scattering/models/elliptical/oriented_reflection.h"

#include <string.h>

enum { N = ORIENTED_N, N_PSI = 256, N_DELTA = 512 }; /* points of each integral; the second has a kink at pi */

/* Adds a value and its slope times cos(k x) for all k. */
static void add_waves(const double part[REFLECTION_N_PART], double x, reflection_wave wave)
{
    const double twice = 2 * cos(x);
    double before = cos(x), now = 1;
    for (int k = 0; k <= N; k++) {
        for (int q = 0; q < REFLECTION_N_PART; q++) wave[q][k] += part[q] * now;
        const double next = twice * now - before;
        before = now;
        now = next;
    }
}

void oriented_reflection_psi(double ratio, reflection_wave wave)
{
    memset(wave, 0, sizeof(reflection_wave));
    for (int i = 0; i < N_PSI; i++) {
        const double psi = M_PI * (i + 0.5) / N_PSI, c2 = cos(psi) * cos(psi), s2 = 1 - c2;
        const double q = ratio * c2 + s2 / ratio, rho = pow(q, -1.5);
        const double part[REFLECTION_N_PART] = {rho, -1.5 * rho / q * (c2 - s2 / (ratio * ratio))};
        add_waves(part, 2 * psi, wave);
    }
    const double mean = wave[REFLECTION_VALUE][0], d_ln_mean = wave[REFLECTION_SLOPE][0] / mean;
    for (int k = 0; k <= N; k++) {
        wave[REFLECTION_VALUE][k] /= mean;
        wave[REFLECTION_SLOPE][k] = wave[REFLECTION_SLOPE][k] / mean - wave[REFLECTION_VALUE][k] * d_ln_mean;
    }
}

void oriented_reflection_delta(double eta, double cos_theta, reflection_wave wave)
{
    const struct dual index = {eta, {[ELLIPSE_BY_ETA] = 1}};
    memset(wave, 0, sizeof(reflection_wave));
    for (int i = 0; i < N_DELTA; i++) {
        const double delta = M_PI * (i + 0.5) / N_DELTA, c = cos(0.5 * delta), share = 0.5 * c * M_PI / N_DELTA;
        const struct dual r = ellipse_reflectance((struct dual){cos_theta * c, {0, 0}}, index);
        add_waves((const double[REFLECTION_N_PART]){share * r.v, share * r.d[ELLIPSE_BY_ETA]}, delta, wave);
    }
}
