/* Systems of linear equations with a dense complex matrix: LU decomposition with row pivots, in blocks.
 *
 * Real and imaginary parts stand apart, row by row: entry (i, j) is re[i * stride + j] + i im[i * stride + j]. One
 * thread; callers solve several systems at a time. */
#ifndef SELVEDGE_RENDERER_COMPLEX_LU_H
#define SELVEDGE_RENDERER_COMPLEX_LU_H

#include "base/status.h"

#include <stddef.h>

struct complex_matrix {
    size_t n_row, n_column, stride; /* stride: of a row, a multiple of 4 */
    double *re, *im;
};

/* Zeros. STATUS_NO_MEMORY. complex_matrix_release frees what complex_matrix_init made, and does nothing for zeros. */
status complex_matrix_init(struct complex_matrix *m, size_t n_row, size_t n_column, struct error *err);
void complex_matrix_release(struct complex_matrix *m);

/* Replaces a square matrix by its factors L (diagonal 1) and U; row i was swapped with row pivot[i] >= i at step i.
 * STATUS_INVALID when it is singular, STATUS_NO_MEMORY. */
status complex_lu_factor(struct complex_matrix *a, size_t *pivot, struct error *err);
/* Replaces the right-hand sides, the columns of b, by the solutions. */
void complex_lu_solve(const struct complex_matrix *lu, const size_t *pivot, struct complex_matrix *b);

#endif
