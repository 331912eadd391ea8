#include "geometry/weave/weave_repeat.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* WINDOW_REPEATS: edge of a window in units of the longest shift of the lattice. */
enum { INDEX_MAX = 8, LEAST_WINDOW_PX = 32, PHASES = 32, ROUNDS = 3 };
static const double WINDOW_REPEATS = 6.0, HIGHEST = 0.48, CLEAR = 4.0;

static int by_frequency(const void *a, const void *b)
{
    const double *f = ((const struct weave_coefficient *)a)->f, *g = ((const struct weave_coefficient *)b)->f;
    double p = f[0] * f[0] + f[1] * f[1], q = g[0] * g[0] + g[1] * g[1];
    return (p > q) - (p < q);
}

/* Lists the lowest frequencies of the lattice, one of each pair f, -f. */
static void list_frequencies(const struct weave_lattice *l, struct weave_repeat *r)
{
    struct weave_coefficient all[(2 * INDEX_MAX + 1) * (INDEX_MAX + 1)];
    size_t n = 0;
    for (int i = 0; i <= INDEX_MAX; i++)
        for (int k = i == 0 ? 1 : -INDEX_MAX; k <= INDEX_MAX; k++) {
            struct weave_coefficient c = {.index = {i, k}};
            for (int a = 0; a < 2; a++) c.f[a] = i * l->f[0][a] + k * l->f[1][a];
            if (fabs(c.f[0]) < HIGHEST && fabs(c.f[1]) < HIGHEST) all[n++] = c;
        }
    qsort(all, n, sizeof *all, by_frequency);
    r->n_coefficient = n < WEAVE_COEFFICIENT_MAX ? n : WEAVE_COEFFICIENT_MAX;
    memcpy(r->coefficient, all, r->n_coefficient * sizeof *all);
}

/* The windows of a picture: squares of `edge` pixels that overlap by half. */
struct windows {
    const float *flat;
    size_t width, height, edge, n[2];
    double *taper; /* edge, sum 1 */
};

static size_t window_edge(const struct weave_lattice *l, size_t width, size_t height)
{
    double longest = 0.0;
    for (int i = 0; i < 2; i++) longest = fmax(longest, hypot(l->shift_px[i][0], l->shift_px[i][1]));
    size_t edge = (size_t)ceil(WINDOW_REPEATS * longest), least = width < height ? width : height;
    if (edge < LEAST_WINDOW_PX) edge = LEAST_WINDOW_PX;
    return edge < least ? edge : least;
}

static status windows_init(struct windows *w, struct error *err)
{
    double sum = 0.0;
    w->n[0] = 2 * (w->width / w->edge) - 1;
    w->n[1] = 2 * (w->height / w->edge) - 1;
    w->taper = malloc(w->edge * sizeof *w->taper);
    if (w->taper == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot analyse texture: out of memory");
    for (size_t i = 0; i < w->edge; i++) {
        w->taper[i] = 0.5 - 0.5 * cos(2.0 * M_PI * ((double)i + 0.5) / (double)w->edge);
        sum += w->taper[i];
    }
    for (size_t i = 0; i < w->edge; i++) w->taper[i] /= sum;
    return STATUS_OK;
}

/* Fourier coefficient of window (wx, wy) at frequency f; the phase counts from the window's corner. wave: room for edge
 * values. */
static double complex window_coefficient(const struct windows *w, size_t wx, size_t wy, const double f[2],
                                         double complex *wave)
{
    double complex sum = 0.0;
    const float *corner = w->flat + wy * (w->edge / 2) * w->width + wx * (w->edge / 2);
    for (size_t x = 0; x < w->edge; x++) wave[x] = w->taper[x] * cexp(-2.0 * M_PI * I * f[0] * (double)x);
    for (size_t y = 0; y < w->edge; y++) {
        double complex row = 0.0;
        for (size_t x = 0; x < w->edge; x++) row += wave[x] * (double)corner[y * w->width + x];
        sum += row * w->taper[y] * cexp(-2.0 * M_PI * I * f[1] * (double)y);
    }
    return sum;
}

/* Chooses the two strongest coefficients that span the lattice. value: n_window x n_coefficient. */
static bool choose_references(const struct weave_repeat *r, const double complex *value, size_t reference[2])
{
    double strength[WEAVE_COEFFICIENT_MAX] = {0}, best = 0.0;
    for (size_t i = 0; i < r->n_window; i++)
        for (size_t k = 0; k < r->n_coefficient; k++) strength[k] += cabs(value[i * r->n_coefficient + k]);
    for (size_t i = 0; i < r->n_coefficient; i++)
        for (size_t k = i + 1; k < r->n_coefficient; k++) {
            const int *a = r->coefficient[i].index, *b = r->coefficient[k].index;
            double both = strength[i] * strength[k] * fmin(strength[i], strength[k]);
            if (abs(a[0] * b[1] - a[1] * b[0]) != 1 || both <= best) continue;
            best = both;
            reference[0] = i;
            reference[1] = k;
        }
    return best > 0.0;
}

/* Averages the windows, each turned by its phases. */
static void average(struct weave_repeat *r, const double complex *value)
{
    for (size_t k = 0; k < r->n_coefficient; k++) {
        struct weave_coefficient *c = &r->coefficient[k];
        double square = 0.0, n = (double)r->n_window;
        double complex sum = 0.0;
        for (size_t i = 0; i < r->n_window; i++) {
            double turn = c->index[0] * r->phase[2 * i] + c->index[1] * r->phase[2 * i + 1];
            double complex v = value[i * r->n_coefficient + k] * cexp(-I * turn);
            sum += v;
            square += creal(v) * creal(v) + cimag(v) * cimag(v);
        }
        c->value = sum / n;
        c->sd = sqrt(fmax(0.0, square / n - cabs(c->value) * cabs(c->value)) / n);
    }
}

/* The phases that give both references phase zero. */
static void phases_of_references(struct weave_repeat *r, const double complex *value, const size_t reference[2])
{
    const int *a = r->coefficient[reference[0]].index, *b = r->coefficient[reference[1]].index;
    int det = a[0] * b[1] - a[1] * b[0];
    for (size_t i = 0; i < r->n_window; i++) {
        double p = carg(value[i * r->n_coefficient + reference[0]]);
        double q = carg(value[i * r->n_coefficient + reference[1]]);
        r->phase[2 * i] = (p * b[1] - q * a[1]) / det;
        r->phase[2 * i + 1] = (q * a[0] - p * b[0]) / det;
    }
}

/* Moves the phases of a window to where it resembles the average most. */
static void align_window(const struct weave_repeat *r, const double complex *value, const double complex *turn,
                         double phase[2])
{
    double complex product[WEAVE_COEFFICIENT_MAX];
    double best = -INFINITY;
    for (size_t k = 0; k < r->n_coefficient; k++) product[k] = value[k] * conj(r->coefficient[k].value);
    for (int p = 0; p < PHASES; p++)
        for (int q = 0; q < PHASES; q++) {
            double alike = 0.0;
            for (size_t k = 0; k < r->n_coefficient; k++) {
                const int *m = r->coefficient[k].index;
                alike += creal(product[k] * turn[((m[0] * p + m[1] * q) % PHASES + PHASES) % PHASES]);
            }
            if (alike <= best) continue;
            best = alike;
            phase[0] = 2.0 * M_PI * p / PHASES;
            phase[1] = 2.0 * M_PI * q / PHASES;
        }
}

/* First by the references alone, then each window against the average of all. */
static void align(struct weave_repeat *r, const double complex *value, const size_t reference[2])
{
    double complex turn[PHASES];
    for (int i = 0; i < PHASES; i++) turn[i] = cexp(-2.0 * M_PI * I * i / PHASES);
    phases_of_references(r, value, reference);
    average(r, value);
    for (int round_number = 0; round_number < ROUNDS; round_number++) {
        for (size_t i = 0; i < r->n_window; i++) align_window(r, value + i * r->n_coefficient, turn, r->phase + 2 * i);
        average(r, value);
    }
}

/* Whether the references stand out of the noise in single windows, so that their phases are known. All of the picture
 * that is not the repeat counts as noise; its standard deviation is 1. */
static bool references_are_clear(const struct windows *w, const struct weave_repeat *r, const double complex *value,
                                 const size_t reference[2])
{
    double noise = 1.5 / (double)w->edge; /* of a coefficient under two Hann windows */
    for (int a = 0; a < 2; a++) {
        double square = 0.0;
        for (size_t i = 0; i < r->n_window; i++) square += pow(cabs(value[i * r->n_coefficient + reference[a]]), 2.0);
        if (square / (double)r->n_window < (CLEAR * CLEAR + 1.0) * noise * noise) return false;
    }
    return true;
}

/* All coefficients of all windows, n_window x n_coefficient; NULL without memory. */
static double complex *transform_windows(const struct windows *w, const struct weave_repeat *r)
{
    double complex *value = malloc(r->n_window * r->n_coefficient * sizeof *value);
    double complex *wave = malloc(w->edge * sizeof *wave);
    if (value == NULL || wave == NULL) {
        free(value);
        free(wave);
        return NULL;
    }
    for (size_t i = 0; i < r->n_window; i++)
        for (size_t k = 0; k < r->n_coefficient; k++)
            value[i * r->n_coefficient + k] =
                window_coefficient(w, i % w->n[0], i / w->n[0], r->coefficient[k].f, wave);
    free(wave);
    return value;
}

/* *clear: on entry whether to average even if the references do not stand out; on return whether it was done. */
static status average_windows(struct windows *w, struct weave_repeat *r, bool *clear, struct error *err)
{
    size_t reference[2] = {0, 0};
    status s = windows_init(w, err);
    if (s != STATUS_OK) return s;
    r->n_window = w->n[0] * w->n[1];
    r->edge_px = w->edge;
    r->n_across = w->n[0];
    free(r->phase);
    r->phase = malloc(2 * r->n_window * sizeof *r->phase);
    double complex *value = transform_windows(w, r);
    if (value == NULL || r->phase == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot analyse texture: out of memory");
    else if (!choose_references(r, value, reference))
        s = error_set(err, STATUS_NOT_FOUND, "the photograph shows no texture that repeats in two directions");
    *clear = *clear || (s == STATUS_OK && references_are_clear(w, r, value, reference));
    if (s == STATUS_OK && *clear) align(r, value, reference);
    free(value);
    free(w->taper);
    return s;
}

status weave_average_repeat(const float *flat, size_t width, size_t height, const struct weave_lattice *lattice,
                            struct weave_repeat *repeat, struct error *err)
{
    struct windows w = {.flat = flat, .width = width, .height = height};
    size_t least = width < height ? width : height;
    bool clear = false;
    status s = STATUS_OK;
    *repeat = (struct weave_repeat){.phase = NULL};
    list_frequencies(lattice, repeat);
    for (w.edge = window_edge(lattice, width, height); s == STATUS_OK && !clear; w.edge *= 2) {
        if (2 * w.edge > least) clear = true; /* there is no larger window to try */
        s = average_windows(&w, repeat, &clear, err);
    }
    if (s != STATUS_OK) weave_repeat_release(repeat);
    return s;
}

status weave_average_again(const float *picture, size_t width, size_t height, struct weave_repeat *repeat,
                           struct error *err)
{
    struct windows w = {.flat = picture, .width = width, .height = height, .edge = repeat->edge_px};
    status s = windows_init(&w, err);
    if (s != STATUS_OK) return s;
    double complex *value = transform_windows(&w, repeat);
    if (value == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot analyse texture: out of memory");
    else
        average(repeat, value);
    free(value);
    free(w.taper);
    return s;
}

/* Moves a place by whole repeats to where it is nearest to `target`. */
static void move_towards(const struct weave_lattice *lattice, const double target_px[2], double at_px[2])
{
    const double *a = lattice->shift_px[0], *b = lattice->shift_px[1];
    double d[2] = {target_px[0] - at_px[0], target_px[1] - at_px[1]}, det = a[0] * b[1] - a[1] * b[0];
    double n_a = round((d[0] * b[1] - d[1] * b[0]) / det), n_b = round((a[0] * d[1] - a[1] * d[0]) / det);
    for (int k = 0; k < 2; k++) at_px[k] += n_a * a[k] + n_b * b[k];
}

void weave_repeat_middle(const struct weave_repeat *repeat, const struct weave_lattice *lattice, double at_px[2])
{
    size_t x = repeat->n_across / 2, y = repeat->n_window / repeat->n_across / 2;
    const double *phase = repeat->phase + 2 * (y * repeat->n_across + x);
    at_px[0] = (double)(x * (repeat->edge_px / 2));
    at_px[1] = (double)(y * (repeat->edge_px / 2));
    for (int i = 0; i < 2; i++)
        for (int a = 0; a < 2; a++) at_px[a] -= phase[i] / (2.0 * M_PI) * lattice->shift_px[i][a];
    /* the phases fit best in the window's middle: the yarns of its corner may have wandered from there */
    const double half = 0.5 * (double)repeat->edge_px;
    move_towards(lattice, (double[2]){(double)x * half + half, (double)y * half + half}, at_px);
}

void weave_repeat_release(struct weave_repeat *repeat)
{
    free(repeat->phase);
    repeat->phase = NULL;
}

double weave_repeat_value(const struct weave_repeat *repeat, const double at_px[2])
{
    double sum = 0.0;
    for (size_t k = 0; k < repeat->n_coefficient; k++) {
        const struct weave_coefficient *c = &repeat->coefficient[k];
        sum += 2.0 * creal(c->value * cexp(2.0 * M_PI * I * (c->f[0] * at_px[0] + c->f[1] * at_px[1])));
    }
    return sum;
}
