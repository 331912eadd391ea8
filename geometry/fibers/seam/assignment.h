/* The assignment of least cost between two sets if only some pairs are allowed: successive shortest paths over sparse
 * rows (Jonker and Volgenant 1987). */
#ifndef SELVEDGE_GEOMETRY_ASSIGNMENT_H
#define SELVEDGE_GEOMETRY_ASSIGNMENT_H

#include "base/status.h"

struct allowed_pair {
    size_t row, column;
    double cost; /* >= 0 */
};

/* Writes the column of each row to partner[0 .. n_row), SIZE_MAX for a row without one, so that the sum of the costs of
 * all pairs plus `alone` for each row without a column is least. pair: sorted by row. alone >= 0. STATUS_NO_MEMORY. */
status assignment_find(const struct allowed_pair *pair, size_t n_pair, size_t n_row, size_t n_column, double alone,
                       size_t *partner, struct error *err);

#endif
