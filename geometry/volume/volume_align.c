#include "geometry/volume/volume_align.h"
#include "base/option_id.h"

#include <math.h>
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

status volume_resample(const struct volume *in, const double matrix[9], double voxel_m, const size_t box[6],
                       struct thread_pool *pool, const struct progress *progress, struct volume *out, struct error *err)
{
    double inverse[9];
    if (!invert(matrix, inverse))
        return error_set_field(err, STATUS_INVALID, OPTION_MATRIX,
                               "cannot align the volume: the matrix has no inverse");
    size_t n[3];
    for (int a = 0; a < 3; a++) n[a] = box[3 + a] - box[a];
    status s = volume_init_in(out, n, (double[3]){voxel_m, voxel_m, voxel_m}, in->space, err);
    if (s != STATUS_OK) return s;
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
    s = thread_pool_run(pool, n[2], resample_slice, &r, progress);
    if (s != STATUS_OK) {
        volume_release(out);
        return error_set(err, s, "aligning the volume was cancelled");
    }
    return STATUS_OK;
}
