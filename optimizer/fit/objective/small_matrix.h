/* Dense symmetric matrices of at most SCATTERING_MAX_PARAM rows, row-major, on the stack. Plain loops in a fixed order:
 * results do not depend on a library's threads or on the processor's vector width.
 */
#ifndef SELVEDGE_OPTIMIZER_SMALL_MATRIX_H
#define SELVEDGE_OPTIMIZER_SMALL_MATRIX_H

#include <stdbool.h>
#include <stddef.h>

enum { SMALL_MATRIX_MAX = 16 };

/* Eigenvalues (not sorted) and eigenvectors (column j of v belongs to value j) of a symmetric a, by Jacobi rotations. a
 * is kept. */
void small_eigen(const double *a, size_t n, double *value, double *v);
/* a <- nearest matrix with eigenvalues >= floor. */
void small_clip_eigenvalues(double *a, size_t n, double floor);
/* Inverse of a symmetric positive definite a; false when a pivot is not positive. */
bool small_invert(const double *a, size_t n, double *inverse);
/* out = a b, n x n; out must differ from a and b. */
void small_multiply(const double *a, const double *b, size_t n, double *out);

#endif
