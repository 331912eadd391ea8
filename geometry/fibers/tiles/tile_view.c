#include "geometry/fibers/tiles/tile_view.h"

#include <math.h>
#include <string.h>

enum { N = TILE_VIEW_EDGE };
/* Over the mean of all moves, and over the least of a move; the least step to moves that only look nearly alike, as of
 * a yarn over another one of the other direction. */
static const double most_difference = 0.7, most_over_least = 3.0, least_step = 0.04;
static const int apart = N / 8;

static int wrap(int i) { return (i % N + N) % N; }

static int cell_of(double x, double tile) { return wrap((int)floor(x / tile * N)); }

static void add_segment(struct tile_view *v, const float *p, const float *q)
{
    double d[3], length = 0.0;
    for (int a = 0; a < 3; a++) d[a] = (double)q[a] - (double)p[a], length += d[a] * d[a];
    length = sqrt(length);
    const double place[2] = {0.5 * ((double)p[0] + (double)q[0]), 0.5 * ((double)p[1] + (double)q[1])};
    float *at = v->at[cell_of(place[1], v->tile_m[1])][cell_of(place[0], v->tile_m[0])];
    at[0] += (float)length;
    at[1] += (float)(length * 0.5 * ((double)p[2] + (double)q[2]));
    at[2] += (float)fabs(d[0]);
    at[3] += (float)fabs(d[1]);
}

/* A mean over 3 x 3 cells, with the mean 0 and the variance 1. */
static void smooth(struct tile_view *v)
{
    float from[N][N][TILE_VIEW_CHANNELS];
    double mean[TILE_VIEW_CHANNELS] = {0.0}, square[TILE_VIEW_CHANNELS] = {0.0};
    memcpy(from, v->at, sizeof from);
    for (int i = 0; i < N * N * TILE_VIEW_CHANNELS; i++) {
        const int c = i % TILE_VIEW_CHANNELS, x = i / TILE_VIEW_CHANNELS % N, y = i / TILE_VIEW_CHANNELS / N;
        float sum = 0.0f;
        for (int k = 0; k < 9; k++) sum += from[wrap(y + k / 3 - 1)][wrap(x + k % 3 - 1)][c];
        v->at[y][x][c] = sum;
        mean[c] += (double)sum / (N * N);
        square[c] += (double)sum * (double)sum / (N * N);
    }
    for (int i = 0; i < N * N * TILE_VIEW_CHANNELS; i++) {
        const int c = i % TILE_VIEW_CHANNELS;
        float *value = &v->at[i / TILE_VIEW_CHANNELS / N][i / TILE_VIEW_CHANNELS % N][c];
        const double variance = square[c] - mean[c] * mean[c];
        *value = variance > 0.0 ? (float)(((double)*value - mean[c]) / sqrt(variance)) : 0.0f;
    }
}

void tile_view_make(struct tile_view *v, const struct fiber_set *f)
{
    memset(v, 0, sizeof *v);
    memcpy(v->tile_m, f->tile_size_m, sizeof v->tile_m);
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++)
            add_segment(v, f->position_m + 3 * k, f->position_m + 3 * k + 3);
    smooth(v);
}

static double difference(const float a[TILE_VIEW_CHANNELS], const float b[TILE_VIEW_CHANNELS])
{
    double sum = 0.0;
    for (int c = 0; c < TILE_VIEW_CHANNELS; c++) sum += ((double)a[c] - (double)b[c]) * ((double)a[c] - (double)b[c]);
    return sum;
}

double tile_view_difference(const struct tile_view *v, const double a_m[2], const double b_m[2])
{
    return difference(v->at[cell_of(a_m[1], v->tile_m[1])][cell_of(a_m[0], v->tile_m[0])],
                      v->at[cell_of(b_m[1], v->tile_m[1])][cell_of(b_m[0], v->tile_m[0])]);
}

/* Mean difference of the tile from itself moved by whole cells. */
static double difference_moved(const struct tile_view *v, int x, int y)
{
    double sum = 0.0;
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++) sum += difference(v->at[j][i], v->at[wrap(j + y)][wrap(i + x)]);
    return sum / (N * N);
}

/* The minimum of a parabola through three values, in cells from the middle one. */
static double vertex_of(double before, double at, double after)
{
    const double bend = before - 2.0 * at + after;
    return bend > 0.0 ? fmin(fmax(0.5 * (before - after) / bend, -0.5), 0.5) : 0.0;
}

static bool is_apart(const struct tile_view *v, double (*move_m)[2], size_t n, const double move[2])
{
    for (size_t i = 0; i < n; i++) {
        double away = 0.0;
        for (int a = 0; a < 2; a++) {
            const double d = (move[a] - move_m[i][a]) / v->tile_m[a];
            away = fmax(away, fabs(d - round(d)));
        }
        if (away < (double)apart / N) return false;
    }
    return true;
}

/* Sorts moves by their differences over the mean, the first one apart, and returns how many come before the widest
 * step. */
static size_t before_step(double (*move_m)[2], double *apart_by, size_t n)
{
    size_t kept = n;
    double widest = least_step;
    for (size_t i = 2; i < n; i++)
        for (size_t k = i; k > 1 && apart_by[k] < apart_by[k - 1]; k--) {
            double keep[3] = {apart_by[k], move_m[k][0], move_m[k][1]};
            apart_by[k] = apart_by[k - 1];
            memcpy(move_m[k], move_m[k - 1], sizeof *move_m);
            apart_by[k - 1] = keep[0];
            memcpy(move_m[k - 1], keep + 1, sizeof *move_m);
        }
    for (size_t i = 2; i < n; i++)
        if (apart_by[i] - apart_by[i - 1] > widest) {
            widest = apart_by[i] - apart_by[i - 1];
            kept = i;
        }
    return kept;
}

size_t tile_view_moves(const struct tile_view *v, double move_m[TILE_VIEW_MOST_MOVES][2])
{
    double moved[N][N], apart_by[TILE_VIEW_MOST_MOVES] = {0.0};
    double mean = 0.0;
    size_t n = 1;
    move_m[0][0] = move_m[0][1] = 0.0;
    for (int y = 0; y < N; y++)
        for (int x = 0; x < N; x++) mean += (moved[y][x] = difference_moved(v, x, y)) / (N * N);
    double most = most_difference * mean;
    for (double below = 0.02; below < 1.0 && n < TILE_VIEW_MOST_MOVES; below += 0.02) /* best first */
        for (int i = 0; i < N * N && n < TILE_VIEW_MOST_MOVES; i++) {
            const int x = i % N, y = i / N;
            const double *row = moved[y], at = row[x], left = row[wrap(x - 1)], right = row[wrap(x + 1)],
                         under = moved[wrap(y - 1)][x], over = moved[wrap(y + 1)][x];
            if (at > below * mean || at > most || at > left || at > right || at > under || at > over) continue;
            const double move[2] = {(x + vertex_of(left, at, right)) / N * v->tile_m[0],
                                    (y + vertex_of(under, at, over)) / N * v->tile_m[1]};
            if (!is_apart(v, move_m, n, move)) continue;
            apart_by[n] = at / mean;
            memcpy(move_m[n++], move, sizeof move);
            if (n == 2) most = fmin(most, most_over_least * at);
        }
    return before_step(move_m, apart_by, n);
}
