#include "renderer/mesh/mesh_drape.h"
#include "renderer/mesh/mesh_shapes.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* The simulation's unit of length is the edge of the cloth, its unit of time the square root of the edge over gravity,
 * and every point has the mass 1. */
enum { CELLS = 64, SIDE = CELLS + 1, POINTS = SIDE * SIDE, STEPS = 12000 };
/* The mesh has so many cells for each of the simulation's, along each edge. */
enum { FINER = 4, FINE_SIDE = FINER * CELLS + 1 };
static const double step = 5e-4;
/* Of the speed, lost in a unit of time: while it falls, and at the end so that it comes to rest. */
static const double damping[2] = {1.0, 4.0};
static const double bending_length = 0.08;
/* Force that shears the cloth by 1, over its weight. */
static const double shear_stiffness = 8.0;
static const double friction = 0.5;
/* Where the middle of the cloth begins beside the ball's axis: no piece is laid down exactly. */
static const double beside[2] = {0.013, 0.007};

struct drape {
    double at[POINTS][3], before[POINTS][3], speed[POINTS][3];
    double radius, center[3];
};

static double length(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/* The XPBD correction of a spring between two points, with its compliance over the squared step. */
static void hold_length(struct drape *d, size_t a, size_t b, double rest, double compliance)
{
    double v[3];
    for (int k = 0; k < 3; k++) v[k] = d->at[b][k] - d->at[a][k];
    double now = length(v), move = (now - rest) / ((2.0 + compliance) * now);
    for (int k = 0; k < 3; k++) {
        d->at[a][k] += move * v[k];
        d->at[b][k] -= move * v[k];
    }
}

/* Three points in a row want no second difference. */
static void hold_straight(struct drape *d, size_t a, size_t b, size_t c, double compliance)
{
    for (int k = 0; k < 3; k++) {
        double move = (d->at[a][k] - 2.0 * d->at[b][k] + d->at[c][k]) / (6.0 + compliance);
        d->at[a][k] -= move;
        d->at[b][k] += 2.0 * move;
        d->at[c][k] -= move;
    }
}

/* Points that have come into the ball are put on it. Friction (Coulomb) holds them where they lay, as far as the depth
 * that they had, which is the force on them, allows. */
static void leave_ball(struct drape *d, size_t i)
{
    double v[3], moved[3], along = 0.0;
    for (int k = 0; k < 3; k++) v[k] = d->at[i][k] - d->center[k];
    double distance = length(v), depth = d->radius - distance;
    if (depth <= 0.0) return;
    for (int k = 0; k < 3; k++) {
        v[k] /= distance;
        d->at[i][k] += depth * v[k];
        moved[k] = d->at[i][k] - d->before[i][k];
        along += moved[k] * v[k];
    }
    for (int k = 0; k < 3; k++) moved[k] -= along * v[k];
    double slid = length(moved), held = slid > friction * depth ? friction * depth / slid : 1.0;
    for (int k = 0; k < 3; k++) d->at[i][k] -= held * moved[k];
}

/* Bends first and the stiffest last: in another order they feed each other. */
static void hold_bends(struct drape *d)
{
    const double h = 1.0 / CELLS, stiff = pow(h, 4.0) / pow(bending_length, 3.0) / (step * step);
    for (size_t i = 0; i < POINTS; i++) {
        if (i % SIDE + 2 < SIDE) hold_straight(d, i, i + 1, i + 2, stiff);
        if (i / SIDE + 2 < SIDE) hold_straight(d, i, i + SIDE, i + 2 * SIDE, stiff);
    }
}

static void hold_lengths(struct drape *d)
{
    const double h = 1.0 / CELLS, soft = h * h / shear_stiffness / (step * step);
    for (size_t i = 0; i < POINTS; i++) {
        bool right = i % SIDE < CELLS, above = i / SIDE < CELLS;
        if (right && above) hold_length(d, i, i + SIDE + 1, h * M_SQRT2, soft);
        if (right && above) hold_length(d, i + 1, i + SIDE, h * M_SQRT2, soft);
        if (right) hold_length(d, i, i + 1, h, 0.0);
        if (above) hold_length(d, i, i + SIDE, h, 0.0);
    }
}

static void make_step(struct drape *d, size_t n)
{
    double kept = 1.0 - step * damping[n > STEPS / 2];
    for (size_t i = 0; i < POINTS; i++)
        for (int k = 0; k < 3; k++) {
            d->before[i][k] = d->at[i][k];
            d->speed[i][k] = kept * d->speed[i][k] - (k == 2 ? step : 0.0);
            d->at[i][k] += step * d->speed[i][k];
        }
    hold_bends(d);
    hold_lengths(d);
    for (size_t i = 0; i < POINTS; i++) {
        leave_ball(d, i);
        for (int k = 0; k < 3; k++) d->speed[i][k] = (d->at[i][k] - d->before[i][k]) / step;
    }
}

static status let_fall(struct drape *d, const struct progress *progress, struct error *err)
{
    for (size_t i = 0; i < POINTS; i++) {
        d->at[i][0] = beside[0] + (double)(i % SIDE) / CELLS - 0.5;
        d->at[i][1] = beside[1] + (double)(i / SIDE) / CELLS - 0.5;
    }
    d->center[2] = -d->radius;
    for (size_t n = 0; n < STEPS; n++) {
        make_step(d, n);
        if (n % 64 == 0 && progress_cancelled(progress)) return error_set(err, STATUS_CANCELLED, "cancelled");
        if (n % 64 == 0) progress_report(progress, (double)n / STEPS);
    }
    return STATUS_OK;
}

/* Points that are neighbors neither in the cloth nor in its next cells, and still lie as near as neighbors do. */
static bool folds_touch(const struct drape *d)
{
    const size_t apart = 5;
    const double near = 1.0 / CELLS;
    for (size_t i = 0; i < POINTS; i++)
        for (size_t j = i + apart; j < POINTS; j++) {
            double v[3];
            for (int k = 0; k < 3; k++) v[k] = d->at[i][k] - d->at[j][k];
            if (fabs(v[2]) >= near || length(v) >= near) continue;
            size_t x[2] = {i % SIDE, j % SIDE};
            if (j / SIDE - i / SIDE >= apart || (x[0] > x[1] ? x[0] - x[1] : x[1] - x[0]) >= apart) return true;
        }
    return false;
}

/* A coordinate of the point at a row's and a column's place, which may lie one beyond the edge: there the cloth goes on
 * straight. */
static double beyond(const struct drape *d, long y, long x, int k)
{
    if (y < 0) return 2.0 * beyond(d, 0, x, k) - beyond(d, 1, x, k);
    if (y >= SIDE) return 2.0 * beyond(d, SIDE - 1, x, k) - beyond(d, SIDE - 2, x, k);
    if (x < 0) return 2.0 * beyond(d, y, 0, k) - beyond(d, y, 1, k);
    if (x >= SIDE) return 2.0 * beyond(d, y, SIDE - 1, k) - beyond(d, y, SIDE - 2, k);
    return d->at[y * SIDE + x][k];
}

static void cubic_weights(size_t part, double w[4])
{
    double t = (double)part / FINER, u = 1.0 - t;
    w[0] = u * u * u / 6.0;
    w[1] = (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0;
    w[2] = (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0;
    w[3] = t * t * t / 6.0;
}

/* The uniform cubic B-spline over the simulated points, at a point of the fine grid. */
static void fine_point(const struct drape *d, size_t row, size_t column, double out[3])
{
    double along_y[4], along_x[4];
    cubic_weights(row % FINER, along_y);
    cubic_weights(column % FINER, along_x);
    memset(out, 0, 3 * sizeof *out);
    for (int a = 0; a < 4; a++)
        for (int b = 0; b < 4; b++) {
            long y = (long)(row / FINER) + a - 1, x = (long)(column / FINER) + b - 1;
            if (along_y[a] == 0.0 || along_x[b] == 0.0) continue; /* may lie two beyond the edge */
            for (int k = 0; k < 3; k++) out[k] += along_y[a] * along_x[b] * beyond(d, y, x, k);
        }
}

/* Moves the mesh so that its bounding box has its middle at the origin, and scales it. */
static void center_and_scale(struct mesh *m, double size_mm)
{
    for (int k = 0; k < 3; k++) {
        double low = INFINITY, high = -INFINITY;
        for (size_t i = 0; i < m->n_position; i++) {
            low = fmin(low, m->position_mm[i][k]);
            high = fmax(high, m->position_mm[i][k]);
        }
        for (size_t i = 0; i < m->n_position; i++)
            m->position_mm[i][k] = size_mm * (m->position_mm[i][k] - 0.5 * (low + high));
    }
}

status mesh_drape(double size_mm, double radius_mm, const struct progress *progress, struct mesh *m, struct error *err)
{
    double ratio = radius_mm / size_mm;
    if (!(size_mm > 0.0 && isfinite(size_mm) && ratio >= 0.02 && ratio <= 10.0))
        return error_set(err, STATUS_INVALID,
                         "cannot drape a cloth of %g mm over a ball of radius %g mm: allowed is 0.02 to 10 times the "
                         "cloth's size",
                         size_mm, radius_mm);
    struct drape *d = calloc(1, sizeof *d);
    if (d == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot drape the cloth: out of memory");
    d->radius = ratio;
    status s = let_fall(d, progress, err);
    if (s == STATUS_OK && folds_touch(d))
        s = error_set(err, STATUS_INVALID,
                      "folds of a cloth of %g mm over a ball of radius %g mm touch each other: take a larger radius",
                      size_mm, radius_mm);
    if (s == STATUS_OK)
        s = mesh_flat((const double[2]){size_mm, size_mm}, (const size_t[2]){FINE_SIDE - 1, FINE_SIDE - 1}, m, err);
    if (s == STATUS_OK) {
        for (size_t i = 0; i < m->n_position; i++) fine_point(d, i / FINE_SIDE, i % FINE_SIDE, m->position_mm[i]);
        center_and_scale(m, size_mm);
    }
    free(d);
    return s;
}
