#include "geometry/diameter/fiber_diameter.h"

#include "geometry/diameter/scale_noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_BRICK = 12, MAX_VOID_BRICK = 4, EDGE = SCALE_EDGE, N_CELL = EDGE * EDGE * EDGE };

/* The ratio is 2 sqrt 2 = 2.83 for an isolated cylinder. Fibers in bundles respond at finer scales. This value lies
 * between the two and was found on phantoms. */
static const double DIAMETER_OVER_SIGMA = 3.25;
static const float MIN_BLURRED = 0.35f;
/* Bricks with less than this share of the material of the fullest one may lie outside of the field of view. */
static const double LEAST_MATERIAL = 0.02;
enum { NEAR_MATERIAL = 2 };           /* voxels; peaks of the noise in void must not count */
static const double MOST_NOISE = 0.5; /* share of a peak that noise may have */
/* A shoulder is a peak of the energy over sigma. The response to a plane outline has an energy that grows as sigma, and
 * the energy of a rod grows faster up to its own peak, so the outlines of yarns and of rods without inner structure
 * have no such peak at finer scales, but may hide the fall beyond the peak of fibers. SHOULDER_VALLEY: before the
 * coarser peak the energy over sigma must fall to this share of the shoulder. MOST_REMAINS: the share of noise, whose
 * remains are broad, in a shoulder or a broad peak stays below this. */
static const double SHOULDER_VALLEY = 0.85, MOST_REMAINS = 0.25;
/* No scanner resolves less than about half a voxel, so a blur by that lowers the noise more than the fibers. It is used
 * only for diameters below the chosen one divided by FIBER_DIAMETER_FINER. */
static const double SECOND_BLUR_VOXEL = 0.5;

/* Mean third power of the bright response: without the part of the noise, and as it is. */
struct energy {
    double signal, raw;
};

struct brick {
    size_t from[3], n[3];
    double material;
    struct energy energy[N_SCALE];
    struct scale_noise noise;
    double voxel_noise_var;
};

struct job {
    const struct volume *v;
    struct brick brick[MAX_BRICK], void_brick[MAX_VOID_BRICK];
    size_t n_brick, n_void_brick;
    double blur_voxel;         /* by which bricks are blurred first; 0: not at all */
    int n_scale;               /* scales to measure */
    double noise_var[N_SCALE]; /* of the response */
    float *scratch;            /* three bricks per thread */
    uint8_t *far;              /* one brick per thread */
};

/* Mean over the inner voxels of the third power of the response r = -sigma^2 lap, where it is positive and there is
 * material at this scale. Noise in void must not count, because most of a volume may be void. On the axis of an
 * isolated cylinder at its scale the blurred density is 0.63.
 * Noise of variance q adds to the third power of the response s of the scan. It is removed by the identity that the
 * mean of (s + noise)^3 - 3 q (s + noise) is s^3. */
static struct energy bright_energy(const float *a, const uint8_t *far, const size_t n[3], double sigma,
                                   double noise_var)
{
    ptrdiff_t sy = (ptrdiff_t)n[0], sz = (ptrdiff_t)(n[0] * n[1]);
    size_t margin = SCALE_EDGE / 8, count = 0, least_k = n[2] > 4 * margin ? margin : 1;
    double sum = 0.0, raw = 0.0;
    float s2 = (float)(sigma * sigma), q3 = (float)(3.0 * noise_var);
    float cube[EDGE], less[EDGE];
    for (size_t k = least_k; k + least_k < n[2]; k++)
        for (size_t j = 1; j + 1 < n[1] && n[0] > 2; j++, count += n[0] - 2) {
            const float *p = a + (k * n[1] + j) * n[0] + 1;
            const uint8_t *q = far + (p - a);
            for (size_t i = 0; i + 2 < n[0]; i++) {
                const float response = s2 * scale_minus_laplacian(p + i, sy, sz);
                const bool counts = (p[i] >= MIN_BLURRED) & (q[i] <= NEAR_MATERIAL) & (response > 0.0f);
                const float bright = counts ? response : 0.0f, square = bright * bright;
                cube[i] = square * bright;
                less[i] = square > q3 ? bright * (square - q3) : 0.0f;
            }
            for (size_t i = 0; i + 2 < n[0]; i++) {
                raw += (double)cube[i];
                sum += (double)less[i];
            }
        }
    double per_voxel = count > 0 ? 1.0 / (double)count : 0.0;
    return (struct energy){sum * per_voxel, raw * per_voxel};
}

/* Copies a brick to a, and blurs it if the job says so. tmp: scratch of the same size. */
static void load_brick(const struct job *job, const struct brick *b, float *a, float *tmp)
{
    const struct volume *v = job->v;
    scratch_keep_within(v->space);
    for (size_t k = 0; k < b->n[2]; k++)
        for (size_t j = 0; j < b->n[1]; j++)
            memcpy(a + (k * b->n[1] + j) * b->n[0],
                   v->density + volume_index(v->n, b->from[0], b->from[1] + j, b->from[2] + k), b->n[0] * sizeof *a);
    if (job->blur_voxel > 0.0) scale_blur(a, tmp, b->n, job->blur_voxel);
}

static void measure_noise(void *context, size_t i_brick, size_t i_thread)
{
    struct job *job = context;
    struct brick *b = &job->void_brick[i_brick];
    float *density = job->scratch + i_thread * 3 * N_CELL;
    load_brick(job, b, density, density + N_CELL);
    b->noise = (struct scale_noise){0};
    scale_noise_add(&b->noise, density, density + N_CELL, density + 2 * (size_t)N_CELL, job->far + i_thread * N_CELL,
                    b->n);
    b->voxel_noise_var = scale_noise_of_voxels(density, b->n);
}

static void measure_brick(void *context, size_t i_brick, size_t i_thread)
{
    struct job *job = context;
    struct brick *b = &job->brick[i_brick];
    float *density = job->scratch + i_thread * 3 * N_CELL, *a = density + N_CELL, *tmp = a + N_CELL;
    uint8_t *far = job->far + i_thread * N_CELL;
    load_brick(job, b, density, tmp);
    scale_find_void(density, a, tmp, far, b->n);
    memcpy(a, density, b->n[0] * b->n[1] * b->n[2] * sizeof *a);
    for (int s = 0; s < job->n_scale; s++) {
        scale_blur_on(a, tmp, b->n, s);
        b->energy[s] = bright_energy(a, far, b->n, scale_sigma(s), job->noise_var[s]);
    }
}

/* Sum of the densities of every third voxel along each axis. */
static double sum_densities(const struct volume *v, const struct brick *b)
{
    double sum = 0.0;
    scratch_keep_within(v->space);
    for (size_t k = 0; k < b->n[2]; k += 3)
        for (size_t j = 0; j < b->n[1]; j += 3)
            for (size_t i = 0; i < b->n[0]; i += 3)
                sum += (double)v->density[volume_index(v->n, b->from[0] + i, b->from[1] + j, b->from[2] + k)];
    return sum;
}

static int fuller_first(const void *a, const void *b)
{
    const struct brick *x = a, *y = b;
    if (x->material != y->material) return x->material > y->material ? -1 : 1;
    for (int i = 2; i >= 0; i--)
        if (x->from[i] != y->from[i]) return x->from[i] < y->from[i] ? -1 : 1;
    return 0;
}

/* Chooses from a lattice of bricks over the volume those with the most material, and for the noise those with the
 * least. */
static status choose_bricks(struct job *job, struct error *err)
{
    const struct volume *v = job->v;
    size_t n_cell[3], n;
    for (int a = 0; a < 3; a++) n_cell[a] = v->n[a] <= EDGE ? 1 : (v->n[a] + EDGE - 1) / EDGE;
    n = n_cell[0] * n_cell[1] * n_cell[2];
    struct brick *all = calloc(n, sizeof *all);
    if (all == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure the fiber diameter: out of memory");
    for (size_t c = 0; c < n; c++) {
        size_t cell[3] = {c % n_cell[0], c / n_cell[0] % n_cell[1], c / (n_cell[0] * n_cell[1])};
        for (int a = 0; a < 3; a++) {
            all[c].n[a] = v->n[a] < EDGE ? v->n[a] : EDGE;
            all[c].from[a] = n_cell[a] == 1 ? 0 : cell[a] * (v->n[a] - all[c].n[a]) / (n_cell[a] - 1);
        }
        all[c].material = sum_densities(v, &all[c]);
    }
    qsort(all, n, sizeof *all, fuller_first);
    job->n_brick = n < MAX_BRICK ? n : MAX_BRICK;
    memcpy(job->brick, all, job->n_brick * sizeof *all);
    for (size_t c = n; c-- > 0 && job->n_void_brick < MAX_VOID_BRICK;)
        if (all[c].material >= LEAST_MATERIAL * all[0].material) job->void_brick[job->n_void_brick++] = all[c];
    free(all);
    return STATUS_OK;
}

/* Fills in noise_var. Returns whether it was measured in void. */
static bool reduce_noise(struct job *job)
{
    struct scale_noise sum = {0};
    double voxel_var = 0.0;
    for (size_t b = 0; b < job->n_void_brick; b++) {
        const struct brick *k = &job->void_brick[b];
        for (int i = 0; i < N_SCALE; i++) {
            sum.square[i] += k->noise.square[i];
            sum.n[i] += k->noise.n[i];
        }
        sum.n_void += k->noise.n_void;
        sum.n_clamped += k->noise.n_clamped;
        voxel_var += k->voxel_noise_var / (double)job->n_void_brick;
    }
    bool measured = scale_noise_variance(&sum, job->noise_var);
    if (!measured) scale_noise_white(voxel_var, job->scratch, job->scratch + N_CELL, job->noise_var);
    return measured;
}

static double noise_share(struct energy e) { return e.raw > 0.0 ? fmax(0.0, 1.0 - e.signal / e.raw) : 0.0; }

static bool is_peak(const struct energy e[N_SCALE], int i)
{
    return e[i].signal > e[i - 1].signal && e[i].signal > e[i + 1].signal && e[i].signal > 1.1 * e[i + 2].signal;
}

/* Whether scale i is a broad peak with little noise: it falls by a tenth anywhere before the energy rises above it. */
static bool is_broad_peak(const struct energy e[N_SCALE], int i)
{
    if (e[i].signal <= e[i - 1].signal || noise_share(e[i]) > MOST_REMAINS) return false;
    for (int k = i + 1; k < N_SCALE && e[k].signal <= e[i].signal; k++)
        if (e[i].signal > 1.1 * e[k].signal) return true;
    return false;
}

static double over_sigma(const struct energy e[N_SCALE], int i) { return e[i].signal / scale_sigma(i); }

/* Whether scale i is a shoulder below the peak of yarns at scale coarse. */
static bool is_shoulder(const struct energy e[N_SCALE], int i, int coarse)
{
    const double at = over_sigma(e, i);
    double least = at;
    if (at < over_sigma(e, i - 1) || at < over_sigma(e, i + 1)) return false;
    for (int k = i + 1; k < coarse; k++) least = fmin(least, over_sigma(e, k));
    return least < SHOULDER_VALLEY * at && noise_share(e[i]) < MOST_REMAINS;
}

/* Diameter of a peak of the energy over sigma^power at or beside scale i: a parabola through its logarithm there and at
 * the scales beside it, in log sigma. */
static double diameter_at(const struct energy e[N_SCALE], int i, double power)
{
    double shift = 0.0;
    if (i > 0 && i < N_SCALE - 1 && e[i - 1].signal > 0.0 && e[i + 1].signal > 0.0) {
        double l = log(e[i - 1].signal), c = log(e[i].signal), r = log(e[i + 1].signal);
        shift = (0.5 * (l - r) + power * log(1.14)) / (l - 2.0 * c + r);
        shift = fmax(-1.0, fmin(1.0, shift));
    }
    return fmin(24.0, fmax(2.0, DIAMETER_OVER_SIGMA * scale_sigma(0) * pow(1.14, i + shift)));
}

/* Chooses the finest peak that is not mostly noise, because peaks at coarser scales are yarns; without such a peak the
 * one with the least noise, and without any the scale of the strongest response. */
static void choose_peak(const struct energy e[N_SCALE], struct fiber_diameter *d)
{
    int best = -1, other = -1, most = 0;
    for (int i = 1; i + 2 < N_SCALE; i++) {
        if (!is_peak(e, i)) continue;
        if (best < 0 || (noise_share(e[best]) > MOST_NOISE && noise_share(e[i]) < noise_share(e[best]))) {
            other = best;
            best = i;
        } else if (other < 0 && e[i].signal > e[best].signal) {
            other = i;
        }
    }
    for (int i = 0; i < N_SCALE; i++)
        if (e[i].signal > e[most].signal) most = i;
    if (best < 0) best = most;
    for (int i = best + 1; i + 2 < N_SCALE && noise_share(e[best]) > MOST_NOISE; i++)
        if (is_broad_peak(e, i)) {
            other = best;
            best = i;
        }
    double power = 0.0;
    for (int i = 1; scale_sigma(i) * FIBER_DIAMETER_FINER < scale_sigma(best); i++)
        if (is_shoulder(e, i, best)) {
            other = best;
            best = i;
            power = 0.5; /* between a peak alone and one on a slope of outlines */
        }
    d->hidden = false;
    d->voxel = diameter_at(e, best, power);
    d->noise_share = noise_share(e[best]);
    d->other_voxel = other >= 0 ? diameter_at(e, other, 0.0) : NAN;
    d->other_noise_share = other >= 0 ? noise_share(e[other]) : NAN;
}

/* Measures the noise and the energy of the first n_scale scales, with the bricks blurred first. */
static status measure_energy(struct job *job, double blur_voxel, int n_scale, struct thread_pool *pool,
                             const struct progress *progress, struct energy energy[N_SCALE], bool *noise_measured)
{
    const struct progress quiet = progress_silent(progress);
    job->blur_voxel = blur_voxel;
    job->n_scale = n_scale;
    status s = thread_pool_run(pool, job->n_void_brick, measure_noise, job, &quiet);
    if (s == STATUS_OK) *noise_measured = reduce_noise(job);
    if (s == STATUS_OK) s = thread_pool_run(pool, job->n_brick, measure_brick, job, progress);
    memset(energy, 0, N_SCALE * sizeof *energy);
    for (int i = 0; i < n_scale && s == STATUS_OK; i++)
        for (size_t b = 0; b < job->n_brick; b++) {
            energy[i].signal += job->brick[b].energy[i].signal;
            energy[i].raw += job->brick[b].energy[i].raw;
        }
    return s;
}

/* Number of scales that say whether there is a peak well below the diameter: the scales of smaller diameters, and the
 * two beyond them that a peak is compared with. Returns 0 if noise hides no peak there. */
static int hidden_scales(const struct energy e[N_SCALE], double diameter)
{
    int n = 0;
    bool hidden = false;
    for (; n + 2 < N_SCALE && DIAMETER_OVER_SIGMA * scale_sigma(n) * FIBER_DIAMETER_FINER < diameter; n++)
        hidden = hidden || noise_share(e[n]) > MOST_NOISE;
    return hidden ? n + 2 : 0;
}

/* Looks for a finer peak than the chosen one in blurred bricks, and takes the finest that is not mostly noise. */
static status look_finer(struct job *job, int n_scale, struct thread_pool *pool, const struct progress *progress,
                         struct fiber_diameter *d)
{
    struct energy e[N_SCALE];
    bool measured;
    const struct progress quiet = progress_silent(progress);
    status s = measure_energy(job, SECOND_BLUR_VOXEL, n_scale, pool, &quiet, e, &measured);
    for (int i = 1; i + 2 < n_scale && s == STATUS_OK; i++) {
        if (!is_peak(e, i) || noise_share(e[i]) > MOST_NOISE ||
            diameter_at(e, i, 0.0) * FIBER_DIAMETER_FINER > d->voxel)
            continue;
        d->other_voxel = d->voxel;
        d->other_noise_share = d->noise_share;
        d->voxel = diameter_at(e, i, 0.0);
        d->noise_share = noise_share(e[i]);
        d->hidden = true;
        break;
    }
    return s;
}

status fiber_diameter_measure(const struct volume *v, struct thread_pool *pool, const struct progress *progress,
                              struct fiber_diameter *diameter, struct error *err)
{
    struct job *job = calloc(1, sizeof *job);
    size_t n_thread = thread_pool_n_thread(pool);
    status s = STATUS_OK;
    if (job != NULL) {
        job->v = v;
        job->scratch = malloc(n_thread * 3 * N_CELL * sizeof *job->scratch);
        job->far = malloc(n_thread * N_CELL * sizeof *job->far);
    }
    if (job == NULL || job->scratch == NULL || job->far == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot measure the fiber diameter: out of memory");
    if (s == STATUS_OK) s = choose_bricks(job, err);
    if (s == STATUS_OK) {
        struct energy energy[N_SCALE];
        s = measure_energy(job, 0.0, N_SCALE, pool, progress, energy, &diameter->noise_measured);
        if (s == STATUS_OK) choose_peak(energy, diameter);
        const int n_hidden = s == STATUS_OK ? hidden_scales(energy, diameter->voxel) : 0;
        if (n_hidden > 0) s = look_finer(job, n_hidden, pool, progress, diameter);
        if (s != STATUS_OK) error_set(err, s, "measuring the fiber diameter was cancelled");
    }
    if (job != NULL) {
        free(job->scratch);
        free(job->far);
    }
    free(job);
    return s;
}
