#include "geometry/weave/weave_drawing.h"

#include <math.h>
#include <stdlib.h>

static size_t modulo(long a, size_t n) { return (size_t)((a % (long)n + (long)n) % (long)n); }

bool weave_cells_init(struct weave_cells *c, const int index_warp[2], const int index_weft[2])
{
    long det = (long)index_warp[0] * index_weft[1] - (long)index_warp[1] * index_weft[0];
    size_t n = (size_t)labs(det), n_found = 0, key[WEAVE_CELL_MAX][2];
    if (n < 2 || n > WEAVE_CELL_MAX) return false;
    *c = (struct weave_cells){.n_cell = n};
    for (long j = 0; j < (long)n; j++)
        for (long i = 0; i < (long)n; i++) {
            size_t own[2] = {modulo(i * index_weft[1] - j * index_warp[1], n),
                             modulo(j * index_warp[0] - i * index_weft[0], n)};
            size_t k = 0;
            while (k < n_found && (key[k][0] != own[0] || key[k][1] != own[1])) k++;
            if (k == n_found) {
                c->place[k][0] = (int)i;
                c->place[k][1] = (int)j;
                for (int a = 0; a < 2; a++) key[k][a] = own[a];
                n_found++;
            }
            c->number[j][i] = k;
        }
    for (c->n_warp = 1; c->n_warp < n && c->number[0][c->n_warp] != c->number[0][0];) c->n_warp++;
    for (c->n_weft = 1; c->n_weft < n && c->number[c->n_weft][0] != c->number[0][0];) c->n_weft++;
    return n_found == n;
}

static bool warp_on_top(const struct weave_cells *c, unsigned pattern, long i, long j)
{
    return (pattern >> c->number[modulo(j, c->n_cell)][modulo(i, c->n_cell)] & 1u) != 0;
}

bool weave_pattern_holds(const struct weave_cells *c, unsigned pattern)
{
    for (size_t k = 0; k < c->n_cell; k++) {
        size_t up_warp = 0, up_weft = 0;
        for (size_t l = 0; l < c->n_cell; l++) {
            up_warp += warp_on_top(c, pattern, (long)k, (long)l);
            up_weft += warp_on_top(c, pattern, (long)l, (long)k);
        }
        if (up_warp == 0 || up_warp == c->n_cell || up_weft == 0 || up_weft == c->n_cell) return false;
    }
    return true;
}

static double sinc(double x) { return fabs(x) < 1e-9 ? 1.0 : sin(M_PI * x) / (M_PI * x); }

/* Fourier transform of a unit box at frequency f, modulated by cos(2 pi x). */
static double rounded(double f) { return 0.5 * (sinc(f - 1.0) + sinc(f + 1.0)); }

/* The same modulated by sin(2 pi x). */
static double complex sloped(double f) { return (sinc(f - 1.0) - sinc(f + 1.0)) / (2.0 * I); }

/* Transform of sin(pi (k + 1/2 + y) / length) over the unit box around y = 0: the place k of a float. */
static double complex bow(double f, long k, long length)
{
    double middle = M_PI * ((double)k + 0.5) / (double)length, rate = 0.5 / (double)length; /* cycles per yarn */
    return (cexp(I * middle) * sinc(f - rate) - cexp(-I * middle) * sinc(f + rate)) / (2.0 * I);
}

/* The same of the cosine. */
static double complex tilt(double f, long k, long length)
{
    double middle = M_PI * ((double)k + 0.5) / (double)length, rate = 0.5 / (double)length;
    return 0.5 * (cexp(I * middle) * sinc(f - rate) + cexp(-I * middle) * sinc(f + rate));
}

/* Length of the float that crossing (i, j) is in, along wefts (along = 0) or warps (1), and the number of its crossings
 * before this one. The pattern holds, so the float ends. */
static void measure_float(const struct weave_cells *c, unsigned pattern, const int at[2], int along, long *before,
                          long *length)
{
    long step[2] = {along == 0, along == 1}, after = 0;
    bool own = warp_on_top(c, pattern, at[0], at[1]);
    *before = 0;
    while (warp_on_top(c, pattern, at[0] - (*before + 1) * step[0], at[1] - (*before + 1) * step[1]) == own) ++*before;
    while (warp_on_top(c, pattern, at[0] + (after + 1) * step[0], at[1] + (after + 1) * step[1]) == own) after++;
    *length = *before + 1 + after;
}

/* Number of the place `before` in a float. */
static size_t float_number(long before, long length) { return (size_t)((length - 1) * length / 2 + before); }

void weave_strokes_init(struct weave_strokes *s, const struct weave_cells *c, const double ab[2])
{
    for (size_t k = 0; k < c->n_cell; k++)
        s->phase[k] = cexp(-2.0 * M_PI * I * (ab[0] * c->place[k][0] + ab[1] * c->place[k][1])) / (double)c->n_cell;
    for (int x = 0; x < 2; x++) {
        s->box[x] = sinc(ab[x]);
        s->rounded[x] = rounded(ab[x]);
        s->sloped[x] = sloped(ab[x]);
        for (long length = 1; length <= (long)c->n_cell; length++)
            for (long before = 0; before < length; before++) {
                s->bow[x][float_number(before, length)] = bow(ab[x], before, length);
                s->tilt[x][float_number(before, length)] = tilt(ab[x], before, length);
            }
    }
}

void weave_draw(const struct weave_cells *c, unsigned pattern, const struct weave_strokes *stroke, size_t n,
                double complex (*shape)[WEAVE_SHAPES])
{
    for (size_t k = 0; k < n; k++)
        for (int s = 0; s < WEAVE_SHAPES; s++) shape[k][s] = 0.0;
    for (size_t l = 0; l < c->n_cell; l++) {
        long before, length;
        bool warp = warp_on_top(c, pattern, c->place[l][0], c->place[l][1]);
        int along = warp ? 1 : 0, across = 1 - along;
        measure_float(c, pattern, c->place[l], along, &before, &length);
        size_t number = float_number(before, length);
        for (size_t k = 0; k < n; k++) {
            const struct weave_strokes *s = &stroke[k];
            if (warp) shape[k][0] += s->phase[l] * (s->box[0] * s->box[1]);
            shape[k][warp ? 1 : 2] += s->phase[l] * (s->rounded[across] * s->box[along]);
            shape[k][warp ? 3 : 4] += s->phase[l] * s->bow[along][number] * s->box[across];
            shape[k][warp ? 5 : 6] += s->phase[l] * s->tilt[along][number] * s->sloped[across];
        }
    }
}
