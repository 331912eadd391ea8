#include "geometry/fibers/shape/axes/axis_brick.h"

#include "base/lanes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BRICK = AXIS_BRICK, SHIFT = 5, BOUND = BRICK - 1 };
static const float OUTLIER = 0.6f;  /* difference of densities beyond which a residual comes from another fiber */
static const float ON_AXIS = 1e-3f; /* distance below which a voxel has no direction from the axis */

void axis_scratch_init(struct axis_scratch *s)
{
    memset(s, 0, sizeof *s);
    axis_claims_init(&s->claims);
}

void axis_scratch_release(struct axis_scratch *s) { axis_claims_release(&s->claims); }

/* A segment, with what the voxels near it share. */
struct axis_view {
    float a[3], u[3], inverse_length2, radius; /* a: begin from the centre of the brick's first voxel; u: to its end */
    const struct section_view *section;        /* NULL: a disc */
};

static struct axis_view view_of(const struct axis_model *m, uint32_t i_segment, const size_t from[3])
{
    const struct segment *g = &m->bricks->segment[i_segment];
    struct axis_view w = {.radius = g->radius, .section = m->section != NULL ? &m->section[i_segment] : NULL};
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

/* Adds the claims of a segment to the model. */
static void add_to_model(const struct axis_model *m, struct axis_scratch *s, const struct axis_view *w, size_t from,
                         size_t to)
{
    for (size_t i = from; i < to; i += LANES) {
        struct axis_places p;
        find_places(w, s->claims.cell + i, to - i, &p);
        const lanes depth = p.depth * m->inverse_blur, at = place_in_table(&m->table, depth);
        lanes share, slope;
        look_up(&m->table, at, &share, &slope);
        slope *= m->inverse_blur;
        const lanes zero = {0.0f}, add[4] = {share, slope * p.by_radius, -(slope * depth), zero};
        lane_row row[LANES];
        lanes_to_rows(add, row);
        for (size_t l = 0; l < p.n; l++) s->model[p.cell[l]] += row[l];
    }
}

/* Sums of shared_sum for one plane of the brick. */
struct plane_sum {
    lanes gradient[4], normal[10], square, weight, slope;
};

/* Finds residual and weight of LANES voxels, of which n are in the brick, and adds those with fibers to the sums. */
static void compare_lanes(const struct axis_model *m, struct axis_scratch *s, size_t at, const float *density, size_t n,
                          struct plane_sum *sum)
{
    static const lanes step = {0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f};
    const float low = (float)m->profile.low, amplitude = (float)(m->profile.high - m->profile.low);
    lanes value = {0.0f}, zero = {0.0f}, one = zero + 1.0f, of[4];
    lanes_of_rows(s->model + at, of);
    const lane_mask near = (of[0] > zero) & (step < (float)n);
    if (n >= LANES)
        value = *(const lanes *)density;
    else
        memcpy(&value, density, n * sizeof *density);
    const lanes share = lanes_choose(of[0] < one, of[0], one), e = value - low - amplitude * share,
                q = one / (one + e * e / (OUTLIER * OUTLIER));
    const lanes weight = lanes_choose(near, q * q, zero), weighted = weight * e;
    *(lanes *)(s->weight + at) = weight;
    const lanes by[4] = {amplitude * of[1], amplitude * of[2], one - share, share};
    of[0] = share;
    of[3] = weighted;
    lanes_to_rows(of, s->model + at);
    sum->square += weighted * e;
    sum->weight += weight;
    sum->slope += weight * (4.0f * q - 3.0f);
    for (int a = 0, i = 0; a < 4; a++) {
        sum->gradient[a] += weighted * by[a];
        for (int b = 0; b <= a; b++, i++) sum->normal[i] += weight * by[a] * by[b];
    }
}

static void add_plane(const struct plane_sum *plane, struct shared_sum *sum)
{
    sum->square += (double)lanes_sum(plane->square);
    sum->weight += (double)lanes_sum(plane->weight);
    sum->slope += (double)lanes_sum(plane->slope);
    for (int a = 0, i = 0; a < 4; a++) {
        sum->gradient[a] += (double)lanes_sum(plane->gradient[a]);
        for (int b = 0; b <= a; b++, i++) {
            const double value = (double)lanes_sum(plane->normal[i]);
            sum->normal[a][b] += value;
            if (b < a) sum->normal[b][a] += value;
        }
    }
}

/* Compares the model with the scan, and adds to the normal equations of what fibers share: a change of all radii, blur,
 * low, high. Shares above 1 become 1. */
static void compare(const struct axis_model *m, struct axis_scratch *s, const size_t from[3], const size_t n[3],
                    struct shared_sum *sum)
{
    for (size_t k = 0; k < n[2]; k++) {
        struct plane_sum plane = {0};
        for (size_t j = 0; j < n[1]; j++) {
            const float *density = m->v->density + volume_index(m->v->n, from[0], from[1] + j, from[2] + k);
            for (size_t i = 0; i < n[0]; i += LANES)
                compare_lanes(m, s, (k * BRICK + j) * BRICK + i, density + i, n[0] - i, &plane);
        }
        add_plane(&plane, sum);
    }
}

/* Sums of axis_pull for the ends of a segment, and of section_pull. */
struct segment_sum {
    lanes gradient[2][3], normal[2][6], radius_normal, radius_gradient, radius_cross[4];
    lanes section_gradient[2], section_normal[3];
};

/* The work's arrays at the voxels of some places; the weight is 0 where a place does not count. */
struct voxel_lanes {
    lanes weight, residual, share, by_radius, by_blur;
};

static lanes gather(const float *value, const uint16_t c[LANES])
{
    return (lanes){value[c[0]], value[c[1]], value[c[2]], value[c[3]],
                   value[c[4]], value[c[5]], value[c[6]], value[c[7]]};
}

static struct voxel_lanes voxels_of(const struct axis_scratch *s, const struct axis_places *p)
{
    static const lanes step = {0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f};
    const lane_mask counts = (step < (float)p->n) & (p->distance > ON_AXIS);
    const lanes zero = {0.0f};
    lane_row row[LANES];
    lanes of[4];
    for (int l = 0; l < LANES; l++) row[l] = s->model[p->cell[l]];
    lanes_of_rows(row, of);
    return (struct voxel_lanes){lanes_choose(counts, gather(s->weight, p->cell), zero),
                                lanes_choose(counts, of[3], zero), of[0], of[1], of[2]};
}

/* Adds places to the normal equations of their segment's ends, of the radius and of the section. */
static void add_places(const struct axis_model *m, const struct axis_scratch *s, const struct axis_places *p,
                       struct segment_sum *sum)
{
    const float amplitude = (float)(m->profile.high - m->profile.low);
    const struct voxel_lanes v = voxels_of(s, p);
    const lanes at = place_in_table(&m->table, p->depth * m->inverse_blur);
    lanes share, slope;
    look_up(&m->table, at, &share, &slope);
    slope *= -amplitude * m->inverse_blur;
    const lanes by = -slope * p->by_radius, weighted = v.weight * by;
    sum->radius_normal += weighted * by;
    sum->radius_gradient += v.residual * by;
    sum->radius_cross[0] += weighted * amplitude * v.by_radius;
    sum->radius_cross[1] += weighted * amplitude * v.by_blur;
    sum->radius_cross[2] += weighted * (1.0f - v.share);
    sum->radius_cross[3] += weighted * v.share;
    for (int end = 0; end < 2; end++) {
        const lanes part = end == 0 ? (lanes)(1.0f - p->along) : p->along;
        const lanes pull = part * slope * v.residual, hold = part * slope * slope * v.weight;
        for (int a = 0, i = 0; a < 3; a++) {
            sum->gradient[end][a] += pull * p->normal[a];
            for (int b = 0; b <= a; b++, i++) sum->normal[end][i] += hold * p->normal[a] * p->normal[b];
        }
    }
    if (m->section == NULL) return;
    const lanes by_c = -slope * p->by_c, by_s = -slope * p->by_s;
    sum->section_gradient[0] += v.residual * by_c;
    sum->section_gradient[1] += v.residual * by_s;
    sum->section_normal[0] += v.weight * by_c * by_c;
    sum->section_normal[1] += v.weight * by_c * by_s;
    sum->section_normal[2] += v.weight * by_s * by_s;
}

/* pull: of both ends. section: NULL for discs. */
static void keep_sum(const struct segment_sum *sum, struct axis_pull *pull, struct section_pull *section)
{
    for (int end = 0; end < 2; end++) {
        for (int i = 0; i < 3; i++) pull[end].gradient[i] = lanes_sum(sum->gradient[end][i]);
        for (int i = 0; i < 6; i++) pull[end].normal[i] = lanes_sum(sum->normal[end][i]);
    }
    pull->radius_normal = lanes_sum(sum->radius_normal);
    pull->radius_gradient = lanes_sum(sum->radius_gradient);
    for (int i = 0; i < 4; i++) pull->radius_cross[i] = lanes_sum(sum->radius_cross[i]);
    if (section == NULL) return;
    for (int i = 0; i < 2; i++) section->gradient[i] = lanes_sum(sum->section_gradient[i]);
    for (int i = 0; i < 3; i++) section->normal[i] = lanes_sum(sum->section_normal[i]);
}

/* Adds the claims to the normal equations of the segments. */
static void add_pulls(const struct axis_model *m, const struct axis_scratch *s, size_t i_brick, const size_t from[3],
                      const struct axis_brick_sum *sum)
{
    const struct segment_bricks *b = m->bricks;
    for (size_t e = 0; e < b->first[i_brick + 1] - b->first[i_brick]; e++) {
        const uint32_t i_segment = b->index[b->first[i_brick] + e], end = s->claims.first[e + 1];
        const struct axis_view w = view_of(m, i_segment, from);
        struct segment_sum total = {0};
        for (size_t i = s->claims.first[e]; i < end; i += LANES) {
            struct axis_places p;
            find_places(&w, s->claims.cell + i, end - i, &p);
            add_places(m, s, &p, &total);
        }
        sum->pull[2 * e].segment = sum->pull[2 * e + 1].segment = i_segment;
        keep_sum(&total, &sum->pull[2 * e], sum->section != NULL ? &sum->section[e] : NULL);
    }
}

static void forget_claims(struct axis_scratch *s, size_t n_claim)
{
    for (size_t i = 0; i < n_claim; i++) {
        s->model[s->claims.cell[i]] = (lane_row){0.0f};
    }
}

bool axis_brick_fit(const struct axis_model *model, size_t i_brick, struct axis_scratch *s, struct axis_brick_sum *sum)
{
    const struct segment_bricks *b = model->bricks;
    const size_t n_segment = b->first[i_brick + 1] - b->first[i_brick];
    size_t from[3], n[3];
    if (n_segment == 0) return true;
    sum->pull = calloc(2 * n_segment, sizeof *sum->pull);
    if (model->section != NULL) sum->section = calloc(n_segment, sizeof *sum->section);
    if (sum->pull == NULL || (model->section != NULL && sum->section == NULL)) return false;
    if (!axis_claims_find(&s->claims, b, model->section, model->tail, i_brick)) return false;
    segment_brick_box(b, i_brick, from, n);
    for (size_t e = 0; e < n_segment; e++) {
        const struct axis_view w = view_of(model, b->index[b->first[i_brick] + e], from);
        add_to_model(model, s, &w, s->claims.first[e], s->claims.first[e + 1]);
    }
    compare(model, s, from, n, &sum->shared);
    add_pulls(model, s, i_brick, from, sum);
    forget_claims(s, s->claims.first[n_segment]);
    return true;
}
