/* The averaged repeat of a texture, as its Fourier coefficients on the lattice.
 *
 * A photographed cloth repeats over a few periods only: yarns wander, and perspective and folds change the period. So
 * the coefficients are taken in small windows; each window is shifted to the phases of two strong reference peaks, and
 * then the windows are averaged. Differences from repeat to repeat average out. */
#ifndef SELVEDGE_GEOMETRY_WEAVE_REPEAT_H
#define SELVEDGE_GEOMETRY_WEAVE_REPEAT_H

#include "geometry/weave/weave_lattice.h"

#include <complex.h>

enum { WEAVE_COEFFICIENT_MAX = 48 };

struct weave_coefficient {
    int index[2];         /* on the basis of the lattice */
    double f[2];          /* cycles per pixel */
    double complex value; /* mean over windows; the picture's standard deviation is 1 */
    double sd;            /* standard error of the value, real and imaginary part together */
};

struct weave_repeat {
    struct weave_coefficient coefficient[WEAVE_COEFFICIENT_MAX]; /* one of each pair f, -f; lowest frequency first */
    size_t n_coefficient, n_window;
    size_t edge_px;  /* of a window; windows overlap by half */
    size_t n_across; /* windows in a row */
    double *phase;   /* n_window x 2: the turn of each window along the lattice's basis, which aligns it */
};

/* Averages the repeat of an even picture (vision_flatten). Frequencies up to half a cycle per pixel take part. Windows
 * are as small as the noise allows. The caller releases repeat. STATUS_NOT_FOUND if no two references that span the
 * lattice are in the picture, STATUS_NO_MEMORY. */
status weave_average_repeat(const float *flat, size_t width, size_t height, const struct weave_lattice *lattice,
                            struct weave_repeat *repeat, struct error *err);
/* The same average of another picture of the same size with the phases of repeat, for its color channels: replaces the
 * values of the coefficients. STATUS_NO_MEMORY. */
status weave_average_again(const float *picture, size_t width, size_t height, struct weave_repeat *repeat,
                           struct error *err);
/* A place 0 of the repeat in the middle of the window that is in the middle of the picture, in its pixels. */
void weave_repeat_middle(const struct weave_repeat *repeat, const struct weave_lattice *lattice, double at_px[2]);
void weave_repeat_release(struct weave_repeat *repeat);

/* Value of the averaged repeat at a place in pixels. */
double weave_repeat_value(const struct weave_repeat *repeat, const double at_px[2]);

#endif
