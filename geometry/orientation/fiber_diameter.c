#include "geometry/orientation/fiber_diameter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_SCALE = 20, MAX_BRICK = 12, EDGE = 64, MAX_REACH = 40 };

static double scale_sigma(int i) { return 0.7 * pow(1.14, i); } /* 0.7 .. 8.4 voxels */

/* The ratio is 2 sqrt 2 = 2.83 for an isolated cylinder. Fibers in bundles respond at finer scales. This value lies
 * between the two and was found on phantoms. */
static const double DIAMETER_OVER_SIGMA = 3.25;
static const float MIN_BLURRED = 0.35f;

struct brick {
    size_t from[3], n[3];
    double energy[N_SCALE];
};

struct job {
    const struct volume *v;
    struct brick brick[MAX_BRICK];
    double noise_var[N_SCALE]; /* of the response to white noise of variance 1 */
    float *scratch;            /* two bricks per thread */
    size_t scratch_per_thread;
};

static void add_scaled(float *restrict to, const float *restrict from, float w, size_t n)
{
    for (size_t i = 0; i < n; i++) to[i] += w * from[i];
}

/* Convolves rows of n values, at most EDGE, with edge values repeated. */
static void blur_rows(const float *in, float *out, size_t n, size_t n_row, const float *kernel, int reach)
{
    float padded[EDGE + 2 * MAX_REACH];
    size_t before = (size_t)reach;
    memset(out, 0, n * n_row * sizeof *out);
    for (size_t k = 0; k < n_row; k++, in += n, out += n) {
        for (size_t i = 0; i < before; i++) {
            padded[i] = in[0];
            padded[before + n + i] = in[n - 1];
        }
        memcpy(padded + before, in, n * sizeof *in);
        for (size_t t = 0; t <= 2 * before; t++) add_scaled(out, padded + t, kernel[t], n);
    }
}

/* Convolves across n_line lines of n_inner neighbouring values, with edge lines repeated; n_outer such blocks. */
static void blur_lines(const float *in, float *out, size_t n_inner, size_t n_line, size_t n_outer, const float *kernel,
                       int reach)
{
    ptrdiff_t last = (ptrdiff_t)n_line - 1;
    memset(out, 0, n_inner * n_line * n_outer * sizeof *out);
    for (size_t o = 0; o < n_outer; o++, in += n_inner * n_line, out += n_inner * n_line)
        for (ptrdiff_t c = 0; c <= last; c++)
            for (int t = -reach; t <= reach; t++) {
                ptrdiff_t s = c + t < 0 ? 0 : c + t > last ? last : c + t;
                add_scaled(out + (size_t)c * n_inner, in + (size_t)s * n_inner, kernel[t + reach], n_inner);
            }
}

static void blur(float *a, float *b, const size_t n[3], double sigma)
{
    float kernel[2 * MAX_REACH + 1];
    int reach = (int)ceil(3.5 * sigma);
    if (reach < 1) reach = 1;
    double sum = 0.0;
    for (int t = -reach; t <= reach; t++) sum += exp(-0.5 * t * t / (sigma * sigma));
    for (int t = -reach; t <= reach; t++) kernel[t + reach] = (float)(exp(-0.5 * t * t / (sigma * sigma)) / sum);
    blur_rows(a, b, n[0], n[1] * n[2], kernel, reach);
    blur_lines(b, a, n[0], n[1], n[2], kernel, reach);
    blur_lines(a, b, n[0] * n[1], n[2], 1, kernel, reach);
    memcpy(a, b, n[0] * n[1] * n[2] * sizeof *a);
}

/* Returns -lap at p, in a volume with rows of sy and slices of sz voxels. */
static float minus_laplacian(const float *p, ptrdiff_t sy, ptrdiff_t sz)
{
    return 6.0f * p[0] - p[-1] - p[1] - p[-sy] - p[sy] - p[-sz] - p[sz];
}

/* Mean over the inner voxels of the third power of the response r = -sigma^2 lap, where it is positive and there is
 * material at this scale. Noise in void must not count, because most of a volume may be void. On the axis of an
 * isolated cylinder at its scale the blurred density is 0.63.
 * Noise of variance q adds to the third power of the response s of the scan. It is removed by the identity that the
 * mean of (s + noise)^3 - 3 q (s + noise) is s^3. */
static double bright_energy(const float *a, const size_t n[3], double sigma, double noise_var)
{
    ptrdiff_t sy = (ptrdiff_t)n[0], sz = (ptrdiff_t)(n[0] * n[1]);
    size_t margin = EDGE / 8, count = 0, least_k = n[2] > 4 * margin ? margin : 1;
    double sum = 0.0;
    float s2 = (float)(sigma * sigma), q3 = (float)(3.0 * noise_var);
    for (size_t k = least_k; k + least_k < n[2]; k++)
        for (size_t j = 1; j + 1 < n[1]; j++)
            for (size_t i = 1; i + 1 < n[0]; i++, count++) {
                const float *p = a + (ptrdiff_t)k * sz + (ptrdiff_t)j * sy + (ptrdiff_t)i;
                if (p[0] < MIN_BLURRED) continue;
                float bright = s2 * minus_laplacian(p, sy, sz);
                if (bright > 0.0f && bright * bright > q3) sum += (double)(bright * (bright * bright - q3));
            }
    return count > 0 ? sum / (double)count : 0.0;
}

/* Noise variance of a brick. Second differences along all three axes at once remove nearly all of the fibers
 * (straight fibers perpendicular to an axis completely), and give 6^3 times the variance of white noise (after
 * Immerkaer 1996). For scans with smooth noise the result is too small. */
static double noise_variance(const float *a, const size_t n[3])
{
    static const float d2[3] = {1.0f, -2.0f, 1.0f};
    size_t count = 0;
    double sum = 0.0;
    for (size_t k = 1; k + 1 < n[2]; k++)
        for (size_t j = 1; j + 1 < n[1]; j++)
            for (size_t i = 1; i + 1 < n[0]; i++) {
                float response = 0.0f;
                for (size_t m = 0; m < 27; m++)
                    response += d2[m % 3] * d2[m / 3 % 3] * d2[m / 9] *
                                a[((k + m / 9 - 1) * n[1] + j + m / 3 % 3 - 1) * n[0] + i + m % 3 - 1];
                sum += (double)(response * response);
                count++;
            }
    return count > 0 ? sum / (216.0 * (double)count) : 0.0;
}

/* Variance of the response to white noise of variance 1 at each scale: the sum of squares of the response to one
 * voxel. */
static void response_to_noise(float *a, float *tmp, double var[N_SCALE])
{
    const size_t n[3] = {EDGE, EDGE, EDGE};
    const ptrdiff_t sy = EDGE, sz = EDGE * EDGE;
    memset(a, 0, EDGE * EDGE * EDGE * sizeof *a);
    a[(EDGE / 2) * (sz + sy + 1)] = 1.0f;
    double done = 0.0;
    for (int s = 0; s < N_SCALE; s++) {
        double sigma = scale_sigma(s), sum = 0.0;
        blur(a, tmp, n, sqrt(sigma * sigma - done));
        done = sigma * sigma;
        for (ptrdiff_t at = sz + sy + 1; at < EDGE * sz - sz - sy - 1; at++) {
            double r = done * (double)minus_laplacian(a + at, sy, sz);
            sum += r * r;
        }
        var[s] = sum;
    }
}

static void measure_brick(void *context, size_t i_brick, size_t i_thread)
{
    struct job *job = context;
    struct brick *b = &job->brick[i_brick];
    float *a = job->scratch + i_thread * job->scratch_per_thread, *tmp = a + job->scratch_per_thread / 2;
    scratch_keep_within(job->v->space);
    for (size_t k = 0; k < b->n[2]; k++)
        for (size_t j = 0; j < b->n[1]; j++)
            memcpy(a + (k * b->n[1] + j) * b->n[0],
                   job->v->density + volume_index(job->v->n, b->from[0], b->from[1] + j, b->from[2] + k),
                   b->n[0] * sizeof *a);
    double done = 0.0, noise_var = noise_variance(a, b->n);
    for (int s = 0; s < N_SCALE; s++) { /* applied one after the other, because the variances of Gaussians add */
        double sigma = scale_sigma(s);
        blur(a, tmp, b->n, sqrt(sigma * sigma - done));
        done = sigma * sigma;
        b->energy[s] = bright_energy(a, b->n, sigma, noise_var * job->noise_var[s]);
    }
}

/* Chooses the bricks with the most material from a lattice over the volume. */
static size_t choose_bricks(const struct volume *v, struct brick *chosen)
{
    double share[MAX_BRICK];
    size_t count = 0, n_cell[3];
    for (int a = 0; a < 3; a++) n_cell[a] = v->n[a] <= EDGE ? 1 : (v->n[a] + EDGE - 1) / EDGE;
    for (size_t c = 0; c < n_cell[0] * n_cell[1] * n_cell[2]; c++) {
        struct brick b = {0};
        size_t cell[3] = {c % n_cell[0], c / n_cell[0] % n_cell[1], c / (n_cell[0] * n_cell[1])};
        for (int a = 0; a < 3; a++) {
            b.n[a] = v->n[a] < EDGE ? v->n[a] : EDGE;
            b.from[a] = n_cell[a] == 1 ? 0 : cell[a] * (v->n[a] - b.n[a]) / (n_cell[a] - 1);
        }
        double sum = 0.0;
        scratch_keep_within(v->space);
        for (size_t k = 0; k < b.n[2]; k += 3)
            for (size_t j = 0; j < b.n[1]; j += 3)
                for (size_t i = 0; i < b.n[0]; i += 3)
                    sum += (double)v->density[volume_index(v->n, b.from[0] + i, b.from[1] + j, b.from[2] + k)];
        size_t at = count < MAX_BRICK ? count++ : MAX_BRICK;
        if (at == MAX_BRICK && sum <= share[MAX_BRICK - 1]) continue;
        if (at == MAX_BRICK) at--;
        for (; at > 0 && share[at - 1] < sum; at--) {
            share[at] = share[at - 1];
            chosen[at] = chosen[at - 1];
        }
        share[at] = sum;
        chosen[at] = b;
    }
    return count;
}

/* Returns the finest scale whose response is stronger than that of its neighbours, because peaks at coarser scales
 * are yarns; the scale of the largest response if there is no peak. */
static int first_peak(const double energy[N_SCALE])
{
    int best = 0;
    for (int i = 0; i < N_SCALE; i++)
        if (energy[i] > energy[best]) best = i;
    for (int i = 1; i + 2 < N_SCALE; i++)
        if (energy[i] > energy[i - 1] && energy[i] > energy[i + 1] && energy[i] > 1.1 * energy[i + 2]) return i;
    return best;
}

status fiber_diameter_measure(const struct volume *v, struct thread_pool *pool, const struct progress *progress,
                              double *diameter_voxel, struct error *err)
{
    struct job job = {.v = v, .scratch_per_thread = 2 * EDGE * EDGE * EDGE};
    size_t n_brick = choose_bricks(v, job.brick);
    job.scratch = malloc(thread_pool_n_thread(pool) * job.scratch_per_thread * sizeof *job.scratch);
    if (job.scratch == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot measure the fiber diameter: out of memory");
    response_to_noise(job.scratch, job.scratch + EDGE * EDGE * EDGE, job.noise_var);
    status s = thread_pool_run(pool, n_brick, measure_brick, &job, progress);
    free(job.scratch);
    if (s != STATUS_OK) return error_set(err, s, "measuring the fiber diameter was cancelled");
    double energy[N_SCALE] = {0.0};
    for (int i = 0; i < N_SCALE; i++)
        for (size_t b = 0; b < n_brick; b++) energy[i] += job.brick[b].energy[i];
    int best = first_peak(energy);
    double shift = 0.0;
    if (best > 0 && best < N_SCALE - 1) { /* parabola in log sigma */
        double l = log(energy[best - 1]), c = log(energy[best]), r = log(energy[best + 1]);
        shift = 0.5 * (l - r) / (l - 2.0 * c + r);
    }
    double sigma = scale_sigma(0) * pow(1.14, best + shift);
    *diameter_voxel = fmin(24.0, fmax(2.0, DIAMETER_OVER_SIGMA * sigma));
    return STATUS_OK;
}
