/* MERL BRDF database (Matusik et al. 2003): three numbers of 32 bits (90, 90, 180), then 64-bit floats, all of red,
 * then of green and blue, little-endian. The sample (i, j, k) is at half angle theta_h = 90 (i/90)^2 degrees,
 * difference angle theta_d = j degrees and phi_d = k degrees (0..180, by reciprocity); the channels have the scales 1,
 * 1.15 and 1.66 over 1500. Negative values mean that nothing was measured. Values between samples are interpolated
 * linearly in sqrt(theta_h), theta_d and phi_d; where a neighbour is missing, the nearest sample counts. Isotropic. */
#include "base/files/durable.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/photographs/rows/brdf_file.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { N_HALF = 90, N_DIFF = 90, N_PHI = 180, N_SAMPLE = N_HALF * N_DIFF * N_PHI, HEADER_BYTES = 12 };
enum { FILE_BYTES = HEADER_BYTES + 3 * N_SAMPLE * 8 };
static const double scale[3] = {1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0};

struct merl {
    char *bytes; /* the file; the samples begin after the header and are not aligned */
};

static status open_merl(const char *path, enum job_symmetry symmetry, void **handle, struct error *err)
{
    const char *name = path_file_name(path);
    size_t n = 0;
    int32_t edge[3];
    struct merl *m = calloc(1, sizeof *m);
    if (m == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read measured BRDF '%s': out of memory", name);
    status s = file_read_all(path, FILE_BYTES, &m->bytes, &n, err);
    if (s == STATUS_OK && n >= HEADER_BYTES) memcpy(edge, m->bytes, sizeof edge);
    if (s == STATUS_OK && (n < HEADER_BYTES || edge[0] != N_HALF || edge[1] != N_DIFF || edge[2] != N_PHI))
        s = error_set(err, STATUS_FORMAT,
                      "cannot read measured BRDF '%s': it does not begin as a MERL file of 90 x 90 x 180 samples",
                      name);
    if (s == STATUS_OK && symmetry == JOB_SYMMETRY_ANISOTROPIC)
        s = error_set(err, STATUS_INVALID,
                      "cannot read measured BRDF '%s': MERL files are isotropic; leave out 'symmetry'", name);
    if (s == STATUS_OK && n != FILE_BYTES)
        s = error_set(err, STATUS_FORMAT, "cannot read measured BRDF '%s': it has %zu bytes, a MERL file has %d", name,
                      n, FILE_BYTES);
    if (s != STATUS_OK) {
        free(m->bytes);
        free(m);
        return s;
    }
    *handle = m;
    return STATUS_OK;
}

static void close_merl(void *handle)
{
    struct merl *m = handle;
    free(m->bytes);
    free(m);
}

static double sample(const struct merl *m, size_t c, size_t i, size_t j, size_t k)
{
    double value;
    memcpy(&value, m->bytes + HEADER_BYTES + 8 * (c * N_SAMPLE + (i * N_DIFF + j) * N_PHI + k), sizeof value);
    return value * scale[c];
}

/* Rusinkiewicz's angles of the half vector and of the light in its frame. */
static void half_angles(const double light[3], const double camera[3], double *theta_h, double *theta_d, double *phi_d)
{
    double h[3], length = 0.0;
    for (int c = 0; c < 3; c++) h[c] = light[c] + camera[c];
    length = sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
    for (int c = 0; c < 3; c++) h[c] /= length;
    double phi_h = atan2(h[1], h[0]);
    *theta_h = acos(fmin(fmax(h[2], -1.0), 1.0));
    /* the light turned by -phi_h about z, then by -theta_h about y */
    double x = light[0] * cos(phi_h) + light[1] * sin(phi_h), y = light[1] * cos(phi_h) - light[0] * sin(phi_h);
    double dx = x * cos(*theta_h) - light[2] * sin(*theta_h), dz = x * sin(*theta_h) + light[2] * cos(*theta_h);
    *theta_d = acos(fmin(fmax(dz, -1.0), 1.0));
    *phi_d = atan2(y, dx);
    if (*phi_d < 0.0) *phi_d += M_PI;
}

/* Index below a place on an axis of n samples, and the share of the next one. phi wraps around. */
static size_t below(double place, size_t n, double *share)
{
    double at = fmin(fmax(place, 0.0), (double)n - 1.0);
    size_t i = (size_t)at;
    *share = at - (double)i;
    return i;
}

static bool eval_merl(const void *handle, const double light[3], const double camera[3], double f_rgb[3])
{
    double theta_h, theta_d, phi_d, share[3];
    half_angles(light, camera, &theta_h, &theta_d, &phi_d);
    double phi = phi_d / M_PI * N_PHI;
    size_t at[3] = {below(sqrt(theta_h / M_PI_2) * N_HALF, N_HALF, &share[0]),
                    below(theta_d / M_PI_2 * N_DIFF, N_DIFF, &share[1]), (size_t)phi % N_PHI};
    share[2] = phi - floor(phi);
    for (size_t c = 0; c < 3; c++) {
        bool missing = false;
        f_rgb[c] = 0.0;
        for (size_t k = 0; k < 8; k++) {
            double weight = 1.0;
            size_t i[3];
            for (size_t a = 0; a < 3; a++) {
                static const size_t n[3] = {N_HALF, N_DIFF, N_PHI};
                bool next = (k >> a & 1) != 0;
                weight *= next ? share[a] : 1.0 - share[a];
                i[a] = at[a] + next;
                if (i[a] >= n[a]) i[a] = a == 2 ? 0 : n[a] - 1;
            }
            double v = weight > 0.0 ? sample(handle, c, i[0], i[1], i[2]) : 0.0;
            missing = missing || !(v >= 0.0);
            f_rgb[c] += weight * v;
        }
        if (missing)
            f_rgb[c] = sample(handle, c, at[0] + (share[0] >= 0.5 && at[0] + 1 < N_HALF),
                              at[1] + (share[1] >= 0.5 && at[1] + 1 < N_DIFF), (at[2] + (share[2] >= 0.5)) % N_PHI);
        if (!(f_rgb[c] >= 0.0 && f_rgb[c] < 1e6)) return false;
    }
    return true;
}

static bool isotropic_merl(const void *handle) { return handle != NULL; }

const brdf_reader merl_brdf_reader = {.id = "merl.v1",
                                      .title = "MERL",
                                      .suffix = ".binary",
                                      .open = open_merl,
                                      .isotropic = isotropic_merl,
                                      .eval = eval_merl,
                                      .close = close_merl};
