#include "geometry/fibers/slices/blob_response.h"

#include "base/lanes.h"

#include <math.h>
#include <string.h>

enum { BLOCK = BLOB_BLOCK };
_Static_assert((int)BLOB_BLOCK == (int)LANES, "a block is a vector");

bool blob_kernel_init(struct blob_kernel *k, double sigma)
{
    if (!(sigma > 0.0) || 4.0 * sigma > BLOB_MAX_REACH) return false;
    double smooth[BLOB_MAX_REACH + 1], second[BLOB_MAX_REACH + 1], sum = 0.0, sum_second = 0.0, moment = 0.0;
    k->reach = (int)fmax(2.0, ceil(4.0 * sigma));
    for (int i = 0; i <= k->reach; i++) {
        smooth[i] = exp(-0.5 * i * i / (sigma * sigma));
        sum += i == 0 ? smooth[i] : 2.0 * smooth[i];
    }
    for (int i = 0; i <= k->reach; i++) {
        smooth[i] /= sum;
        second[i] = smooth[i] * (i * i / (sigma * sigma) - 1.0);
        sum_second += i == 0 ? second[i] : 2.0 * second[i];
    }
    for (int i = 0; i <= k->reach; i++) {
        second[i] -= sum_second * smooth[i];
        moment += 2.0 * second[i] * i * i;
    }
    for (int i = 0; i <= k->reach; i++) {
        k->smooth[i] = (float)smooth[i];
        k->second[i] = (float)(second[i] * 2.0 / moment);
    }
    k->factor = (float)(-sigma * sigma);
    return true;
}

/* Place i of a line of n that is mirrored at its ends, the last pixel beside its image. */
static size_t mirrored(ptrdiff_t i, size_t n)
{
    const ptrdiff_t end = (ptrdiff_t)n;
    while (i < 0 || i >= end) i = i < 0 ? -i - 1 : 2 * end - 1 - i;
    return (size_t)i;
}

static size_t padded_width(size_t width) { return blob_n_block(width) * BLOCK; }

size_t blob_scratch(size_t width, int reach)
{
    const size_t wide = padded_width(width), beside = (size_t)reach;
    return wide + 2 * beside + 2 * (2 * beside + 1) * wide;
}

static inline uint8_t least(uint8_t a, uint8_t b) { return a < b ? a : b; }

/* One pass of a distance transform: sets distance[b] to min(distance[b], beside[b] + 1). */
static void lower(uint8_t *restrict distance, const uint8_t *restrict beside, size_t n)
{
    for (size_t b = 0; b < n; b++) distance[b] = least(distance[b], (uint8_t)(beside[b] + 1));
}

/* Finds how many rows away the next block is that is asked for, at most FAR. */
static void find_distances(const struct blob_picture *p, uint8_t *distance)
{
    enum { FAR = BLOB_MAX_REACH + 1 };
    const size_t n = blob_n_block(p->width);
    for (size_t i = 0; i < n * p->height; i++) distance[i] = p->asked[i] != 0 ? 0 : FAR;
    for (size_t v = 1; v < p->height; v++) lower(distance + v * n, distance + (v - 1) * n, n);
    for (size_t v = p->height - 1; v-- > 0;) lower(distance + v * n, distance + (v + 1) * n, n);
}

/* Filters a row with both kernels in the blocks that columns need. distance: of the row's blocks. padded: place for the
 * row and its mirror images. out: two rows, the second derivative and the Gaussian. */
static void filter_row(const struct blob_kernel *k, const struct blob_picture *p, size_t v, const uint8_t *distance,
                       float *padded, float *out)
{
    const size_t n = blob_n_block(p->width), wide = padded_width(p->width), reach = (size_t)k->reach;
    const float *row = p->image + v * p->width;
    memcpy(padded + reach, row, p->width * sizeof *row);
    for (size_t i = 0; i < reach; i++) padded[i] = row[mirrored((ptrdiff_t)i - (ptrdiff_t)reach, p->width)];
    for (size_t i = p->width; i < wide + reach; i++) padded[reach + i] = row[mirrored((ptrdiff_t)i, p->width)];
    for (size_t b = 0; b < n; b++) {
        if (distance[b] > reach) continue;
        const float *x = padded + reach + b * BLOCK;
        lanes smooth = k->smooth[0] * *(const lanes *)x, second = k->second[0] * *(const lanes *)x;
        for (size_t t = 1; t <= reach; t++) {
            const lanes pair = *(const lanes *)(x - t) + *(const lanes *)(x + t);
            smooth += k->smooth[t] * pair;
            second += k->second[t] * pair;
        }
        *(lanes *)(out + b * BLOCK) = second;
        *(lanes *)(out + wide + b * BLOCK) = smooth;
    }
}

/* Filters the columns of the blocks of row v that are asked for. row: the filtered rows v - reach .. v + reach. */
static void filter_columns(const struct blob_kernel *k, const struct blob_picture *p, size_t v, const float *const *row,
                           float *response)
{
    const size_t n = blob_n_block(p->width), wide = padded_width(p->width), reach = (size_t)k->reach;
    for (size_t b = 0; b < n; b++) {
        if (p->asked[v * n + b] == 0) continue;
        const size_t u = b * BLOCK;
        const float *middle = row[reach] + u;
        lanes sum = k->smooth[0] * *(const lanes *)middle + k->second[0] * *(const lanes *)(middle + wide);
        for (size_t t = 1; t <= reach; t++) {
            const float *before = row[reach - t] + u, *after = row[reach + t] + u;
            sum += k->smooth[t] * (*(const lanes *)before + *(const lanes *)after);
            sum += k->second[t] * (*(const lanes *)(before + wide) + *(const lanes *)(after + wide));
        }
        sum *= k->factor;
        memcpy(response + v * p->width + u, &sum, (u + BLOCK <= p->width ? BLOCK : p->width - u) * sizeof *response);
    }
}

void blob_response(const struct blob_kernel *k, const struct blob_picture *p, float *scratch, uint8_t *work,
                   float *response)
{
    const size_t n = blob_n_block(p->width), wide = padded_width(p->width), reach = (size_t)k->reach;
    const size_t n_ring = 2 * reach + 1;
    float *padded = scratch, *ring = scratch + wide + 2 * reach;
    const float *row[2 * BLOB_MAX_REACH + 1];
    find_distances(p, work);
    for (size_t v = 0, done = 0; v < p->height; v++) {
        for (; done < p->height && done <= v + reach; done++)
            filter_row(k, p, done, work + done * n, padded, ring + done % n_ring * 2 * wide);
        if (memchr(p->asked + v * n, 1, n) == NULL) continue;
        for (size_t t = 0; t < n_ring; t++)
            row[t] = ring + mirrored((ptrdiff_t)(v + t) - (ptrdiff_t)reach, p->height) % n_ring * 2 * wide;
        filter_columns(k, p, v, row, response);
    }
}
