#include "geometry/fibers/axes/axis_compare.h"

#include <math.h>
#include <string.h>

enum { BRICK = AXIS_BRICK, AHEAD = 8, LINE = 16 };
static const float OUTLIER = 0.6f; /* difference of densities beyond which a residual comes from another fiber */

/* Sums of shared_sum for one plane of the brick. */
struct plane_sum {
    lanes gradient[AXIS_N_SHARED], normal[15], square, weight, slope, edge_slope;
};

/* Mean of a normal variable of standard deviation sd about `value` after it was clamped to [0, 1], and its
 * derivative by the value. */
static void clamp_mean(float sd, lanes *value, lanes *slope)
{
    for (int l = 0; l < LANES; l++) {
        const float v = (*value)[l], low = -v / sd, high = (1.0f - v) / sd,
                    below = 0.5f * erfcf(-low * (float)M_SQRT1_2), above = 0.5f * erfcf(high * (float)M_SQRT1_2),
                    edge = (expf(-0.5f * low * low) - expf(-0.5f * high * high)) / sqrtf(2.0f * (float)M_PI);
        (*slope)[l] = 1.0f - below - above;
        (*value)[l] = v * (*slope)[l] + sd * edge + above;
    }
}

/* Finds residual and weight of the first n of LANES voxels, and adds voxels with fibers to the sums. */
static void compare_lanes(const struct axis_model *m, struct axis_scratch *s, size_t at, const float *density, size_t n,
                          struct plane_sum *sum)
{
    static const lanes step = {0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f};
    const float low = (float)m->profile.low, amplitude = (float)(m->profile.high - m->profile.low);
    lanes value = {0.0f}, zero = {0.0f}, one = zero + 1.0f, of[4];
    lanes_of_rows(s->model + at, of);
    const lane_mask near = (of[0] != zero) & (step < (float)n);
    if (n >= LANES)
        value = *(const lanes *)density;
    else
        memcpy(&value, density, n * sizeof *density);
    /* with lumens a share above 1 comes from a negative area, whose derivatives would not know of a bound */
    lanes share = of[0];
    if (m->lumen == NULL) share = lanes_choose(of[0] < one, of[0], one);
    lanes e = value - low - amplitude * share, by_value = one;
    if (m->lumen != NULL && m->profile.clamp_sd > 0.0) {
        lanes mean = low + amplitude * share;
        clamp_mean((float)m->profile.clamp_sd, &mean, &by_value);
        e = value - mean;
    }
    const lanes q = one / (one + e * e / (OUTLIER * OUTLIER));
    lanes weight = lanes_choose(near, q * q, zero);
    sum->square += weight * e * e;
    sum->weight += weight;
    sum->slope += weight * (4.0f * q - 3.0f);
    const lanes weighted = weight * e * by_value;
    weight *= by_value * by_value;
    *(lanes *)(s->weight + at) = weight;
    const lanes by[4] = {amplitude * of[1], amplitude * of[2], one - share, share};
    of[0] = share;
    of[3] = weighted;
    lanes_to_rows(of, s->model + at);
    sum->edge_slope += weight * (4.0f * q - 3.0f) * by[0] * by[0];
    for (int a = 0, i = 0; a < 4; a++) {
        sum->gradient[a] += weighted * by[a];
        for (int b = 0; b <= a; b++, i++) sum->normal[i] += weight * by[a] * by[b];
    }
    if (m->lumen == NULL) return;
    const lanes by_area = amplitude * *(const lanes *)(s->lumen + at);
    sum->gradient[4] += weighted * by_area;
    for (int b = 0; b < 4; b++) sum->normal[10 + b] += weight * by_area * by[b];
    sum->normal[14] += weight * by_area * by_area;
}

static void add_plane(const struct plane_sum *plane, struct shared_sum *sum)
{
    sum->square += (double)lanes_sum(plane->square);
    sum->weight += (double)lanes_sum(plane->weight);
    sum->slope += (double)lanes_sum(plane->slope);
    sum->edge_slope += (double)lanes_sum(plane->edge_slope);
    for (int a = 0, i = 0; a < AXIS_N_SHARED; a++) {
        sum->gradient[a] += (double)lanes_sum(plane->gradient[a]);
        for (int b = 0; b <= a; b++, i++) {
            const double value = (double)lanes_sum(plane->normal[i]);
            sum->normal[a][b] += value;
            if (b < a) sum->normal[b][a] += value;
        }
    }
}

/* Asks for the densities of a row of n voxels, so that they are there when they are compared: rows of a volume are too
 * far from each other for the processor to guess the next. */
static void fetch_row(const float *density, size_t n)
{
    for (size_t i = 0; i < n; i += LINE) __builtin_prefetch(density + i);
    __builtin_prefetch(density + n - 1);
}

void axis_compare(const struct axis_model *m, struct axis_scratch *s, const size_t from[3], const size_t n[3],
                  struct shared_sum *sum)
{
    for (size_t k = 0; k < n[2]; k++) {
        struct plane_sum plane = {0};
        for (size_t j = 0; j < n[1]; j++) {
            const size_t row = from[1] + j - m->first_row;
            const float *density = m->v->density + volume_index(m->v->n, from[0], row, from[2] + k);
            if (j + AHEAD < n[1]) fetch_row(density + AHEAD * m->v->n[0], n[0]);
            for (size_t i = 0; i < n[0]; i += LANES) {
                const size_t at = (k * BRICK + j) * BRICK + i;
                if (s->touched[at / LANES]) compare_lanes(m, s, at, density + i, n[0] - i, &plane);
            }
        }
        add_plane(&plane, sum);
    }
}
