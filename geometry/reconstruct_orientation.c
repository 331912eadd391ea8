/* Step "orientation": the direction of the fiber through every voxel of material.
 *
 * For each block of 2 x 2 x 2 voxels the densest voxel is tried against a coarse set of directions over the half
 * sphere; every voxel then walks downhill on a fine set from its block's answer and ends on the paraboloid through J at
 * the best node and its neighbours. This finds the minimum over all directions without a structure tensor, which mixes
 * the two directions where yarns cross. Both passes depend on the densities alone, not on how work is divided. */
#include "geometry/reconstruct.h"

#include "geometry/orientation/fiber_diameter.h"
#include "geometry/orientation/line_filter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_FINE = 900, NO_SEED = UINT16_MAX, J_BINS = 512, MAX_STEP = 24 };

struct orientation_job {
    const struct volume *v;
    struct direction_volume *d;
    struct direction_set fine, coarse;
    uint16_t *coarse_node; /* node of the fine set nearest to each coarse direction */
    struct line_filter *filter;
    float eps_d, eps_j;
    double j_full;         /* J in solid material */
    size_t n_block[3];
    uint16_t *seed;        /* per block: node of the fine set */
    size_t (*j_histogram)[J_BINS]; /* per thread; of J / j_full of the seeds */
    float *scratch;        /* per thread */
    size_t scratch_per_thread;
    size_t *n_material, *n_kept; /* per slab */
};

static bool densest_of_block(const struct orientation_job *o, size_t bi, size_t bj, size_t bk, size_t at[3])
{
    float most = o->eps_d;
    bool found = false;
    const size_t *n = o->v->n;
    for (size_t k = 2 * bk; k < 2 * bk + 2 && k < n[2]; k++)
        for (size_t j = 2 * bj; j < 2 * bj + 2 && j < n[1]; j++)
            for (size_t i = 2 * bi; i < 2 * bi + 2 && i < n[0]; i++)
                if (o->v->density[volume_index(n, i, j, k)] >= most) {
                    most = o->v->density[volume_index(n, i, j, k)];
                    at[0] = i, at[1] = j, at[2] = k;
                    found = true;
                }
    return found;
}

static void seed_slab(void *context, size_t bk, size_t i_thread)
{
    struct orientation_job *o = context;
    float *scratch = o->scratch + i_thread * o->scratch_per_thread;
    uint16_t *seed = o->seed + bk * o->n_block[0] * o->n_block[1];
    for (size_t bj = 0; bj < o->n_block[1]; bj++)
        for (size_t bi = 0; bi < o->n_block[0]; bi++, seed++) {
            size_t at[3];
            *seed = NO_SEED;
            if (!densest_of_block(o, bi, bj, bk, at)) continue;
            struct line_filter_site site = line_filter_at(o->filter, o->v, at[0], at[1], at[2], scratch);
            float least = INFINITY;
            for (size_t c = 0; c < o->coarse.n; c++) {
                float j = line_filter_j(o->filter, &site, o->coarse_node[c]);
                if (j < least) {
                    least = j;
                    *seed = o->coarse_node[c];
                }
            }
            double share = (double)least / o->j_full * J_BINS;
            o->j_histogram[i_thread][share < 0.0 ? 0 : share >= J_BINS ? J_BINS - 1 : (size_t)share]++;
        }
}

/* Values of J already known at a voxel. */
struct memory {
    size_t n;
    uint16_t node[MAX_STEP * DIRECTION_NEIGHBOURS + 1];
    float value[MAX_STEP * DIRECTION_NEIGHBOURS + 1];
};

static float recall_j(const struct orientation_job *o, const struct line_filter_site *site, struct memory *m,
                      uint16_t node)
{
    for (size_t i = m->n; i-- > 0;)
        if (m->node[i] == node) return m->value[i];
    float j = line_filter_j(o->filter, site, node);
    m->node[m->n] = node;
    m->value[m->n++] = j;
    return j;
}

/* Downhill from seed; the direction in d, J at the best node returned. */
static float descend(const struct orientation_job *o, const struct line_filter_site *site, uint16_t seed, float d[3])
{
    struct memory m = {.n = 0};
    uint16_t here = seed;
    float value = recall_j(o, site, &m, here), around[DIRECTION_NEIGHBOURS];
    for (int step = 0; step < MAX_STEP; step++) {
        const struct direction_node *node = &o->fine.node[here];
        uint16_t best = here;
        float least = value;
        for (int k = 0; k < DIRECTION_NEIGHBOURS; k++) {
            around[k] = recall_j(o, site, &m, node->neighbour[k]);
            if (around[k] < least) {
                least = around[k];
                best = node->neighbour[k];
            }
        }
        if (best == here || step == MAX_STEP - 1) break;
        here = best;
        value = least;
    }
    direction_set_refine(&o->fine, here, value, around, d);
    return value;
}

static void refine_slab(void *context, size_t k, size_t i_thread)
{
    struct orientation_job *o = context;
    const size_t *n = o->v->n;
    float *scratch = o->scratch + i_thread * o->scratch_per_thread;
    size_t material = 0, kept = 0;
    for (size_t j = 0; j < n[1]; j++)
        for (size_t i = 0; i < n[0]; i++) {
            size_t at = volume_index(n, i, j, k);
            float density = o->v->density[at];
            o->d->density[at] = 0;
            if (density < o->eps_d) continue;
            material++;
            uint16_t seed = o->seed[(k / 2 * o->n_block[1] + j / 2) * o->n_block[0] + i / 2];
            struct line_filter_site site = line_filter_at(o->filter, o->v, i, j, k, scratch);
            float d[3], least = descend(o, &site, seed, d);
            if (least > o->eps_j) continue;
            kept++;
            long byte = lrintf(255.0f * density);
            o->d->density[at] = (uint8_t)(byte < 1 ? 1 : byte > 255 ? 255 : byte);
            direction_volume_set(o->d, at, d);
        }
    o->n_material[k] = material;
    o->n_kept[k] = kept;
}

/* Filter parameters from the fiber diameter. Over the six fabrics of thesis Table 5.2 s times the squared radius in voxels is
 * between 0.7 and 11, about 4 in the (geometric) mean; t is twice s for most; h is about three radii, 11 at least. */
static void choose_parameters(struct reconstruct_option *o, double diameter_voxel)
{
    double radius = 0.5 * diameter_voxel;
    if (isnan(o->s)) o->s = fmin(2.0, 4.0 / (radius * radius));
    if (isnan(o->t)) o->t = 2.0 * o->s;
    if (o->h == 0) {
        size_t h = 2 * (size_t)lrint(1.6 * radius) + 1;
        o->h = h < 11 ? 11 : h > 31 ? 31 : h;
    }
    if (isnan(o->eps_d)) o->eps_d = 0.5; /* half way between the modes of void and material */
}

/* 30 % of the J that the upper fifth of the material reaches: fiber surfaces have about 45 %, noise in void near 0. */
static void choose_eps_j(struct orientation_job *o, struct reconstruct_option *option, size_t n_thread)
{
    if (isnan(option->eps_j)) {
        size_t total = 0, above = 0, bin = J_BINS;
        for (size_t t = 0; t < n_thread; t++)
            for (size_t b = 0; b < J_BINS; b++) total += o->j_histogram[t][b];
        while (bin > 0 && above * 5 <= total) {
            bin--;
            for (size_t t = 0; t < n_thread; t++) above += o->j_histogram[t][bin];
        }
        option->eps_j = 0.30 * o->j_full * ((double)bin + 0.5) / J_BINS;
    }
    o->eps_j = (float)option->eps_j;
}

static double solid_j(double s, double t, size_t h)
{
    return (-2.0 * M_PI / s + M_PI / t) * (double)h;
}

static status prepare(struct orientation_job *o, const struct reconstruct_option *option, double diameter_voxel,
                      size_t n_thread, struct error *err)
{
    const size_t *n = o->v->n;
    /* Half-width of the dip of J over angle is about radius / (h / 2); a coarse node must fall into it. */
    double dip = fmin(0.5, diameter_voxel / (double)option->h), n_coarse = 2.0 * M_PI / (0.7 * dip * dip);
    status s = direction_set_init(&o->fine, N_FINE, err);
    if (s == STATUS_OK) s = direction_set_init(&o->coarse, (size_t)fmin(fmax(n_coarse, 40.0), 300.0), err);
    if (s == STATUS_OK) s = line_filter_new(&o->fine, option->s, option->t, option->h, n, &o->filter, err);
    if (s != STATUS_OK) return s;
    for (int a = 0; a < 3; a++) o->n_block[a] = (n[a] + 1) / 2;
    o->scratch_per_thread = line_filter_scratch(o->filter);
    o->coarse_node = malloc(o->coarse.n * sizeof *o->coarse_node);
    o->seed = malloc(volume_n_voxel(o->n_block) * sizeof *o->seed);
    o->j_histogram = calloc(n_thread, sizeof *o->j_histogram);
    o->scratch = calloc(n_thread, o->scratch_per_thread * sizeof *o->scratch);
    o->n_material = calloc(n[2], sizeof *o->n_material);
    o->n_kept = calloc(n[2], sizeof *o->n_kept);
    if (o->coarse_node == NULL || o->seed == NULL || o->j_histogram == NULL || o->scratch == NULL || o->n_material == NULL ||
        o->n_kept == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot filter directions: out of memory");
    for (size_t c = 0; c < o->coarse.n; c++)
        o->coarse_node[c] = (uint16_t)direction_set_nearest(&o->fine, o->coarse.node[c].d);
    o->eps_d = (float)option->eps_d;
    o->j_full = solid_j(option->s, option->t, option->h);
    return STATUS_OK;
}

static void release(struct orientation_job *o)
{
    direction_set_release(&o->fine);
    direction_set_release(&o->coarse);
    line_filter_free(o->filter);
    free(o->coarse_node);
    free(o->seed);
    free(o->j_histogram);
    free(o->scratch);
    free(o->n_material);
    free(o->n_kept);
}

struct part_progress {
    const struct progress *outer;
    double from, share;
};

static void report_part(void *context, double fraction)
{
    const struct part_progress *p = context;
    progress_report(p->outer, p->from + p->share * fraction);
}

status reconstruct_orientation(const struct volume *v, struct reconstruct_option *option, struct thread_pool *pool,
                               const struct progress *progress, struct direction_volume *d,
                               struct reconstruct_report *report, struct error *err)
{
    struct orientation_job o = {.v = v, .d = d};
    struct part_progress part = {progress, 0.0, 0.1};
    struct progress inner = {report_part, &part, progress != NULL ? progress->cancel : NULL};
    *d = (struct direction_volume){0};
    status s = fiber_diameter_measure(v, pool, &inner, &report->fiber_diameter_voxel, err);
    if (s != STATUS_OK) return s;
    choose_parameters(option, report->fiber_diameter_voxel);
    s = prepare(&o, option, report->fiber_diameter_voxel, thread_pool_n_thread(pool), err);
    if (s == STATUS_OK) s = direction_volume_init(d, v->n, v->voxel_size_m, err);
    if (s != STATUS_OK) goto out;
    part = (struct part_progress){progress, 0.1, 0.3};
    s = thread_pool_run(pool, o.n_block[2], seed_slab, &o, &inner);
    if (s == STATUS_OK) {
        choose_eps_j(&o, option, thread_pool_n_thread(pool));
        part = (struct part_progress){progress, 0.4, 0.6};
        s = thread_pool_run(pool, v->n[2], refine_slab, &o, &inner);
    }
    if (s != STATUS_OK) {
        s = error_set(err, s, "finding fiber directions was cancelled");
        goto out;
    }
    report->n_material_voxel = report->n_kept_voxel = 0;
    for (size_t k = 0; k < v->n[2]; k++) {
        report->n_material_voxel += o.n_material[k];
        report->n_kept_voxel += o.n_kept[k];
    }
    if (report->n_kept_voxel == 0)
        s = error_set_field(err, STATUS_INVALID, "volume.eps_d",
                            "cannot find fibers: %zu voxels reach the density eps_d %g, none of them J <= eps_j %g",
                            report->n_material_voxel, option->eps_d, option->eps_j);
out:
    release(&o);
    if (s != STATUS_OK) direction_volume_release(d);
    return s;
}
