#include "geometry/fibers/axes/axis_share.h"

#include "base/ranks/byte_pack.h"
#include "base/ranks/rank_link.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

_Static_assert((int)SLAB_EDGE == (int)AXIS_BRICK, "a column of a slab is one of bricks");

/* Bytes of a brick's sums that fit into one message with the sums of others. */
enum { BRICK_MOST_BYTES = RANK_MESSAGE_MOST / 4 };

/* The lines of a round, in a helper. */
struct axis_round {
    struct polyline_set lines;
    struct fiber_section *section;
    struct section_view *view;
    float *reach;
    struct segment_bricks bricks;
    struct segment *nearest_of;
    struct axis_batch batch;
    size_t n_thread;
};

/* A batch in the order in which the ranks' tasks follow each other: column by column, in each from bottom to top. */
struct share_view {
    struct axis_batch *batch;
    size_t n_column, n_layer;
    bool frees; /* in a helper: sums are not wanted after they were sent */
    size_t *first;
};

static size_t brick_of(const struct share_view *v, size_t i_task)
{
    return i_task % v->n_layer * v->n_column + i_task / v->n_layer;
}

static size_t n_segment_of(const struct share_view *v, size_t i_brick)
{
    const size_t *first = v->batch->model.bricks->first + v->batch->first_brick + i_brick;
    return first[1] - first[0];
}

/* ---- the sums of a brick as bytes: the shared ones, a bit for each segment whether it has any, and those ---- */

/* Terms of a segment as they are sent. */
struct segment_terms {
    float end[2][9], radius[6];
    struct section_equation section;
};

static size_t terms_bytes(bool with_section)
{
    return sizeof(struct segment_terms) - (with_section ? 0 : sizeof(struct section_equation));
}

static size_t most_bytes_of(size_t n_segment, bool with_section)
{
    return sizeof(struct shared_sum) + (n_segment + 7) / 8 + n_segment * terms_bytes(with_section);
}

static void terms_of(const struct axis_brick_sum *sum, size_t e, struct segment_terms *t)
{
    memset(t, 0, sizeof *t);
    for (int end = 0; end < 2; end++) {
        const struct axis_equation *q = &sum->equation[2 * e + (size_t)end];
        memcpy(t->end[end], q->normal, sizeof q->normal);
        memcpy(t->end[end] + 6, q->gradient, sizeof q->gradient);
    }
    t->radius[0] = sum->equation[2 * e].radius_normal;
    t->radius[1] = sum->equation[2 * e].radius_gradient;
    memcpy(t->radius + 2, sum->equation[2 * e].radius_cross, sizeof sum->equation->radius_cross);
    if (sum->section != NULL) t->section = sum->section[e];
}

static void take_terms(struct axis_brick_sum *sum, size_t e, const struct segment_terms *t)
{
    for (int end = 0; end < 2; end++) {
        struct axis_equation *q = &sum->equation[2 * e + (size_t)end];
        memcpy(q->normal, t->end[end], sizeof q->normal);
        memcpy(q->gradient, t->end[end] + 6, sizeof q->gradient);
    }
    sum->equation[2 * e].radius_normal = t->radius[0];
    sum->equation[2 * e].radius_gradient = t->radius[1];
    memcpy(sum->equation[2 * e].radius_cross, t->radius + 2, sizeof sum->equation->radius_cross);
    if (sum->section != NULL) sum->section[e] = t->section;
}

static void put(char **to, const void *data, size_t n)
{
    memcpy(*to, data, n);
    *to += n;
}

static size_t pack_brick(void *context, size_t i_task, void *to)
{
    static const struct segment_terms nothing;
    const struct share_view *v = context;
    const size_t i_brick = brick_of(v, i_task), n_segment = n_segment_of(v, i_brick);
    struct axis_brick_sum *sum = &v->batch->sum[i_brick];
    if (sum->equation == NULL) return 0; /* no line comes near */
    char *at = to;
    put(&at, &sum->shared, sizeof sum->shared);
    uint8_t *has = (uint8_t *)at;
    memset(has, 0, (n_segment + 7) / 8);
    at += (n_segment + 7) / 8;
    for (size_t e = 0; e < n_segment; e++) {
        struct segment_terms t;
        terms_of(sum, e, &t);
        if (memcmp(&t, &nothing, sizeof t) == 0) continue;
        has[e / 8] |= (uint8_t)(1u << e % 8);
        put(&at, &t, terms_bytes(sum->section != NULL));
    }
    if (v->frees) axis_brick_sum_release(sum);
    return (size_t)(at - (char *)to);
}

/* Makes room for the sums of a brick. A segment without terms has zeros. */
static bool make_sum(const struct share_view *v, size_t i_brick, struct axis_brick_sum *sum)
{
    const struct segment_bricks *b = v->batch->model.bricks;
    const size_t n = n_segment_of(v, i_brick);
    sum->equation = calloc(2 * n, sizeof *sum->equation);
    if (v->batch->model.section != NULL) sum->section = calloc(n, sizeof *sum->section);
    if (sum->equation == NULL || (v->batch->model.section != NULL && sum->section == NULL)) return false;
    for (size_t e = 0; e < 2 * n; e++)
        sum->equation[e].segment = b->index[b->first[v->batch->first_brick + i_brick] + e / 2];
    return true;
}

static bool unpack_brick(void *context, size_t i_task, const void *from, size_t n_bytes)
{
    const struct share_view *v = context;
    const size_t i_brick = brick_of(v, i_task), n_segment = n_segment_of(v, i_brick);
    struct axis_brick_sum *sum = &v->batch->sum[i_brick];
    struct byte_view bytes = {.data = from, .n = n_bytes};
    if (n_segment == 0 || n_bytes == 0) return n_segment == n_bytes;
    const uint8_t *has = (const uint8_t *)from + sizeof sum->shared;
    struct shared_sum shared;
    BYTE_VIEW(&bytes, shared);
    if (bytes.n < (n_segment + 7) / 8 || sum->equation != NULL || !make_sum(v, i_brick, sum)) return false;
    bytes.data += (n_segment + 7) / 8;
    bytes.n -= (n_segment + 7) / 8;
    sum->shared = shared;
    for (size_t e = 0; e < n_segment && !bytes.failed; e++) {
        struct segment_terms t = {.radius = {0.0f}};
        if ((has[e / 8] >> e % 8 & 1) == 0) continue;
        byte_view_get(&bytes, &t, terms_bytes(sum->section != NULL));
        take_terms(sum, e, &t);
    }
    return !bytes.failed && bytes.n == 0;
}

static void fit_task(void *context, size_t i_task, size_t i_thread)
{
    const struct share_view *v = context;
    axis_batch_fit(v->batch, brick_of(v, i_task), i_thread);
}

/* ---- both sides ---- */

static size_t largest_brick(const struct axis_batch *b)
{
    const size_t *first = b->model.bricks->first + b->first_brick;
    size_t most = 0;
    for (size_t i = 0; i < b->n_brick; i++)
        if (first[i + 1] - first[i] > most) most = first[i + 1] - first[i];
    return most;
}

static status share_bricks(struct axis_batch *b, const struct volume_slabs *slabs, struct thread_pool *pool,
                           const struct progress *progress, struct error *err)
{
    const size_t n_column = volume_slabs_n_column(slabs->n);
    struct share_view v = {.batch = b,
                           .n_column = n_column,
                           .n_layer = b->n_brick / n_column,
                           .frees = rank_team_rank(slabs->team) > 0,
                           .first = malloc((slabs->n_rank + 1) * sizeof *v.first)};
    if (v.first == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit fibers: out of memory");
    for (size_t r = 0; r <= slabs->n_rank; r++) v.first[r] = slabs->first[r] * v.n_layer;
    const struct rank_work work = {.n_task = b->n_brick,
                                   .most_bytes = most_bytes_of(largest_brick(b), b->model.section != NULL),
                                   .first = v.first,
                                   .run = fit_task,
                                   .pack = pack_brick,
                                   .unpack = unpack_brick,
                                   .context = &v};
    status s = rank_team_share(slabs->team, &work, pool, progress, err);
    free(v.first);
    return s;
}

/* ---- the root ---- */

bool axis_share_can(const struct axis_batch *b)
{
    const struct axis_model *m = &b->model;
    return m->v->slabs != NULL && m->profile.lumen == NULL &&
           most_bytes_of(largest_brick(b), m->section != NULL) <= BRICK_MOST_BYTES;
}

status axis_share_round(const struct axis_model *m, const struct polyline_set *lines, bool follows, struct error *err)
{
    const struct axis_profile *profile = &m->profile;
    struct byte_pack p = {0};
    struct axes_order o;
    memset(&o, 0, sizeof o);
    o.n_line = lines->n_line;
    o.n_vertex = lines->n_vertex;
    o.blur = profile->blur;
    o.low = profile->low;
    o.high = profile->high;
    o.has_shape = lines->shape != NULL;
    o.has_section = profile->section != NULL;
    o.follows = follows;
    BYTE_PACK(&p, o);
    for (size_t l = 0; l <= lines->n_line; l++) BYTE_PACK(&p, (uint64_t){lines->n_line > 0 ? lines->first[l] : 0});
    byte_pack_put(&p, lines->vertex, lines->n_vertex * sizeof *lines->vertex);
    byte_pack_put(&p, lines->radius, lines->n_line * sizeof *lines->radius);
    if (lines->shape != NULL) byte_pack_put(&p, lines->shape, lines->n_vertex * sizeof *lines->shape);
    if (profile->section != NULL) byte_pack_put(&p, profile->section, lines->n_vertex * sizeof *profile->section);
    status s = byte_pack_check(&p, err);
    if (s == STATUS_OK) s = rank_team_order(m->v->slabs->team, RANK_ORDER_AXES, p.data, p.n, err);
    byte_pack_release(&p);
    return s;
}

status axis_share_bricks(struct axis_batch *b, struct thread_pool *pool, const struct progress *progress,
                         struct error *err)
{
    const struct volume_slabs *slabs = b->model.v->slabs;
    const struct bricks_order o = {b->first_brick, b->n_brick};
    status s = rank_team_order(slabs->team, RANK_ORDER_BRICKS, &o, sizeof o, err);
    return s == STATUS_OK ? share_bricks(b, slabs, pool, progress, err) : s;
}

/* ---- a helper ---- */

void axis_round_free(struct axis_round *r)
{
    if (r == NULL) return;
    axis_batch_release(&r->batch, r->n_thread);
    polyline_set_release(&r->lines);
    free(r->section);
    free(r->view);
    free(r->reach);
    segment_bricks_release(&r->bricks);
    free(r->nearest_of);
    free(r);
}

static bool all_finite(const float *value, size_t n, float most)
{
    bool good = true;
    for (size_t i = 0; i < n; i++) good = good && fabsf(value[i]) <= most; /* false for NaN */
    return good;
}

/* Whether the lines are lines: numbers that are none would be indices of bricks. */
static bool lines_make_sense(const struct axis_round *r, const struct axes_order *o, const uint64_t *first)
{
    const float most = 1e7f;
    const struct polyline_set *p = &r->lines;
    bool good = first[0] == 0 && first[o->n_line] == o->n_vertex && o->blur > 0.0 && o->blur <= (double)most &&
                isfinite(o->low) && isfinite(o->high);
    for (size_t l = 0; l < o->n_line && good; l++) good = first[l] <= first[l + 1];
    good =
        good && all_finite((const float *)p->vertex, 3 * o->n_vertex, most) && all_finite(p->radius, o->n_line, most);
    for (size_t i = 0; i < o->n_vertex && good; i++) {
        if (p->shape != NULL) good = all_finite(&p->shape[i].radius, 1, most);
        if (good && r->section != NULL) good = all_finite(r->section[i].u, 3, 2.0f);
        if (good && r->section != NULL)
            good = all_finite(&r->section[i].c, 1, 8.0f) && all_finite(&r->section[i].s, 1, 8.0f);
    }
    return good;
}

static status read_lines(struct axis_round *r, const struct rank_order *order, struct axes_order *o, struct error *err)
{
    struct byte_view v = {.data = order->data, .n = order->n_bytes};
    struct polyline_set *p = &r->lines;
    polyline_set_init(p);
    BYTE_VIEW(&v, *o);
    uint64_t *first = o->n_line < UINT32_MAX ? byte_view_array(&v, o->n_line + 1, sizeof *first) : NULL;
    p->vertex = byte_view_array(&v, o->n_vertex, sizeof *p->vertex);
    p->radius = byte_view_array(&v, o->n_line, sizeof *p->radius);
    if (o->has_shape) p->shape = byte_view_array(&v, o->n_vertex, sizeof *p->shape);
    if (o->has_section) r->section = byte_view_array(&v, o->n_vertex, sizeof *r->section);
    status s = byte_view_check(&v, err);
    if (s == STATUS_OK && (first == NULL || !lines_make_sense(r, o, first)))
        s = error_set(err, STATUS_FORMAT, "the lines of another rank are none");
    if (s == STATUS_OK) {
        p->first = calloc(o->n_line + 1, sizeof *p->first);
        p->axis = calloc(o->n_line + 1, sizeof *p->axis);
        if (p->first == NULL || p->axis == NULL) s = error_set(err, STATUS_NO_MEMORY, "no memory for lines");
    }
    for (size_t l = 0; s == STATUS_OK && l <= o->n_line; l++) p->first[l] = first[l];
    if (s == STATUS_OK) p->n_line = p->line_capacity = o->n_line;
    if (s == STATUS_OK) p->n_vertex = p->vertex_capacity = o->n_vertex;
    free(first);
    return s;
}

/* Takes the bricks of the round before for its lines at other places. */
static status follow_round(struct axis_round *r, struct axis_round *before, struct error *err)
{
    const struct polyline_set *p = &r->lines;
    bool same =
        before != NULL && before->bricks.segment != NULL && r->section == NULL && p->n_line == before->lines.n_line;
    for (size_t l = 0; same && l <= p->n_line; l++) same = p->first[l] == before->lines.first[l];
    if (!same) return error_set(err, STATUS_FORMAT, "another rank goes on with a fit of lines that are not there");
    r->bricks = before->bricks;
    r->nearest_of = before->nearest_of;
    before->bricks = (struct segment_bricks){0};
    before->nearest_of = NULL;
    r->batch.model.nearest_tail = before->batch.model.nearest_tail;
    return axis_round_follow(&r->batch.model, &r->lines, &r->bricks, &r->nearest_of, err);
}

static status take_round(const struct helper_slab *slab, struct axis_round **round, const struct rank_order *order,
                         struct axis_round *before, struct thread_pool *pool, struct error *err)
{
    struct axes_order o;
    struct axis_round *r = *round = calloc(1, sizeof *r);
    if (r == NULL) return error_set(err, STATUS_NO_MEMORY, "no memory for lines");
    status s = read_lines(r, order, &o, err);
    if (s != STATUS_OK) return s;
    struct axis_model *m = &r->batch.model;
    r->n_thread = thread_pool_n_thread(pool);
    r->reach = malloc((o.n_vertex + 1) * sizeof *r->reach);
    if (o.has_section) r->view = malloc((o.n_vertex + 1) * sizeof *r->view);
    if (r->reach == NULL || (o.has_section && r->view == NULL))
        return error_set(err, STATUS_NO_MEMORY, "no memory for lines");
    m->v = &slab->volume;
    m->first_row = slab->rows.with_halo;
    m->profile = (struct axis_profile){.blur = o.blur, .low = o.low, .high = o.high, .section = r->section};
    s = axis_batch_init(&r->batch, r->n_thread, err);
    if (s == STATUS_OK && o.follows) return follow_round(r, before, err);
    return s == STATUS_OK ? axis_round_prepare(m, &r->lines, slab->slabs.n, r->view, r->reach, &r->bricks, err) : s;
}

status axis_share_take(const struct helper_slab *slab, struct axis_round **round, const struct rank_order *order,
                       struct thread_pool *pool, struct error *err)
{
    struct axis_round *before = *round;
    *round = NULL;
    status s = take_round(slab, round, order, before, pool, err);
    axis_round_free(before);
    return s;
}

status axis_share_help(const struct helper_slab *slab, struct axis_round *round, const struct rank_order *order,
                       struct thread_pool *pool, struct error *err)
{
    struct byte_view v = {.data = order->data, .n = order->n_bytes};
    struct bricks_order o;
    BYTE_VIEW(&v, o);
    status s = byte_view_check(&v, err);
    if (s != STATUS_OK) return s;
    if (round == NULL) return error_set(err, STATUS_FORMAT, "another rank asks for a fit of lines that are not there");
    struct axis_batch *b = &round->batch;
    const size_t n_brick = segment_n_brick(&round->bricks), n_column = volume_slabs_n_column(slab->slabs.n);
    if (slab->slabs.halo > 0 || o.n_brick == 0 || o.first_brick > n_brick || o.n_brick > n_brick - o.first_brick ||
        o.first_brick % n_column != 0 || o.n_brick % n_column != 0)
        return error_set(err, STATUS_FORMAT, "another rank asks for a fit of bricks that do not exist");
    b->first_brick = o.first_brick;
    b->n_brick = o.n_brick;
    const struct progress progress = {.cancel = rank_team_cancel(slab->slabs.team)};
    s = axis_batch_start(b, err);
    if (s == STATUS_OK) s = share_bricks(b, &slab->slabs, pool, &progress, err);
    for (size_t t = 0; t < round->n_thread && s == STATUS_OK; t++)
        if (b->failed[t]) s = error_set(err, STATUS_NO_MEMORY, "no memory for the fit of fibers");
    axis_batch_end(b);
    return s;
}
