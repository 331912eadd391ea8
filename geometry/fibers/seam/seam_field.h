/* A smooth offset over the plane of a seam: by how much the yarns at the high face lie beside those at the low face. It
 * is periodic along the seam. */
#ifndef SELVEDGE_GEOMETRY_SEAM_FIELD_H
#define SELVEDGE_GEOMETRY_SEAM_FIELD_H

#include "base/status.h"

struct seam_field {
    size_t n[2];    /* cells along the seam and in z */
    double cell[2]; /* edges of a cell, m */
    double z0;      /* lowest z, m */
    float *offset;  /* n[1] x n[0] x 2, m; at the middles of the cells */
};

/* Makes a field of the constant offset, with cells of at most `cell_m`. STATUS_NO_MEMORY. */
status seam_field_init(struct seam_field *f, double period_m, const double z_m[2], double cell_m,
                       const double offset_m[2], struct error *err);
void seam_field_release(struct seam_field *f);

struct seam_sample {
    double at[2], offset[2]; /* along the seam and z, m */
};

/* Makes the field the mean of the samples weighted by a Gaussian of standard deviation width_m. Where there are few
 * samples it stays near its previous value. STATUS_NO_MEMORY. */
status seam_field_fit(struct seam_field *f, const struct seam_sample *sample, size_t n, double width_m,
                      struct error *err);

/* Bilinear between the middles of cells; beyond the first and last height as there. */
void seam_field_at(const struct seam_field *f, const double at[2], double offset_m[2]);
/* Largest and root mean square length of an offset, m. */
double seam_field_largest(const struct seam_field *f);
double seam_field_rms(const struct seam_field *f);

#endif
