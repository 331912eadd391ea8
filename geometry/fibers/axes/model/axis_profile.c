#include "geometry/fibers/axes/model/axis_profile.h"
#include "base/small_matrix.h"

#include <math.h>

/* Largest radius of a fiber, per typical diameter, and bound of a step, voxels. */
static const double RADIUS_MOST = 1.0, RADIUS_STEP = 0.3;
/* Largest density of the walls of hollow fibers: void and brightest voxels are at 0 and 1. */
static const double HIGH_OF_WALLS = 3.0;
/* Bounds of the area of a lumen over its outline's, and of a step; share of the information about it that must be left
 * beside the radius. */
static const double AREA_MOST = 0.81, AREA_STEP = 0.1, AREA_KNOWN = 1e-6;
/* Lower bound of the spread of the radii, relative. */
static const double SPREAD_LEAST = 0.01;

void axis_table_init(struct axis_table *t)
{
    t->scale = (float)(AXIS_N_TABLE / (AXIS_CORE + AXIS_TAIL));
    for (int i = 0; i < AXIS_N_TABLE + 2; i++) {
        double z = i * (AXIS_CORE + AXIS_TAIL) / AXIS_N_TABLE - AXIS_CORE;
        t->entry[i][0] = (float)(0.5 * erfc(z * M_SQRT1_2));
        t->entry[i][1] = (float)(-exp(-0.5 * z * z) / sqrt(2.0 * M_PI));
    }
}

double axis_scatter(const float *value, size_t stride, size_t n, size_t piece)
{
    double sum = 0.0, square = 0.0;
    size_t n_piece = n / piece, used = n_piece * piece;
    if (n_piece < 2) return INFINITY;
    for (size_t p = 0; p < n_piece; p++) {
        double part = 0.0;
        for (size_t i = p * piece; i < (p + 1) * piece; i++) part += (double)value[i * stride];
        sum += part;
        square += part * part;
    }
    double count = (double)n_piece, of_piece = fmax(0.0, square - sum * sum / count) / (count - 1.0);
    return of_piece * count * (double)n / (double)used;
}

/* Least share of the curvature that is believed. */
static const double LEAST_SLOPE = 0.2;

double axis_mean_slope(const struct shared_sum *shared)
{
    return shared->weight > 0.0 ? fmax(LEAST_SLOPE, shared->slope / shared->weight) : 1.0;
}

double axis_edge_slope(const struct shared_sum *shared)
{
    const double normal = shared->normal[0][0], mean = axis_mean_slope(shared);
    return normal > 0.0 ? fmax(LEAST_SLOPE, fmin(mean, shared->edge_slope / normal)) : mean;
}

/* Mean radius of the lines by length, their spread without the part of white noise, and their errors. The errors of
 * lines too short to show their scatter count as the mean of the others. hold: towards the mean radius. */
static void measure_spread(struct axis_profile *p, const struct radius_sum *line, const double *length, size_t n_line,
                           double variance, double hold, const float *radius)
{
    double sum = 0.0, square = 0.0, white = 0.0, total = 0.0, error = 0.0, measured = 0.0;
    for (size_t l = 0; l < n_line; l++) {
        if (!(line[l].normal > 0.0)) continue;
        double r = (double)radius[l], normal = line[l].normal + hold;
        total += length[l];
        sum += length[l] * r;
        square += length[l] * r * r;
        white += length[l] * variance / line[l].normal;
        if (!isfinite(line[l].scatter)) continue;
        error += length[l] * line[l].scatter / (normal * normal);
        measured += length[l];
    }
    if (!(total > 0.0)) return;
    p->radius = sum / total;
    double var = square / total - p->radius * p->radius;
    p->radius_se = sqrt(measured > 0.0 ? error / measured : white / total) / p->radius;
    p->radius_spread = sqrt(fmax(0.0, var - white / total)) / p->radius;
}

/* Solves for the first n numbers of the shared step; zero if the data do not determine it. damping: added to the
 * diagonal, as a share of it (Marquardt 1963). */
static void solve_shared(const struct shared_sum *shared, size_t n, double damping, double x[AXIS_N_SHARED])
{
    double m[AXIS_N_SHARED * AXIS_N_SHARED];
    for (size_t a = 0; a < n; a++) {
        x[a] = shared->gradient[a];
        for (size_t b = 0; b < n; b++) m[n * a + b] = shared->normal[a][b];
        m[n * a + a] *= 1.0 + damping;
    }
    if (small_factor(m, n, 0.0))
        small_solve(m, n, x, 1);
    else
        for (size_t a = 0; a < n; a++) x[a] = 0.0;
    for (size_t a = n; a < AXIS_N_SHARED; a++) x[a] = 0.0;
}

static double within(double least, double value, double most) { return fmin(most, fmax(least, value)); }

/* Shortens a step of several numbers, each with a limit, without turning it: numbers that depend on each other
 * strongly, as wall density, radius and lumen do, leave their valley when only some of them are held back. Returns its
 * factor. */
static double shorten(double *x, const double *most, size_t n)
{
    double over = 1.0;
    for (size_t i = 0; i < n; i++) over = fmax(over, fabs(x[i]) / most[i]);
    for (size_t i = 0; i < n; i++) x[i] /= over;
    return 1.0 / over;
}

/* Steps the area of the lumen of a line together with its radius. normal, step: of the radius. x: the shared step.
 * part: of a whole step that the shared one was. Returns the remaining step of the radius, times `normal`. */
static double step_lumen(const struct axis_profile *p, const struct radius_sum *line, const double x[AXIS_N_SHARED],
                         double part, double normal, double step, float *area)
{
    const double both = line->area_by_radius, own = (1.0 + p->damping) * line->area_normal - both * both / normal;
    double gradient = line->area_gradient, change = 0.0;
    for (int a = 0; a < AXIS_N_SHARED; a++) gradient -= line->area_cross[a] * x[a];
    if (own > AREA_KNOWN * line->area_normal) change = (gradient - both * step / normal) / own;
    double both_steps[2] = {(step - both * change) / normal, change};
    shorten(both_steps, (const double[2]){RADIUS_STEP, AREA_STEP}, 2);
    *area = (float)within(-AREA_MOST, (double)*area + x[4] + part * both_steps[1], AREA_MOST);
    return part * both_steps[0] * normal;
}

void axis_profile_step(struct axis_profile *p, const struct shared_sum *shared, const struct radius_sum *line,
                       const double *length, size_t n_line, double diameter, float *radius)
{
    double x[AXIS_N_SHARED], variance = shared->weight > 0.0 ? shared->square / shared->weight : 1.0;
    double spread = fmax(p->radius_spread, SPREAD_LEAST) * p->radius, hold = variance / (spread * spread);
    solve_shared(shared, p->lumen != NULL ? 5 : 4, p->damping, x);
    double part = 1.0;
    if (p->lumen != NULL) part = shorten(x, (const double[AXIS_N_SHARED]){RADIUS_STEP, 0.2, 0.2, 0.2, AREA_STEP}, 5);
    const double low = within(-0.2, p->low + x[2], 0.4),
                 high = within(0.5, p->high + x[3], p->lumen != NULL ? HIGH_OF_WALLS : 1.5),
                 blur = within(0.4, p->blur + within(-0.2, x[1], 0.2), 2.5);
    x[0] = within(-RADIUS_STEP, x[0], RADIUS_STEP);
    x[1] = blur - p->blur;
    x[2] = low - p->low;
    x[3] = high - p->high;
    for (size_t l = 0; l < n_line; l++) {
        double step = line[l].gradient + hold * (p->radius - (double)radius[l]), normal = line[l].normal + hold;
        for (int a = 0; a < 4; a++) step -= line[l].cross[a] * x[a];
        if (p->lumen != NULL) step -= line[l].cross[4] * x[4];
        if (p->lumen != NULL) step = step_lumen(p, &line[l], x, part, normal, step, &p->lumen[l]);
        double r = (double)radius[l] + x[0] + within(-RADIUS_STEP, step / normal, RADIUS_STEP);
        radius[l] = (float)within(AXIS_RADIUS_LEAST * diameter, r, RADIUS_MOST * diameter);
    }
    p->blur = blur;
    p->low = low;
    p->high = high;
    measure_spread(p, line, length, n_line, variance, hold, radius);
    p->radius_se /= axis_edge_slope(shared);
}
