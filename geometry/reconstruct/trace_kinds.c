#include "geometry/reconstruct/trace_kinds.h"

#include "geometry/grade/fiber_kinds.h"

#include <math.h>
#include <stdlib.h>

/* Sums over lines of their length, and of length times the radius and its square. */
struct kind_sum {
    double length, radius, square;
};

static struct kind_sum sum_rows(const struct fiber_row *row, size_t n)
{
    struct kind_sum s = {0.0, 0.0, 0.0};
    for (size_t i = 0; i < n; i++) {
        s.length += row[i].length;
        s.radius += row[i].length * row[i].radius;
        s.square += row[i].length * row[i].radius * row[i].radius;
    }
    return s;
}

status trace_find_kinds(const struct polyline_set *lines, double spread, struct trace_kinds *kinds, struct error *err)
{
    struct fiber_row *row = malloc((lines->n_line + 1) * sizeof *row);
    *kinds = (struct trace_kinds){spread, 0.0};
    if (row == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot sort lines into kinds: out of memory");
    for (size_t l = 0; l < lines->n_line; l++)
        row[l] = (struct fiber_row){(double)lines->radius[l], (double)polyline_length(lines, l)};
    const size_t n_thick = fiber_rows_split(row, lines->n_line);
    if (n_thick < lines->n_line) {
        const struct kind_sum sum[2] = {sum_rows(row, n_thick), sum_rows(row + n_thick, lines->n_line - n_thick)};
        kinds->spread = 0.0;
        for (int k = 0; k < 2; k++) {
            const double ratio = sum[k].square * sum[k].length / (sum[k].radius * sum[k].radius);
            kinds->spread = fmax(kinds->spread, sqrt(fmax(0.0, ratio - 1.0)));
        }
        kinds->thin_diameter = 2.0 * sum[1].radius / sum[1].length;
    }
    free(row);
    return STATUS_OK;
}
