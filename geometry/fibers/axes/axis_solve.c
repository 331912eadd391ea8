#include "geometry/fibers/axes/axis_solve.h"
#include "base/small_matrix.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Lower bound of the measured standard deviation of a fiber's curvature, per diameter. */
static const double CURVATURE_LEAST = 0.05;

/* Length to either side over which the curvature at a vertex is measured, and the length of line whose weight the
 * curvature of all lines has beside it. */
static const double WINDOW_DIAMETERS = 2.0, PRIOR_DIAMETERS = 2.0;

/* Length over which a fiber's curvature is correlated. */
static const double BEND_DIAMETERS = 2.5;

/* The diagonal and six below it: second differences of three coordinates. Nine: differences of these. */
enum { BAND = 7, BAND_CORRELATED = 10 };

void axis_equation_add(struct axis_equation *to, const struct axis_equation *from)
{
    for (int i = 0; i < 6; i++) to->normal[i] += from->normal[i];
    for (int i = 0; i < 3; i++) to->gradient[i] += from->gradient[i];
    to->radius_normal += from->radius_normal;
    to->radius_gradient += from->radius_gradient;
}

double axis_information(const struct axis_equation *total, size_t n_vertex)
{
    double sum = 0.0; /* half the trace, because none lies along the fiber */
    for (size_t i = 0; i < n_vertex; i++)
        sum += 0.5 * (double)(total[i].normal[0] + total[i].normal[2] + total[i].normal[5]);
    return fmax(sum / fmax((double)n_vertex, 1.0), 1e-12);
}

struct solve_job {
    struct polyline_set *lines;
    const struct axis_equation *equation;
    const double *stiffness; /* of the second difference at each vertex */
    double correlation, hold;
    bool *failed; /* one per line */
};

/* The equations of one line: n vertices p, a band matrix m and the right side x. */
struct line_system {
    const float (*p)[3];
    size_t n, band;
    double *m, *x;
};

/* Adds weight times the square of sum_r factor[r] p[r], r < n_factor, to the equations of a line from vertex `first`
 * on, for each coordinate. */
static void add_square(struct line_system *y, size_t first, const double *factor, size_t n_factor, double weight)
{
    for (size_t a = 0; a < 3; a++) {
        double sum = 0.0;
        for (size_t r = 0; r < n_factor; r++) sum += factor[r] * (double)y->p[first + r][a];
        for (size_t r = 0; r < n_factor; r++) {
            const size_t row = 3 * (first + r) + a;
            y->x[row] -= weight * factor[r] * sum;
            for (size_t c = 0; c <= r; c++) y->m[row * y->band + 3 * (r - c)] += weight * factor[r] * factor[c];
        }
    }
}

/* Adds the terms of the bends. */
static void add_bends(struct line_system *y, const double *stiffness, double correlation)
{
    const double weight = 1.0 / (1.0 - correlation * correlation);
    for (size_t i = 0; i + 2 < y->n; i++) {
        const double own = sqrt(stiffness[i + 1]);
        if (i == 0 || !(correlation > 0.0)) {
            add_square(y, i, (const double[3]){own, -2.0 * own, own}, 3, 1.0);
            continue;
        }
        const double before = correlation * sqrt(stiffness[i]);
        add_square(y, i - 1, (const double[4]){-before, own + 2.0 * before, -2.0 * own - before, own}, 4, weight);
    }
}

static void solve_line(void *context, size_t l, size_t i_thread)
{
    (void)i_thread;
    struct solve_job *job = context;
    const size_t n = polyline_length(job->lines, l), band = job->correlation > 0.0 ? BAND_CORRELATED : BAND;
    float(*p)[3] = job->lines->vertex + job->lines->first[l];
    const struct axis_equation *q = job->equation + job->lines->first[l];
    double *m = calloc(3 * n * band, sizeof *m), *x = calloc(3 * n, sizeof *x);
    struct line_system system = {(const float(*)[3])p, n, band, m, x};
    if (m == NULL || x == NULL) {
        job->failed[l] = true;
        goto out;
    }
    for (size_t i = 0; i < n; i++)
        for (size_t a = 0, c = 0; a < 3; a++) {
            x[3 * i + a] = (double)q[i].gradient[a];
            m[(3 * i + a) * band] += job->hold;
            for (size_t b = 0; b <= a; b++, c++) m[(3 * i + a) * band + a - b] += (double)q[i].normal[c];
        }
    add_bends(&system, job->stiffness + job->lines->first[l], job->correlation);
    if (!small_solve_banded(m, 3 * n, band, x)) goto out; /* the line stays as it is */
    for (size_t i = 0; i < n; i++) {
        double length = sqrt(x[3 * i] * x[3 * i] + x[3 * i + 1] * x[3 * i + 1] + x[3 * i + 2] * x[3 * i + 2]);
        for (size_t a = 0; a < 3; a++) p[i][a] += (float)(x[3 * i + a] * (length > 1.0 ? 1.0 / length : 1.0));
    }
out:
    free(m);
    free(x);
}

status axis_solve_lines(struct polyline_set *lines, const struct axis_equation *equation, const double *stiffness,
                        double correlation, struct thread_pool *pool, struct error *err)
{
    struct solve_job job = {.lines = lines,
                            .equation = equation,
                            .correlation = correlation,
                            .failed = calloc(lines->n_line + 1, sizeof(bool))};
    double mean = 0.0;
    if (job.failed == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit fibers: out of memory");
    /* half the trace, because the direction along the fiber contributes nothing */
    for (size_t i = 0; i < lines->n_vertex; i++)
        mean += 0.5 * (double)(equation[i].normal[0] + equation[i].normal[2] + equation[i].normal[5]);
    mean = lines->n_vertex > 0 ? mean / (double)lines->n_vertex : 0.0;
    job.stiffness = stiffness;
    job.hold = 0.02 * mean + 1e-12;
    status s = thread_pool_run(pool, lines->n_line, solve_line, &job, NULL);
    for (size_t l = 0; l < lines->n_line && s == STATUS_OK; l++)
        if (job.failed[l]) s = error_set(err, STATUS_NO_MEMORY, "cannot fit fibers: out of memory");
    free(job.failed);
    return s;
}

double axis_bend_correlation(double diameter) { return exp(-1.0 / (BEND_DIAMETERS * diameter)); }

/* Vertices to either side between which the chords of a bend lie. */
static size_t bend_span(double diameter) { return diameter > 4.0 ? (size_t)(0.5 * diameter) : 2; }

/* Square of the bend at vertex i of the lines: the second difference over 2 h vertices. */
static double bend_square(const struct polyline_set *lines, size_t i, size_t h)
{
    double square = 0.0;
    for (int a = 0; a < 3; a++) {
        const double bend =
            (double)lines->vertex[i - h][a] - 2.0 * (double)lines->vertex[i][a] + (double)lines->vertex[i + h][a];
        square += bend * bend;
    }
    return square;
}

double axis_curvature_sd(const struct polyline_set *lines, double diameter)
{
    const size_t h = bend_span(diameter);
    double square = 0.0, n = 0.0;
    for (size_t l = 0; l < lines->n_line; l++)
        for (size_t i = lines->first[l] + h; i + h < lines->first[l + 1]; i++, n += 2.0)
            square += bend_square(lines, i, h);
    double sd = n > 0.0 ? sqrt(square / n) / (double)(h * h) : INFINITY;
    return fmin(fmax(sd, CURVATURE_LEAST / diameter), AXIS_CURVATURE_MOST / diameter);
}

void axis_local_stiffness(const struct polyline_set *lines, double diameter, double variance, double *stiffness)
{
    const size_t h = bend_span(diameter), reach = (size_t)(WINDOW_DIAMETERS * diameter + 0.5);
    const double sd = axis_curvature_sd(lines, diameter), least = CURVATURE_LEAST / diameter,
                 most = AXIS_CURVATURE_MOST / diameter, prior = PRIOR_DIAMETERS * diameter,
                 scale = 2.0 * (double)(h * h * h * h);
    for (size_t l = 0; l < lines->n_line; l++) {
        /* bends are known from h vertices after the first to h before the last */
        const size_t end = lines->first[l + 1] > h ? lines->first[l + 1] - h : 0;
        double square = 0.0;
        for (size_t i = lines->first[l], from = i + h, to = from; i < lines->first[l + 1]; i++) {
            for (; to < end && to <= i + reach; to++) square += bend_square(lines, to, h);
            for (; from < to && from + reach < i; from++) square -= bend_square(lines, from, h);
            const double n = (double)(to - from), local = (fmax(square, 0.0) / scale + prior * sd * sd) / (n + prior);
            stiffness[i] = variance / fmin(fmax(local, least * least), most * most);
        }
    }
}
