#include "renderer/glint/wave_height.h"

#include "base/rng.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Filters reach 5 standard deviations, where the Gaussian is 4e-6 of its middle. */
#define REACH 5.0
/* of a scratch along its length and across: the Gaussian is 4e-4 there */
#define SCRATCH_REACH 4.0

struct wave_height_option wave_height_option_usual(void)
{
    return (struct wave_height_option){.n = 1024, .texel_um = 1, .rms_um = 0.35, .length_um = {8, 8}, .seed = 1};
}

static status check(const struct wave_height_option *o, struct error *err)
{
    if (o->n < 64 || o->n > 4096 || (o->n & (o->n - 1)) != 0)
        return error_set(err, STATUS_INVALID, "a height field of %zu texels: not a power of two of 64 to 4096", o->n);
    if (!(o->texel_um >= 0.25 && o->texel_um <= 4))
        return error_set(err, STATUS_INVALID, "a texel of %g um: not 0.25 to 4", o->texel_um);
    if (!(o->rms_um >= 0 && o->rms_um <= 10))
        return error_set(err, STATUS_INVALID, "a height of %g um: not 0 to 10", o->rms_um);
    for (int d = 0; d < 2 && o->rms_um > 0; d++)
        if (!(o->length_um[d] >= 3 * o->texel_um && o->length_um[d] <= (double)o->n * o->texel_um))
            return error_set(err, STATUS_INVALID, "a correlation length of %g um: not from 3 texels to the tile",
                             o->length_um[d]);
    if (o->n_scratch > 0 &&
        !(o->scratch_width_um >= 1.5 * o->texel_um && o->scratch_width_um <= 100 && fabs(o->scratch_depth_um) <= 10))
        return error_set(err, STATUS_INVALID, "scratches %g um deep and %g um wide: at most 10, and from 1.5 texels",
                         o->scratch_depth_um, o->scratch_width_um);
    return STATUS_OK;
}

/* Adds to out the periodic convolution of the rows of in, along v, with a Gaussian (derivative = 0) or its derivative
 * by place (1), sd in texels. */
static void filter_along_v(const float *in, float *out, size_t n, double sd, int derivative)
{
    const long reach = (long)ceil(REACH * sd), wrap = (reach / (long)n + 2) * (long)n;
    for (size_t j = 0; j < n; j++)
        for (long k = -reach; k <= reach; k++) {
            const double x = (double)k, g = exp(-0.5 * x * x / (sd * sd));
            const float w = (float)(derivative ? -x / (sd * sd) * g : g);
            const float *from = in + (size_t)((long)j - k + wrap) % n * n;
            for (size_t i = 0; i < n; i++) out[j * n + i] += w * from[i];
        }
}

static void transpose(const float *in, float *out, size_t n)
{
    enum { BLOCK = 16 };
    for (size_t j0 = 0; j0 < n; j0 += BLOCK)
        for (size_t i0 = 0; i0 < n; i0 += BLOCK)
            for (size_t j = j0; j < j0 + BLOCK; j++)
                for (size_t i = i0; i < i0 + BLOCK; i++) out[i * n + j] = in[j * n + i];
}

/* Fills the field with noise, mean 0 and the stated root mean square. scratch: 3 n n floats. */
static void add_noise(struct wave_height *h, const struct wave_height_option *o, float *scratch)
{
    const size_t n = o->n, n2 = n * n;
    float *white = scratch, *along = scratch + n2, *slope_along = scratch + 2 * n2;
    const struct rng_key key = {o->seed, 1, 0, 0};
    const double sd[2] = {o->length_um[0] / 2 / o->texel_um, o->length_um[1] / 2 / o->texel_um};
    struct rng rng;
    rng_start(&rng, &key, 0, 0);
    for (size_t i = 0; i < n2; i += 2) {
        double pair[2];
        rng_normal_pair(&rng, pair);
        white[i] = (float)pair[0];
        white[i + 1] = (float)pair[1];
    }
    memset(along, 0, 2 * n2 * sizeof *along);
    filter_along_v(white, along, n, sd[0], 0); /* of transposed rows: along u */
    filter_along_v(white, slope_along, n, sd[0], 1);
    transpose(along, white, n);
    filter_along_v(white, h->height_um, n, sd[1], 0);
    filter_along_v(white, h->slope_v, n, sd[1], 1);
    transpose(slope_along, white, n);
    filter_along_v(white, h->slope_u, n, sd[1], 0);
    double mean = 0, square = 0;
    for (size_t i = 0; i < n2; i++) mean += (double)h->height_um[i] / (double)n2;
    for (size_t i = 0; i < n2; i++) square += pow((double)h->height_um[i] - mean, 2) / (double)n2;
    const double scale = o->rms_um / sqrt(square);
    for (size_t i = 0; i < n2; i++) {
        h->height_um[i] = (float)(((double)h->height_um[i] - mean) * scale);
        h->slope_u[i] = (float)((double)h->slope_u[i] * scale / o->texel_um);
        h->slope_v[i] = (float)((double)h->slope_v[i] * scale / o->texel_um);
    }
}

/* A groove: depth times a Gaussian along (u) and across (v) its own axes. */
struct scratch_mark {
    double center_um[2], along[2], depth_um, sd_along_um, sd_across_um;
};

static void add_mark(struct wave_height *h, const struct scratch_mark *m)
{
    const double reach[2] = {
        SCRATCH_REACH * hypot(m->along[0] * m->sd_along_um, m->along[1] * m->sd_across_um),
        SCRATCH_REACH * hypot(m->along[1] * m->sd_along_um, m->along[0] * m->sd_across_um),
    };
    const double texel = (double)h->texel_um, pa = 1 / (m->sd_along_um * m->sd_along_um),
                 pb = 1 / (m->sd_across_um * m->sd_across_um);
    const size_t mask = h->n - 1;
    for (long j = (long)((m->center_um[1] - reach[1]) / texel) - 1; (double)j * texel < m->center_um[1] + reach[1]; j++)
        for (long i = (long)((m->center_um[0] - reach[0]) / texel) - 1; (double)i * texel < m->center_um[0] + reach[0];
             i++) {
            const double x = ((double)i + 0.5) * texel - m->center_um[0],
                         y = ((double)j + 0.5) * texel - m->center_um[1];
            const double a = x * m->along[0] + y * m->along[1], b = y * m->along[0] - x * m->along[1];
            const double q = a * a * pa + b * b * pb;
            if (q > SCRATCH_REACH * SCRATCH_REACH) continue;
            const size_t at = ((size_t)j & mask) * h->n + ((size_t)i & mask);
            const double groove = -m->depth_um * exp(-0.5 * q);
            h->height_um[at] += (float)groove;
            h->slope_u[at] += (float)(-groove * (a * pa * m->along[0] - b * pb * m->along[1]));
            h->slope_v[at] += (float)(-groove * (a * pa * m->along[1] + b * pb * m->along[0]));
        }
}

static void add_scratches(struct wave_height *h, const struct wave_height_option *o)
{
    const double side_um = (double)o->n * o->texel_um;
    for (size_t i = 0; i < o->n_scratch; i++) {
        const struct rng_key key = {o->seed, 2, 0, 0};
        struct rng rng;
        rng_start(&rng, &key, (uint32_t)i, 0);
        struct scratch_mark m;
        for (int d = 0; d < 2; d++) m.center_um[d] = rng_double(&rng) * side_um;
        const double turn = M_PI * rng_double(&rng);
        m.along[0] = cos(turn);
        m.along[1] = sin(turn);
        m.depth_um = o->scratch_depth_um * (0.5 + rng_double(&rng));
        m.sd_across_um = fmax(o->scratch_width_um * (0.5 + rng_double(&rng)), 1.5 * o->texel_um);
        m.sd_along_um = side_um * (0.25 + 0.25 * rng_double(&rng)) / (2 * SCRATCH_REACH);
        add_mark(h, &m);
    }
}

status wave_height_init(struct wave_height *h, const struct wave_height_option *o, struct error *err)
{
    *h = (struct wave_height){.n = o->n, .texel_um = (float)o->texel_um};
    status s = check(o, err);
    if (s != STATUS_OK) return s;
    float *scratch = o->rms_um > 0 ? calloc(3 * o->n * o->n, sizeof *scratch) : NULL;
    h->height_um = calloc(3 * o->n * o->n, sizeof *h->height_um);
    if (h->height_um == NULL || (scratch == NULL && o->rms_um > 0)) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot make a height field: out of memory");
        goto out;
    }
    h->slope_u = h->height_um + o->n * o->n;
    h->slope_v = h->slope_u + o->n * o->n;
    if (o->rms_um > 0) add_noise(h, o, scratch);
    add_scratches(h, o);
out:
    free(scratch);
    if (s != STATUS_OK) wave_height_release(h);
    return s;
}

void wave_height_release(struct wave_height *h)
{
    free(h->height_um);
    free(h->curve_uu);
    *h = (struct wave_height){0};
}
