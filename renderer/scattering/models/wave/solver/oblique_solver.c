#include "renderer/scattering/models/wave/solver/oblique_solver.h"

#include "renderer/scattering/models/wave/solver/complex_parts.h"
#include "renderer/scattering/models/wave/solver/wave_kernels.h"

#include <lapacke.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>

enum { OUTSIDE, INSIDE, N_MEDIUM };
enum kernel { TWICE, SINGLE_OUTSIDE, SINGLE_INSIDE, SLOPE, PRIME_OUTSIDE, PRIME_INSIDE, N_KERNEL };
enum { MOST_SYSTEM = 2 };
#define SYMMETRIC_WITHIN 1e-11 /* of the largest distance of two mirrored nodes, over the extent */

/* Values at the nodes that stand for a function: all (sign 0), or the upper half's for even (1) and odd (-1)
 * functions of t. */
struct fold {
    size_t first, n;
    double sign;
};

/* Equations of one symmetry: for each field u, then v over kappa_e, at the nodes of its fold. */
struct equations {
    struct fold fold[WAVE_N_FIELD];
    size_t size;
    double complex *matrix; /* column after column; its factors L and U */
    lapack_int *pivot;
};

struct oblique_solver {
    struct wave_nodes nodes;
    double kappa;
    double complex kappa_of[N_MEDIUM], q[WAVE_N_FIELD], coupling[WAVE_N_FIELD]; /* g = coupling d/ds of the other */
    bool symmetric;
    size_t n_system;
    struct equations system[MOST_SYSTEM];
    size_t n_wave; /* of the solution */
    double *angle_rad;
    double *re, *im; /* by field, u or v, node; columns by incident field and wave */
};

bool oblique_solver_is_symmetric(const struct oblique_solver *s) { return s->symmetric; }

static bool is_symmetric(const struct wave_nodes *w)
{
    double extent = 0, off = 0;
    for (size_t i = 0; i < w->n; i++) {
        extent = fmax(extent, cabs(w->node[i].at));
        off = fmax(off, cabs(w->node[i].at - conj(w->node[(w->n - i) % w->n].at)));
    }
    return off < SYMMETRIC_WITHIN * extent;
}

static struct fold fold_of(size_t n, double sign)
{
    if (sign == 0) return (struct fold){0, n, 0};
    return sign > 0 ? (struct fold){0, n / 2 + 1, 1} : (struct fold){1, n / 2 - 1, -1};
}

static bool has_mirror(const struct fold *f, size_t n, size_t j) { return f->sign != 0 && j != 0 && j != n / 2; }

/* Kernels from all nodes to the first n_row nodes, [kernel][row][node], without speeds. */
static void fill_kernels(const struct oblique_solver *s, size_t n_row, double complex *kernel)
{
    const size_t n = s->nodes.n;
    for (size_t i = 0; i < n_row; i++)
        for (size_t j = 0; j < n; j++) {
            struct wave_kernels k[N_MEDIUM];
            for (int m = 0; m < N_MEDIUM; m++)
                k[m] = i == j ? wave_kernels_at(&s->nodes, s->kappa_of[m], i)
                              : wave_kernels_between(&s->nodes, s->kappa_of[m], i, j);
            const double complex value[N_KERNEL] = {
                k[INSIDE].twice - k[OUTSIDE].twice, k[OUTSIDE].single,      k[INSIDE].single,
                k[OUTSIDE].slope - k[INSIDE].slope, k[OUTSIDE].twice_prime, k[INSIDE].twice_prime};
            for (int q = 0; q < N_KERNEL; q++) kernel[((size_t)q * n_row + i) * n + j] = value[q];
        }
}

struct filling {
    const struct oblique_solver *s;
    struct equations *e;
    const double complex *kernel;
    size_t n_row;
    enum wave_field field;
    double complex *single, *prime; /* of the inside, folded, by column and row; room for n^2 */
    double *slope;                  /* a column of d/dt */
};

/* Kernel q from the function of a fold with the value 1 at node j to node i. */
static double complex folded(const struct filling *f, enum kernel q, size_t i, size_t j)
{
    const size_t n = f->s->nodes.n;
    const struct fold *own = &f->e->fold[f->field];
    const double complex *row = f->kernel + ((size_t)q * f->n_row + i) * n;
    return has_mirror(own, n, j) ? row[j] + own->sign * row[n - j] : row[j];
}

/* First equation, and unknown, of a field. */
static size_t place_of(const struct equations *e, enum wave_field field)
{
    return field == WAVE_ALONG ? 0 : 2 * e->fold[WAVE_ALONG].n;
}

/* The equations of a field without the other one. */
static void fill_own(struct filling *f)
{
    const struct fold *own = &f->e->fold[f->field];
    const size_t place = place_of(f->e, f->field), size = f->e->size;
    const double complex q = f->s->q[f->field];
    const double kappa = f->s->kappa;
    for (size_t c = 0; c < own->n; c++) {
        const size_t j = own->first + c;
        const double speed = f->s->nodes.node[j].speed;
        double complex *u = f->e->matrix + (place + c) * size + place, *v = u + own->n * size;
        for (size_t r = 0; r < own->n; r++) {
            const size_t i = own->first + r;
            const double same = i == j ? 1 : 0;
            const double complex single = folded(f, SINGLE_INSIDE, i, j), prime = folded(f, PRIME_INSIDE, i, j);
            f->single[c * own->n + r] = single;
            f->prime[c * own->n + r] = prime;
            u[r] = same + speed * folded(f, TWICE, i, j);
            v[r] = speed * kappa * (folded(f, SINGLE_OUTSIDE, i, j) - q * single);
            u[own->n + r] = -speed / kappa * folded(f, SLOPE, i, j);
            v[own->n + r] = same * 0.5 * (1 + q) + speed * (folded(f, PRIME_OUTSIDE, i, j) - q * prime);
        }
    }
}

/* The derivative by t at node i of the trigonometric polynomial that is 1 at node j. */
static double derivative(size_t n, size_t i, size_t j)
{
    if (i == j) return 0;
    const double sign = (i + j) % 2 == 0 ? 0.5 : -0.5;
    return sign / tan(M_PI * ((double)i - (double)j) / (double)n);
}

/* The terms of g, which the other field makes. */
static void fill_coupling(struct filling *f)
{
    const struct fold *own = &f->e->fold[f->field], *other = &f->e->fold[1 - f->field];
    const size_t n = f->s->nodes.n, size = f->e->size, place = place_of(f->e, f->field);
    const double complex coupling = f->s->coupling[f->field], over = coupling / f->s->kappa;
    for (size_t c = 0; c < other->n; c++) {
        const size_t j = other->first + c;
        double complex *u = f->e->matrix + (place_of(f->e, 1 - f->field) + c) * size + place, *v = u + own->n;
        for (size_t r = 0; r < own->n; r++) {
            const size_t i = own->first + r;
            f->slope[r] = derivative(n, i, j);
            if (has_mirror(other, n, j)) f->slope[r] += other->sign * derivative(n, i, n - j);
            v[r] += 0.5 * over / f->s->nodes.node[i].speed * f->slope[r];
        }
        for (size_t k = 0; k < own->n; k++) {
            const double complex by_u = -coupling * f->slope[k], by_v = -over * f->slope[k];
            const double complex *single = f->single + k * own->n, *prime = f->prime + k * own->n;
            for (size_t r = 0; r < own->n; r++) {
                u[r] += complex_product(by_u, single[r]);
                v[r] += complex_product(by_v, prime[r]);
            }
        }
    }
}

static status factorise(struct equations *e, struct error *err)
{
    const lapack_int n = (lapack_int)e->size, info = LAPACKE_zgetrf(LAPACK_COL_MAJOR, n, n, e->matrix, n, e->pivot);
    return info == 0 ? STATUS_OK
                     : error_set(err, STATUS_INVALID, "the equations of %zu unknowns have no solution (zgetrf: %d)",
                                 e->size, (int)info);
}

static status no_memory(struct error *err)
{
    return error_set(err, STATUS_NO_MEMORY, "cannot set up a wave solver: out of memory");
}

static status set_up(struct oblique_solver *s, struct error *err)
{
    const size_t n = s->nodes.n, n_row = s->symmetric ? n / 2 + 1 : n;
    double complex *kernel = malloc((size_t)N_KERNEL * n_row * n * sizeof *kernel);
    struct filling f = {s,
                        NULL,
                        kernel,
                        n_row,
                        WAVE_ALONG,
                        malloc(n_row * n_row * sizeof *f.single),
                        malloc(n_row * n_row * sizeof *f.prime),
                        malloc(n * sizeof *f.slope)};
    status st = kernel == NULL || f.single == NULL || f.prime == NULL || f.slope == NULL ? no_memory(err) : STATUS_OK;
    if (st == STATUS_OK) fill_kernels(s, n_row, kernel);
    s->n_system = s->symmetric ? 2 : 1;
    for (size_t k = 0; k < s->n_system && st == STATUS_OK; k++) {
        struct equations *e = f.e = &s->system[k];
        const double sign = !s->symmetric ? 0 : k == 0 ? 1 : -1;
        e->fold[WAVE_ALONG] = fold_of(n, sign);
        e->fold[WAVE_ACROSS] = fold_of(n, -sign);
        e->size = 2 * (e->fold[WAVE_ALONG].n + e->fold[WAVE_ACROSS].n);
        e->matrix = calloc(e->size * e->size, sizeof *e->matrix);
        e->pivot = malloc(e->size * sizeof *e->pivot);
        if (e->matrix == NULL || e->pivot == NULL) {
            st = no_memory(err);
            break;
        }
        for (int field = 0; field < WAVE_N_FIELD; field++) {
            f.field = (enum wave_field)field;
            fill_own(&f);
            fill_coupling(&f);
        }
        st = factorise(e, err);
    }
    free(kernel);
    free(f.single);
    free(f.prime);
    free(f.slope);
    return st;
}

status oblique_solver_new(const struct oblique_problem *p, struct oblique_solver **solver, struct error *err)
{
    status st = wave_check_problem(p->outline, p->k, p->index, p->n_node, err);
    if (st == STATUS_OK && !(fabs(p->theta_rad) < 0.999 * M_PI_2))
        st = error_set_field(err, STATUS_INVALID, "theta", "the wave runs along the fiber, or nearly so (%g rad)",
                             p->theta_rad);
    if (st != STATUS_OK) return st;
    const double sine = sin(p->theta_rad);
    const double complex square = p->index * p->index;
    struct oblique_solver *s = calloc(1, sizeof *s);
    if (s == NULL) return no_memory(err);
    s->kappa = p->k * cos(p->theta_rad);
    s->kappa_of[OUTSIDE] = s->kappa;
    s->kappa_of[INSIDE] = p->k * csqrt(square - sine * sine);
    s->q[WAVE_ACROSS] = (s->kappa_of[INSIDE] / s->kappa) * (s->kappa_of[INSIDE] / s->kappa);
    s->q[WAVE_ALONG] = s->q[WAVE_ACROSS] / square;
    s->coupling[WAVE_ACROSS] = sine * (1 - s->q[WAVE_ACROSS]);
    s->coupling[WAVE_ALONG] = -s->coupling[WAVE_ACROSS] / square;
    st = wave_nodes_init(&s->nodes, p->outline, p->n_node, err);
    if (st == STATUS_OK) {
        s->symmetric = is_symmetric(&s->nodes);
        st = set_up(s, err);
    }
    if (st != STATUS_OK) {
        oblique_solver_free(s);
        return st;
    }
    *solver = s;
    return STATUS_OK;
}

void oblique_solver_free(struct oblique_solver *s)
{
    if (s == NULL) return;
    for (int k = 0; k < MOST_SYSTEM; k++) {
        free(s->system[k].matrix);
        free(s->system[k].pivot);
    }
    wave_nodes_release(&s->nodes);
    free(s->angle_rad);
    free(s->re);
    free(s->im);
    free(s);
}

/* Sets the right side for wave w of the incident field i, b the first equation of this field. */
static void fill_incident(const struct oblique_solver *s, const struct fold *f, size_t w, double complex *b)
{
    const size_t n = s->nodes.n;
    const double complex d = wave_direction(s->angle_rad[w]);
    for (size_t r = 0; r < f->n; r++) {
        const size_t j = f->first + r;
        const size_t at[2] = {j, has_mirror(f, n, j) ? n - j : j};
        for (int side = 0; side < 2; side++) {
            const struct wave_node *p = &s->nodes.node[at[side]];
            const double half = f->sign == 0 || side == 0 ? 0.5 : 0.5 * f->sign;
            const double complex u = half * cexp(I * s->kappa * wave_dot(d, p->at));
            b[r] += u;
            b[f->n + r] += I * wave_dot(d, p->normal) * u;
        }
    }
}

/* Adds the solution of one symmetry to the values at all nodes. */
static void spread(struct oblique_solver *s, const struct equations *e, const double complex *b, size_t n_column)
{
    const size_t n = s->nodes.n;
    for (int field = 0; field < WAVE_N_FIELD; field++)
        for (size_t half = 0; half < 2; half++) {
            const struct fold *f = &e->fold[field];
            const size_t place = place_of(e, (enum wave_field)field) + half * f->n;
            for (size_t r = 0; r < f->n; r++) {
                const size_t j = f->first + r, base = (size_t)field * 2 * n + half * n;
                for (size_t c = 0; c < n_column; c++) {
                    const double complex x = b[c * e->size + place + r];
                    s->re[(base + j) * n_column + c] += creal(x);
                    s->im[(base + j) * n_column + c] += cimag(x);
                    if (!has_mirror(f, n, j)) continue;
                    s->re[(base + n - j) * n_column + c] += f->sign * creal(x);
                    s->im[(base + n - j) * n_column + c] += f->sign * cimag(x);
                }
            }
        }
}

static status solve_system(struct oblique_solver *s, const struct equations *e, size_t n, struct error *err)
{
    const size_t n_column = WAVE_N_FIELD * n;
    double complex *b = calloc(e->size * n_column, sizeof *b);
    if (b == NULL || n_column > INT_MAX) {
        free(b);
        return no_memory(err);
    }
    for (size_t c = 0; c < n_column; c++) {
        const enum wave_field i = (enum wave_field)(c / n);
        fill_incident(s, &e->fold[i], c % n, b + c * e->size + place_of(e, i));
    }
    const lapack_int rows = (lapack_int)e->size;
    const lapack_int info =
        LAPACKE_zgetrs(LAPACK_COL_MAJOR, 'N', rows, (lapack_int)n_column, e->matrix, rows, e->pivot, b, rows);
    if (info == 0) spread(s, e, b, n_column);
    free(b);
    return info == 0 ? STATUS_OK
                     : error_set(err, STATUS_INVALID, "cannot solve for %zu waves (zgetrs: %d)", n, (int)info);
}

status oblique_solver_solve(struct oblique_solver *s, const double *angle_rad, size_t n, struct error *err)
{
    const size_t size = WAVE_N_FIELD * 2 * s->nodes.n * WAVE_N_FIELD * n;
    status st = STATUS_OK;
    free(s->angle_rad);
    free(s->re);
    free(s->im);
    s->n_wave = 0;
    s->angle_rad = malloc((n > 0 ? n : 1) * sizeof *s->angle_rad);
    s->re = calloc(size > 0 ? size : 1, sizeof *s->re);
    s->im = calloc(size > 0 ? size : 1, sizeof *s->im);
    if (s->angle_rad == NULL || s->re == NULL || s->im == NULL) return no_memory(err);
    for (size_t w = 0; w < n; w++) s->angle_rad[w] = angle_rad[w];
    for (size_t k = 0; k < s->n_system && st == STATUS_OK && n > 0; k++) st = solve_system(s, &s->system[k], n, err);
    if (st == STATUS_OK) s->n_wave = n;
    return st;
}

/* Columns of an exitant field. */
static struct wave_columns columns(const struct oblique_solver *s, enum wave_field out, size_t first, size_t n)
{
    const size_t stride = WAVE_N_FIELD * s->n_wave, place = (size_t)out * 2 * s->nodes.n * stride + first;
    return (struct wave_columns){s->re + place, s->im + place, stride, n};
}

void oblique_solver_towards(const struct oblique_solver *s, double angle_rad, double complex *t)
{
    for (int out = 0; out < WAVE_N_FIELD; out++) {
        const struct wave_columns all = columns(s, (enum wave_field)out, 0, WAVE_N_FIELD * s->n_wave);
        wave_nodes_towards(&s->nodes, s->kappa, angle_rad, &all, t + (size_t)out * WAVE_N_FIELD * s->n_wave);
    }
}

double oblique_solver_extinction(const struct oblique_solver *s, enum wave_field i, size_t w)
{
    const struct wave_columns own = columns(s, i, (size_t)i * s->n_wave + w, 1);
    double complex t;
    wave_nodes_towards(&s->nodes, s->kappa, s->angle_rad[w], &own, &t);
    return 4 / s->kappa * creal(t);
}

double oblique_solver_absorption(const struct oblique_solver *s, enum wave_field i, size_t w)
{
    double sum = 0;
    for (int out = 0; out < WAVE_N_FIELD; out++) {
        const struct wave_columns own = columns(s, (enum wave_field)out, (size_t)i * s->n_wave + w, 1);
        sum += wave_nodes_absorption(&s->nodes, &own, 0);
    }
    return sum;
}
