#include "renderer/scene/scene_grid.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

/* Edge of a cell in mean diameters of the fibers, and how many cells there may be for each segment. */
#define CELL_DIAMETERS 1.2
#define MOST_CELLS_PER_SEGMENT 2.0
/* Segments reach into cells that are nearer than this part of a radius, and than this part of the tile: rounding. */
static const float slack_radii = 1e-2f, slack_of_tile = 1e-6f;

/* Cells that the box around a segment meets; x and y run over the endless cloth. */
struct cell_range {
    int low[3], high[3];
};

static int cell_of(const struct scene_grid *g, int axis, float x)
{
    return (int)floorf((x - g->low_mm[axis]) * g->per_mm[axis]);
}

static float slack_of(const struct scene *s, float radius)
{
    return slack_radii * radius + slack_of_tile * (float)(s->tile_mm[0] + s->tile_mm[1]);
}

static struct cell_range range_of(const struct scene *s, const struct scene_grid *g, size_t i)
{
    const struct scene_vertex *v = &s->vertex[s->segment_vertex[i]];
    const float a[3] = {v[0].x, v[0].y, v[0].z}, b[3] = {v[1].x, v[1].y, v[1].z},
                reach = fmaxf(v[0].radius, v[1].radius) + slack_of(s, v[0].radius);
    struct cell_range r;
    for (int k = 0; k < 3; k++) {
        r.low[k] = cell_of(g, k, fminf(a[k], b[k]) - reach);
        r.high[k] = cell_of(g, k, fmaxf(a[k], b[k]) + reach);
    }
    r.low[2] = r.low[2] < 0 ? 0 : r.low[2];
    r.high[2] = r.high[2] >= g->n[2] ? g->n[2] - 1 : r.high[2];
    return r;
}

/* Whether a segment reaches into a cell: the plane across the shortest way from the cell's middle to the axis parts
 * both if any such plane does. */
static bool reaches(const struct scene *s, const struct scene_grid *g, size_t i, const int at[3])
{
    const struct scene_vertex *v = &s->vertex[s->segment_vertex[i]];
    const float a[3] = {v[0].x, v[0].y, v[0].z}, u[3] = {v[1].x - v[0].x, v[1].y - v[0].y, v[1].z - v[0].z};
    float from[3], along = 0, length2 = 0, off2 = 0, half = 0;
    for (int k = 0; k < 3; k++) {
        from[k] = g->low_mm[k] + ((float)at[k] + 0.5f) * g->cell_mm[k] - a[k];
        along += from[k] * u[k];
        length2 += u[k] * u[k];
    }
    const float place = fminf(fmaxf(along / length2, 0), 1),
                reach = fmaxf(v[0].radius, v[1].radius) + slack_of(s, v[0].radius);
    for (int k = 0; k < 3; k++) {
        const float off = from[k] - place * u[k];
        off2 += off * off;
        half += 0.5f * g->cell_mm[k] * fabsf(off);
    }
    const float off = sqrtf(off2);
    return off * (off - reach) <= half;
}

static int floor_divide(int x, int n) { return x >= 0 ? x / n : -((n - 1 - x) / n); }

/* Counts the entries of cells, or with `fill` puts them in: first of a cell then goes from its end to its begin. */
static void add_segment(const struct scene *s, struct scene_grid *g, size_t i, bool fill)
{
    const struct cell_range r = range_of(s, g, i);
    const uint32_t begin = (s->segment_flag[i] & RTC_CURVE_FLAG_NEIGHBOR_LEFT) == 0 ? g->begin_bit : 0;
    int at[3];
    for (at[2] = r.low[2]; at[2] <= r.high[2]; at[2]++)
        for (at[1] = r.low[1]; at[1] <= r.high[1]; at[1]++)
            for (at[0] = r.low[0]; at[0] <= r.high[0]; at[0]++) {
                if (!reaches(s, g, i, at)) continue;
                const int x = floor_divide(at[0], g->n[0]), y = floor_divide(at[1], g->n[1]);
                const size_t cell = scene_grid_cell(g, at[0] - x * g->n[0], at[1] - y * g->n[1], at[2]);
                if (!fill) {
                    g->first[cell]++;
                    continue;
                }
                const uint32_t shift = (uint32_t)((y - g->shift_low[1]) * g->n_shift[0] + (x - g->shift_low[0]));
                g->entry[--g->first[cell]] =
                    s->segment_vertex[i] | begin | (g->shift_bit < 32 ? shift << g->shift_bit : 0);
            }
}

static size_t n_cell(const struct scene_grid *g) { return (size_t)g->n[0] * (size_t)g->n[1] * (size_t)g->n[2]; }

static void choose_cells(const struct scene *s, struct scene_grid *g)
{
    double radius_mm = 0, size[3] = {s->tile_mm[0], s->tile_mm[1], 2 * (double)SCENE_MARGIN_MM - (double)s->bottom_mm};
    for (size_t v = 0; v < s->n_vertex; v++) radius_mm += (double)s->vertex[v].radius / (double)s->n_vertex;
    const double most = MOST_CELLS_PER_SEGMENT * (double)s->n_segment + 64,
                 edge = fmax(CELL_DIAMETERS * 2 * radius_mm, cbrt(size[0] * size[1] * size[2] / most));
    for (int k = 0; k < 3; k++) {
        g->n[k] = (int)fmin(fmax(1, floor(size[k] / edge)), most);
        g->cell_mm[k] = (float)(size[k] / g->n[k]);
        g->per_mm[k] = (float)(g->n[k] / size[k]);
    }
    g->low_mm[2] = s->bottom_mm - SCENE_MARGIN_MM;
}

/* The shifts that segments have, and how they are numbered. */
static status number_shifts(const struct scene *s, struct scene_grid *g, struct error *err)
{
    int high[2] = {0, 0};
    for (size_t i = 0; i < s->n_segment; i++) {
        const struct cell_range r = range_of(s, g, i);
        for (int k = 0; k < 2; k++) {
            const int low = floor_divide(r.low[k], g->n[k]), up = floor_divide(r.high[k], g->n[k]);
            g->shift_low[k] = low < g->shift_low[k] ? low : g->shift_low[k];
            high[k] = up > high[k] ? up : high[k];
        }
    }
    for (int k = 0; k < 2; k++) g->n_shift[k] = high[k] - g->shift_low[k] + 1;
    const size_t n = (size_t)g->n_shift[0] * (size_t)g->n_shift[1];
    g->shift_bit = 32;
    for (size_t room = 1; room < n; room *= 2) g->shift_bit--;
    g->begin_bit = (uint32_t)1 << (g->shift_bit - 1);
    g->vertex_mask = g->begin_bit - 1;
    g->here = g->shift_bit < 32 ? (uint32_t)(-g->shift_low[1] * g->n_shift[0] - g->shift_low[0]) << g->shift_bit : 0;
    if (s->n_vertex > g->vertex_mask)
        return error_set(err, STATUS_TOO_LARGE, "cannot build scene: %zu vertices in %zu tiles, at most %u of them",
                         s->n_vertex, n, g->vertex_mask);
    g->shift_mm = malloc(n * sizeof *g->shift_mm);
    if (g->shift_mm == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot build scene: no memory for %zu tiles", n);
    for (size_t i = 0; i < n; i++) {
        g->shift_mm[i][0] = (float)((g->shift_low[0] + (int)(i % (size_t)g->n_shift[0])) * s->tile_mm[0]);
        g->shift_mm[i][1] = (float)((g->shift_low[1] + (int)(i / (size_t)g->n_shift[0])) * s->tile_mm[1]);
    }
    return STATUS_OK;
}

static status fill_cells(const struct scene *s, struct scene_grid *g, struct error *err)
{
    const size_t n = n_cell(g);
    g->first = calloc(n + 1, sizeof *g->first);
    if (g->first == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot build scene: no memory for %zu cells", n);
    for (size_t i = 0; i < s->n_segment; i++) add_segment(s, g, i, false);
    uint64_t sum = 0;
    for (size_t c = 0; c < n; c++) {
        sum += g->first[c];
        if (sum > UINT32_MAX) return error_set(err, STATUS_TOO_LARGE, "cannot build scene: %zu cells hold too much", n);
        g->first[c] = (uint32_t)sum;
    }
    g->first[n] = (uint32_t)sum;
    g->entry = calloc(sum + 8, sizeof *g->entry);
    if (g->entry == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot build scene: no memory for %" PRIu64 " parts of segments", sum);
    for (size_t i = s->n_segment; i-- > 0;) add_segment(s, g, i, true);
    g->segment_of = calloc(s->n_vertex, sizeof *g->segment_of);
    if (g->segment_of == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot build scene: no memory for %zu vertices", s->n_vertex);
    for (size_t i = 0; i < s->n_segment; i++) g->segment_of[s->segment_vertex[i]] = (uint32_t)i;
    return STATUS_OK;
}

status scene_grid_new(const struct scene *s, struct scene_grid **grid, struct error *err)
{
    struct scene_grid *g = calloc(1, sizeof *g);
    *grid = g;
    if (g == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot build scene: out of memory");
    choose_cells(s, g);
    status st = number_shifts(s, g, err);
    return st == STATUS_OK ? fill_cells(s, g, err) : st;
}

void scene_grid_free(struct scene_grid *g)
{
    if (g == NULL) return;
    free(g->first);
    free(g->entry);
    free(g->segment_of);
    free(g->shift_mm);
    free(g);
}

size_t scene_grid_bytes(const struct scene *s)
{
    const struct scene_grid *g = s->grid;
    const size_t n = n_cell(g);
    return sizeof *g + (n + 1 + g->first[n] + 8 + s->n_vertex) * sizeof *g->first +
           (size_t)g->n_shift[0] * (size_t)g->n_shift[1] * sizeof *g->shift_mm;
}
