#include "geometry/diameter/lumen_fill.h"

#include "geometry/diameter/along_smooth.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum {
    UNIT = 250, /* of the smoothed density as a byte */
    CELL = 6,   /* blocks of two cells to each side show the outside: wider than a lumen */
    MAX_SWEEP = 64,
    MARK = 255
};
/* Depth of the basin of a lumen, and in units of the noise that the mean along a fiber leaves of white noise. */
static const double LEAST_DEPTH = 0.1, NOISE_DEPTH = 3.0, NOISE_LEFT = 0.26;
static const double VOID_DENSITY = 0.3, BLOCK_RANGE = 0.05;

/* A volume: its smoothed density, and the height of the ways to the outside, later the depth of basins. */
struct lumen_box {
    const struct volume *v;
    size_t n[3];
    uint8_t *density, *height;
};

/* Sums of the smoothed density over cells of CELL voxels to each side, fewer at the ends of the axes. */
struct cell_sums {
    size_t n[3];
    double *sum;
    uint8_t *outside;
};

static size_t cell_end(const struct lumen_box *b, const size_t c[3], int axis)
{
    return CELL * (c[axis] + 1) < b->n[axis] ? CELL * (c[axis] + 1) : b->n[axis];
}

static void sum_cells(const struct lumen_box *b, struct cell_sums *cells)
{
    for (size_t k = 0; k < b->n[2]; k++)
        for (size_t j = 0; j < b->n[1]; j++)
            for (size_t i = 0; i < b->n[0]; i++)
                cells->sum[volume_index(cells->n, i / CELL, j / CELL, k / CELL)] +=
                    (double)b->density[volume_index(b->n, i, j, k)];
}

/* Sets from and to to the cells of block c, which begins with cell c - 1 on each axis, and returns its mean density in
 * units of a byte; INFINITY where less than half of it is inside of the volume. */
static double block_mean(const struct lumen_box *b, const struct cell_sums *cells, const size_t c[3], size_t from[3],
                         size_t to[3])
{
    size_t n_voxel = 1, n_whole = 1;
    double sum = 0.0;
    for (int a = 0; a < 3; a++) {
        from[a] = c[a] > 0 ? c[a] - 1 : 0;
        to[a] = c[a] < cells->n[a] ? c[a] + 1 : cells->n[a];
        n_voxel *= (CELL * to[a] < b->n[a] ? CELL * to[a] : b->n[a]) - CELL * from[a];
        n_whole *= 2 * CELL < b->n[a] ? 2 * CELL : b->n[a];
    }
    if (2 * n_voxel < n_whole) return INFINITY;
    for (size_t k = from[2]; k < to[2]; k++)
        for (size_t j = from[1]; j < to[1]; j++)
            for (size_t i = from[0]; i < to[0]; i++) sum += cells->sum[volume_index(cells->n, i, j, k)];
    return sum / (double)n_voxel;
}

/* Finds the cells of the emptiest blocks. Blocks overlap by a cell, and those at a face may have half of their
 * thickness, so that a thin layer of void above a cloth is outside wherever it begins. */
static void find_outside(const struct lumen_box *b, struct cell_sums *cells)
{
    size_t c[3], from[3], to[3];
    double least = INFINITY;
    for (int pass = 0; pass < 2; pass++)
        for (c[2] = 0; c[2] <= cells->n[2]; c[2]++)
            for (c[1] = 0; c[1] <= cells->n[1]; c[1]++)
                for (c[0] = 0; c[0] <= cells->n[0]; c[0]++) {
                    const double mean = block_mean(b, cells, c, from, to);
                    if (pass == 0) least = fmin(least, mean);
                    if (pass == 0 || mean > least + BLOCK_RANGE * UNIT) continue;
                    for (size_t k = from[2]; k < to[2]; k++)
                        for (size_t j = from[1]; j < to[1]; j++)
                            memset(cells->outside + volume_index(cells->n, from[0], j, k), 1, to[0] - from[0]);
                }
}

/* Sets the height of void in the emptiest blocks, which is outside, to its density, and all other to MARK. */
static bool mark_outside(const struct lumen_box *b)
{
    struct cell_sums cells;
    size_t c[3];
    for (int a = 0; a < 3; a++) cells.n[a] = (b->n[a] + CELL - 1) / CELL;
    cells.sum = calloc(volume_n_voxel(cells.n), sizeof *cells.sum);
    cells.outside = calloc(volume_n_voxel(cells.n), 1);
    const bool done = cells.sum != NULL && cells.outside != NULL;
    memset(b->height, MARK, volume_n_voxel(b->n));
    if (done) {
        sum_cells(b, &cells);
        find_outside(b, &cells);
    }
    for (c[2] = 0; c[2] < cells.n[2] && done; c[2]++)
        for (c[1] = 0; c[1] < cells.n[1]; c[1]++)
            for (c[0] = 0; c[0] < cells.n[0]; c[0]++) {
                if (!cells.outside[volume_index(cells.n, c[0], c[1], c[2])]) continue;
                for (size_t k = CELL * c[2]; k < cell_end(b, c, 2); k++)
                    for (size_t j = CELL * c[1]; j < cell_end(b, c, 1); j++)
                        for (size_t i = CELL * c[0]; i < cell_end(b, c, 0); i++) {
                            const size_t at = volume_index(b->n, i, j, k);
                            if (b->density[at] < VOID_DENSITY * UNIT) b->height[at] = b->density[at];
                        }
            }
    free(cells.sum);
    free(cells.outside);
    return done;
}

/* New height of voxel `at` of a box, from its neighbours; marked: spreads marks within basins instead. */
static uint8_t relaxed(const struct lumen_box *b, const size_t x[3], size_t at, bool marked)
{
    const size_t step[3] = {1, b->n[0], b->n[0] * b->n[1]};
    uint8_t best = b->height[at], most = 0;
    for (int a = 0; a < 3; a++) {
        uint8_t before = x[a] > 0 ? b->height[at - step[a]] : best;
        uint8_t after = x[a] + 1 < b->n[a] ? b->height[at + step[a]] : best;
        uint8_t low = before < after ? before : after, high = before > after ? before : after;
        if (!marked && low < best) best = low;
        if (high > most) most = high;
    }
    if (marked) return most == MARK ? MARK : best;
    return best > b->density[at] ? best : b->density[at];
}

/* Passes over the box forwards and backwards in turn until nothing changes. */
static void sweep(const struct lumen_box *b, bool marked)
{
    bool changed = true;
    for (int pass = 0; changed && pass < MAX_SWEEP; pass++) {
        changed = false;
        for (size_t k = 0; k < b->n[2]; k++) {
            for (size_t j = 0; j < b->n[1]; j++)
                for (size_t i = 0; i < b->n[0]; i++) {
                    const bool back = pass % 2 == 1;
                    const size_t x[3] = {back ? b->n[0] - 1 - i : i, back ? b->n[1] - 1 - j : j,
                                         back ? b->n[2] - 1 - k : k};
                    size_t at = volume_index(b->n, x[0], x[1], x[2]);
                    const uint8_t old = b->height[at];
                    if (marked ? old == 0 || old == MARK : old == b->density[at]) continue;
                    b->height[at] = relaxed(b, x, at, marked);
                    changed = changed || b->height[at] != old;
                }
            scratch_keep_within(b->v->space);
        }
    }
}

/* Marks the basins with a place deeper than `depth`. *share: of the material. Returns false without memory. */
static bool mark_basins(const struct lumen_box *b, double depth, double *share)
{
    size_t n = volume_n_voxel(b->n), n_material = 0, n_basin = 0;
    if (!mark_outside(b)) return false;
    sweep(b, false);
    for (size_t i = 0; i < n; i++) {
        int deep = b->height[i] - b->density[i]; /* MARK was not reached: a place that sweeps leave out */
        n_material += 2 * b->density[i] > UNIT;
        b->height[i] = b->height[i] == MARK ? 0 : (double)deep > depth * UNIT ? MARK : (uint8_t)(deep > 0 ? deep : 0);
    }
    sweep(b, true);
    for (size_t i = 0; i < n; i++)
        if (b->height[i] == MARK) n_basin++;
    *share = n_material > 0 ? (double)n_basin / (double)n_material : 0.0;
    return true;
}

static status box_share(struct lumen_box *b, double depth, struct thread_pool *pool, double *share, struct error *err)
{
    void *array[2] = {NULL, NULL};
    const size_t n = volume_n_voxel(b->n);
    status s = scratch_new(b->v->space, n, "the lumens of fibers", &array[0], err);
    if (s == STATUS_OK) s = scratch_new(b->v->space, n, "the lumens of fibers", &array[1], err);
    b->density = array[0];
    b->height = array[1];
    if (s == STATUS_OK) s = density_smooth_along(b->v, pool, UNIT, b->density, err);
    if (s == STATUS_OK && !mark_basins(b, depth, share))
        s = error_set(err, STATUS_NO_MEMORY, "cannot look for lumens: out of memory");
    return s;
}

static void release_box(struct lumen_box *b)
{
    scratch_release(b->v->space, b->density);
    scratch_release(b->v->space, b->height);
    b->density = b->height = NULL;
}

status lumens_fill(struct volume *v, double noise_sd, struct thread_pool *pool, double *filled_share, struct error *err)
{
    const double depth = fmax(LEAST_DEPTH, isfinite(noise_sd) ? NOISE_DEPTH * NOISE_LEFT * noise_sd : 0.0);
    struct lumen_box all = {.v = v, .n = {v->n[0], v->n[1], v->n[2]}};
    *filled_share = 0.0;
    status s = box_share(&all, depth, pool, filled_share, err);
    if (s == STATUS_OK) s = volume_fill_marked(v, all.height, MARK, err);
    release_box(&all);
    return s;
}
