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

static float trilinear(const struct volume *v, const double x[3])
{
    size_t i[3], j[3];
    float f[3];
    for (int a = 0; a < 3; a++) {
        double last = (double)v->n[a] - 1.0;
        if (x[a] < -0.5 || x[a] > last + 0.5) return VOLUME_OUTSIDE;
        double c = fmin(fmax(x[a], 0.0), last), whole = floor(c);
        i[a] = (size_t)whole;
        j[a] = i[a] + 1 < v->n[a] ? i[a] + 1 : i[a];
        f[a] = (float)(c - whole);
    }
    const float *d = v->density;
    const size_t *n = v->n;
#define ROW(y, z) ((1.0f - f[0]) * d[volume_index(n, i[0], y, z)] + f[0] * d[volume_index(n, j[0], y, z)])
    float low = (1.0f - f[1]) * ROW(i[1], i[2]) + f[1] * ROW(j[1], i[2]);
    float high = (1.0f - f[1]) * ROW(i[1], j[2]) + f[1] * ROW(j[1], j[2]);
#undef ROW
    return (1.0f - f[2]) * low + f[2] * high;
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
            r->out->density[volume_index(n, i, j, k)] = trilinear(r->in, x);
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
    size_t n_all[3], n[3];
    volume_resampled_shape(in->n, in->voxel_size_m, voxel_m, n_all);
    for (int a = 0; a < 3; a++) n[a] = box[3 + a] - box[a];
    status s = volume_init_in(out, n, (double[3]){voxel_m, voxel_m, voxel_m}, in->space, err);
    if (s != STATUS_OK) return s;
    struct resample r = {.in = in, .out = out};
    for (int a = 0; a < 3; a++) { /* a: axis of `in` */
        double first = 0.0;
        for (int b = 0; b < 3; b++) { /* b: axis of `out`; voxel centres are at (i + 1/2) voxel_m */
            r.column[b][a] = inverse[3 * a + b] * voxel_m / in->voxel_size_m[a];
            first += r.column[b][a] * ((double)box[b] + 0.5 - 0.5 * (double)n_all[b]);
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
