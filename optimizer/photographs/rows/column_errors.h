/* Standard errors of the columns of a cylinder, beyond the scatter along each column (photograph.h).
 *
 * Light changes smoothly from column to column, so what does not is an error: a column cuts the weave at another phase
 * than its neighbours. With the fourth difference d_i = m[i-2] - 4 m[i-1] + 6 m[i] - 4 m[i+1] + m[i+2], which is zero
 * for a polynomial of degree three and has 70 times the variance of a column, the relative error that all columns of a
 * photograph share is 1.4826 median |d_i / m[i]| / sqrt(70): the median leaves single highlights out. Five
 * columns whose steps differ by over a quarter, because one between them was left out, are skipped; without five at
 * equal steps the error is 0.
 *
 * The outline's error turns all columns of a photograph by column.angle_se_deg: the column's radiance changes by this
 * angle times the slope between its neighbours. */
#ifndef SELVEDGE_OPTIMIZER_COLUMN_ERRORS_H
#define SELVEDGE_OPTIMIZER_COLUMN_ERRORS_H

#include "optimizer/photographs/rows/observation.h"

/* Adds both to se_rgb of all columns from the observation `first` on. */
void column_errors_add(struct observation_set *o, size_t first);

#endif
