#include "renderer/fast/sphere_harmonics.h"

#include <math.h>

/* sqrt((2 l + 1) / 4 pi (l - m)! / (l + m)!), times sqrt(2) for m > 0 */
static float norm[SPHERE_MAX_ORDER + 1][SPHERE_MAX_ORDER + 1];

__attribute__((constructor)) static void fill_norm(void)
{
    for (int l = 0; l <= SPHERE_MAX_ORDER; l++)
        for (int m = 0; m <= l; m++) {
            double ratio = (2 * l + 1) / (4 * M_PI) * (m > 0 ? 2 : 1);
            for (int k = l - m + 1; k <= l + m; k++) ratio /= k;
            norm[l][m] = (float)sqrt(ratio);
        }
}

void sphere_harmonics(size_t order, const float d[3], float *y)
{
    /* cosine and sine of m phi times sin^m theta, by recursion; associated Legendre functions without that factor */
    int n = (int)order;
    float c = 1, s = 0, p_mm = 1;
    for (int m = 0; m <= n; m++) {
        float p = p_mm, before = 0;
        for (int l = m; l <= n; l++) {
            int at = l * (l + 1);
            float k = norm[l][m] * p;
            y[at + m] = k * c;
            if (m > 0) y[at - m] = k * s;
            float next = ((float)(2 * l + 1) * d[2] * p - (float)(l + m) * before) / (float)(l - m + 1);
            before = p;
            p = next;
        }
        float turned = c * d[0] - s * d[1];
        s = c * d[1] + s * d[0];
        c = turned;
        p_mm *= (float)(2 * m + 1);
    }
}

static inline size_t block_at(size_t l) { return l == 0 ? 0 : l * (2 * l - 1) * (2 * l + 1) / 3; }

/* The P of Ivanic and Ruedenberg: products of the block of order 1, r, and the block of order l - 1, before. */
static inline float product(int i, int l, int a, int b, const float *r, const float *before)
{
    int n = 2 * l - 1, row = (a + l - 1) * n;
    const float *ri = r + 3 * (i + 1);
    if (b == -l) return ri[2] * before[row] + ri[0] * before[row + n - 1];
    if (b == l) return ri[2] * before[row + n - 1] - ri[0] * before[row];
    return ri[1] * before[row + b + l - 1];
}

static float element_v(int l, int m, int b, const float *r, const float *before)
{
    if (m == 0) return product(1, l, 1, b, r, before) + product(-1, l, -1, b, r, before);
    if (m > 0) {
        float p = product(1, l, m - 1, b, r, before);
        return m == 1 ? p * (float)M_SQRT2 : p - product(-1, l, -m + 1, b, r, before);
    }
    float p = product(-1, l, -m - 1, b, r, before);
    return m == -1 ? p * (float)M_SQRT2 : p + product(1, l, m + 1, b, r, before);
}

static float element_w(int l, int m, int b, const float *r, const float *before)
{
    if (m > 0) return product(1, l, m + 1, b, r, before) + product(-1, l, -m - 1, b, r, before);
    return product(1, l, m - 1, b, r, before) - product(-1, l, -m + 1, b, r, before);
}

/* The factors u, v and w of order l, row m, for columns |b| < l and |b| = l. They do not depend on the rotation. */
struct factors {
    float u[2], v[2], w[2];
};
static struct factors factor[SPHERE_MAX_ORDER + 1][2 * SPHERE_MAX_ORDER + 1];

__attribute__((constructor)) static void fill_factors(void)
{
    for (int l = 2; l <= SPHERE_MAX_ORDER; l++)
        for (int m = -l; m <= l; m++)
            for (int edge = 0; edge < 2; edge++) {
                /* with |b| = l the divisor is 2 l (2 l - 1); otherwise (l + b)(l - b), which is left to the caller */
                double a = edge ? 2.0 * l * (2 * l - 1) : 1.0, k = m < 0 ? -m : m;
                struct factors *f = &factor[l][m + l];
                f->u[edge] = (float)sqrt((l + m) * (l - m) / a);
                f->v[edge] = (float)(0.5 * sqrt((m == 0 ? 2 : 1) * (l + k - 1) * (l + k) / a) * (m == 0 ? -1 : 1));
                f->w[edge] = (float)(m == 0 ? 0 : -0.5 * sqrt(fmax(0, (l - k - 1) * (l - k)) / a));
            }
}

static void fill_block(int l, const float *r, const float *before, float *block)
{
    int n = 2 * l + 1;
    for (int b = -l; b <= l; b++) {
        int edge = b == l || b == -l;
        float inv = edge ? 1 : 1 / sqrtf((float)((l + b) * (l - b)));
        for (int m = -l; m <= l; m++) {
            const struct factors *f = &factor[l][m + l];
            float sum = 0;
            if (f->u[edge] != 0) sum += f->u[edge] * product(0, l, m, b, r, before);
            if (f->v[edge] != 0) sum += f->v[edge] * element_v(l, m, b, r, before);
            if (f->w[edge] != 0) sum += f->w[edge] * element_w(l, m, b, r, before);
            block[(m + l) * n + b + l] = inv * sum;
        }
    }
}

void sphere_rotation(size_t order, const float row[3][3], float *rotation)
{
    static const int axis[3] = {1, 2, 0}; /* m = -1, 0, 1 are y, z, x */
    rotation[0] = 1;
    if (order == 0) return;
    for (int m = 0; m < 3; m++)
        for (int b = 0; b < 3; b++) rotation[1 + 3 * m + b] = row[axis[m]][axis[b]];
    for (size_t l = 2; l <= order; l++)
        fill_block((int)l, rotation + 1, rotation + block_at(l - 1), rotation + block_at(l));
}

void sphere_rotate(size_t order, const float *rotation, const float *in, size_t n_channel, float *out)
{
    size_t count = sphere_count(order);
    for (size_t l = 0; l <= order; l++) {
        size_t n = 2 * l + 1, at = l * l;
        const float *block = rotation + block_at(l);
        for (size_t c = 0; c < n_channel; c++)
            for (size_t i = 0; i < n; i++) {
                float sum = 0;
                for (size_t k = 0; k < n; k++) sum += block[i * n + k] * in[c * count + at + k];
                out[c * count + at + i] = sum;
            }
    }
}

void sphere_gaussian_zonal(size_t order, double sharpness, float *z)
{
    enum { N = 4096 };
    double sum[SPHERE_MAX_ORDER + 1] = {0.0}, all = 0.0;
    /* midpoints of equal steps of x = 1 - cos, cut where nothing is left of the Gaussian */
    double most = sharpness * 2.0 > 40.0 ? 40.0 / sharpness : 2.0, step = most / N;
    for (int i = 0; i < N; i++) {
        double x = (i + 0.5) * step, g = exp(-sharpness * x), t = 1.0 - x, before = 0.0, p = 1.0;
        all += g;
        for (size_t l = 0; l <= order; l++) {
            sum[l] += g * p;
            double next = ((double)(2 * l + 1) * t * p - (double)l * before) / (double)(l + 1);
            before = p;
            p = next;
        }
    }
    for (size_t l = 0; l <= order; l++) z[l] = (float)(sum[l] / all * sqrt((double)(2 * l + 1) / (4 * M_PI)));
}
