#include "renderer/scattering/wave/complex_lu.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 64, LANES = 4, TILE_ROWS = 4, STRIP = 256 }; /* STRIP: columns whose part of U stays in the cache */
typedef double lanes __attribute__((vector_size(LANES * sizeof(double))));

status complex_matrix_init(struct complex_matrix *m, size_t n_row, size_t n_column, struct error *err)
{
    const size_t stride = (n_column + LANES - 1) / LANES * LANES;
    *m = (struct complex_matrix){.n_row = n_row, .n_column = n_column, .stride = stride};
    m->re = calloc(n_row * stride, sizeof *m->re);
    m->im = calloc(n_row * stride, sizeof *m->im);
    if (m->re != NULL && m->im != NULL) return STATUS_OK;
    complex_matrix_release(m);
    return error_set(err, STATUS_NO_MEMORY, "cannot hold a matrix of %zu x %zu: out of memory", n_row, n_column);
}

void complex_matrix_release(struct complex_matrix *m)
{
    free(m->re);
    free(m->im);
    m->re = m->im = NULL;
}

/* Row `to` less factor times row `from`, in columns [first, end). */
static void subtract_row(struct complex_matrix *m, size_t to, size_t from, const double factor[2], size_t first,
                         size_t end)
{
    double *restrict x = m->re + to * m->stride, *restrict y = m->im + to * m->stride;
    const double *restrict u = m->re + from * m->stride, *restrict v = m->im + from * m->stride;
    const double f = factor[0], g = factor[1];
    for (size_t j = first; j < end; j++) {
        x[j] -= f * u[j] - g * v[j];
        y[j] -= f * v[j] + g * u[j];
    }
}

static void swap_rows(struct complex_matrix *m, size_t a, size_t b)
{
    double *part[2] = {m->re, m->im};
    for (int k = 0; k < 2 && a != b; k++)
        for (size_t j = 0; j < m->n_column; j++) {
            double *x = part[k] + a * m->stride + j, *y = part[k] + b * m->stride + j, keep = *x;
            *x = *y;
            *y = keep;
        }
}

/* Columns [first, end) below row `first`. */
static status factor_panel(struct complex_matrix *a, size_t first, size_t end, size_t *pivot, struct error *err)
{
    for (size_t k = first; k < end; k++) {
        double top = -1;
        for (size_t i = k; i < a->n_row; i++) {
            const double size = hypot(a->re[i * a->stride + k], a->im[i * a->stride + k]);
            if (!(size > top)) continue;
            top = size;
            pivot[k] = i;
        }
        if (!(top > 0) || isinf(top)) return error_set(err, STATUS_INVALID, "the matrix is singular in row %zu", k);
        swap_rows(a, k, pivot[k]);
        const double x = a->re[k * a->stride + k] / (top * top), y = -a->im[k * a->stride + k] / (top * top);
        for (size_t i = k + 1; i < a->n_row; i++) {
            double *re = a->re + i * a->stride + k, *im = a->im + i * a->stride + k;
            const double factor[2] = {*re * x - *im * y, *re * y + *im * x};
            *re = factor[0];
            *im = factor[1];
            subtract_row(a, i, k, factor, k + 1, end);
        }
    }
    return STATUS_OK;
}

/* The part of U in rows [first, end) beside the panel. */
static void finish_rows(struct complex_matrix *a, size_t first, size_t end)
{
    for (size_t i = first + 1; i < end; i++)
        for (size_t k = first; k < i; k++) {
            const double factor[2] = {a->re[i * a->stride + k], a->im[i * a->stride + k]};
            subtract_row(a, i, k, factor, end, a->n_column);
        }
}

/* U of LANES columns, row after row. */
struct packed {
    lanes re[BLOCK], im[BLOCK];
};

static lanes lanes_at(const double *x)
{
    lanes v;
    memcpy(&v, x, sizeof v);
    return v;
}

/* Less L times U in a tile of `n` rows and LANES columns; L has n_inner columns from `first`. */
static inline void subtract_tile(struct complex_matrix *a, size_t row, size_t n, size_t column, const struct packed *u,
                                 const size_t inner[2])
{
    const size_t first = inner[0], n_inner = inner[1];
    lanes re[TILE_ROWS], im[TILE_ROWS];
    const double *l_re[TILE_ROWS], *l_im[TILE_ROWS];
    for (size_t i = 0; i < n; i++) {
        re[i] = lanes_at(a->re + (row + i) * a->stride + column);
        im[i] = lanes_at(a->im + (row + i) * a->stride + column);
        l_re[i] = a->re + (row + i) * a->stride + first;
        l_im[i] = a->im + (row + i) * a->stride + first;
    }
    for (size_t k = 0; k < n_inner; k++)
        for (size_t i = 0; i < n; i++) {
            re[i] = re[i] - l_re[i][k] * u->re[k] + l_im[i][k] * u->im[k];
            im[i] = im[i] - l_re[i][k] * u->im[k] - l_im[i][k] * u->re[k];
        }
    for (size_t i = 0; i < n; i++) {
        memcpy(a->re + (row + i) * a->stride + column, &re[i], sizeof re[i]);
        memcpy(a->im + (row + i) * a->stride + column, &im[i], sizeof im[i]);
    }
}

/* The rest of the matrix less L times U of a block. Columns of a row's padding are worked on, too. */
static void subtract_block(struct complex_matrix *a, size_t first, size_t end, struct packed *packed)
{
    const size_t inner[2] = {first, end - first};
    for (size_t strip = end; strip < a->n_column; strip += STRIP) {
        const size_t stop = strip + STRIP < a->stride ? strip + STRIP : a->stride, n_tile = (stop - strip) / LANES;
        for (size_t t = 0; t < n_tile; t++)
            for (size_t k = first; k < end; k++) {
                packed[t].re[k - first] = lanes_at(a->re + k * a->stride + strip + t * LANES);
                packed[t].im[k - first] = lanes_at(a->im + k * a->stride + strip + t * LANES);
            }
        size_t i = end;
        for (; i + TILE_ROWS <= a->n_row; i += TILE_ROWS)
            for (size_t t = 0; t < n_tile; t++) subtract_tile(a, i, TILE_ROWS, strip + t * LANES, &packed[t], inner);
        for (; i < a->n_row; i++)
            for (size_t t = 0; t < n_tile; t++) subtract_tile(a, i, 1, strip + t * LANES, &packed[t], inner);
    }
}

status complex_lu_factor(struct complex_matrix *a, size_t *pivot, struct error *err)
{
    struct packed *packed = aligned_alloc(sizeof(lanes), (STRIP / LANES) * sizeof *packed);
    if (packed == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot factorise a matrix: out of memory");
    status st = STATUS_OK;
    for (size_t first = 0; first < a->n_row && st == STATUS_OK; first += BLOCK) {
        /* the last block may end within a vector; all others end at a multiple of LANES */
        const size_t end = first + BLOCK < a->n_row ? first + BLOCK : a->n_row;
        st = factor_panel(a, first, end, pivot, err);
        if (st != STATUS_OK) break;
        finish_rows(a, first, end);
        subtract_block(a, first, end, packed);
    }
    free(packed);
    return st;
}

/* Row i of b less row k times the entry (i, k) of the factors. */
static void eliminate(const struct complex_matrix *lu, struct complex_matrix *b, size_t i, size_t k)
{
    const double factor[2] = {lu->re[i * lu->stride + k], lu->im[i * lu->stride + k]};
    subtract_row(b, i, k, factor, 0, b->n_column);
}

void complex_lu_solve(const struct complex_matrix *lu, const size_t *pivot, struct complex_matrix *b)
{
    const size_t n = lu->n_row;
    for (size_t i = 0; i < n; i++) swap_rows(b, i, pivot[i]);
    for (size_t i = 1; i < n; i++)
        for (size_t k = 0; k < i; k++) eliminate(lu, b, i, k);
    for (size_t i = n; i-- > 0;) {
        for (size_t k = i + 1; k < n; k++) eliminate(lu, b, i, k);
        const double x = lu->re[i * lu->stride + i], y = lu->im[i * lu->stride + i], size = x * x + y * y;
        for (size_t j = 0; j < b->n_column; j++) {
            double *re = b->re + i * b->stride + j, *im = b->im + i * b->stride + j, keep = *re;
            *re = (keep * x + *im * y) / size;
            *im = (*im * x - keep * y) / size;
        }
    }
}
