/* Smooths polylines (fabric thesis, 5.6.4): minimises sum_i alpha |p_i - p_i0|^2 + |p_{i-1} - 2 p_i + p_{i+1}|^2. */
#ifndef SELVEDGE_GEOMETRY_SMOOTHING_H
#define SELVEDGE_GEOMETRY_SMOOTHING_H

#include "base/status.h"

/* Smooths the n vertices of one polyline in place. work has room for 4 n doubles; alpha > 0. Fewer than three
 * vertices are left unchanged. One pentadiagonal LDL^T factorisation serves all three coordinates. */
void polyline_smooth(float (*vertex)[3], size_t n, double alpha, double *work);

#endif
