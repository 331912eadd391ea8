#include "optimizer/photographs/rows/column_errors.h"

#include <math.h>

enum { MAX_COLUMN = 720, N = PHOTOGRAPH_PARTS, LEAST_PART = 4, REACH = 3 };
static const double uneven_step = 0.25, most_alike = 0.5, least_alike = -0.4, of_second = 1.0 / 48.0,
                    of_fourth = 1.0 / 501.0;

/* Sums of squares and of products of neighbours over the residuals of parts. */
struct moments {
    double square, product;
};

/* Residuals of the parts of a column about a line along the axis, relative to the column's light. */
static void residuals(const struct observation *column, size_t c, double e[N])
{
    const struct photograph_record *r = &column->photograph;
    const double n = (double)r->n_part, middle = 0.5 * (n - 1.0), spread = n * (n * n - 1.0) / 12.0;
    double mean = 0.0, slope = 0.0;
    for (size_t b = 0; b < r->n_part; b++) {
        mean += r->part_rgb[b][c] / n;
        slope += ((double)b - middle) * r->part_rgb[b][c] / spread;
    }
    for (size_t b = 0; b < r->n_part; b++)
        e[b] = (r->part_rgb[b][c] - mean - slope * ((double)b - middle)) / column->mean_rgb[c];
}

static bool tells(const struct observation *column, size_t n_part, size_t c)
{
    return column->photograph.n_part == n_part && column->mean_rgb[c] > 0.0;
}

/* Adds the moments of channel c of the columns from `from` up to `end` that have n_part parts. Returns their number. */
static size_t add_moments(const struct observation *from, const struct observation *end, size_t n_part, size_t c,
                          struct moments *m)
{
    size_t n = 0;
    for (const struct observation *column = from; column < end; column++) {
        double e[N];
        if (!tells(column, n_part, c)) continue;
        residuals(column, c, e);
        for (size_t b = 0; b < n_part; b++) m->square += e[b] * e[b];
        for (size_t b = 0; b + 1 < n_part; b++) m->product += e[b] * e[b + 1];
        n++;
    }
    return n;
}

/* The traces of column_errors.h for n parts: M T and M T M T, with M = 1 - H. */
static void traces(size_t n, double *mt, double *mtmt)
{
    double m[N][N], x[N][N];
    const double count = (double)n, middle = 0.5 * (count - 1.0), spread = count * (count * count - 1.0) / 12.0;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            m[i][j] = (i == j) - 1.0 / count - ((double)i - middle) * ((double)j - middle) / spread;
    *mt = *mtmt = 0.0;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) x[i][j] = (j > 0 ? m[i][j - 1] : 0.0) + (j + 1 < n ? m[i][j + 1] : 0.0);
    for (size_t i = 0; i < n; i++) {
        *mt += x[i][i];
        for (size_t j = 0; j < n; j++) *mtmt += x[i][j] * x[j][i];
    }
}

/* How alike neighbouring parts are, r of column_errors.h, by all columns and channels. */
static double alike(const struct observation *column, size_t n, size_t n_part)
{
    struct moments m = {0};
    double mt, mtmt;
    for (size_t c = 0; c < 3; c++) add_moments(column, column + n, n_part, c, &m);
    if (!(m.square > 0.0)) return 0.0;
    traces(n_part, &mt, &mtmt);
    const double ratio = m.product / m.square, top = ratio * ((double)n_part - 2.0) - 0.5 * mt,
                 bottom = 0.5 * mtmt - ratio * mt;
    return bottom > 0.0 ? fmin(fmax(top / bottom, least_alike), most_alike) : most_alike;
}

/* Relative standard error of column i of n by the parts along it and along its neighbours. */
static double along(const struct observation *column, size_t n, size_t i, size_t c, double r)
{
    const size_t n_part = column[i].photograph.n_part, from = i > REACH ? i - REACH : 0,
                 end = i + REACH + 1 < n ? i + REACH + 1 : n;
    struct moments m = {0};
    double mt, mtmt;
    const size_t n_column = add_moments(column + from, column + end, n_part, c, &m);
    traces(n_part, &mt, &mtmt);
    const double count = (double)n_part, v = m.square / ((double)n_column * (count - 2.0 + r * mt));
    return sqrt(v * (1.0 + 2.0 * r * (count - 1.0) / count) / count);
}

/* The part of the error that photograph_measure_image states by the scatter of the parts. */
static double plain_scatter(const struct observation *column, size_t c)
{
    const struct photograph_record *r = &column->photograph;
    const double n = (double)r->n_part;
    double sum = 0.0, square = 0.0;
    for (size_t b = 0; b < r->n_part; b++) sum += r->part_rgb[b][c];
    for (size_t b = 0; b < r->n_part; b++) square += pow(r->part_rgb[b][c] - sum / n, 2.0);
    return r->n_part > 1 ? sqrt(square / (n - 1.0) / n) : 0.0;
}

/* Returns whether the columns from `from` to `to` of n are there and lie at equal steps: one that was left out shows in
 * the angles. */
static bool at_equal_steps(const struct observation *column, size_t n, size_t from, size_t to)
{
    if (from > to || to >= n) return false;
    const double step = (column[to].column.angle_deg - column[from].column.angle_deg) / (double)(to - from);
    for (size_t i = from; i < to; i++)
        if (fabs(column[i + 1].column.angle_deg - column[i].column.angle_deg - step) > uneven_step * step) return false;
    return true;
}

/* Change of the radiance by a degree around the cylinder, between the neighbours of column i. */
static double slope(const struct observation *column, size_t n, size_t i, size_t c)
{
    const size_t before = i > 0 ? i - 1 : i, after = i + 1 < n ? i + 1 : i;
    const double step = column[after].column.angle_deg - column[before].column.angle_deg;
    return step > 0.0 ? (column[after].mean_rgb[c] - column[before].mean_rgb[c]) / step : 0.0;
}

static void state_errors(struct observation *column, size_t n, size_t c)
{
    for (size_t i = 0; i < n; i++) {
        const size_t n_part = column[i].photograph.n_part;
        const double turned = column[i].column.angle_se_deg * slope(column, n, i, c);
        double *se = &column[i].se_rgb[c];
        if (n_part >= LEAST_PART && tells(&column[i], n_part, c)) {
            const double plain = plain_scatter(&column[i], c),
                         own = along(column, n, i, c, alike(column, n, n_part)) * column[i].mean_rgb[c];
            *se = hypot(sqrt(fmax(0.0, *se * *se - plain * plain)), own);
        }
        *se = hypot(*se, turned);
    }
}

static void remove_curvature(struct observation *column, size_t n, size_t c)
{
    double was[MAX_COLUMN];
    for (size_t i = 0; i < n; i++) was[i] = column[i].mean_rgb[c];
    for (size_t i = 1; i + 1 < n; i++) {
        const double *m = &was[i];
        double change = 0.0;
        if (at_equal_steps(column, n, i - 1, i + 1)) change = -of_second * (m[-1] - 2.0 * m[0] + m[1]);
        if (i > 1 && at_equal_steps(column, n, i - 2, i + 2))
            change += of_fourth * (m[-2] - 4.0 * m[-1] + 6.0 * m[0] - 4.0 * m[1] + m[2]);
        column[i].mean_rgb[c] = fmax(0.0, m[0] + change);
    }
}

void column_errors_state(struct observation_set *o, size_t first)
{
    for (size_t i = first, n; i < o->n; i += n) {
        struct observation *column = &o->item[i];
        n = 1;
        if (column->column.number != 1) continue;
        while (n < MAX_COLUMN && i + n < o->n && column[n].column.number == n + 1) n++;
        for (size_t c = 0; c < 3; c++) state_errors(column, n, c);
        for (size_t c = 0; c < 3; c++) remove_curvature(column, n, c);
    }
}
