#include "renderer/scattering/models/wave/solver/wave_solver.h"

#include "renderer/scattering/models/wave/solver/complex_parts.h"
#include "renderer/scattering/models/wave/solver/cylinder_functions.h"

#include <lapacke.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>

enum { MOST_NODE = 16384 }; /* 17 GB */
#define EULER 0.57721566490153286061
#define MOST_ABSORPTION 20.0 /* of Im(k m) times a distance: the range of the cylinder functions */

struct node {
    double complex at, normal; /* x + i y; outward unit normal */
    double speed, curvature;   /* |dx / dt|, positive where convex */
};

enum { OUTSIDE, INSIDE, N_MEDIUM };

struct wave_solver {
    size_t n; /* nodes */
    double k, step;
    double complex k_of[N_MEDIUM], q;
    struct node *node;
    double *log_weight;     /* of a kernel's logarithmic part, by the distance in nodes */
    double complex *matrix; /* of 2 n unknowns, u at all nodes, then v / k; column after column; its factors L and U */
    lapack_int *pivot;
    size_t n_wave; /* of the solution */
    double *angle_rad;
    double *re, *im; /* parts of the solution, by unknown and wave: loops over the waves are vectorised */
};

size_t wave_solver_nodes(const struct wave_outline *o, double k, double index, double per_wave)
{
    double fastest = 0;
    for (int i = 0; i < 720; i++) {
        double complex d;
        wave_outline_at(o, i * M_PI / 360, &d, NULL);
        fastest = fmax(fastest, cabs(d));
    }
    return 2 * (size_t)ceil(0.5 * (per_wave * fastest * k * fmax(index, 1) + 32));
}

static double dot(double complex a, double complex b) { return creal(conj(a) * b); }

static void place_nodes(struct wave_solver *s, const struct wave_outline *o)
{
    for (size_t i = 0; i < s->n; i++) {
        struct node *p = &s->node[i];
        double complex d, dd;
        p->at = wave_outline_at(o, s->step * (double)i, &d, &dd);
        p->speed = cabs(d);
        p->normal = -I * d / p->speed;
        p->curvature = cimag(conj(d) * dd) / (p->speed * p->speed * p->speed);
    }
}

/* Integrals of ln(4 sin^2(t / 2)) times the trigonometric polynomials through the nodes, less their quadrature with
 * equal weights: a kernel K with the logarithmic part L ln(4 sin^2) has the weight K step + L log_weight. At distance
 * 0: the integral alone. */
static void weigh_logarithm(struct wave_solver *s)
{
    const size_t half = s->n / 2;
    for (size_t j = 0; j <= half; j++) {
        const double t = s->step * (double)j, sine = sin(0.5 * t);
        double sum = (j % 2 == 0 ? 1 : -1) / (2.0 * (double)half);
        for (size_t m = 1; m < half; m++) sum += cos((double)(m * j % s->n) * s->step) / (double)m;
        s->log_weight[j] = -2 * s->step * sum;
        if (j > 0) s->log_weight[j] -= s->step * log(4 * sine * sine);
    }
}

/* The kernels of one medium from node j (source) to node i (target), times weights but not times speeds. */
struct kernels {
    double complex single, twice, twice_prime, slope; /* S, D, D', T */
};

static struct kernels kernels_between(const struct wave_solver *s, double complex k, size_t i, size_t j)
{
    const struct node *to = &s->node[i], *from = &s->node[j];
    const size_t apart = i > j ? i - j : j - i, steps = apart < s->n - apart ? apart : s->n - apart;
    const double complex away = to->at - from->at;
    const double r = cabs(away), a = dot(to->normal, away) / r, b = dot(from->normal, away) / r;
    const double log_part = -s->log_weight[steps] / (4 * M_PI);
    struct cylinder_functions f;
    cylinder_functions_at(k * r, &f);
    const double complex z0 = 0.25 * I * s->step * f.h[0] + log_part * f.j[0],
                         z1 = k * (0.25 * I * s->step * f.h[1] + log_part * f.j[1]);
    return (struct kernels){z0, b * z1, -a * z1,
                            dot(to->normal, from->normal) * z1 / r + a * b * (k * k * z0 - 2 * z1 / r)};
}

/* The limits at a node. D and D' have the limits of Laplace's equation, the same in both media; T is without its
 * strongest singularity, which cancels between the media. */
static struct kernels kernels_at(const struct wave_solver *s, double complex k, size_t i)
{
    const struct node *p = &s->node[i];
    const double complex log_half = clog(0.5 * k * p->speed) + EULER, square = k * k;
    const double log_weight = s->log_weight[0], bend = -s->step * p->curvature / (4 * M_PI);
    return (struct kernels){-log_weight / (4 * M_PI) + s->step * (0.25 * I - log_half / (2 * M_PI)), bend, bend,
                            -square / (8 * M_PI) * log_weight +
                                s->step * square * (0.125 * I - log_half / (4 * M_PI) + 1 / (8 * M_PI))};
}

static void set(struct wave_solver *s, size_t i, size_t j, double complex value)
{
    s->matrix[j * 2 * s->n + i] = value;
}

/* Sets the contribution of source j to the two equations at node i. */
static void set_pair(struct wave_solver *s, size_t i, size_t j, const struct kernels kernel[N_MEDIUM])
{
    const struct kernels *e = &kernel[OUTSIDE], *in = &kernel[INSIDE];
    const double speed = s->node[j].speed, same = i == j ? 1 : 0;
    set(s, i, j, same + speed * (in->twice - e->twice));
    set(s, i, s->n + j, speed * s->k * (e->single - s->q * in->single));
    set(s, s->n + i, j, -speed / s->k * (e->slope - in->slope));
    set(s, s->n + i, s->n + j, same * 0.5 * (1 + s->q) + speed * (e->twice_prime - s->q * in->twice_prime));
}

static void assemble(struct wave_solver *s)
{
    struct kernels kernel[N_MEDIUM], back[N_MEDIUM];
    for (size_t i = 0; i < s->n; i++) {
        for (int m = 0; m < N_MEDIUM; m++) kernel[m] = kernels_at(s, s->k_of[m], i);
        set_pair(s, i, i, kernel);
        for (size_t j = 0; j < i; j++) {
            for (int m = 0; m < N_MEDIUM; m++) { /* the other way round, D and D' change places */
                kernel[m] = kernels_between(s, s->k_of[m], i, j);
                back[m] = (struct kernels){kernel[m].single, kernel[m].twice_prime, kernel[m].twice, kernel[m].slope};
            }
            set_pair(s, i, j, kernel);
            set_pair(s, j, i, back);
        }
    }
}

static status check_problem(const struct wave_problem *p, struct error *err)
{
    const double reach = wave_outline_length(p->outline) / 2;
    if (!(p->k > 0) || !isfinite(p->k))
        return error_set_field(err, STATUS_INVALID, "k", "the wave number is %g, which is not positive", p->k);
    if (!(creal(p->index) > 0) || !(cimag(p->index) >= 0) || !isfinite(cabs(p->index)))
        return error_set_field(err, STATUS_INVALID, "index", "the index %g + %g i is not that of a medium that absorbs",
                               creal(p->index), cimag(p->index));
    if (!(cimag(p->index) * p->k * reach <= MOST_ABSORPTION))
        return error_set_field(err, STATUS_INVALID, "index",
                               "the fiber absorbs too much: exp(-%.3g) across it, at most exp(-%g)",
                               cimag(p->index) * p->k * reach, MOST_ABSORPTION);
    if (p->n_node < 8 || p->n_node % 2 != 0 || p->n_node > MOST_NODE)
        return error_set_field(err, STATUS_INVALID, "n_node", "%zu nodes are not an even number from 8 to %d",
                               p->n_node, MOST_NODE);
    return STATUS_OK;
}

static status factorise(struct wave_solver *s, struct error *err)
{
    const lapack_int n = (lapack_int)(2 * s->n), info = LAPACKE_zgetrf(LAPACK_COL_MAJOR, n, n, s->matrix, n, s->pivot);
    return info == 0 ? STATUS_OK
                     : error_set(err, STATUS_INVALID, "the equations of %zu nodes have no solution (zgetrf: %d)", s->n,
                                 (int)info);
}

status wave_solver_new(const struct wave_problem *problem, struct wave_solver **solver, struct error *err)
{
    status st = check_problem(problem, err);
    if (st != STATUS_OK) return st;
    const size_t n = problem->n_node;
    struct wave_solver *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot set up a wave solver: out of memory");
    s->n = n;
    s->k = problem->k;
    s->step = 2 * M_PI / (double)n;
    s->k_of[OUTSIDE] = problem->k;
    s->k_of[INSIDE] = problem->k * problem->index;
    s->q = problem->field == WAVE_ALONG ? 1 : problem->index * problem->index;
    s->node = malloc(n * sizeof *s->node);
    s->log_weight = malloc((n / 2 + 1) * sizeof *s->log_weight);
    s->pivot = malloc(2 * n * sizeof *s->pivot);
    s->matrix = malloc(4 * n * n * sizeof *s->matrix);
    if (s->node == NULL || s->log_weight == NULL || s->pivot == NULL || s->matrix == NULL)
        st = error_set(err, STATUS_NO_MEMORY, "cannot set up a wave solver: out of memory");
    if (st == STATUS_OK) {
        place_nodes(s, problem->outline);
        weigh_logarithm(s);
        assemble(s);
        st = factorise(s, err);
    }
    if (st != STATUS_OK) {
        wave_solver_free(s);
        return st;
    }
    *solver = s;
    return STATUS_OK;
}

void wave_solver_free(struct wave_solver *s)
{
    if (s == NULL) return;
    free(s->matrix);
    free(s->re);
    free(s->im);
    free(s->node);
    free(s->log_weight);
    free(s->pivot);
    free(s->angle_rad);
    free(s);
}

static double complex direction(double angle_rad) { return complex_of(cos(angle_rad), sin(angle_rad)); }

/* Makes room for the solution of n waves. */
static status reserve(struct wave_solver *s, size_t n, struct error *err)
{
    double **part[3] = {&s->angle_rad, &s->re, &s->im};
    const size_t size[3] = {n, 2 * s->n * n, 2 * s->n * n};
    s->n_wave = 0;
    for (int k = 0; k < 3; k++) {
        double *kept = n > 0 ? realloc(*part[k], size[k] * sizeof *kept) : *part[k];
        if (kept == NULL && n > 0) return error_set(err, STATUS_NO_MEMORY, "cannot hold %zu waves: out of memory", n);
        *part[k] = kept;
    }
    return STATUS_OK;
}

status wave_solver_solve(struct wave_solver *s, const double *angle_rad, size_t n, struct error *err)
{
    const size_t n_row = 2 * s->n;
    status st = reserve(s, n, err);
    if (st != STATUS_OK || n == 0) return st;
    double complex *b = malloc(n_row * n * sizeof *b); /* column after column */
    if (b == NULL || n > INT_MAX) {
        free(b);
        return error_set(err, STATUS_NO_MEMORY, "cannot hold %zu waves: out of memory", n);
    }
    for (size_t w = 0; w < n; w++) {
        const double complex d = direction(angle_rad[w]);
        s->angle_rad[w] = angle_rad[w];
        for (size_t i = 0; i < s->n; i++) {
            const double complex u = cexp(I * s->k * dot(d, s->node[i].at));
            b[w * n_row + i] = u;
            b[w * n_row + s->n + i] = I * dot(d, s->node[i].normal) * u;
        }
    }
    const lapack_int rows = (lapack_int)n_row;
    const lapack_int info =
        LAPACKE_zgetrs(LAPACK_COL_MAJOR, 'N', rows, (lapack_int)n, s->matrix, rows, s->pivot, b, rows);
    if (info != 0) st = error_set(err, STATUS_INVALID, "cannot solve for %zu waves (zgetrs: %d)", n, (int)info);
    for (size_t i = 0; i < n_row && st == STATUS_OK; i++)
        for (size_t w = 0; w < n; w++) {
            s->re[i * n + w] = creal(b[w * n_row + i]);
            s->im[i * n + w] = cimag(b[w * n_row + i]);
        }
    if (st == STATUS_OK) s->n_wave = n;
    free(b);
    return st;
}

static double complex at(const struct wave_solver *s, size_t row, size_t i_wave)
{
    const size_t i = row * s->n_wave + i_wave;
    return complex_of(s->re[i], s->im[i]);
}

/* Contribution of node i to T towards d: factors of u and of v / k. */
static void far_factors(const struct wave_solver *s, double complex d, size_t i, double complex factor[2])
{
    const struct node *p = &s->node[i];
    factor[1] = 0.25 * I * s->k * s->step * p->speed * cexp(-I * s->k * dot(d, p->at));
    factor[0] = I * dot(d, p->normal) * factor[1];
}

double complex wave_solver_amplitude(const struct wave_solver *s, size_t i_wave, double angle_rad)
{
    const double complex d = direction(angle_rad);
    double complex sum = 0;
    for (size_t i = 0; i < s->n; i++) {
        double complex factor[2];
        far_factors(s, d, i, factor);
        sum += factor[0] * at(s, i, i_wave) + factor[1] * at(s, s->n + i, i_wave);
    }
    return sum;
}

void wave_solver_towards(const struct wave_solver *s, double angle_rad, double complex *t)
{
    enum { CHUNK = 80 };
    const double complex d = direction(angle_rad);
    for (size_t first = 0; first < s->n_wave; first += CHUNK) {
        const size_t n = s->n_wave - first < CHUNK ? s->n_wave - first : CHUNK;
        double re[CHUNK] = {0}, im[CHUNK] = {0};
        for (size_t i = 0; i < s->n; i++) {
            double complex factor[2];
            far_factors(s, d, i, factor);
            for (int half = 0; half < 2; half++) {
                const double f = creal(factor[half]), g = cimag(factor[half]);
                const size_t row = ((size_t)half * s->n + i) * s->n_wave + first;
                for (size_t w = 0; w < n; w++) {
                    re[w] += f * s->re[row + w] - g * s->im[row + w];
                    im[w] += f * s->im[row + w] + g * s->re[row + w];
                }
            }
        }
        for (size_t w = 0; w < n; w++) t[first + w] = complex_of(re[w], im[w]);
    }
}

void wave_solver_amplitudes(const struct wave_solver *s, size_t i_wave, double complex *t, size_t n_angle)
{
    for (size_t j = 0; j < n_angle; j++)
        t[j] = wave_solver_amplitude(s, i_wave, 2 * M_PI * (double)j / (double)n_angle);
}

double wave_solver_extinction(const struct wave_solver *s, size_t i_wave)
{
    return 4 / s->k * creal(wave_solver_amplitude(s, i_wave, s->angle_rad[i_wave]));
}

double wave_scattering_of(double k, const double complex *t, size_t n)
{
    double sum = 0;
    for (size_t j = 0; j < n; j++) sum += creal(t[j]) * creal(t[j]) + cimag(t[j]) * cimag(t[j]);
    return 4 / k * sum / (double)n;
}

double wave_solver_absorption(const struct wave_solver *s, size_t i_wave)
{
    double sum = 0;
    for (size_t i = 0; i < s->n; i++) sum += s->node[i].speed * cimag(conj(at(s, i, i_wave)) * at(s, s->n + i, i_wave));
    return -s->step * sum;
}
