#include "tests/support/glint/glint_binning.h"

#include "base/rng.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double wrapped(double x, double n) { return x - n * floor(x / n); }

static const float *texel(const struct glint_map *m, double i, double j)
{
    const double n = (double)m->n;
    return m->normal[(size_t)wrapped(j, n) * m->n + (size_t)wrapped(i, n)];
}

/* The cubic through b and c with slopes (c - a) / 2 and (d - b) / 2, as a polynomial of x in 0..1. */
static double cubic(double a, double b, double c, double d, double x)
{
    const double k1 = (c - a) / 2, k2 = a - 2.5 * b + 2 * c - 0.5 * d, k3 = (d - a + 3 * (b - c)) / 2;
    return b + x * (k1 + x * (k2 + x * k3));
}

void glint_binning_normal(const struct glint_map *m, double u, double v, double normal[2])
{
    if (m->is_flat) {
        for (int c = 0; c < 2; c++) normal[c] = (double)texel(m, floor(u), floor(v))[c];
        return;
    }
    const double i = floor(u - 0.5), j = floor(v - 0.5), x = u - 0.5 - i, y = v - 0.5 - j;
    for (int c = 0; c < 2; c++) {
        double row[4];
        for (int k = 0; k < 4; k++)
            row[k] = cubic((double)texel(m, i - 1, j + k - 1)[c], (double)texel(m, i, j + k - 1)[c],
                           (double)texel(m, i + 1, j + k - 1)[c], (double)texel(m, i + 2, j + k - 1)[c], x);
        normal[c] = cubic(row[0], row[1], row[2], row[3], y);
    }
}

void glint_binning(const struct glint_option *given, const struct glint_footprint *f, size_t n, uint64_t seed,
                   double share[GLINT_BINNING_N * GLINT_BINNING_N])
{
    struct glint_option o;
    struct glint_map m;
    const struct rng_key key = {.seed = seed};
    struct rng r;
    if (glint_option_complete(given, &o, NULL) != STATUS_OK || glint_map_make(&o, &m, NULL) != STATUS_OK) abort();
    memset(share, 0, GLINT_BINNING_N * GLINT_BINNING_N * sizeof *share);
    rng_start(&r, &key, 0, 0);
    const double uu = (double)f->covariance_um2[0], uv = (double)f->covariance_um2[1],
                 vv = (double)f->covariance_um2[2];
    const double l00 = sqrt(uu), l10 = uu > 0 ? uv / l00 : 0, l11 = sqrt(fmax(vv - l10 * l10, 0));
    for (size_t k = 0; k < n; k++) {
        double z[2], noise[2], normal[2];
        rng_normal_pair(&r, z);
        rng_normal_pair(&r, noise);
        const double u = (double)f->center_um[0] + l00 * z[0], v = (double)f->center_um[1] + l10 * z[0] + l11 * z[1];
        glint_binning_normal(&m, u / (double)o.texel_um, v / (double)o.texel_um, normal);
        int bin[2];
        for (int c = 0; c < 2; c++)
            bin[c] = (int)floor((normal[c] + noise[c] * (double)o.roughness + GLINT_BINNING_EDGE) /
                                (2 * GLINT_BINNING_EDGE) * GLINT_BINNING_N);
        if (bin[0] >= 0 && bin[1] >= 0 && bin[0] < GLINT_BINNING_N && bin[1] < GLINT_BINNING_N)
            share[bin[1] * GLINT_BINNING_N + bin[0]] += 1 / (double)n;
    }
    glint_map_release(&m);
}
