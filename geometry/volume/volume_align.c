#include "geometry/volume/volume_align.h"
#include "base/option_id.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

status axis_map_parse(const char *text, struct axis_map *map, struct error *err)
{
    const char *p = text;
    bool used[3] = {false, false, false};
    for (int a = 0; a < 3; a++) {
        map->flip[a] = *p == '-';
        if (*p == '-' || *p == '+') p++;
        if (*p < 'x' || *p > 'z' || used[*p - 'x']) break;
        map->source[a] = *p - 'x';
        used[*p - 'x'] = true;
        p++;
    }
    if (*p == '\0' && used[0] && used[1] && used[2]) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, OPTION_AXES,
                           "cannot use axes '%.16s': x, y and z are needed once each, with '-' before a reversed axis",
                           text);
}

void volume_resampled_shape(const size_t n_in[3], const double voxel_size_m[3], double voxel_m, size_t n_out[3])
{
    for (int a = 0; a < 3; a++) {
        n_out[a] = (size_t)llround((double)n_in[a] * voxel_size_m[a] / voxel_m);
        if (n_out[a] == 0) n_out[a] = 1;
    }
}

struct resample {
    const struct volume *in;
    struct volume *out;
    double column[3][3]; /* step in voxels of `in` for one voxel of `out` along each axis */
    double start[3];     /* voxel coordinate in `in` (centres at whole numbers) of voxel 0, 0, 0 of `out` */
};

enum { N_TAP = 6 };

/* The voxels along one axis that an interpolated value is made of. */
struct taps {
    size_t n, at[N_TAP];
    float weight[N_TAP];
};

/* Six-point Lagrange interpolation, which is exact for polynomials of degree 5; one voxel where x is a voxel's centre.
 * Beyond the ends the last voxel goes on. Returns false outside of the volume. */
static bool taps_at(double x, size_t n, struct taps *t)
{
    double last = (double)n - 1.0;
    if (x < -0.5 || x > last + 0.5) return false;
    double c = fmin(fmax(x, 0.0), last), whole = floor(c + 1e-6), f = c - whole;
    t->n = fabs(f) < 1e-6 ? 1 : N_TAP;
    if (t->n == 1) {
        t->at[0] = (size_t)whole;
        t->weight[0] = 1.0f;
        return true;
    }
    for (int k = 0; k < N_TAP; k++) {
        double at = fmin(fmax(whole + k - 2, 0.0), last), weight = 1.0;
        for (int m = 0; m < N_TAP; m++)
            if (m != k) weight *= (f + 2 - m) / (double)(k - m);
        t->at[k] = (size_t)at;
        t->weight[k] = (float)weight;
    }
    return true;
}

/* Returns the value that stands for a sum that is not finite: a voxel that is not a number or infinite in the file,
 * which is refused later, else the outside of the scan. */
static float not_finite(const struct volume *v, const struct taps t[3])
{
    for (size_t c = 0; c < t[2].n; c++)
        for (size_t b = 0; b < t[1].n; b++)
            for (size_t a = 0; a < t[0].n; a++) {
                float d = v->density[volume_index(v->n, t[0].at[a], t[1].at[b], t[2].at[c])];
                if (!isfinite(d) && d != VOLUME_OUTSIDE) return d;
            }
    return VOLUME_OUTSIDE;
}

static float interpolate(const struct volume *v, const double x[3])
{
    struct taps t[3];
    float sum = 0.0f;
    for (int a = 0; a < 3; a++)
        if (!taps_at(x[a], v->n[a], &t[a])) return VOLUME_OUTSIDE;
    for (size_t c = 0; c < t[2].n; c++)
        for (size_t b = 0; b < t[1].n; b++) {
            const float *row = v->density + volume_index(v->n, 0, t[1].at[b], t[2].at[c]);
            float of_row = 0.0f;
            for (size_t a = 0; a < t[0].n; a++) of_row += t[0].weight[a] * row[t[0].at[a]];
            sum += t[1].weight[b] * t[2].weight[c] * of_row;
        }
    return isfinite(sum) ? sum : not_finite(v, t);
}

static void resample_slice(void *context, size_t k, size_t i_thread)
{
    (void)i_thread;
    const struct resample *r = context;
    const size_t *n = r->out->n;
    for (size_t j = 0; j < n[1]; j++) {
        scratch_keep_within(r->in->space);
        for (size_t i = 0; i < n[0]; i++) {
            double x[3];
            for (int a = 0; a < 3; a++)
                x[a] = r->start[a] + (double)i * r->column[0][a] + (double)j * r->column[1][a] +
                       (double)k * r->column[2][a];
            r->out->density[volume_index(n, i, j, k)] = interpolate(r->in, x);
        }
    }
}

/* ---- axes that stay parallel: taps of each axis; rows that are interpolated along x once, for many rows ---- */

enum { BAND = 32 }; /* rows of `out` that share rows interpolated along x */

struct straight {
    struct resample r;
    struct taps *taps[3]; /* of each voxel of `out` along the axis; n == 0: outside */
    size_t n_row;         /* rows of `in` that a band needs at most */
    float *row;           /* per thread: N_TAP slices of n_row rows of n[0] */
};

static bool is_straight(const struct resample *r)
{
    for (int b = 0; b < 3; b++)
        for (int a = 0; a < 3; a++)
            if (a != b && r->column[b][a] != 0.0) return false;
    return true;
}

/* Rows of `in` from the first to the last one that a band uses. */
static void band_rows(const struct straight *job, size_t j0, size_t j1, size_t *first, size_t *n)
{
    size_t least = SIZE_MAX, most = 0;
    for (size_t j = j0; j < j1; j++)
        for (size_t b = 0; b < job->taps[1][j].n; b++) {
            const size_t at = job->taps[1][j].at[b];
            least = at < least ? at : least;
            most = at > most ? at : most;
        }
    *first = least <= most ? least : 0;
    *n = least <= most ? most + 1 - least : 0;
}

static void row_along_x(const struct straight *job, const float *in, float *out)
{
    const size_t n = job->r.out->n[0];
    for (size_t i = 0; i < n; i++) {
        const struct taps *t = &job->taps[0][i];
        float sum = 0.0f;
        for (size_t a = 0; a < t->n; a++) sum += t->weight[a] * in[t->at[a]];
        out[i] = sum;
    }
}

/* Sums the rows of taps y and z, in the order of interpolate(). */
static void add_rows(const struct straight *job, const float *row, size_t first, const struct taps *y,
                     const struct taps *z, float *restrict out)
{
    const size_t n = job->r.out->n[0];
    memset(out, 0, n * sizeof *out);
    for (size_t c = 0; c < z->n; c++)
        for (size_t b = 0; b < y->n; b++) {
            const float *from = row + (c * job->n_row + y->at[b] - first) * n, weight = y->weight[b] * z->weight[c];
            for (size_t i = 0; i < n; i++) out[i] += weight * from[i];
        }
}

static void straight_slice(void *context, size_t k, size_t i_thread)
{
    const struct straight *job = context;
    const struct resample *r = &job->r;
    const size_t *n = r->out->n;
    const struct taps *z = &job->taps[2][k];
    float *row = job->row + i_thread * N_TAP * job->n_row * n[0];
    for (size_t j0 = 0; j0 < n[1]; j0 += BAND) {
        const size_t j1 = j0 + BAND < n[1] ? j0 + BAND : n[1];
        size_t first, n_row;
        scratch_keep_within(r->in->space);
        band_rows(job, j0, j1, &first, &n_row);
        for (size_t c = 0; c < z->n; c++)
            for (size_t m = 0; m < n_row; m++)
                row_along_x(job, r->in->density + volume_index(r->in->n, 0, first + m, z->at[c]),
                            row + (c * job->n_row + m) * n[0]);
        for (size_t j = j0; j < j1; j++) {
            const struct taps *y = &job->taps[1][j];
            float *out = r->out->density + volume_index(n, 0, j, k);
            add_rows(job, row, first, y, z, out);
            for (size_t i = 0; i < n[0]; i++) {
                const bool inside = job->taps[0][i].n > 0 && y->n > 0 && z->n > 0;
                if (inside && isfinite(out[i])) continue;
                const struct taps t[3] = {job->taps[0][i], *y, *z};
                out[i] = inside ? not_finite(r->in, t) : VOLUME_OUTSIDE;
            }
        }
    }
}

static status run_straight(const struct resample *r, struct thread_pool *pool, const struct progress *progress)
{
    struct straight job = {.r = *r};
    const size_t *n = r->out->n;
    status s = STATUS_OK;
    for (int a = 0; a < 3; a++) {
        job.taps[a] = malloc(n[a] * sizeof *job.taps[a]);
        if (job.taps[a] == NULL) s = STATUS_NO_MEMORY;
        for (size_t i = 0; i < n[a] && s == STATUS_OK; i++)
            if (!taps_at(r->start[a] + (double)i * r->column[a][a], r->in->n[a], &job.taps[a][i])) job.taps[a][i].n = 0;
    }
    for (size_t j0 = 0; j0 < n[1] && s == STATUS_OK; j0 += BAND) {
        size_t first, n_row;
        band_rows(&job, j0, j0 + BAND < n[1] ? j0 + BAND : n[1], &first, &n_row);
        job.n_row = n_row > job.n_row ? n_row : job.n_row;
    }
    if (s == STATUS_OK) job.row = malloc(thread_pool_n_thread(pool) * N_TAP * (job.n_row + 1) * n[0] * sizeof *job.row);
    if (job.row == NULL) s = STATUS_NO_MEMORY;
    if (s == STATUS_OK) s = thread_pool_run(pool, n[2], straight_slice, &job, progress);
    for (int a = 0; a < 3; a++) free(job.taps[a]);
    free(job.row);
    return s;
}

static bool invert(const double m[9], double inverse[9])
{
    double c0 = m[4] * m[8] - m[5] * m[7], c1 = m[5] * m[6] - m[3] * m[8], c2 = m[3] * m[7] - m[4] * m[6];
    double det = m[0] * c0 + m[1] * c1 + m[2] * c2, size = 0.0;
    for (int i = 0; i < 9; i++) size = fmax(size, fabs(m[i]));
    if (!(fabs(det) > 1e-6 * size * size * size) || !isfinite(det)) return false;
    const double adjugate[9] = {c0, m[2] * m[7] - m[1] * m[8], m[1] * m[5] - m[2] * m[4],
                                c1, m[0] * m[8] - m[2] * m[6], m[2] * m[3] - m[0] * m[5],
                                c2, m[1] * m[6] - m[0] * m[7], m[0] * m[4] - m[1] * m[3]};
    for (int i = 0; i < 9; i++) inverse[i] = adjugate[i] / det;
    return true;
}

status volume_resample_to(const struct volume *in, const double matrix[9], const size_t box[3],
                          struct thread_pool *pool, const struct progress *progress, struct volume *out,
                          struct error *err)
{
    double inverse[9];
    const double voxel_m = out->voxel_size_m[0];
    if (!invert(matrix, inverse))
        return error_set_field(err, STATUS_INVALID, OPTION_MATRIX,
                               "cannot align the volume: the matrix has no inverse");
    struct resample r = {.in = in, .out = out};
    for (int a = 0; a < 3; a++) { /* a: axis of `in` */
        double first = 0.0;
        for (int b = 0; b < 3; b++) { /* b: axis of `out`; voxel centres are at (i + 1/2) voxel_m, as in `in` */
            double middle = 0.5 * (double)in->n[b] * (in->voxel_size_m[b] / voxel_m);
            r.column[b][a] = inverse[3 * a + b] * voxel_m / in->voxel_size_m[a];
            first += r.column[b][a] * ((double)box[b] + 0.5 - middle);
        }
        r.start[a] = first + 0.5 * (double)in->n[a] - 0.5;
    }
    status s = is_straight(&r) ? run_straight(&r, pool, progress)
                               : thread_pool_run(pool, out->n[2], resample_slice, &r, progress);
    if (s == STATUS_OK) return s;
    return error_set(
        err, s, s == STATUS_NO_MEMORY ? "cannot align the volume: out of memory" : "aligning the volume was cancelled");
}

status volume_resample(const struct volume *in, const double matrix[9], double voxel_m, const size_t box[6],
                       struct thread_pool *pool, const struct progress *progress, struct volume *out, struct error *err)
{
    size_t n[3];
    for (int a = 0; a < 3; a++) n[a] = box[3 + a] - box[a];
    status s = volume_init_in(out, n, (double[3]){voxel_m, voxel_m, voxel_m}, in->space, err);
    if (s == STATUS_OK) s = volume_resample_to(in, matrix, box, pool, progress, out, err);
    if (s != STATUS_OK) volume_release(out);
    return s;
}
