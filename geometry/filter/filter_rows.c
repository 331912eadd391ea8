/* The direction of the fiber through every voxel of material.
 *
 * J(x, d) is sharp only on the axis of a fiber: off the axis a line that leans across the fiber stays inside it for
 * longer. So every voxel first climbs to its ridge, the densest place of the blurred volume within about one radius.
 * J is minimised there, and the voxel gets the direction and J of its ridge. The descent starts from the structure
 * tensor, which in dense bundles is not misled by rows of touching fibers as J is. It ends on the paraboloid through
 * J at the best node of a fine set of directions and at the node's neighbours. Where the neighbourhood has another
 * direction whose J is almost as low, that direction is used. The result does not depend on how the work is divided. */
#include "geometry/filter/filter_rows.h"
#include "geometry/filter/filter_choice.h"

#include "geometry/filter/consensus.h"
#include "geometry/filter/line_bound.h"
#include "geometry/filter/line_descent.h"
#include "geometry/filter/line_filter.h"
#include "geometry/orientation/structure_tensor.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_FINE = 900, N_CONSENSUS_BLUR = 3, MAX_CLIMB = 19 };

/* difference of two minima of J up to which noise and touching fibers may decide between them */
#define J_TOLERANCE 0.07
#define AGREEMENT_COSINE 0.94f
#define TENSOR_DIAMETERS 0.28  /* standard deviation of the structure tensor's window */
#define J_UNIT (1.0 / 40000.0) /* J at ridges is stored in 16 bits, as a share of J in solid material */

struct orientation_job {
    const struct volume *v;
    struct volume blurred;
    struct direction_volume *d;
    struct direction_set fine;
    struct line_filter *filter;
    struct tensor_window window;
    float eps_d, eps_j;
    double j_full;                             /* J in solid material */
    int n_climb;                               /* most steps to the ridge */
    size_t begin, end, climb_begin, climb_end; /* rows that are wanted, and those that have an effect on them */
    struct line_bound bound;
    uint16_t *ridge;           /* per voxel of material: packed offset of its ridge voxel */
    _Atomic uint16_t *j_ridge; /* 0: not a ridge; at ridges J in J_UNIT * j_full, at least 1 */
    struct consensus consensus;
    float *scratch; /* per thread */
    size_t scratch_per_thread;
    ptrdiff_t neighbour[26]; /* offsets in the volume, in ascending order */
};

enum { BAND = 32 }; /* rows of a slice in one task; short, so that a cancellation is noticed soon */

struct band {
    size_t j0, j1, k;
};

static size_t n_band(const struct orientation_job *o) { return (o->v->n[1] + BAND - 1) / BAND; }

static struct band band_of(const struct orientation_job *o, size_t i_task)
{
    size_t j0 = i_task % n_band(o) * BAND;
    return (struct band){j0, j0 + BAND < o->v->n[1] ? j0 + BAND : o->v->n[1], i_task / n_band(o)};
}

/* Moves x to the highest of its 26 neighbours in the blurred volume. Returns false at a peak. */
static bool step_up_inside(const struct orientation_job *o, size_t x[3])
{
    const float *p = o->blurred.density + volume_index(o->blurred.n, x[0], x[1], x[2]);
    float most = *p;
    int best = -1;
    for (int m = 0; m < 26; m++) {
        float value = p[o->neighbour[m]];
        best = value > most ? m : best;
        most = value > most ? value : most;
    }
    if (best < 0) return false;
    size_t cell = best < 13 ? (size_t)best : (size_t)best + 1; /* index among the 27 cells */
    x[0] += cell % 3 - 1;
    x[1] += cell / 3 % 3 - 1;
    x[2] += cell / 9 - 1;
    return true;
}

/* The same for voxels at a face, where neighbours are missing. */
static bool step_up(const struct volume *l, size_t x[3])
{
    size_t best[3] = {x[0], x[1], x[2]}, at[3];
    float most = l->density[volume_index(l->n, x[0], x[1], x[2])];
    size_t from[3], to[3];
    for (int a = 0; a < 3; a++) {
        from[a] = x[a] > 0 ? x[a] - 1 : 0;
        to[a] = x[a] + 1 < l->n[a] ? x[a] + 1 : x[a];
    }
    for (at[2] = from[2]; at[2] <= to[2]; at[2]++)
        for (at[1] = from[1]; at[1] <= to[1]; at[1]++)
            for (at[0] = from[0]; at[0] <= to[0]; at[0]++) {
                float value = l->density[volume_index(l->n, at[0], at[1], at[2])];
                if (value > most) {
                    most = value;
                    memcpy(best, at, sizeof best);
                }
            }
    bool moved = memcmp(x, best, sizeof best) != 0;
    memcpy(x, best, sizeof best);
    return moved;
}

static void climb(const struct orientation_job *o, size_t x[3])
{
    const size_t *n = o->v->n;
    for (int step = 0; step < o->n_climb; step++) {
        bool inside = true;
        for (int a = 0; a < 3; a++) inside = inside && x[a] > 0 && x[a] + 1 < n[a];
        if (!(inside ? step_up_inside(o, x) : step_up(&o->blurred, x))) return;
    }
}

/* Packs an offset of at most n_climb along each axis into 16 bits. */
static uint16_t pack_offset(const struct orientation_job *o, const size_t from[3], const size_t to[3])
{
    size_t code = 0, edge = 2 * (size_t)o->n_climb + 1;
    for (int a = 2; a >= 0; a--) code = code * edge + (to[a] + (size_t)o->n_climb - from[a]);
    return (uint16_t)code;
}

static size_t ridge_index(const struct orientation_job *o, size_t at)
{
    size_t code = o->ridge[at], climb = (size_t)o->n_climb, edge = 2 * climb + 1;
    const size_t *n = o->v->n;
    size_t dx = code % edge, dy = code / edge % edge, dz = code / (edge * edge);
    return at + dx + dy * n[0] + dz * n[0] * n[1] - climb * (1 + n[0] + n[0] * n[1]);
}

static uint16_t get_j(const struct orientation_job *o, size_t at)
{
    return atomic_load_explicit(&o->j_ridge[at], memory_order_relaxed);
}

static void set_j(struct orientation_job *o, size_t at, double share)
{
    double units = fmin(fmax(1.0, share / J_UNIT), 65535.0);
    atomic_store_explicit(&o->j_ridge[at], (uint16_t)units, memory_order_relaxed);
}

static void climb_band(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    struct orientation_job *o = context;
    const size_t *n = o->v->n;
    const struct band b = band_of(o, i_task);
    scratch_keep_within(o->v->space);
    for (size_t j = b.j0; j < b.j1; j++) {
        if (j < o->climb_begin || j >= o->climb_end) continue;
        for (size_t i = 0; i < n[0]; i++) {
            size_t at = volume_index(n, i, j, b.k), x[3] = {i, j, b.k};
            if (o->v->density[at] < o->eps_d) continue;
            if (!line_bound_reaches(&o->bound, i, j, b.k)) continue;
            const size_t from[3] = {i, j, b.k};
            climb(o, x);
            o->ridge[at] = pack_offset(o, from, x);
            set_j(o, volume_index(n, x[0], x[1], x[2]), 0.0);
        }
    }
}

/* Descends at ridge voxel x from the node nearest to `start`. Writes the direction to d, and returns J as a share of
 * J in solid material. */
static double descend_at(const struct orientation_job *o, const size_t x[3], const float start[3], float *scratch,
                         float d[3])
{
    const struct line_descent descent = {&o->fine, o->filter};
    struct line_filter_site site = line_filter_at(o->filter, &o->blurred, x[0], x[1], x[2], scratch);
    return (double)line_descend(&descent, &site, (uint16_t)direction_set_nearest(&o->fine, start), d) / o->j_full;
}

typedef void (*ridge_visitor)(struct orientation_job *o, const size_t x[3], size_t at, float *scratch);

/* Visits all ridge voxels of a band. scratch belongs to the thread. */
static void visit_ridges(struct orientation_job *o, size_t i_task, size_t i_thread, ridge_visitor visit)
{
    const struct band b = band_of(o, i_task);
    float *scratch = o->scratch + i_thread * o->scratch_per_thread;
    scratch_keep_within(o->v->space);
    for (size_t j = b.j0; j < b.j1; j++)
        for (size_t i = 0; i < o->v->n[0]; i++) {
            size_t at = volume_index(o->v->n, i, j, b.k);
            if (get_j(o, at) != 0) visit(o, (const size_t[3]){i, j, b.k}, at, scratch);
        }
}

static void find_direction(struct orientation_job *o, const size_t x[3], size_t at, float *scratch)
{
    float d[3], start[3];
    structure_tensor_direction(&o->blurred, &o->window, x[0], x[1], x[2], start);
    set_j(o, at, descend_at(o, x, start, scratch, d));
    direction_volume_set(o->d, at, d);
}

static void ridge_band(void *context, size_t i_task, size_t i_thread)
{
    visit_ridges(context, i_task, i_thread, find_direction);
}

/* Collects one layer of cells of the consensus. */
static void collect_layer(void *context, size_t layer, size_t i_thread)
{
    (void)i_thread;
    struct orientation_job *o = context;
    const size_t *n = o->v->n;
    scratch_keep_within(o->v->space);
    for (size_t k = layer * o->consensus.cell; k < (layer + 1) * o->consensus.cell && k < n[2]; k++)
        for (size_t j = 0; j < n[1]; j++)
            for (size_t i = 0; i < n[0]; i++) {
                size_t at = volume_index(n, i, j, k);
                uint16_t units = get_j(o, at);
                if (units == 0) continue;
                float d[3], share = (float)(units * J_UNIT);
                direction_volume_get(o->d, at, d);
                consensus_add(&o->consensus, i, j, k, d, share * share);
            }
}

/* Changes to the direction of the neighbourhood if J has a minimum near it that is almost as low. */
static void take_consensus(struct orientation_job *o, const size_t x[3], size_t at, float *scratch)
{
    float own[3], common[3], d[3];
    if (!consensus_direction(&o->consensus, x[0], x[1], x[2], common)) return;
    direction_volume_get(o->d, at, own);
    if (fabsf(own[0] * common[0] + own[1] * common[1] + own[2] * common[2]) > AGREEMENT_COSINE) return;
    double share = descend_at(o, x, common, scratch, d);
    if (share < (1.0 - J_TOLERANCE) * get_j(o, at) * J_UNIT) return;
    set_j(o, at, share);
    direction_volume_set(o->d, at, d);
}

static void consensus_band(void *context, size_t i_task, size_t i_thread)
{
    visit_ridges(context, i_task, i_thread, take_consensus);
}

static status apply_consensus(struct orientation_job *o, struct thread_pool *pool, const struct progress *progress,
                              struct error *err)
{
    status s = thread_pool_run(pool, o->consensus.n[2], collect_layer, o, NULL);
    if (s == STATUS_OK) s = consensus_blur(&o->consensus, N_CONSENSUS_BLUR, pool, err);
    if (s == STATUS_OK) s = thread_pool_run(pool, n_band(o) * o->v->n[2], consensus_band, o, progress);
    return s;
}

static void assign_slice(void *context, size_t k, size_t i_thread)
{
    (void)i_thread;
    struct orientation_job *o = context;
    const size_t n = o->v->n[0] * o->v->n[1], end = k * n + o->end * o->v->n[0];
    scratch_keep_within(o->v->space);
    for (size_t at = k * n + o->begin * o->v->n[0]; at < end; at++) { /* densities are 0 at first */
        float density = o->v->density[at];
        if (density < o->eps_d || !line_bound_reaches(&o->bound, at % o->v->n[0], at % n / o->v->n[0], k)) continue;
        size_t top = ridge_index(o, at);
        if (get_j(o, top) * J_UNIT * o->j_full > (double)o->eps_j) continue;
        long byte = lrintf(255.0f * density);
        o->d->density[at] = (uint8_t)(byte < 1 ? 1 : byte > 255 ? 255 : byte);
        if (get_j(o, at) == 0)
            memcpy(o->d->octahedral + 2 * at, o->d->octahedral + 2 * top, 2 * sizeof *o->d->octahedral);
    }
}

static int climb_of(double diameter_voxel) { return (int)fmin(ceil(0.5 * diameter_voxel), MAX_CLIMB); }
static size_t cell_of(double diameter_voxel) { return (size_t)fmax(2.0, 0.5 * diameter_voxel + 0.5); }
/* Rows beyond a voxel whose cells have a part in its consensus. */
static size_t consensus_reach(double diameter_voxel) { return (N_CONSENSUS_BLUR + 1) * cell_of(diameter_voxel); }

static size_t common_multiple(size_t a, size_t b)
{
    size_t m = a;
    while (m % b != 0) m += a;
    return m;
}

size_t filter_rows_alignment(double diameter_voxel)
{
    return common_multiple(cell_of(diameter_voxel), LINE_BOUND_CELL);
}

size_t filter_rows_halo(const struct reconstruct_option *option, double diameter_voxel)
{
    struct tensor_window window;
    tensor_window_init(&window, TENSOR_DIAMETERS * diameter_voxel);
    const size_t climb = (size_t)climb_of(diameter_voxel), line = option->h / 2 + 3;
    const size_t bound = climb + option->h / 2 + 2 + 2 * LINE_BOUND_CELL, tensor = (size_t)window.reach + 2;
    const size_t looks = bound > tensor ? bound : tensor > line ? tensor : line;
    return 3 * climb + consensus_reach(diameter_voxel) + looks + line_filter_blur_reach(option->s, option->t);
}

static status prepare(struct orientation_job *o, const struct reconstruct_option *option, double diameter_voxel,
                      size_t n_thread, struct error *err)
{
    const size_t *n = o->v->n;
    size_t n_voxel = volume_n_voxel(n);
    void *array = NULL;
    status s = direction_set_init(&o->fine, N_FINE, err);
    if (s == STATUS_OK) s = line_filter_new(&o->fine, option->h, n, &o->filter, err);
    if (s != STATUS_OK) return s;
    s = consensus_init(&o->consensus, n, cell_of(diameter_voxel), o->v->space, err);
    if (s == STATUS_OK) s = scratch_new(o->v->space, n_voxel * sizeof *o->ridge, "the ridges of fibers", &array, err);
    o->ridge = array;
    array = NULL;
    if (s == STATUS_OK) s = scratch_new(o->v->space, n_voxel * sizeof *o->j_ridge, "the ridges of fibers", &array, err);
    o->j_ridge = array;
    if (s != STATUS_OK) return s;
    o->scratch_per_thread = line_filter_scratch(o->filter);
    o->scratch = calloc(n_thread, o->scratch_per_thread * sizeof *o->scratch);
    if (o->scratch == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot filter directions: out of memory");
    o->eps_d = (float)option->eps_d;
    o->eps_j = (float)option->eps_j;
    o->j_full = filter_solid_j(option->s, option->t, option->h);
    tensor_window_init(&o->window, TENSOR_DIAMETERS * diameter_voxel);
    o->n_climb = climb_of(diameter_voxel);
    const size_t reach = 2 * (size_t)o->n_climb + consensus_reach(diameter_voxel);
    o->climb_begin = o->begin > reach ? o->begin - reach : 0;
    o->climb_end = o->end + reach;
    for (ptrdiff_t c = 0, m = 0; c < 27; c++)
        if (c != 13)
            o->neighbour[m++] = c % 3 - 1 + (c / 3 % 3 - 1) * (ptrdiff_t)n[0] + (c / 9 - 1) * (ptrdiff_t)(n[0] * n[1]);
    return STATUS_OK;
}

static void release(struct orientation_job *o)
{
    volume_release(&o->blurred);
    direction_set_release(&o->fine);
    line_filter_free(o->filter);
    line_bound_release(&o->bound);
    consensus_release(&o->consensus);
    scratch_release(o->v->space, o->ridge);
    scratch_release(o->v->space, (void *)o->j_ridge);
    free(o->scratch);
}

/* Runs all passes over the volume. Their progress continues where the progress of the blur ends. */
static status search(struct orientation_job *o, struct thread_pool *pool, const struct progress *inner,
                     struct progress_part *part, struct error *err)
{
    size_t n_slice = o->v->n[2];
    *part = (struct progress_part){part->outer, 0.2, 0.2};
    status s = thread_pool_run(pool, n_band(o) * n_slice, climb_band, o, inner);
    *part = (struct progress_part){part->outer, 0.4, 0.5};
    if (s == STATUS_OK) s = thread_pool_run(pool, n_band(o) * n_slice, ridge_band, o, inner);
    *part = (struct progress_part){part->outer, 0.9, 0.1};
    if (s == STATUS_OK) s = apply_consensus(o, pool, inner, err);
    if (s == STATUS_OK) s = thread_pool_run(pool, n_slice, assign_slice, o, NULL);
    return s == STATUS_CANCELLED ? error_set(err, s, "finding fiber directions was cancelled") : s;
}

status filter_rows(const struct volume *v, const size_t row[2], double diameter_voxel,
                   const struct reconstruct_option *option, struct thread_pool *pool, const struct progress *progress,
                   struct direction_volume *d, struct error *err)
{
    struct orientation_job o = {.v = v, .d = d, .begin = row[0], .end = row[1]};
    struct progress_part part = {progress, 0.0, 0.2};
    const struct progress inner = progress_of_part(&part);
    *d = (struct direction_volume){0};
    status s = prepare(&o, option, diameter_voxel, thread_pool_n_thread(pool), err);
    if (s == STATUS_OK) s = direction_volume_init_in(d, v->n, v->voxel_size_m, v->space, err);
    if (s == STATUS_OK) s = line_filter_blur(v, option->s, option->t, pool, &inner, &o.blurred, err);
    if (s == STATUS_OK) /* the climb, half a line, and the taps of its interpolation */
        s = line_bound_init(&o.bound, &o.blurred, (size_t)o.n_climb + option->h / 2 + 2,
                            -option->eps_j / (double)option->h, pool, err);
    if (s == STATUS_OK) s = search(&o, pool, &inner, &part, err);
    release(&o);
    if (s != STATUS_OK) direction_volume_release(d);
    return s;
}
