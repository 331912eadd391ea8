#include "optimizer/photographs/profile/bowl_cells.h"
#include "base/small_matrix.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = BOWL_N_TERM };
/* Samples all over a square have 3.5 times the variance of their mean in its middle, by a polynomial of degree two. */
static const double most_variance = 12.0;

status bowl_cells_init(struct bowl_cells *c, double step_deg, struct error *err)
{
    c->step_deg = step_deg;
    c->n_theta = c->n_azimuth = (size_t)ceil(180.0 / step_deg - 1e-9);
    c->cell = calloc(c->n_theta * c->n_azimuth, sizeof *c->cell);
    return c->cell != NULL ? STATUS_OK
                           : error_set(err, STATUS_NO_MEMORY, "cannot read the photographs of a bowl: out of memory");
}

void bowl_cells_release(struct bowl_cells *c)
{
    free(c->cell);
    c->cell = NULL;
}

void bowl_cells_middle(const struct bowl_cells *c, size_t i, double *theta_deg, double *azimuth_deg)
{
    *theta_deg = ((double)(i / c->n_azimuth) + 0.5) * c->step_deg - 90.0;
    *azimuth_deg = ((double)(i % c->n_azimuth) + 0.5) * c->step_deg;
}

void bowl_cells_add(struct bowl_cells *c, double theta_deg, double azimuth_deg, const double value[3])
{
    const double t = (theta_deg + 90.0) / c->step_deg, z = azimuth_deg / c->step_deg;
    if (!(t >= 0.0 && z >= 0.0 && t < (double)c->n_theta && z < (double)c->n_azimuth)) return;
    struct bowl_cell *cell = &c->cell[(size_t)t * c->n_azimuth + (size_t)z];
    const double a = t - floor(t) - 0.5, b = z - floor(z) - 0.5, x[N] = {1.0, a, b, a * a, a * b, b * b};
    cell->n++;
    for (int u = 0; u < N; u++)
        for (int v = 0; v < N; v++) cell->xx[u * N + v] += x[u] * x[v];
    for (int k = 0; k < 3; k++) {
        for (int u = 0; u < N; u++) cell->xy[k][u] += x[u] * value[k];
        cell->yy[k] += value[k] * value[k];
    }
}

bool bowl_cells_value(const struct bowl_cells *c, size_t i, double value[3], double se[3])
{
    const struct bowl_cell *cell = &c->cell[i];
    const double n = (double)cell->n;
    double inverse[N * N];
    if (cell->n < BOWL_LEAST_SAMPLE || !small_invert(cell->xx, N, inverse) || !(inverse[0] * n <= most_variance))
        return false;
    for (int k = 0; k < 3; k++) {
        double left = cell->yy[k];
        value[k] = 0.0;
        for (int u = 0; u < N; u++) {
            double term = 0.0;
            for (int v = 0; v < N; v++) term += inverse[u * N + v] * cell->xy[k][v];
            left -= term * cell->xy[k][u];
            if (u == 0) value[k] = term;
        }
        se[k] = sqrt(fmax(left, 0.0) / (n - N) * inverse[0]);
    }
    return true;
}
