#include "renderer/scattering/speckle.h"
#include "renderer/scattering/quadratic_spline.h"

#include <math.h>

void speckle_numbers_init(struct speckle_numbers *n)
{
    /* Mean of the square within equally probable ranges of its exponential distribution: their mean is 1 exactly. */
    double above = 0; /* integral of -ln(p) over p from 0 to the present range's end */
    for (int i = 0; i < SPECKLE_N_SIZE; i++) {
        const double p = (i + 1.0) / SPECKLE_N_SIZE, whole = p - p * log(p);
        n->size[i] = (float)sqrt((whole - above) * SPECKLE_N_SIZE);
        above = whole;
    }
    for (int i = 0; i < SPECKLE_N_TURN; i++) {
        n->turn[i][0] = (float)cos(2 * M_PI * i / SPECKLE_N_TURN);
        n->turn[i][1] = (float)sin(2 * M_PI * i / SPECKLE_N_TURN);
    }
}

/* An invertible mix of bits in which each bit depends on all (Wellons 2018, "Prospecting for hash functions"). */
static inline uint32_t mix(uint32_t x)
{
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return x ^ (x >> 16);
}

/* The place on one axis: first of three nodes, and their weights over the root of the sum of squares. */
static inline int32_t spline(float at, float weight[3])
{
    double whole[3];
    const int nearest = quadratic_spline((double)at, whole, NULL);
    const double scale = 1 / sqrt(whole[0] * whole[0] + whole[1] * whole[1] + whole[2] * whole[2]);
    for (int k = 0; k < 3; k++) weight[k] = (float)(scale * whole[k]);
    return nearest - 1;
}

void speckle_amplitude(const struct speckle *s, uint32_t i_fiber, uint32_t i_band, const float place[3], float re_im[2])
{
    static const uint32_t step[3] = {0x9e3779b1u, 0x85ebca77u, 0xc2b2ae3du};
    const uint32_t whose = mix(mix(mix((uint32_t)s->seed) + (uint32_t)(s->seed >> 32)) + i_fiber);
    const uint32_t key = mix(whose + i_band);
    uint32_t node[3];
    float weight[3][3], re = 0, im = 0;
    for (uint32_t a = 0; a < 3; a++) {
        const float offset = (float)(mix(key + step[a] + 1) >> 8) * 0x1p-24f;
        node[a] = (uint32_t)spline(place[a] + offset, weight[a]) * step[a];
    }
    for (uint32_t i = 0; i < 3; i++)
        for (uint32_t j = 0; j < 3; j++) {
            const uint32_t row = key + node[0] + i * step[0] + node[1] + j * step[1] + node[2];
            const float across = weight[0][i] * weight[1][j];
            for (uint32_t k = 0; k < 3; k++) {
                const uint32_t bits = mix(row + k * step[2]);
                const float size = across * weight[2][k] * s->numbers->size[bits % SPECKLE_N_SIZE];
                const float *turn = s->numbers->turn[bits / SPECKLE_N_SIZE % SPECKLE_N_TURN];
                re += size * turn[0];
                im += size * turn[1];
            }
        }
    re_im[0] = re;
    re_im[1] = im;
}

void speckle_factor(const struct speckle *s, uint32_t i_fiber, const float wi[3], const float wo[3], float rgb[3])
{
    for (int c = 0; c < 3; c++) {
        float scale = s->table->cells[c], re = 0, im = 0;
        for (uint32_t b = 0; b < SPECKLE_N_BAND; b++, scale *= 2) {
            const float weight = s->table->weight[b];
            float place[3], a[2];
            if (weight == 0) continue;
            for (int k = 0; k < 3; k++) place[k] = scale * (wi[k] + wo[k]);
            speckle_amplitude(s, i_fiber, b, place, a);
            re += weight * a[0];
            im += weight * a[1];
        }
        rgb[c] = re * re + im * im;
    }
}

/* Mean of the correlation of the lattice along one axis over places, and mean of its square. */
static void axis_correlation(double distance, double mean[2])
{
    enum { N_PHASE = 32 };
    mean[0] = mean[1] = 0;
    for (int i = 0; i < N_PHASE; i++) {
        const double at = (i + 0.5) / N_PHASE;
        float weight[2][3];
        double product = 0;
        const int32_t first = spline((float)at, weight[0]), second = spline((float)(at + distance), weight[1]);
        for (int32_t k = 0; k < 3; k++) {
            const int32_t other = first + k - second;
            if (other >= 0 && other < 3) product += (double)weight[0][k] * (double)weight[1][other];
        }
        mean[0] += product / N_PHASE;
        mean[1] += product * product / N_PHASE;
    }
}

/* Both means for places that are apart in one direction of the plane. */
static void plane_correlation(double distance, double angle_rad, double mean[2])
{
    double x[2], y[2];
    axis_correlation(distance * cos(angle_rad), x);
    axis_correlation(distance * sin(angle_rad), y);
    for (int k = 0; k < 2; k++) mean[k] = x[k] * y[k];
}

enum { N_DIRECTION = 16 };

static double direction(int i) { return M_PI_2 * (i + 0.5) / N_DIRECTION; }

double speckle_band_correlation(double distance)
{
    double sum = 0, mean[2];
    for (int i = 0; i < N_DIRECTION; i++) {
        plane_correlation(distance, direction(i), mean);
        sum += mean[0] / N_DIRECTION;
    }
    return sum;
}

double speckle_correlation(const float weight[SPECKLE_N_BAND], double distance)
{
    double sum = 0;
    for (int i = 0; i < N_DIRECTION; i++) {
        double whole = 0, rest = 0, mean[2]; /* places in different bands are independent */
        for (int b = 0; b < SPECKLE_N_BAND; b++) {
            const double v = (double)weight[b] * (double)weight[b];
            plane_correlation(distance * (1 << b), direction(i), mean);
            whole += v * mean[0];
            rest += v * v * (mean[1] - mean[0] * mean[0]);
        }
        sum += (whole * whole + rest) / N_DIRECTION;
    }
    return sum;
}
