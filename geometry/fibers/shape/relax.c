#include "geometry/fibers/shape/relax.h"

#include "geometry/fibers/lines/segment_bricks.h"
#include "geometry/fibers/shape/smoothing.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { BRICK = 32 };
static const float FLOOR = 0.15f;   /* densities up to this count as void */
static const float MAX_MOVE = 0.7f; /* voxels per round */

/* Sums over the voxels of one brick for one vertex. */
struct pull {
    uint32_t vertex;
    float weight, offset[3];
};

struct brick_pulls {
    struct pull *pull; /* two for each segment of the brick */
    size_t n;
    bool failed;
};

struct relax_job {
    const struct volume *v;
    const struct segment_bricks *bricks;
    const uint32_t *first_vertex_of; /* index of the first vertex of each segment */
    float *distance2;                /* one per thread */
    uint32_t *nearest, *slot;
    struct brick_pulls *result; /* one per brick */
};

static void pull_voxel(const struct relax_job *job, struct brick_pulls *r, uint32_t slot, uint32_t segment,
                       const float x[3], float weight)
{
    const struct segment *g = &job->bricks->segment[segment];
    float u[3], p[3], length2 = 0.0f, along = 0.0f;
    for (int a = 0; a < 3; a++) {
        u[a] = g->b[a] - g->a[a];
        p[a] = x[a] - g->a[a];
        length2 += u[a] * u[a];
        along += u[a] * p[a];
    }
    if (!(length2 > 0.0f)) return;
    float t = along / length2;
    if (t < -0.5f || t > 1.5f) return; /* beyond the end of a line */
    /* near a face only voxels whose mirror image is in the volume count, or the mean would be biased */
    for (int a = 0; a < 3; a++) {
        float mirror = 2.0f * (g->a[a] + t * u[a]) - x[a];
        if (mirror < 0.0f || mirror > (float)job->v->n[a]) return;
    }
    float inside = t < 0.0f ? 0.0f : t > 1.0f ? 1.0f : t;
    for (int e = 0; e < 2; e++) {
        struct pull *q = &r->pull[2 * slot + (size_t)e];
        float w = weight * (e == 0 ? 1.0f - inside : inside);
        q->weight += w;
        for (int a = 0; a < 3; a++) q->offset[a] += w * (p[a] - t * u[a]);
    }
}

static void relax_brick(void *context, size_t i_brick, size_t i_thread)
{
    struct relax_job *job = context;
    const struct segment_bricks *b = job->bricks;
    size_t n_segment = b->first[i_brick + 1] - b->first[i_brick];
    if (n_segment == 0) return;
    scratch_keep_within(job->v->space);
    float *distance2 = job->distance2 + i_thread * BRICK * BRICK * BRICK;
    uint32_t *nearest = job->nearest + i_thread * BRICK * BRICK * BRICK, *slot = job->slot + i_thread * b->n_segment;
    struct brick_pulls *r = &job->result[i_brick];
    r->pull = calloc(2 * n_segment, sizeof *r->pull);
    r->failed = r->pull == NULL;
    if (r->failed) return;
    r->n = 2 * n_segment;
    for (size_t e = 0; e < n_segment; e++) {
        uint32_t segment = b->index[b->first[i_brick] + e];
        slot[segment] = (uint32_t)e;
        r->pull[2 * e].vertex = job->first_vertex_of[segment];
        r->pull[2 * e + 1].vertex = job->first_vertex_of[segment] + 1;
    }
    struct point_lattice l = segment_brick_lattice(b, i_brick, 1);
    size_t from[3], n[3], p = 0;
    segment_brick_box(b, i_brick, from, n);
    segment_distances(b, i_brick, &l, distance2, nearest);
    for (size_t k = 0; k < n[2]; k++)
        for (size_t j = 0; j < n[1]; j++)
            for (size_t i = 0; i < n[0]; i++, p++) {
                if (nearest[p] == UINT32_MAX) continue;
                float w = job->v->density[volume_index(job->v->n, from[0] + i, from[1] + j, from[2] + k)] - FLOOR;
                if (w <= 0.0f) continue;
                const float x[3] = {(float)(from[0] + i) + 0.5f, (float)(from[1] + j) + 0.5f,
                                    (float)(from[2] + k) + 0.5f};
                pull_voxel(job, r, slot[nearest[p]], nearest[p], x, w);
            }
}

/* Adds the bricks in order, then takes a running mean over five vertices along each line. */
static void apply_pulls(const struct relax_job *job, size_t n_brick, struct polyline_set *lines, float (*sum)[4])
{
    memset(sum, 0, lines->n_vertex * sizeof *sum);
    for (size_t b = 0; b < n_brick; b++)
        for (size_t i = 0; i < job->result[b].n; i++) {
            const struct pull *q = &job->result[b].pull[i];
            for (int a = 0; a < 3; a++) sum[q->vertex][a] += q->offset[a];
            sum[q->vertex][3] += q->weight;
        }
    for (size_t l = 0; l < lines->n_line; l++)
        for (size_t i = lines->first[l]; i < lines->first[l + 1]; i++) {
            float total[4] = {0.0f, 0.0f, 0.0f, 0.0f};
            size_t from = i >= lines->first[l] + 2 ? i - 2 : lines->first[l];
            size_t to = i + 2 < lines->first[l + 1] ? i + 2 : lines->first[l + 1] - 1;
            for (size_t k = from; k <= to; k++)
                for (int a = 0; a < 4; a++) total[a] += sum[k][a];
            if (!(total[3] > 0.0f)) continue;
            for (int a = 0; a < 3; a++) lines->vertex[i][a] += fminf(MAX_MOVE, fmaxf(-MAX_MOVE, total[a] / total[3]));
        }
}

static status one_round(struct relax_job *job, struct polyline_set *lines, float reach, struct thread_pool *pool,
                        const struct progress *progress, float (*sum)[4], struct error *err)
{
    struct segment_bricks bricks = {0};
    status s = segment_bricks_init(&bricks, lines, job->v->n, BRICK, reach, err);
    if (s != STATUS_OK) return s;
    size_t n_brick = segment_n_brick(&bricks);
    job->bricks = &bricks;
    job->result = calloc(n_brick, sizeof *job->result);
    if (job->result == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot center fibers: out of memory");
    if (s == STATUS_OK) {
        s = thread_pool_run(pool, n_brick, relax_brick, job, progress);
        if (s != STATUS_OK) error_set(err, s, "centering fibers was cancelled");
        for (size_t b = 0; b < n_brick && s == STATUS_OK; b++)
            if (job->result[b].failed) s = error_set(err, STATUS_NO_MEMORY, "cannot center fibers: out of memory");
    }
    if (s == STATUS_OK) apply_pulls(job, n_brick, lines, sum);
    for (size_t b = 0; job->result != NULL && b < n_brick; b++) free(job->result[b].pull);
    free(job->result);
    job->result = NULL;
    job->bricks = NULL;
    segment_bricks_release(&bricks);
    return s;
}

static size_t longest_line(const struct polyline_set *p)
{
    size_t longest = 0;
    for (size_t l = 0; l < p->n_line; l++)
        if (polyline_length(p, l) > longest) longest = polyline_length(p, l);
    return longest;
}

status polylines_relax(struct polyline_set *lines, const struct volume *v, float reach_voxel, int n_round,
                       double smooth_alpha, struct thread_pool *pool, const struct progress *progress,
                       struct error *err)
{
    size_t n_thread = thread_pool_n_thread(pool), n_segment = 0;
    struct relax_job job = {.v = v};
    uint32_t *first_vertex_of = malloc((lines->n_vertex + 1) * sizeof *first_vertex_of);
    float(*sum)[4] = malloc((lines->n_vertex + 1) * sizeof *sum);
    double *work = malloc(4 * (longest_line(lines) + 1) * sizeof *work);
    job.distance2 = malloc(n_thread * BRICK * BRICK * BRICK * sizeof *job.distance2);
    job.nearest = malloc(n_thread * BRICK * BRICK * BRICK * sizeof *job.nearest);
    job.slot = malloc(n_thread * (lines->n_vertex + 1) * sizeof *job.slot);
    status s = STATUS_OK;
    if (first_vertex_of == NULL || sum == NULL || work == NULL || job.distance2 == NULL || job.nearest == NULL ||
        job.slot == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot center fibers: out of memory");
        goto out;
    }
    for (size_t l = 0; l < lines->n_line; l++)
        for (size_t i = lines->first[l]; i + 1 < lines->first[l + 1]; i++) first_vertex_of[n_segment++] = (uint32_t)i;
    job.first_vertex_of = first_vertex_of;
    for (int round = 0; round < n_round && s == STATUS_OK; round++) {
        s = one_round(&job, lines, reach_voxel, pool, progress, sum, err);
        for (size_t l = 0; l < lines->n_line && s == STATUS_OK; l++)
            polyline_smooth(lines->vertex + lines->first[l], polyline_length(lines, l), smooth_alpha, work);
    }
out:
    free(first_vertex_of);
    free(sum);
    free(work);
    free(job.distance2);
    free(job.nearest);
    free(job.slot);
    return s;
}
