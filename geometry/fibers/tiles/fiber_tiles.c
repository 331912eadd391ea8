#include "geometry/fibers/tiles/fiber_tiles.h"
#include "geometry/fibers/tiles/tile_chains.h"
#include "geometry/fibers/tiles/tile_cuts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BISECTIONS = 24 };
static const double face_share = 1e-5;

struct work {
    const struct fiber_set *f;
    struct tile_cuts cuts;
    struct tile_lines *lines;
    size_t row, column;
    double offset[2]; /* of the copy of a fiber that is cut */
};

static struct tile_vertex vertex_of(const struct work *w, size_t k)
{
    struct tile_vertex v = {.p = {0.0}};
    for (int a = 0; a < 3; a++) v.p[a] = (double)w->f->position_m[3 * k + (size_t)a] + (a < 2 ? w->offset[a] : 0.0);
    if (w->f->shape != NULL) v.shape = w->f->shape[k];
    return v;
}

static bool is_inside(const struct work *w, const struct tile_vertex *v)
{
    return tile_cuts_inside(&w->cuts, w->row, w->column, v->p);
}

/* Where a segment with one end in the block crosses its border. */
static struct tile_vertex border_of(const struct work *w, const struct tile_vertex *in, const struct tile_vertex *out)
{
    struct tile_vertex v = *in;
    double low = 0.0, high = 1.0;
    for (int i = 0; i < BISECTIONS; i++) {
        const double at = 0.5 * (low + high);
        for (int a = 0; a < 3; a++) v.p[a] = in->p[a] + at * (out->p[a] - in->p[a]);
        if (is_inside(w, &v))
            low = at;
        else
            high = at;
    }
    return v;
}

/* Whether a vertex lies on a face of the small tile, where its fiber goes on in the next copy. */
static bool is_on_face(const struct fiber_set *f, size_t k)
{
    for (size_t a = 0; a < 2; a++) {
        const double share = (double)f->position_m[3 * k + a] / f->tile_size_m[a];
        if (fabs(share) < face_share || fabs(share - 1.0) < face_share) return true;
    }
    return false;
}

/* The parts of a copy of a fiber that lie in the block. */
static status cut_fiber(const struct work *w, size_t i_fiber, struct error *err)
{
    const size_t first = w->f->first_vertex[i_fiber], last = w->f->first_vertex[i_fiber + 1] - 1;
    struct tile_vertex v = vertex_of(w, first), next;
    bool inside = is_inside(w, &v), began_cut = inside && is_on_face(w->f, first);
    status s = inside ? tile_lines_add(w->lines, &v, err) : STATUS_OK;
    for (size_t k = first; k < last && s == STATUS_OK; k++, v = next) {
        next = vertex_of(w, k + 1);
        const bool goes_on = is_inside(w, &next);
        if (goes_on != inside) {
            const struct tile_vertex border = inside ? border_of(w, &v, &next) : border_of(w, &next, &v);
            s = tile_lines_add(w->lines, &border, err);
            if (s == STATUS_OK && inside) s = tile_lines_end(w->lines, i_fiber, began_cut, true, err);
            began_cut = !inside;
        }
        if (s == STATUS_OK && goes_on) s = tile_lines_add(w->lines, &next, err);
        inside = goes_on;
    }
    return s == STATUS_OK && inside ? tile_lines_end(w->lines, i_fiber, began_cut, is_on_face(w->f, last), err) : s;
}

static void extent_of(const struct fiber_set *f, size_t i, double low[2], double high[2])
{
    for (int a = 0; a < 2; a++) low[a] = INFINITY, high[a] = -INFINITY;
    for (size_t k = f->first_vertex[i]; k < f->first_vertex[i + 1]; k++)
        for (int a = 0; a < 2; a++) {
            low[a] = fmin(low[a], (double)f->position_m[3 * k + (size_t)a]);
            high[a] = fmax(high[a], (double)f->position_m[3 * k + (size_t)a]);
        }
}

/* All copies of a fiber that may reach into the block. */
static status cut_copies(struct work *w, size_t i_fiber, struct error *err)
{
    const double *move = w->cuts.move_m[w->row * w->cuts.n + w->column], *tile = w->cuts.tile_m;
    const size_t block[2] = {w->column, w->row};
    double low[2], high[2];
    long from[2], to[2];
    status s = STATUS_OK;
    extent_of(w->f, i_fiber, low, high);
    for (int a = 0; a < 2; a++) {
        const double reach = TILE_CUT_REACH * tile[a], begin = (double)block[a] * tile[a] - reach;
        from[a] = (long)ceil((begin - high[a] + move[a]) / tile[a]);
        to[a] = (long)floor((begin + tile[a] + 2.0 * reach - low[a] + move[a]) / tile[a]);
    }
    for (long y = from[1]; y <= to[1]; y++)
        for (long x = from[0]; x <= to[0] && s == STATUS_OK; x++) {
            w->offset[0] = (double)x * tile[0] - move[0];
            w->offset[1] = (double)y * tile[1] - move[1];
            s = cut_fiber(w, i_fiber, err);
        }
    return s;
}

static status cut_all(struct work *w, struct error *err)
{
    status s = STATUS_OK;
    for (w->row = 0; w->row < w->cuts.n; w->row++)
        for (w->column = 0; w->column < w->cuts.n; w->column++)
            for (size_t i = 0; i < w->f->n_fiber && s == STATUS_OK; i++) s = cut_copies(w, i, err);
    return s;
}

/* Cuts the blocks, joins them, and replaces the fibers. */
static status assemble(const struct work *of, struct fiber_set *f, struct fiber_tiles *tiles, struct error *err)
{
    struct tile_lines lines = {0}, out = {0};
    struct tile_ends ends = {0};
    struct work w = *of;
    const double tile_m[2] = {(double)w.cuts.n * w.cuts.tile_m[0], (double)w.cuts.n * w.cuts.tile_m[1]};
    w.lines = &lines;
    status s = tile_lines_init(&lines, err);
    if (s == STATUS_OK) s = cut_all(&w, err);
    if (s == STATUS_OK) s = tile_ends_make(&ends, &lines, f, tile_m, tiles, err);
    if (s == STATUS_OK) {
        tile_ends_join(&ends, &lines, tiles);
        s = tile_lines_init(&out, err);
    }
    if (s == STATUS_OK) s = tile_chains_make(&ends, &lines, &out, err);
    if (s == STATUS_OK) s = tile_lines_take(&out, tile_m, f, err);
    tile_ends_release(&ends);
    tile_lines_release(&lines);
    tile_lines_release(&out);
    return s;
}

status fiber_tiles_make(struct fiber_set *f, size_t n, uint64_t seed, struct fiber_tiles *tiles, struct error *err)
{
    double move_m[TILE_VIEW_MOST_MOVES][2];
    struct work w = {.f = f};
    *tiles = (struct fiber_tiles){.n_move = 1, .move_m = NAN};
    if (n < 2) return STATUS_OK;
    if (n > FIBER_TILES_MAX || f->n_vertex > FIBER_TILES_MAX_VERTEX / (n * n))
        return error_set(err, STATUS_TOO_LARGE,
                         "%zu x %zu tiles of %zu vertices are too many: allowed are %d a side with %d vertices", n, n,
                         f->n_vertex, FIBER_TILES_MAX, FIBER_TILES_MAX_VERTEX);
    struct tile_view *v = malloc(sizeof *v);
    if (v == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make a large tile: out of memory");
    tile_view_make(v, f);
    tiles->n_move = tile_view_moves(v, move_m);
    status s = STATUS_OK;
    if (tiles->n_move > 1) {
        s = tile_cuts_make(&w.cuts, v, n, move_m, tiles->n_move, seed, err);
        if (s == STATUS_OK) s = assemble(&w, f, tiles, err);
    }
    tile_cuts_release(&w.cuts);
    free(v);
    return s;
}
