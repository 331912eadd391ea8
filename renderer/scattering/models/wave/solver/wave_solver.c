#include "renderer/scattering/models/wave/solver/wave_solver.h"

#include "renderer/scattering/models/wave/solver/wave_kernels.h"

#include <lapacke.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>

enum { OUTSIDE, INSIDE, N_MEDIUM };

struct wave_solver {
    struct wave_nodes nodes;
    double k;
    double complex k_of[N_MEDIUM], q;
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

static void set(struct wave_solver *s, size_t i, size_t j, double complex value)
{
    s->matrix[j * 2 * s->nodes.n + i] = value;
}

/* Sets the contribution of source j to the two equations at node i. */
static void set_pair(struct wave_solver *s, size_t i, size_t j, const struct wave_kernels kernel[N_MEDIUM])
{
    const struct wave_kernels *e = &kernel[OUTSIDE], *in = &kernel[INSIDE];
    const double speed = s->nodes.node[j].speed, same = i == j ? 1 : 0;
    set(s, i, j, same + speed * (in->twice - e->twice));
    set(s, i, s->nodes.n + j, speed * s->k * (e->single - s->q * in->single));
    set(s, s->nodes.n + i, j, -speed / s->k * (e->slope - in->slope));
    set(s, s->nodes.n + i, s->nodes.n + j, same * 0.5 * (1 + s->q) + speed * (e->twice_prime - s->q * in->twice_prime));
}

static void assemble(struct wave_solver *s)
{
    struct wave_kernels kernel[N_MEDIUM], back[N_MEDIUM];
    for (size_t i = 0; i < s->nodes.n; i++) {
        for (int m = 0; m < N_MEDIUM; m++) kernel[m] = wave_kernels_at(&s->nodes, s->k_of[m], i);
        set_pair(s, i, i, kernel);
        for (size_t j = 0; j < i; j++) {
            for (int m = 0; m < N_MEDIUM; m++) { /* the other way round, D and D' change places */
                kernel[m] = wave_kernels_between(&s->nodes, s->k_of[m], i, j);
                back[m] =
                    (struct wave_kernels){kernel[m].single, kernel[m].twice_prime, kernel[m].twice, kernel[m].slope};
            }
            set_pair(s, i, j, kernel);
            set_pair(s, j, i, back);
        }
    }
}

static status factorise(struct wave_solver *s, struct error *err)
{
    const lapack_int n = (lapack_int)(2 * s->nodes.n),
                     info = LAPACKE_zgetrf(LAPACK_COL_MAJOR, n, n, s->matrix, n, s->pivot);
    return info == 0 ? STATUS_OK
                     : error_set(err, STATUS_INVALID, "the equations of %zu nodes have no solution (zgetrf: %d)",
                                 s->nodes.n, (int)info);
}

status wave_solver_new(const struct wave_problem *problem, struct wave_solver **solver, struct error *err)
{
    status st = wave_check_problem(problem->outline, problem->k, problem->index, problem->n_node, err);
    if (st != STATUS_OK) return st;
    const size_t n = problem->n_node;
    struct wave_solver *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot set up a wave solver: out of memory");
    s->k = problem->k;
    s->k_of[OUTSIDE] = problem->k;
    s->k_of[INSIDE] = problem->k * problem->index;
    s->q = problem->field == WAVE_ALONG ? 1 : problem->index * problem->index;
    st = wave_nodes_init(&s->nodes, problem->outline, n, err);
    s->pivot = malloc(2 * n * sizeof *s->pivot);
    s->matrix = malloc(4 * n * n * sizeof *s->matrix);
    if (st == STATUS_OK && (s->pivot == NULL || s->matrix == NULL))
        st = error_set(err, STATUS_NO_MEMORY, "cannot set up a wave solver: out of memory");
    if (st == STATUS_OK) {
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
    wave_nodes_release(&s->nodes);
    free(s->pivot);
    free(s->angle_rad);
    free(s);
}

/* Makes room for the solution of n waves. */
static status reserve(struct wave_solver *s, size_t n, struct error *err)
{
    double **part[3] = {&s->angle_rad, &s->re, &s->im};
    const size_t size[3] = {n, 2 * s->nodes.n * n, 2 * s->nodes.n * n};
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
    const size_t n_row = 2 * s->nodes.n;
    status st = reserve(s, n, err);
    if (st != STATUS_OK || n == 0) return st;
    double complex *b = malloc(n_row * n * sizeof *b); /* column after column */
    if (b == NULL || n > INT_MAX) {
        free(b);
        return error_set(err, STATUS_NO_MEMORY, "cannot hold %zu waves: out of memory", n);
    }
    for (size_t w = 0; w < n; w++) {
        const double complex d = wave_direction(angle_rad[w]);
        s->angle_rad[w] = angle_rad[w];
        for (size_t i = 0; i < s->nodes.n; i++) {
            const double complex u = cexp(I * s->k * wave_dot(d, s->nodes.node[i].at));
            b[w * n_row + i] = u;
            b[w * n_row + s->nodes.n + i] = I * wave_dot(d, s->nodes.node[i].normal) * u;
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

static struct wave_columns columns(const struct wave_solver *s, size_t first, size_t n)
{
    return (struct wave_columns){s->re + first, s->im + first, s->n_wave, n};
}

void wave_solver_towards(const struct wave_solver *s, double angle_rad, double complex *t)
{
    const struct wave_columns all = columns(s, 0, s->n_wave);
    wave_nodes_towards(&s->nodes, s->k, angle_rad, &all, t);
}

double complex wave_solver_amplitude(const struct wave_solver *s, size_t i_wave, double angle_rad)
{
    const struct wave_columns one = columns(s, i_wave, 1);
    double complex t;
    wave_nodes_towards(&s->nodes, s->k, angle_rad, &one, &t);
    return t;
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
    const struct wave_columns one = columns(s, i_wave, 1);
    return wave_nodes_absorption(&s->nodes, &one, 0);
}
