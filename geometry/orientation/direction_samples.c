#include "geometry/orientation/direction_samples.h"
#include "base/small_matrix.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLUR = 2,   /* reach of the blur of standard deviation 1 voxel */
    WINDOW = 5, /* reach of the tensor's window */
    INNER = 16,
    STEP = 4, /* samples are taken at every 4th of the 16 voxels along each axis */
    BUFFER = INNER + 2 * (WINDOW + 1 + BLUR),
    MAX_BRICK = 1600
};

_Static_assert(DIRECTION_SAMPLES_PER_BRICK == (INNER / STEP) * (INNER / STEP) * (INNER / STEP), "samples of a brick");

struct sampler {
    const struct volume *v;
    float material;
    size_t *first; /* corner voxels of bricks, in the order x, y, z */
    struct direction_samples *out;
    float *scratch; /* two buffers per thread */
};

static const size_t EDGE = BUFFER, CUBE = (size_t)BUFFER * BUFFER * BUFFER;

static size_t cube_index(size_t i, size_t j, size_t k) { return (k * EDGE + j) * EDGE + i; }

static size_t clamped(size_t corner, size_t i, size_t n)
{
    size_t shift = WINDOW + 1 + BLUR, at = corner + i;
    return at < shift ? 0 : at - shift < n ? at - shift : n - 1;
}

static void copy_brick(const struct sampler *f, const size_t corner[3], float *out)
{
    const size_t *n = f->v->n;
    float least = f->material;
    scratch_keep_within(f->v->space);
    for (size_t k = 0; k < EDGE; k++)
        for (size_t j = 0; j < EDGE; j++)
            for (size_t i = 0; i < EDGE; i++) {
                float x = f->v->density[volume_index(n, clamped(corner[0], i, n[0]), clamped(corner[1], j, n[1]),
                                                     clamped(corner[2], k, n[2]))];
                out[cube_index(i, j, k)] = x;
                if (isfinite(x) && x < least) least = x;
            }
    for (size_t i = 0; i < CUBE; i++)
        if (!isfinite(out[i])) out[i] = least;
}

/* Blurs by a Gaussian of one voxel along all three axes. A border of BLUR voxels keeps its values. */
static void blur_brick(float *a, float *b)
{
    static const float weight[2 * BLUR + 1] = {0.0545f, 0.2442f, 0.4026f, 0.2442f, 0.0545f};
    const size_t stride[3] = {1, EDGE, EDGE * EDGE};
    for (int axis = 0; axis < 3; axis++) {
        memcpy(b, a, CUBE * sizeof *b);
        for (size_t at = BLUR * stride[axis]; at + BLUR * stride[axis] < CUBE; at++) {
            float sum = 0.0f;
            for (size_t o = 0; o <= 2 * BLUR; o++) sum += weight[o] * b[at + o * stride[axis] - BLUR * stride[axis]];
            a[at] = sum;
        }
    }
}

/* Direction of least change around a place of the buffer; its weight states how clearly it is a single line. The
 * window is cut at the faces of the volume, because repeated voxels beyond them would not change along one axis. */
static void tensor_sample(const struct sampler *f, const size_t corner[3], const float *a, const size_t at[3],
                          struct direction_sample *s)
{
    const size_t stride[3] = {1, EDGE, EDGE * EDGE}, shift = WINDOW + 1 + BLUR;
    double sum[6] = {0.0}, scale[3];
    size_t from[3], to[3];
    for (int c = 0; c < 3; c++) {
        size_t end = f->v->n[c] + shift > corner[c] + 1 ? f->v->n[c] + shift - corner[c] - 1
                                                        : 0; /* one before the last inner voxel */
        from[c] = corner[c] + at[c] < shift + WINDOW + 1 ? shift + 1 - corner[c] : at[c] - WINDOW;
        to[c] = at[c] + WINDOW + 1 < end ? at[c] + WINDOW + 1 : end;
        scale[c] = f->v->voxel_size_m[0] / f->v->voxel_size_m[c];
    }
    for (size_t k = from[2]; k < to[2]; k++)
        for (size_t j = from[1]; j < to[1]; j++) {
            float row[6] = {0.0f};
            for (size_t i = from[0]; i < to[0]; i++) {
                const float *p = a + cube_index(i, j, k);
                float gx = p[1] - *(p - 1), gy = p[stride[1]] - *(p - stride[1]), gz = p[stride[2]] - *(p - stride[2]);
                row[0] += gx * gx, row[1] += gy * gy, row[2] += gz * gz;
                row[3] += gx * gy, row[4] += gx * gz, row[5] += gy * gz;
            }
            for (int c = 0; c < 6; c++) sum[c] += (double)row[c];
        }
    double m[3][3] = {{sum[0], sum[3], sum[4]}, {sum[3], sum[1], sum[5]}, {sum[4], sum[5], sum[2]}};
    for (int p = 0; p < 3; p++)
        for (int q = 0; q < 3; q++) m[p][q] *= scale[p] * scale[q];
    float vector[3][3], value[3];
    small_eigen_3(m, vector, value);
    float clear = value[1] + value[0] > 0.0f ? (value[1] - value[0]) / (value[1] + value[0]) : 0.0f;
    memcpy(s->d, vector[0], sizeof s->d);
    s->weight = clear * clear;
}

static void sample_brick(void *context, size_t i_brick, size_t i_thread)
{
    const struct sampler *f = context;
    float *a = f->scratch + i_thread * 2 * CUBE, *b = a + CUBE;
    struct direction_sample *out = f->out->sample + i_brick * DIRECTION_SAMPLES_PER_BRICK;
    size_t n = 0, at[3];
    scratch_keep_within(f->v->space);
    copy_brick(f, f->first + 3 * i_brick, a);
    blur_brick(a, b);
    const size_t low = WINDOW + 1 + BLUR;
    for (at[2] = low; at[2] < low + INNER; at[2] += STEP)
        for (at[1] = low; at[1] < low + INNER; at[1] += STEP)
            for (at[0] = low; at[0] < low + INNER; at[0] += STEP)
                if (a[cube_index(at[0], at[1], at[2])] >= f->material)
                    tensor_sample(f, f->first + 3 * i_brick, a, at, &out[n++]);
}

/* Places bricks side by side, or spread evenly if there are more than MAX_BRICK of them. */
static status place_bricks(struct sampler *f, struct error *err)
{
    size_t n[3], gap[3];
    for (int a = 0; a < 3; a++) {
        gap[a] = INNER;
        n[a] = f->v->n[a] / gap[a] > 0 ? f->v->n[a] / gap[a] : 1;
    }
    while (n[0] * n[1] * n[2] > MAX_BRICK) {
        int longest = n[0] >= n[1] && n[0] >= n[2] ? 0 : n[1] >= n[2] ? 1 : 2;
        n[longest]--;
    }
    f->out->n_column = n[0] * n[1];
    f->out->n_brick = f->out->n_column * n[2];
    f->first = malloc(3 * f->out->n_brick * sizeof *f->first);
    f->out->sample = calloc(f->out->n_brick * DIRECTION_SAMPLES_PER_BRICK, sizeof *f->out->sample);
    if (f->first == NULL || f->out->sample == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot find main directions: out of memory");
    for (size_t b = 0; b < f->out->n_brick; b++) {
        const size_t i[3] = {b % n[0], b / n[0] % n[1], b / n[0] / n[1]};
        for (int a = 0; a < 3; a++) {
            size_t room = f->v->n[a] > INNER ? f->v->n[a] - INNER : 0;
            f->first[3 * b + (size_t)a] = n[a] > 1 ? i[a] * room / (n[a] - 1) : room / 2;
        }
    }
    return STATUS_OK;
}

status direction_samples_take(const struct volume *v, double material, struct thread_pool *pool,
                              const struct progress *progress, struct direction_samples *samples, struct error *err)
{
    struct sampler f = {.v = v, .material = (float)material, .out = samples};
    *samples = (struct direction_samples){0};
    status s = place_bricks(&f, err);
    f.scratch = malloc(thread_pool_n_thread(pool) * 2 * CUBE * sizeof *f.scratch);
    if (s == STATUS_OK && f.scratch == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot find main directions: out of memory");
    if (s == STATUS_OK) {
        s = thread_pool_run(pool, samples->n_brick, sample_brick, &f, progress);
        if (s != STATUS_OK) error_set(err, s, "finding main directions was cancelled");
    }
    free(f.first);
    free(f.scratch);
    if (s != STATUS_OK) direction_samples_release(samples);
    return s;
}

void direction_samples_release(struct direction_samples *samples)
{
    free(samples->sample);
    *samples = (struct direction_samples){0};
}
