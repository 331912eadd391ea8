#include "geometry/fibers/shape/axes/axis_brick.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BRICK = AXIS_BRICK, LANES = 8 };
static const float OUTLIER = 0.6f; /* difference of densities beyond which a residual comes from another fiber */

void axis_scratch_init(struct axis_scratch *s)
{
    memset(s, 0, sizeof *s);
    for (size_t i = 0; i < AXIS_N_CELL; i++) s->own[i] = UINT32_MAX;
}

void axis_scratch_release(struct axis_scratch *s)
{
    free(s->claim);
    free(s->place);
}

/* A segment with what the rows of voxels near it share. */
struct stamp {
    float a[3], u[3], length2, inverse_length2, inverse_x; /* u: from its begin to its end */
    float margin, reach2, least_t, most_t;                 /* t beyond least and most lies beyond an end of the line */
    size_t lo[3], hi[3];                                   /* voxels of the brick in reach */
};

/* Returns false if the segment reaches no voxel of the brick. */
static bool stamp_init(struct stamp *w, const struct axis_model *m, uint32_t segment, const size_t from[3],
                       const size_t n[3])
{
    const struct segment *g = &m->bricks->segment[segment];
    const float reach = (m->section != NULL ? m->section[segment].stretch : 1.0f) * g->radius + m->tail;
    w->length2 = 0.0f;
    for (int a = 0; a < 3; a++) {
        float low = g->a[a] < g->b[a] ? g->a[a] : g->b[a], high = g->a[a] < g->b[a] ? g->b[a] : g->a[a];
        float l = ceilf(low - reach - 0.5f), h = floorf(high + reach - 0.5f) + 1.0f;
        float first = (float)from[a], end = (float)(from[a] + n[a]);
        if (h <= first || l >= end) return false;
        w->lo[a] = l <= first ? 0 : (size_t)(l - first);
        w->hi[a] = h >= end ? n[a] : (size_t)(h - first);
        w->a[a] = g->a[a];
        w->u[a] = g->b[a] - g->a[a];
        w->length2 += w->u[a] * w->u[a];
    }
    w->inverse_length2 = w->length2 > 0.0f ? 1.0f / w->length2 : 0.0f;
    w->margin = sqrtf(w->length2);
    w->inverse_x = fabsf(w->u[0]) < 0.2f * w->margin ? 0.0f : 1.0f / w->u[0];
    w->reach2 = reach * reach;
    w->least_t = g->is_first ? 0.0f : -INFINITY;
    w->most_t = g->is_last ? 1.0f : INFINITY;
    return true;
}

/* Finds the part of a row of n voxel centres, from p on relative to the segment's begin, whose nearest points lie
 * within a voxel of the segment. */
static void row_range(const struct stamp *w, const float p[3], size_t n, size_t *from, size_t *to)
{
    float x = p[0], fixed = p[1] * w->u[1] + p[2] * w->u[2], margin = w->margin;
    *from = 0;
    *to = n;
    if (w->inverse_x == 0.0f) {
        float wide = (float)n * fabsf(w->u[0]) + fabsf(x * w->u[0]);
        if (fixed < -margin - wide || fixed > w->length2 + margin + wide) *to = 0;
        return;
    }
    float x0 = (-margin - fixed) * w->inverse_x - x, x1 = (w->length2 + margin - fixed) * w->inverse_x - x;
    float lo = ceilf(x0 < x1 ? x0 : x1), hi = floorf(x0 < x1 ? x1 : x0) + 1.0f;
    *from = lo <= 0.0f ? 0 : lo >= (float)n ? n : (size_t)lo;
    *to = hi <= 0.0f ? 0 : hi >= (float)n ? n : (size_t)hi;
}

/* Squared distances of LANES voxel centres that follow each other along x from the segment; infinite beyond an end of
 * the line. Without branches, so that the loop is vectorised. */
static void row_distances(const struct stamp *w, const float p[3], float distance2[LANES])
{
    const float ux = w->u[0], uy = w->u[1], uz = w->u[2], x = p[0], y = p[1], z = p[2], fixed = y * uy + z * uz;
    const float inverse = w->inverse_length2, least = w->least_t, most = w->most_t;
    for (int i = 0; i < LANES; i++) {
        float px = x + (float)i, t = (px * ux + fixed) * inverse;
        bool beside = t >= least && t <= most;
        t = t < 0.0f ? 0.0f : t;
        t = t > 1.0f ? 1.0f : t;
        float dx = px - t * ux, dy = y - t * uy, dz = z - t * uz, d2 = dx * dx + dy * dy + dz * dz;
        distance2[i] = beside ? d2 : INFINITY;
    }
}

/* Lists the voxels of the brick for which this segment is the nearest of its line so far. */
static size_t stamp(const struct axis_model *m, struct axis_scratch *s, const size_t from[3], const size_t n[3],
                    uint32_t segment, size_t n_touched)
{
    struct stamp w;
    if (!stamp_init(&w, m, segment, from, n)) return n_touched;
    for (size_t k = w.lo[2]; k < w.hi[2]; k++)
        for (size_t j = w.lo[1]; j < w.hi[1]; j++) {
            size_t i0, i1;
            float p[3] = {(float)(from[0] + w.lo[0]) + 0.5f - w.a[0], (float)(from[1] + j) + 0.5f - w.a[1],
                          (float)(from[2] + k) + 0.5f - w.a[2]};
            row_range(&w, p, w.hi[0] - w.lo[0], &i0, &i1);
            p[0] += (float)i0;
            size_t at = (k * BRICK + j) * BRICK + w.lo[0] + i0;
            for (; i0 < i1; i0 += LANES, p[0] += (float)LANES) {
                float d2[LANES];
                row_distances(&w, p, d2);
                for (size_t l = 0; l < LANES && i0 + l < i1; l++, at++) {
                    bool is_new = s->own[at] == UINT32_MAX;
                    if (!(d2[l] < (is_new ? w.reach2 : s->own2[at]))) continue;
                    if (is_new) s->touched[n_touched++] = (uint32_t)at;
                    s->own2[at] = d2[l];
                    s->own[at] = segment;
                }
            }
        }
    return n_touched;
}

/* Appends the touched voxels of a line to the claims, and makes the scratch ready for the next line. */
static bool keep_claims(struct axis_scratch *s, size_t n_touched)
{
    if (s->n_claim + n_touched > s->capacity) {
        size_t n = 2 * s->capacity + n_touched + AXIS_N_CELL;
        struct axis_claim *bigger = realloc(s->claim, n * sizeof *bigger);
        if (bigger != NULL) {
            s->claim = bigger;
            s->capacity = n;
        }
    }
    bool fits = s->n_claim + n_touched <= s->capacity;
    for (size_t i = 0; i < n_touched; i++) {
        uint32_t cell = s->touched[i];
        if (fits) s->claim[s->n_claim++] = (struct axis_claim){cell, s->own[cell], s->own2[cell]};
        s->own[cell] = UINT32_MAX;
    }
    return fits;
}

/* Finds the point of the segment nearest to p (relative to its begin): *t is its position along the segment in
 * [0, 1]. */
static void foot_of(const struct segment *g, const float p[3], float *t, float offset[3])
{
    float u[3], along = 0.0f, length2 = 0.0f;
    for (int a = 0; a < 3; a++) {
        u[a] = g->b[a] - g->a[a];
        along += u[a] * p[a];
        length2 += u[a] * u[a];
    }
    *t = length2 > 0.0f ? along / length2 : 0.0f;
    /* comparisons, because fminf would be a function call */
    *t = *t < 0.0f ? 0.0f : *t > 1.0f ? 1.0f : *t;
    for (int a = 0; a < 3; a++) offset[a] = p[a] - *t * u[a];
}

/* The place of a claimed voxel in the section of its line. */
static struct section_place place_of(const struct axis_model *m, const size_t from[3], const struct axis_claim *c)
{
    const struct segment *g = &m->bricks->segment[c->segment];
    uint32_t at = c->cell;
    float p[3] = {(float)(from[0] + at % BRICK) + 0.5f - g->a[0],
                  (float)(from[1] + at / BRICK % BRICK) + 0.5f - g->a[1],
                  (float)(from[2] + at / (BRICK * BRICK)) + 0.5f - g->a[2]};
    float offset[3], t, d = sqrtf(c->distance2);
    foot_of(g, p, &t, offset);
    struct section_place place = {.depth = d - g->radius, .by_radius = -1.0f};
    if (m->section != NULL && d > 1e-3f) {
        place = fiber_section_place(&m->section[c->segment], g->radius, offset);
    } else {
        for (int a = 0; a < 3 && d > 0.0f; a++) place.normal[a] = offset[a] / d;
    }
    place.along = t;
    return place;
}

/* Makes room for the places of all claims. */
static bool fit_places(struct axis_scratch *s)
{
    if (s->n_claim <= s->place_capacity) return true;
    struct section_place *bigger = realloc(s->place, s->capacity * sizeof *bigger);
    if (bigger == NULL) return false;
    s->place = bigger;
    s->place_capacity = s->capacity;
    return true;
}

/* Adds the claims of a line from number `first` on to the model. */
static void add_to_model(const struct axis_model *m, struct axis_scratch *s, const size_t from[3], size_t first)
{
    for (size_t i = first; i < s->n_claim; i++) {
        const struct axis_claim *c = &s->claim[i];
        float depth = sqrtf(c->distance2) - m->bricks->segment[c->segment].radius, by_radius = -1.0f;
        if (m->section != NULL) {
            s->place[i] = place_of(m, from, c);
            depth = s->place[i].depth;
            by_radius = s->place[i].by_radius;
        }
        depth *= m->inverse_blur;
        float at = axis_table_place(&m->table, depth);
        s->model[c->cell] += axis_table_look_up(m->table.share, at);
        float slope = axis_table_look_up(m->table.slope, at) * m->inverse_blur;
        s->by_radius[c->cell] += slope * by_radius;
        s->by_blur[c->cell] -= slope * depth;
    }
}

/* Residual and weight of a voxel. */
static float residual(const struct axis_model *m, const struct axis_scratch *s, const size_t from[3], uint32_t at,
                      float *weight)
{
    size_t i = from[0] + at % BRICK, j = from[1] + at / BRICK % BRICK, k = from[2] + at / (BRICK * BRICK);
    float low = (float)m->profile.low, high = (float)m->profile.high, share = s->model[at] < 1.0f ? s->model[at] : 1.0f;
    float e = m->v->density[volume_index(m->v->n, i, j, k)] - low - (high - low) * share;
    float q = 1.0f / (1.0f + e * e / (OUTLIER * OUTLIER));
    *weight = q * q;
    return e;
}

/* Adds a voxel to the normal equation of its line's radius. by: derivative of the model by the radius. */
static void add_radius(const struct axis_scratch *s, uint32_t at, float amplitude, float by, float e, float weight,
                       struct axis_pull *q)
{
    float share = s->model[at] < 1.0f ? s->model[at] : 1.0f;
    q->radius_normal += weight * by * by;
    q->radius_gradient += weight * e * by;
    q->radius_cross[0] += weight * by * amplitude * s->by_radius[at];
    q->radius_cross[1] += weight * by * amplitude * s->by_blur[at];
    q->radius_cross[2] += weight * by * (1.0f - share);
    q->radius_cross[3] += weight * by * share;
}

/* Adds a claimed voxel to the normal equations of its segment's ends, of the radius and of the section. */
static void add_pull(const struct axis_model *m, const struct axis_scratch *s, const size_t from[3], size_t i_claim,
                     struct axis_pull *pull, struct section_pull *section)
{
    const float amplitude = (float)(m->profile.high - m->profile.low);
    const struct axis_claim *c = &s->claim[i_claim];
    float weight;
    if (!(c->distance2 > 1e-6f)) return;
    const struct section_place place = m->section != NULL ? s->place[i_claim] : place_of(m, from, c);
    float e = residual(m, s, from, c->cell, &weight), at = axis_table_place(&m->table, place.depth * m->inverse_blur);
    float slope = -amplitude * m->inverse_blur * axis_table_look_up(m->table.slope, at);
    add_radius(s, c->cell, amplitude, -slope * place.by_radius, e, weight, pull);
    for (int end = 0; end < 2; end++) {
        struct axis_pull *q = pull + end;
        float w = weight * (end == 0 ? 1.0f - place.along : place.along) * slope;
        for (int a = 0, i = 0; a < 3; a++) {
            q->gradient[a] += w * e * place.normal[a];
            for (int b = 0; b <= a; b++, i++) q->normal[i] += w * slope * place.normal[a] * place.normal[b];
        }
    }
    if (section == NULL) return;
    float by_c = -slope * place.by_c, by_s = -slope * place.by_s;
    section->gradient[0] += weight * e * by_c;
    section->gradient[1] += weight * e * by_s;
    section->normal[0] += weight * by_c * by_c;
    section->normal[1] += weight * by_c * by_s;
    section->normal[2] += weight * by_s * by_s;
}

/* Finds the voxels near every line of a brick and adds their densities to the model. */
static bool claim_voxels(const struct axis_model *m, struct axis_scratch *s, size_t i_brick, const size_t from[3],
                         const size_t n[3])
{
    const struct segment_bricks *b = m->bricks;
    bool fits = true;
    s->n_claim = 0;
    for (size_t e = b->first[i_brick], end; e < b->first[i_brick + 1]; e = end) {
        uint32_t line = b->segment[b->index[e]].line;
        size_t n_touched = 0, first = s->n_claim;
        for (end = e; end < b->first[i_brick + 1] && b->segment[b->index[end]].line == line; end++)
            n_touched = stamp(m, s, from, n, b->index[end], n_touched);
        fits = keep_claims(s, n_touched) && fits && (m->section == NULL || fit_places(s));
        if (fits) add_to_model(m, s, from, first);
    }
    return fits;
}

/* Adds the claimed voxels to the normal equations of the segments. The list of a brick is in ascending order, and the
 * segments of a line follow each other in it. */
static void add_pulls(const struct axis_model *m, const struct axis_scratch *s, size_t i_brick, const size_t from[3],
                      const struct axis_brick_sum *sum)
{
    const struct segment_bricks *b = m->bricks;
    const size_t begin = b->first[i_brick], end = b->first[i_brick + 1];
    size_t e = begin;
    for (size_t i = 0; i < s->n_claim; i++) {
        uint32_t segment = s->claim[i].segment;
        while (e > begin && b->index[e] > segment) e--;
        while (e + 1 < end && b->index[e] < segment) e++;
        add_pull(m, s, from, i, &sum->pull[2 * (e - begin)], sum->section != NULL ? &sum->section[e - begin] : NULL);
    }
}

/* Adds to the normal equations of what fibers share: a change of all radii, blur, low, high. */
static void add_shared(const struct axis_model *m, const struct axis_scratch *s, const size_t from[3],
                       const size_t n[3], struct shared_sum *sum)
{
    double amplitude = m->profile.high - m->profile.low;
    for (size_t k = 0; k < n[2]; k++)
        for (size_t j = 0; j < n[1]; j++)
            for (size_t i = 0; i < n[0]; i++) {
                uint32_t at = (uint32_t)((k * BRICK + j) * BRICK + i);
                float weight;
                if (!(s->model[at] > 0.0f)) continue;
                double e = (double)residual(m, s, from, at, &weight), share = fmin(1.0, (double)s->model[at]);
                sum->square += (double)weight * e * e;
                sum->weight += (double)weight;
                double by[4] = {amplitude * (double)s->by_radius[at], amplitude * (double)s->by_blur[at], 1.0 - share,
                                share};
                for (int a = 0; a < 4; a++) {
                    sum->gradient[a] += (double)weight * e * by[a];
                    for (int c = 0; c < 4; c++) sum->normal[a][c] += (double)weight * by[a] * by[c];
                }
            }
}

bool axis_brick_fit(const struct axis_model *model, size_t i_brick, struct axis_scratch *s, struct axis_brick_sum *sum)
{
    const struct segment_bricks *b = model->bricks;
    size_t n_segment = b->first[i_brick + 1] - b->first[i_brick], from[3], n[3];
    if (n_segment == 0) return true;
    sum->pull = calloc(2 * n_segment, sizeof *sum->pull);
    if (model->section != NULL) sum->section = calloc(n_segment, sizeof *sum->section);
    segment_brick_box(b, i_brick, from, n);
    bool fits = claim_voxels(model, s, i_brick, from, n) && sum->pull != NULL &&
                (model->section == NULL || sum->section != NULL);
    if (fits) {
        for (size_t e = 0; e < 2 * n_segment; e++) sum->pull[e].segment = b->index[b->first[i_brick] + e / 2];
        add_pulls(model, s, i_brick, from, sum);
        add_shared(model, s, from, n, &sum->shared);
    }
    for (size_t i = 0; i < s->n_claim; i++)
        s->model[s->claim[i].cell] = s->by_radius[s->claim[i].cell] = s->by_blur[s->claim[i].cell] = 0.0f;
    return fits;
}
