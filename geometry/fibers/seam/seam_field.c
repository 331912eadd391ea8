#include "geometry/fibers/seam/seam_field.h"

#include <math.h>
#include <stdlib.h>

/* Weight of the field's previous value, in samples at the same place. */
static const double KEPT_WEIGHT = 0.5;
enum { MOST_CELLS = 512 };

static size_t cells_of(double length, double cell)
{
    const double n = ceil(length / cell);
    return n < 1.0 ? 1 : n > MOST_CELLS ? MOST_CELLS : (size_t)n;
}

status seam_field_init(struct seam_field *f, double period_m, const double z_m[2], double cell_m,
                       const double offset_m[2], struct error *err)
{
    const double height = fmax(z_m[1] - z_m[0], cell_m);
    *f = (struct seam_field){.n = {cells_of(period_m, cell_m), cells_of(height, cell_m)}, .z0 = z_m[0]};
    f->cell[0] = period_m / (double)f->n[0];
    f->cell[1] = height / (double)f->n[1];
    f->offset = malloc(2 * f->n[0] * f->n[1] * sizeof *f->offset);
    if (f->offset == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot match the seams: out of memory");
    for (size_t i = 0; i < 2 * f->n[0] * f->n[1]; i++) f->offset[i] = (float)offset_m[i % 2];
    return STATUS_OK;
}

void seam_field_release(struct seam_field *f)
{
    if (f == NULL) return;
    free(f->offset);
    *f = (struct seam_field){0};
}

/* Weighted mean at one place. Samples beyond three standard deviations count nothing. */
static void mean_at(const struct seam_field *f, const double at[2], const struct seam_sample *sample, size_t n,
                    double width_m, const float before[2], float mean[2])
{
    const double period = f->cell[0] * (double)f->n[0];
    double weight = KEPT_WEIGHT, sum[2] = {KEPT_WEIGHT * (double)before[0], KEPT_WEIGHT * (double)before[1]};
    for (size_t i = 0; i < n; i++) {
        double du = sample[i].at[0] - at[0], dz = (sample[i].at[1] - at[1]) / width_m;
        if (fabs(dz) > 3.0) continue;
        du = (du - period * round(du / period)) / width_m;
        if (fabs(du) > 3.0) continue;
        const double w = exp(-0.5 * (du * du + dz * dz));
        weight += w;
        for (int k = 0; k < 2; k++) sum[k] += w * sample[i].offset[k];
    }
    for (int k = 0; k < 2; k++) mean[k] = (float)(sum[k] / weight);
}

status seam_field_fit(struct seam_field *f, const struct seam_sample *sample, size_t n, double width_m,
                      struct error *err)
{
    float *next = malloc(2 * f->n[0] * f->n[1] * sizeof *next);
    if (next == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot match the seams: out of memory");
    for (size_t k = 0; k < f->n[1]; k++)
        for (size_t i = 0; i < f->n[0]; i++) {
            const double at[2] = {((double)i + 0.5) * f->cell[0], f->z0 + ((double)k + 0.5) * f->cell[1]};
            const size_t cell = 2 * (k * f->n[0] + i);
            mean_at(f, at, sample, n, width_m, f->offset + cell, next + cell);
        }
    free(f->offset);
    f->offset = next;
    return STATUS_OK;
}

void seam_field_at(const struct seam_field *f, const double at[2], double offset_m[2])
{
    const double u = at[0] / f->cell[0] - 0.5, z = (at[1] - f->z0) / f->cell[1] - 0.5, n = (double)f->n[0];
    const double zc = fmin(fmax(z, 0.0), (double)(f->n[1] - 1)), wrapped = u - n * floor(u / n);
    const size_t i0 = (size_t)wrapped % f->n[0], i1 = (i0 + 1) % f->n[0];
    const size_t k0 = (size_t)zc, k1 = k0 + 1 < f->n[1] ? k0 + 1 : k0;
    const double fu = wrapped - floor(wrapped), fz = zc - (double)k0;
    for (size_t c = 0; c < 2; c++) {
        const double low = (1.0 - fu) * (double)f->offset[2 * (k0 * f->n[0] + i0) + c] +
                           fu * (double)f->offset[2 * (k0 * f->n[0] + i1) + c];
        const double high = (1.0 - fu) * (double)f->offset[2 * (k1 * f->n[0] + i0) + c] +
                            fu * (double)f->offset[2 * (k1 * f->n[0] + i1) + c];
        offset_m[c] = (1.0 - fz) * low + fz * high;
    }
}

double seam_field_largest(const struct seam_field *f)
{
    double largest = 0.0;
    for (size_t i = 0; i < f->n[0] * f->n[1]; i++)
        largest = fmax(largest, hypot((double)f->offset[2 * i], (double)f->offset[2 * i + 1]));
    return largest;
}

double seam_field_rms(const struct seam_field *f)
{
    double sum = 0.0;
    for (size_t i = 0; i < 2 * f->n[0] * f->n[1]; i++) sum += (double)f->offset[i] * (double)f->offset[i];
    return sqrt(sum / (double)(f->n[0] * f->n[1]));
}
