#include "geometry/fibers/axes/axis_brick.h"
#include "geometry/fibers/axes/axis_compare.h"

#include "base/lanes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BRICK = AXIS_BRICK, SHIFT = 5, BOUND = BRICK - 1 };
static const float ON_AXIS = 1e-3f; /* distance below which a voxel has no direction from the axis */

void axis_scratch_init(struct axis_scratch *s)
{
    memset(s, 0, sizeof *s);
    nearest_segments_init(&s->nearest);
}

void axis_scratch_release(struct axis_scratch *s) { nearest_segments_release(&s->nearest); }

/* A segment, with the values that all voxels near it share. */
struct axis_view {
    float a[3], u[3], inverse_length2, radius; /* a: begin from the centre of the brick's first voxel; u: to its end */
    const struct section_view *section;        /* NULL: a disc */
    const struct lumen_view *lumen;            /* NULL: solid */
};

static struct axis_view view_of(const struct axis_model *m, uint32_t i_segment, const size_t from[3])
{
    const struct segment *g = &m->bricks->segment[i_segment];
    struct axis_view w = {.radius = g->radius,
                          .section = m->section != NULL ? &m->section[i_segment] : NULL,
                          .lumen = m->lumen != NULL ? &m->lumen[i_segment] : NULL};
    float length2 = 0.0f;
    for (int a = 0; a < 3; a++) {
        w.a[a] = (g->a[a] - (float)from[a]) - 0.5f;
        w.u[a] = g->b[a] - g->a[a];
        length2 += w.u[a] * w.u[a];
    }
    w.inverse_length2 = length2 > 0.0f ? 1.0f / length2 : 0.0f;
    return w;
}

/* LANES voxels seen from the segment that they are nearest to (section_place). The first n count. */
struct axis_places {
    const uint16_t *cell;
    size_t n;
    lanes along, distance, depth, normal[3], by_radius, by_c, by_s;
    lanes x, y, curvature; /* with sections: in the frame of the section, and of its outline on the ray */
};

/* The places in a section that is not a disc (fiber_section_place). offset: from the axis. */
static void place_in_section(const struct section_view *s, float radius, const lanes offset[3], struct axis_places *p)
{
    const lanes zero = {0.0f}, one = zero + 1.0f;
    const lanes x = offset[0] * s->u[0] + offset[1] * s->u[1] + offset[2] * s->u[2];
    const lanes y = offset[0] * s->v[0] + offset[1] * s->v[1] + offset[2] * s->v[2];
    const lanes g = s->uu * x + s->uv * y, h = s->uv * x + s->vv * y, form = x * g + y * h;
    const lanes share = lanes_sqrt(form) / radius, norm = lanes_sqrt(g * g + h * h);
    const lane_mask off = p->distance > ON_AXIS;
    const lanes inverse = one / lanes_choose(off, norm, one), outline = inverse / lanes_choose(off, share, one);
    p->depth = lanes_choose(off, (form - radius * radius * share) * inverse, zero - radius);
    p->by_radius = lanes_choose(off, -radius * share * inverse, -one);
    p->by_c = (y * h - x * g) * outline;
    p->by_s = -(y * g + x * h) * outline;
    for (int a = 0; a < 3; a++) p->normal[a] = (g * s->u[a] + h * s->v[a]) * inverse;
    const lanes flat = share * inverse;
    p->curvature = radius * radius * flat * flat * flat;
    p->x = x;
    p->y = y;
}

/* Finds the places of the first n of LANES voxels of a segment. */
static void find_places(const struct axis_view *w, const uint16_t *cell, size_t n, struct axis_places *p)
{
    const lanes zero = {0.0f}, one = zero + 1.0f;
    const lane_mask at = {cell[0], cell[1], cell[2], cell[3], cell[4], cell[5], cell[6], cell[7]};
    lanes x[3], offset[3], along = zero, distance2 = zero;
    p->cell = cell;
    p->n = n < LANES ? n : LANES;
    for (int a = 0; a < 3; a++) {
        x[a] = __builtin_convertvector(at >> SHIFT * a & BOUND, lanes) - w->a[a];
        along += x[a] * w->u[a];
    }
    along *= w->inverse_length2;
    along = lanes_choose(along < zero, zero, along);
    p->along = lanes_choose(along > one, one, along);
    for (int a = 0; a < 3; a++) {
        offset[a] = x[a] - p->along * w->u[a];
        distance2 += offset[a] * offset[a];
    }
    p->distance = lanes_sqrt(distance2);
    if (w->section != NULL) {
        place_in_section(w->section, w->radius, offset, p);
        return;
    }
    const lanes inverse = one / lanes_choose(p->distance > ON_AXIS, p->distance, one);
    p->depth = p->distance - w->radius;
    p->by_radius = -one;
    for (int a = 0; a < 3; a++) p->normal[a] = offset[a] * inverse;
}

/* Share and slope of the table at places (axis_table_place), 0 beyond its end. */
static void look_up(const struct axis_table *t, lanes at, lanes *share, lanes *slope)
{
    const lanes zero = {0.0f}, last = zero + (float)AXIS_N_TABLE;
    const lane_mask within = at < last, i = __builtin_convertvector(lanes_choose(within, at, last), lane_mask);
    const lanes part = at - __builtin_convertvector(i, lanes);
    lane_row row[LANES];
    lanes of[4]; /* share and slope of the entry, and of the next one */
    for (int l = 0; l < LANES; l++) row[l] = *(const lane_row *)t->entry[i[l]];
    lanes_of_rows(row, of);
    *share = lanes_choose(within, of[0] + part * (of[2] - of[0]), zero);
    *slope = lanes_choose(within, of[1] + part * (of[3] - of[1]), zero);
}

static lanes place_in_table(const struct axis_table *t, lanes depth)
{
    const lanes at = (depth + (float)AXIS_CORE) * t->scale, zero = {0.0f};
    return lanes_choose(at > zero, at, zero);
}

/* Depths in units of the blur. The blurred edge of a round fiber has half of the density inside of its outline, by half
 * the squared blur times the curvature, which would pass for a lumen. *bend: the change of depth by that, or 0. */
static lanes depth_in_blur(const struct axis_model *m, const struct axis_view *w, const struct axis_places *p,
                           lanes *bend)
{
    const lanes zero = {0.0f};
    *bend = zero;
    if (w->lumen != NULL) *bend = p->curvature * (0.5f / m->inverse_blur);
    return p->depth * m->inverse_blur + *bend;
}

/* Subtracts the lumen from the share in LANES voxels and from its derivatives. */
static void subtract_lumen(const struct axis_model *m, struct axis_scratch *s, const struct axis_view *w,
                           const struct axis_places *p, lanes add[4])
{
    const struct lumen_lanes q = lumen_lanes_at(w->lumen, m->lumen_table, p->x, p->y);
    add[0] -= q.share;
    add[1] -= q.by_radius;
    add[2] -= q.by_blur;
    for (size_t l = 0; l < p->n; l++) s->lumen[p->cell[l]] -= q.by_area[l];
}

/* Adds the voxels of a segment to the model. */
static void add_to_model(const struct axis_model *m, struct axis_scratch *s, const struct axis_view *w,
                         const uint16_t *cell, size_t n)
{
    for (size_t i = 0; i < n; i += LANES) {
        struct axis_places p;
        find_places(w, cell + i, n - i, &p);
        lanes share, slope, bend;
        const lanes depth = depth_in_blur(m, w, &p, &bend), at = place_in_table(&m->table, depth);
        look_up(&m->table, at, &share, &slope);
        slope *= m->inverse_blur;
        const lanes zero = {0.0f};
        lanes add[4] = {share, slope * p.by_radius, -(slope * depth), zero};
        if (w->lumen != NULL) {
            add[2] += 2.0f * slope * bend;
            subtract_lumen(m, s, w, &p, add);
        }
        lane_row row[LANES];
        lanes_to_rows(add, row);
        for (size_t l = 0; l < p.n; l++) {
            s->model[p.cell[l]] += row[l];
            s->touched[p.cell[l] / LANES] = true;
        }
    }
}

/* Sums of axis_equation for the ends of a segment, and of section_equation. */
struct segment_sum {
    lanes gradient[2][3], normal[2][6], radius_normal, radius_gradient, radius_cross[4];
    lanes section_gradient[2], section_normal[3];
    lanes area_normal, area_gradient, area_by_radius, area_cross[AXIS_N_SHARED], radius_shared;
};

/* The work's arrays at the voxels of some places; the weight is 0 where a place does not count. */
struct voxel_lanes {
    lanes weight, residual, share, by_radius, by_blur, by_area;
};

static lanes gather(const float *value, const uint16_t c[LANES])
{
    return (lanes){value[c[0]], value[c[1]], value[c[2]], value[c[3]],
                   value[c[4]], value[c[5]], value[c[6]], value[c[7]]};
}

static struct voxel_lanes voxels_of(const struct axis_scratch *s, const struct axis_places *p, bool lumens)
{
    static const lanes step = {0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f};
    const lane_mask counts = (step < (float)p->n) & (p->distance > ON_AXIS);
    const lanes zero = {0.0f};
    lane_row row[LANES];
    lanes of[4];
    for (int l = 0; l < LANES; l++) row[l] = s->model[p->cell[l]];
    lanes_of_rows(row, of);
    return (struct voxel_lanes){lanes_choose(counts, gather(s->weight, p->cell), zero),
                                lanes_choose(counts, of[3], zero),
                                of[0],
                                of[1],
                                of[2],
                                lumens ? gather(s->lumen, p->cell) : zero};
}

/* Adds places to the normal equation of the area of the lumen. by_radius: of the densities. */
static void add_lumen(float amplitude, const struct voxel_lanes *v, lanes by_area, lanes by_radius,
                      struct segment_sum *sum)
{
    const lanes weighted = v->weight * by_area;
    const lanes shared[AXIS_N_SHARED] = {amplitude * v->by_radius, amplitude * v->by_blur, 1.0f - v->share, v->share,
                                         amplitude * v->by_area};
    sum->area_normal += weighted * by_area;
    sum->area_gradient += v->residual * by_area;
    sum->area_by_radius += weighted * by_radius;
    for (int i = 0; i < AXIS_N_SHARED; i++) sum->area_cross[i] += weighted * shared[i];
    sum->radius_shared += v->weight * by_radius * shared[4];
}

/* Derivatives of the densities at LANES voxels by the numbers of a segment: slope times normal is that by the axis. */
struct place_slopes {
    lanes slope, normal[3], by_radius, by_c, by_s, by_area;
};

/* Takes the lumen into account. */
static void slopes_of_lumen(const struct axis_model *m, const struct axis_view *w, const struct axis_places *p,
                            struct place_slopes *d)
{
    const float amplitude = (float)(m->profile.high - m->profile.low);
    const struct lumen_lanes q = lumen_lanes_at(w->lumen, m->lumen_table, p->x, p->y);
    const lanes zero = {0.0f}, one = zero + 1.0f;
    lanes by_axis[3], square = zero;
    for (int a = 0; a < 3; a++) {
        by_axis[a] =
            d->slope * d->normal[a] - amplitude * (q.by_axis[0] * w->section->u[a] + q.by_axis[1] * w->section->v[a]);
        square += by_axis[a] * by_axis[a];
    }
    d->slope = lanes_sqrt(square);
    for (int a = 0; a < 3; a++) d->normal[a] = by_axis[a] / lanes_choose(d->slope > zero, d->slope, one);
    d->by_radius -= amplitude * q.by_radius;
    d->by_c -= amplitude * q.by_c;
    d->by_s -= amplitude * q.by_s;
    d->by_area = -amplitude * q.by_area;
}

static struct place_slopes slopes_at(const struct axis_model *m, const struct axis_view *w, const struct axis_places *p)
{
    const float amplitude = (float)(m->profile.high - m->profile.low);
    lanes share, slope, bend;
    const lanes at = place_in_table(&m->table, depth_in_blur(m, w, p, &bend));
    look_up(&m->table, at, &share, &slope);
    slope *= -amplitude * m->inverse_blur;
    struct place_slopes d = {.slope = slope,
                             .normal = {p->normal[0], p->normal[1], p->normal[2]},
                             .by_radius = -slope * p->by_radius,
                             .by_c = -slope * p->by_c,
                             .by_s = -slope * p->by_s};
    if (w->lumen != NULL) slopes_of_lumen(m, w, p, &d);
    return d;
}

/* Adds places to the normal equations of their segment's ends, of the radius and of the section. */
static void add_places(const struct axis_model *m, const struct axis_scratch *s, const struct axis_view *w,
                       const struct axis_places *p, struct segment_sum *sum)
{
    const float amplitude = (float)(m->profile.high - m->profile.low);
    const struct voxel_lanes v = voxels_of(s, p, w->lumen != NULL);
    const struct place_slopes d = slopes_at(m, w, p);
    const lanes by = d.by_radius, weighted = v.weight * by;
    sum->radius_normal += weighted * by;
    sum->radius_gradient += v.residual * by;
    sum->radius_cross[0] += weighted * amplitude * v.by_radius;
    sum->radius_cross[1] += weighted * amplitude * v.by_blur;
    sum->radius_cross[2] += weighted * (1.0f - v.share);
    sum->radius_cross[3] += weighted * v.share;
    for (int end = 0; end < 2; end++) {
        const lanes part = end == 0 ? (lanes)(1.0f - p->along) : p->along;
        const lanes gradient = part * d.slope * v.residual, hold = part * d.slope * d.slope * v.weight;
        for (int a = 0, i = 0; a < 3; a++) {
            sum->gradient[end][a] += gradient * d.normal[a];
            for (int b = 0; b <= a; b++, i++) sum->normal[end][i] += hold * d.normal[a] * d.normal[b];
        }
    }
    if (w->section == NULL) return;
    sum->section_gradient[0] += v.residual * d.by_c;
    sum->section_gradient[1] += v.residual * d.by_s;
    sum->section_normal[0] += v.weight * d.by_c * d.by_c;
    sum->section_normal[1] += v.weight * d.by_c * d.by_s;
    sum->section_normal[2] += v.weight * d.by_s * d.by_s;
    if (w->lumen != NULL) add_lumen(amplitude, &v, d.by_area, by, sum);
}

static void keep_lumen(const struct segment_sum *sum, struct lumen_equation *equation)
{
    equation->normal = lanes_sum(sum->area_normal);
    equation->gradient = lanes_sum(sum->area_gradient);
    equation->by_radius = lanes_sum(sum->area_by_radius);
    for (int i = 0; i < AXIS_N_SHARED; i++) equation->cross[i] = lanes_sum(sum->area_cross[i]);
    equation->radius_shared = lanes_sum(sum->radius_shared);
}

/* equation: of both ends. section: NULL for discs. */
static void keep_sum(const struct segment_sum *sum, struct axis_equation *equation, struct section_equation *section)
{
    for (int end = 0; end < 2; end++) {
        for (int i = 0; i < 3; i++) equation[end].gradient[i] = lanes_sum(sum->gradient[end][i]);
        for (int i = 0; i < 6; i++) equation[end].normal[i] = lanes_sum(sum->normal[end][i]);
    }
    equation->radius_normal = lanes_sum(sum->radius_normal);
    equation->radius_gradient = lanes_sum(sum->radius_gradient);
    for (int i = 0; i < 4; i++) equation->radius_cross[i] = lanes_sum(sum->radius_cross[i]);
    if (section == NULL) return;
    for (int i = 0; i < 2; i++) section->gradient[i] = lanes_sum(sum->section_gradient[i]);
    for (int i = 0; i < 3; i++) section->normal[i] = lanes_sum(sum->section_normal[i]);
}

/* Adds the voxels of all segments to their normal equations. */
static void add_equations(const struct axis_model *m, const struct axis_scratch *s, const struct nearest_list *nearest,
                          size_t i_brick, const size_t from[3], const struct axis_brick_sum *sum)
{
    const struct segment_bricks *b = m->bricks;
    for (size_t e = 0; e < b->first[i_brick + 1] - b->first[i_brick]; e++) {
        const uint32_t i_segment = b->index[b->first[i_brick] + e], end = nearest->first[e + 1];
        const struct axis_view w = view_of(m, i_segment, from);
        struct segment_sum total = {0};
        for (size_t i = nearest->first[e]; i < end; i += LANES) {
            struct axis_places p;
            find_places(&w, nearest->cell + i, end - i, &p);
            add_places(m, s, &w, &p, &total);
        }
        sum->equation[2 * e].segment = sum->equation[2 * e + 1].segment = i_segment;
        keep_sum(&total, &sum->equation[2 * e], sum->section != NULL ? &sum->section[e] : NULL);
        if (sum->lumen != NULL) keep_lumen(&total, &sum->lumen[e]);
    }
}

static void clear_model(struct axis_scratch *s, bool lumens)
{
    for (size_t b = 0; b < AXIS_N_CELL / LANES; b++) {
        if (!s->touched[b]) continue;
        memset(s->model + b * LANES, 0, LANES * sizeof *s->model);
        if (lumens) memset(s->lumen + b * LANES, 0, LANES * sizeof *s->lumen);
        s->touched[b] = false;
    }
}

/* Finds the nearest segments in a brick, or takes them from the cache. */
static bool find_nearest(const struct axis_model *m, size_t i_brick, struct axis_scratch *s,
                         struct nearest_list *nearest)
{
    struct segment_bricks of = *m->bricks;
    if (m->nearest_of != NULL) of.segment = m->nearest_of;
    if (m->nearest_of != NULL && m->store != NULL && nearest_cache_find(m->store, i_brick, nearest)) return true;
    if (!nearest_segments_find(&s->nearest, &of, m->section, m->nearest_tail, i_brick)) return false;
    *nearest = (struct nearest_list){s->nearest.cell, s->nearest.first};
    if (m->nearest_of == NULL && m->store != NULL)
        nearest_cache_add(m->store, i_brick, nearest, of.first[i_brick + 1] - of.first[i_brick]);
    return true;
}

bool axis_brick_fit(const struct axis_model *model, size_t i_brick, struct axis_scratch *s, struct axis_brick_sum *sum)
{
    const struct segment_bricks *b = model->bricks;
    const size_t n_segment = b->first[i_brick + 1] - b->first[i_brick];
    size_t from[3], n[3];
    if (n_segment == 0) return true;
    sum->equation = calloc(2 * n_segment, sizeof *sum->equation);
    if (model->section != NULL) sum->section = calloc(n_segment, sizeof *sum->section);
    if (model->lumen != NULL) sum->lumen = calloc(n_segment, sizeof *sum->lumen);
    if (sum->equation == NULL || (model->section != NULL && sum->section == NULL) ||
        (model->lumen != NULL && sum->lumen == NULL))
        return false;
    struct nearest_list nearest;
    if (!find_nearest(model, i_brick, s, &nearest)) return false;
    segment_brick_box(b, i_brick, from, n);
    for (size_t e = 0; e < n_segment; e++) {
        const struct axis_view w = view_of(model, b->index[b->first[i_brick] + e], from);
        add_to_model(model, s, &w, nearest.cell + nearest.first[e], nearest.first[e + 1] - nearest.first[e]);
    }
    axis_compare(model, s, from, n, &sum->shared);
    add_equations(model, s, &nearest, i_brick, from, sum);
    clear_model(s, model->lumen != NULL);
    return true;
}
