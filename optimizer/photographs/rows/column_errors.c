#include "optimizer/photographs/rows/column_errors.h"

#include <math.h>
#include <stdlib.h>

enum { MAX_COLUMN = 720 };
static const double of_median = 1.4826, of_difference = 70.0, uneven_step = 0.25;

static int compare_double(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* Returns whether the five columns about column[0] are at equal steps: a column that was left out between them shows in
 * their angles. */
static bool at_equal_steps(const struct observation *column)
{
    const double step = 0.25 * (column[2].column.angle_deg - column[-2].column.angle_deg);
    for (int k = -2; k < 2; k++)
        if (fabs(column[k + 1].column.angle_deg - column[k].column.angle_deg - step) > uneven_step * step) return false;
    return true;
}

/* Relative error of the n columns by their fourth differences; 0 for fewer than five. */
static double scatter(const struct observation *column, size_t n, size_t c)
{
    double value[MAX_COLUMN];
    size_t n_value = 0;
    for (size_t i = 2; i + 2 < n; i++) {
        if (!at_equal_steps(&column[i])) continue;
        const double d = column[i - 2].mean_rgb[c] - 4.0 * column[i - 1].mean_rgb[c] + 6.0 * column[i].mean_rgb[c] -
                         4.0 * column[i + 1].mean_rgb[c] + column[i + 2].mean_rgb[c];
        if (column[i].mean_rgb[c] > 0.0) value[n_value++] = fabs(d) / column[i].mean_rgb[c];
    }
    if (n_value == 0) return 0.0;
    qsort(value, n_value, sizeof *value, compare_double);
    const double median = 0.5 * (value[(n_value - 1) / 2] + value[n_value / 2]);
    return of_median * median / sqrt(of_difference);
}

/* Change of the radiance by a degree around the cylinder, between the neighbours of column i. */
static double slope(const struct observation *column, size_t n, size_t i, size_t c)
{
    const size_t before = i > 0 ? i - 1 : i, after = i + 1 < n ? i + 1 : i;
    const double step = column[after].column.angle_deg - column[before].column.angle_deg;
    return step > 0.0 ? (column[after].mean_rgb[c] - column[before].mean_rgb[c]) / step : 0.0;
}

void column_errors_add(struct observation_set *o, size_t first)
{
    for (size_t i = first, n; i < o->n; i += n) {
        struct observation *column = &o->item[i];
        n = 1;
        if (column->column.number != 1) continue;
        while (n < MAX_COLUMN && i + n < o->n && column[n].column.number == n + 1) n++;
        for (size_t c = 0; c < 3; c++) {
            const double rel = scatter(column, n, c);
            for (size_t k = 0; k < n; k++) {
                const double turned = column[k].column.angle_se_deg * slope(column, n, k, c);
                column[k].se_rgb[c] = hypot(hypot(column[k].se_rgb[c], rel * column[k].mean_rgb[c]), turned);
            }
        }
    }
}
