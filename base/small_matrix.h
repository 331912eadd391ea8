/* Dense and banded linear algebra of small symmetric matrices, row-major.
 *
 * LAPACK is not used for it. A result must have the same bits on every machine and with any number of threads;
 * OpenBLAS selects its kernels by processor, and which BLAS a Debian system runs is the administrator's choice. The
 * matrices have 3 to 64 rows, mostly fewer than 16 (a few thousand in a band of 7), where plain loops in a fixed order
 * cost nothing that can be measured.
 */
#ifndef SELVEDGE_BASE_SMALL_MATRIX_H
#define SELVEDGE_BASE_SMALL_MATRIX_H

#include <stdbool.h>
#include <stddef.h>

/* Largest n of small_eigen, small_clip_eigenvalues and small_invert, and largest band of small_invert_banded, which
 * keep copies on the stack. */
enum { SMALL_MATRIX_MAX = 64, SMALL_BAND_MAX = 10 };

/* Cholesky factor L of a symmetric n x n matrix, in place of its lower triangle; the upper triangle is neither read nor
 * written. Returns false when a pivot is not greater than least_pivot (0 accepts every positive definite matrix). */
bool small_factor(double *m, size_t n, double least_pivot);
/* Solves L L^T x = b with the factor of small_factor. Element i of b, and then of x, is x[i * stride]. */
void small_solve(const double *factor, size_t n, double *x, size_t stride);
/* Solves m x = b for a symmetric positive definite m of n rows and band width n_band: m[i * n_band + k] is the
 * element (i, i - k), k < n_band. m is destroyed and x replaces b. Returns false, with x undefined, when a pivot is
 * not positive. */
bool small_solve_banded(double *m, size_t n, size_t n_band, double *x);
/* Replaces a banded symmetric positive definite m, stored as above, by the elements of its inverse within the band
 * (Takahashi et al. 1973). Returns false, with m destroyed, when a pivot is not positive. */
bool small_invert_banded(double *m, size_t n, size_t n_band);
/* Inverse of a symmetric positive definite a; false when a pivot is not positive. */
bool small_invert(const double *a, size_t n, double *inverse);
/* out = a b, n x n; out must differ from a and b. */
void small_multiply(const double *a, const double *b, size_t n, double *out);

/* Eigenvalues (not sorted) and eigenvectors (column j of v belongs to value j) of a symmetric a, by Jacobi rotations. a
 * is kept. */
void small_eigen(const double *a, size_t n, double *value, double *v);
/* The same for 3 x 3, for use at every voxel: unit eigenvectors are the rows of vector, eigenvalues rise. m is
 * destroyed. */
void small_eigen_3(double m[3][3], float vector[3][3], float value[3]);
/* Replaces a by the nearest matrix whose eigenvalues are at least floor. */
void small_clip_eigenvalues(double *a, size_t n, double floor);

#endif
