/* The direction of the fiber through every voxel of material.
 *
 * J(x, d) is sharp only on the axis of a fiber: off the axis a line that leans across the fiber stays inside it for
 * longer. So every voxel first climbs to its ridge, the densest place of the blurred volume within about one radius.
 * J is minimised there, and the voxel gets the direction and J of its ridge. The descent starts from the structure
 * tensor, which in dense bundles is not misled by rows of touching fibers as J is. It ends on the paraboloid through
 * J at the best node of a fine set of directions and at the node's neighbours. Where the neighbourhood has another
 * direction whose J is almost as low, that direction is used. The result does not depend on how the work is divided.
 *
 * The blurred volume exists in a window of slices alone, which each pass moves through the volume anew. That costs a
 * twentieth of the time, and saves four bytes of eleven for each voxel. */
#include "geometry/filter/filter_rows.h"
#include "geometry/filter/filter_choice.h"

#include "geometry/filter/consensus.h"
#include "geometry/filter/line_blur.h"
#include "geometry/filter/line_bound.h"
#include "geometry/filter/line_descent.h"
#include "geometry/filter/line_filter.h"
#include "geometry/filter/ridge_assign.h"
#include "geometry/orientation/structure_tensor.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_FINE = 900, N_CONSENSUS_BLUR = 3, MAX_CLIMB = 19 };

/* difference of two minima of J up to which noise and touching fibers may decide between them */
#define J_TOLERANCE 0.07
#define AGREEMENT_COSINE 0.94f
#define TENSOR_DIAMETERS 0.28 /* standard deviation of the structure tensor's window */

struct orientation_job {
    const struct volume *v;
    struct line_blur *blur;
    struct volume blurred; /* the window of `blur` */
    size_t first, slab;    /* slice of task 0; slices that a pass looks at before the window moves on */
    struct direction_set fine;
    struct line_filter *filter;
    struct tensor_window window;
    float eps_d, eps_j;
    double j_full;                             /* J in solid material */
    int n_climb;                               /* most steps to the ridge */
    size_t look;                               /* slices beyond a ridge that its direction depends on */
    size_t begin, end, climb_begin, climb_end; /* rows that are wanted, and those that have an effect on them */
    struct line_bound bound;
    struct ridge_map ridges; /* with J as a share of j_full */
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
    return (struct band){j0, j0 + BAND < o->v->n[1] ? j0 + BAND : o->v->n[1], o->first + i_task / n_band(o)};
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
            ridge_map_mark(&o->ridges, from, x);
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
            if (ridge_map_is_ridge(&o->ridges, at)) visit(o, (const size_t[3]){i, j, b.k}, at, scratch);
        }
}

static void find_direction(struct orientation_job *o, const size_t x[3], size_t at, float *scratch)
{
    float d[3], start[3];
    structure_tensor_direction(&o->blurred, &o->window, x[0], x[1], x[2], start);
    ridge_map_set_share(&o->ridges, at, descend_at(o, x, start, scratch, d));
    direction_volume_set(&o->ridges.direction, ridge_map_place(&o->ridges, at), d);
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
                if (!ridge_map_is_ridge(&o->ridges, at)) continue;
                float d[3], share = (float)ridge_map_share(&o->ridges, at);
                direction_volume_get(&o->ridges.direction, ridge_map_place(&o->ridges, at), d);
                consensus_add(&o->consensus, i, j, k, d, share * share);
            }
}

/* Changes to the direction of the neighbourhood if J has a minimum near it that is almost as low. */
static void take_consensus(struct orientation_job *o, const size_t x[3], size_t at, float *scratch)
{
    float own[3], common[3], d[3];
    if (!consensus_direction(&o->consensus, x[0], x[1], x[2], common)) return;
    direction_volume_get(&o->ridges.direction, ridge_map_place(&o->ridges, at), own);
    if (fabsf(own[0] * common[0] + own[1] * common[1] + own[2] * common[2]) > AGREEMENT_COSINE) return;
    double share = descend_at(o, x, common, scratch, d);
    if (share < (1.0 - J_TOLERANCE) * ridge_map_share(&o->ridges, at)) return;
    ridge_map_set_share(&o->ridges, at, share);
    direction_volume_set(&o->ridges.direction, ridge_map_place(&o->ridges, at), d);
}

static void consensus_band(void *context, size_t i_task, size_t i_thread)
{
    visit_ridges(context, i_task, i_thread, take_consensus);
}

/* Runs a pass over all slices. reach: slices of the blurred volume that it looks at beyond a voxel. */
static status run_pass(struct orientation_job *o, task_function task, size_t reach, struct thread_pool *pool,
                       const struct progress *progress)
{
    const size_t n = o->v->n[2];
    const struct progress quiet = progress_silent(progress);
    status s = STATUS_OK;
    for (o->first = 0; o->first < n && s == STATUS_OK; o->first += o->slab) {
        const size_t end = o->first + o->slab < n ? o->first + o->slab : n;
        s = line_blur_move(o->blur, o->first > reach ? o->first - reach : 0, end + reach < n ? end + reach : n, pool,
                           &quiet);
        o->blurred = line_blur_volume(o->blur);
        if (s == STATUS_OK) s = thread_pool_run(pool, n_band(o) * (end - o->first), task, o, &quiet);
        progress_report(progress, (double)end / (double)n);
    }
    return s;
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
                      struct thread_pool *pool, struct error *err)
{
    const size_t *n = o->v->n, n_thread = thread_pool_n_thread(pool);
    status s = direction_set_init(&o->fine, N_FINE, err);
    if (s == STATUS_OK) s = line_filter_new(&o->fine, option->h, n, &o->filter, err);
    if (s != STATUS_OK) return s;
    o->scratch_per_thread = line_filter_scratch(o->filter);
    o->scratch = calloc(n_thread, o->scratch_per_thread * sizeof *o->scratch);
    if (o->scratch == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot filter directions: out of memory");
    o->eps_d = (float)option->eps_d;
    o->eps_j = (float)option->eps_j;
    o->j_full = filter_solid_j(option->s, option->t, option->h);
    tensor_window_init(&o->window, TENSOR_DIAMETERS * diameter_voxel);
    o->n_climb = climb_of(diameter_voxel);
    o->look = (size_t)o->window.reach + 2 > option->h / 2 + 3 ? (size_t)o->window.reach + 2 : option->h / 2 + 3;
    const size_t reach = 2 * (size_t)o->n_climb + consensus_reach(diameter_voxel);
    o->climb_begin = o->begin > reach ? o->begin - reach : 0;
    o->climb_end = o->end + reach;
    for (ptrdiff_t c = 0, m = 0; c < 27; c++)
        if (c != 13)
            o->neighbour[m++] = c % 3 - 1 + (c / 3 % 3 - 1) * (ptrdiff_t)n[0] + (c / 9 - 1) * (ptrdiff_t)(n[0] * n[1]);
    return ridge_map_init(&o->ridges, o->v, o->eps_d, (size_t)o->n_climb, pool, err);
}

static void release(struct orientation_job *o)
{
    line_blur_free(o->blur);
    direction_set_release(&o->fine);
    line_filter_free(o->filter);
    line_bound_release(&o->bound);
    consensus_release(&o->consensus);
    ridge_map_release(&o->ridges);
    free(o->scratch);
}

/* Gives ridges the direction of their neighbourhood where it is almost as good. */
static status apply_consensus(struct orientation_job *o, double diameter_voxel, struct thread_pool *pool,
                              const struct progress *progress, struct error *err)
{
    status s = consensus_init(&o->consensus, o->v->n, cell_of(diameter_voxel), o->v->space, err);
    if (s == STATUS_OK) s = thread_pool_run(pool, o->consensus.n[2], collect_layer, o, NULL);
    if (s == STATUS_OK) s = consensus_blur(&o->consensus, N_CONSENSUS_BLUR, pool, err);
    if (s == STATUS_OK) s = run_pass(o, consensus_band, o->look, pool, progress);
    consensus_release(&o->consensus);
    return s;
}

/* Runs all passes over the volume. */
static status search(struct orientation_job *o, double diameter_voxel, struct thread_pool *pool,
                     const struct progress *progress, struct error *err)
{
    struct progress_part part = {progress, 0.1, 0.3};
    const struct progress inner = progress_of_part(&part);
    status s = run_pass(o, climb_band, (size_t)o->n_climb, pool, &inner);
    if (s == STATUS_OK) s = ridge_map_list(&o->ridges, err);
    part = (struct progress_part){progress, 0.4, 0.5};
    if (s == STATUS_OK) s = run_pass(o, ridge_band, o->look, pool, &inner);
    part = (struct progress_part){progress, 0.9, 0.1};
    if (s == STATUS_OK) s = apply_consensus(o, diameter_voxel, pool, &inner, err);
    line_blur_free(o->blur); /* before the directions take memory */
    o->blur = NULL;
    return s;
}

status filter_rows(const struct volume *v, const size_t *row, double diameter_voxel,
                   const struct reconstruct_option *option, struct thread_pool *pool, const struct progress *progress,
                   struct direction_volume *d, struct error *err)
{
    struct orientation_job o = {.v = v, .end = v->n[1], .slab = line_blur_slab(pool)};
    *d = (struct direction_volume){0};
    if (row != NULL) o.begin = row[0];
    if (row != NULL) o.end = row[1];
    status s = prepare(&o, option, diameter_voxel, pool, err);
    const size_t most = o.look > (size_t)o.n_climb ? o.look : (size_t)o.n_climb;
    if (s == STATUS_OK) s = line_blur_new(v, option->s, option->t, o.slab + 2 * most, pool, &o.blur, err);
    if (s == STATUS_OK) /* the climb, half a line, and the taps of its interpolation */
        s = line_bound_init(&o.bound, o.blur, (size_t)o.n_climb + option->h / 2 + 2, -option->eps_j / (double)option->h,
                            pool, err);
    if (s == STATUS_OK) s = search(&o, diameter_voxel, pool, progress, err);
    const struct ridge_assign rule = {v, &o.bound, &o.ridges, o.j_full, o.eps_d, o.eps_j, o.begin, o.end};
    if (s == STATUS_OK) s = ridge_assign_all(&rule, row == NULL, pool, d, err);
    if (s == STATUS_CANCELLED) error_set(err, s, "finding fiber directions was cancelled");
    release(&o);
    if (s != STATUS_OK) direction_volume_release(d);
    return s;
}
