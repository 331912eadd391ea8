/* Rays from cell to cell of the grid. */
#include "renderer/scene/fiber_frame.h"
#include "renderer/scene/scene_faces.h"
#include "renderer/scene/scene_grid.h"
#include "renderer/scene/scene_segment.h"
#include "renderer/scene/scene_visitor.h"

#include <string.h>

/* A ray on its way. */
struct grid_walk {
    const struct scene *s;
    const struct scene_grid *g;
    float o[3]; /* in the copy of the tile that the ray is in */
    float d[3], d2, inv_d2, inv[3], t_near, near_t;
    float across[2][3], along[3]; /* two unit vectors across the ray, and d / d2 */
    bool checked;                 /* it may start in fibers: faces inside of their own tube are none */
    uint32_t i_from;
    int at[3], step[3], copy[2];
    float next[3]; /* where the ray leaves the cell */
};

static inline void set_next(struct grid_walk *w, int k)
{
    const float face = w->g->low_mm[k] + (float)(w->at[k] + (w->step[k] > 0)) * w->g->cell_mm[k];
    w->next[k] = w->d[k] != 0 ? (face - w->o[k]) * w->inv[k] : INFINITY;
}

static inline void set_frame(struct grid_walk *w, const float d[3])
{
    struct fiber_frame f;
    const float inv = sqrtf(w->inv_d2), unit[3] = {inv * d[0], inv * d[1], inv * d[2]};
    fiber_frame_from(&f, unit);
    memcpy(w->across[0], f.v, sizeof f.v);
    memcpy(w->across[1], f.w, sizeof f.w);
    for (int k = 0; k < 3; k++) w->along[k] = w->inv_d2 * d[k];
}

static inline void start(struct grid_walk *w, const struct scene *s, const struct scene_ray *r)
{
    const struct scene_grid *g = s->grid;
    w->s = s;
    w->g = g;
    w->checked = r->inside;
    w->i_from = r->i_from;
    w->t_near = r->tnear_mm;
    w->near_t = scene_faces_near(s, r->i_from);
    w->copy[0] = w->copy[1] = 0;
    w->d2 = segment_dot(r->direction, r->direction);
    w->inv_d2 = 1 / w->d2;
    set_frame(w, r->direction);
    for (int k = 0; k < 3; k++) {
        w->o[k] = r->origin_mm[k];
        w->d[k] = r->direction[k];
        w->inv[k] = 1 / w->d[k];
        w->step[k] = w->d[k] > 0 ? 1 : -1;
        const int at = (int)floorf((w->o[k] + w->t_near * w->d[k] - g->low_mm[k]) * g->per_mm[k]);
        w->at[k] = at < 0 ? 0 : at >= g->n[k] ? g->n[k] - 1 : at;
        set_next(w, k);
    }
}

/* To the next cell. False: it is outside of the cloth. */
static inline bool move_on(struct grid_walk *w, int k)
{
    w->at[k] += w->step[k];
    if ((unsigned)w->at[k] >= (unsigned)w->g->n[k]) {
        if (k == 2) return false;
        w->at[k] = w->step[k] > 0 ? 0 : w->g->n[k] - 1;
        w->copy[k] += w->step[k];
        w->o[k] -= (float)(w->step[k] * w->s->tile_mm[k]);
    }
    set_next(w, k);
    return true;
}

/* Eight numbers at once. */
typedef float f4 __attribute__((vector_size(16)));
typedef float f8 __attribute__((vector_size(32)));
typedef int32_t i8 __attribute__((vector_size(32)));

static inline f8 along8(const f8 a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static inline f8 two_vertices(const struct scene_vertex *a, const struct scene_vertex *b)
{
    f4 x, y;
    memcpy(&x, a, sizeof x);
    memcpy(&y, b, sizeof y);
    return __builtin_shufflevector(x, y, 0, 1, 2, 3, 4, 5, 6, 7);
}

/* Coordinates and radii of eight vertices. */
static inline void gather(const struct scene_vertex *v, const uint32_t at[8], f8 out[4])
{
    f8 row[4];
    for (int i = 0; i < 4; i++) row[i] = two_vertices(&v[at[i]], &v[at[i + 4]]);
    const f8 xy01 = __builtin_shufflevector(row[0], row[1], 0, 8, 1, 9, 4, 12, 5, 13),
             xy23 = __builtin_shufflevector(row[2], row[3], 0, 8, 1, 9, 4, 12, 5, 13),
             zr01 = __builtin_shufflevector(row[0], row[1], 2, 10, 3, 11, 6, 14, 7, 15),
             zr23 = __builtin_shufflevector(row[2], row[3], 2, 10, 3, 11, 6, 14, 7, 15);
    out[0] = __builtin_shufflevector(xy01, xy23, 0, 1, 8, 9, 4, 5, 12, 13);
    out[1] = __builtin_shufflevector(xy01, xy23, 2, 3, 10, 11, 6, 7, 14, 15);
    out[2] = __builtin_shufflevector(zr01, zr23, 0, 1, 8, 9, 4, 5, 12, 13);
    out[3] = __builtin_shufflevector(zr01, zr23, 2, 3, 10, 11, 6, 7, 14, 15);
}

static inline unsigned lanes(i8 x)
{
#ifdef __AVX__
    return (unsigned)__builtin_ia32_movmskps256((f8)x);
#else
    unsigned m = 0;
    for (unsigned i = 0; i < 8; i++) m |= (unsigned)(x[i] & 1) << i;
    return m;
#endif
}

static inline f8 choose(i8 which, f8 yes, f8 no) { return (f8)(((i8)yes & which) | ((i8)no & ~which)); }

static inline f8 root8(f8 x)
{
#ifdef __AVX__
    return (f8)__builtin_ia32_sqrtps256(x);
#else
    for (int i = 0; i < 8; i++) x[i] = sqrtf(x[i]);
    return x;
#endif
}

/* Eight segments as a ray sees them. */
struct eight {
    f8 t;          /* where it comes in */
    i8 met, along; /* whether it does; along: it runs nearly along the axis, and t is not known */
};

/* The first ends of eight segments from the start of the ray, turned around, and their axes. */
static inline void place_eight(const struct grid_walk *w, const uint32_t *entry, f8 o[3], f8 a[3], f8 radius[2])
{
    const struct scene_grid *g = w->g;
    uint32_t at[8];
    f8 v[4], end[4];
    i8 numbers;
    for (int i = 0; i < 8; i++) at[i] = entry[i] & g->vertex_mask;
    gather(w->s->vertex, at, v);
    gather(w->s->vertex + 1, at, end);
    for (int k = 0; k < 3; k++) {
        o[k] = w->o[k] - v[k];
        a[k] = end[k] - v[k];
    }
    radius[0] = v[3];
    radius[1] = end[3];
    memcpy(&numbers, entry, sizeof numbers);
    if (lanes(((numbers ^ (int32_t)g->here) & (int32_t) ~(g->begin_bit | g->vertex_mask)) == 0) == 255) return;
    for (int i = 0; i < 8; i++) {
        const float *shift = g->shift_mm[(uint64_t)entry[i] >> g->shift_bit];
        o[0][i] += shift[0];
        o[1][i] += shift[1];
    }
}

/* segment_meet for eight entries at once, in the frame of the ray: lengths across it, and along it counts of its
 * direction. The axis of a segment is a; the ray runs past its first end at p. On the cone that touches both balls,
 *     z^2 slope - 2 z a_z g + g^2 - cone (p^2 - r^2) = 0,   cone = slope + a_z^2,
 * and the ball that touches there has the place (g + z a_z) / cone of the way from the first end to the second. */
static inline struct eight meet_eight(const struct grid_walk *w, const uint32_t *entry)
{
    struct eight m;
    i8 numbers;
    f8 o[3], a[3], radius[2];
    place_eight(w, entry, o, a, radius);
    const f8 px = along8(o, w->across[0]), py = along8(o, w->across[1]), start = along8(o, w->along),
             ax = along8(a, w->across[0]), ay = along8(a, w->across[1]), az = along8(a, w->along);
    const f8 rate = radius[1] - radius[0], r2 = radius[0] * radius[0], off2 = ax * ax + ay * ay,
             slope = off2 - rate * rate, az_d2 = az * w->d2, cone = slope + az * az_d2, side = px * ay - py * ax,
             pa = px * ax + py * ay, p2 = px * px + py * py, g = pa + radius[0] * rate,
             root2 = off2 * r2 - side * side + rate * (2 * radius[0] * pa + rate * p2),
             z = (az * g - root8(root2 * cone * w->inv_d2)) / slope, place = g + z * az_d2;
    const i8 before = place<0, after = place> cone;
    m.along = ~(slope > 1e-6f * cone);
    m.met = root2 >= 0;
    m.t = z - start;
    const f8 qx = px - (f8)((i8)ax & after), qy = py - (f8)((i8)ay & after),
             ball = choose(after, radius[1] * radius[1], r2) - (qx * qx + qy * qy);
    memcpy(&numbers, entry, sizeof numbers);
    const i8 begins = (numbers & (int32_t)w->g->begin_bit) != 0, meets_ball = (ball >= 0) & (after | (before & begins));
    m.met &= ~(before | after) | meets_ball;
    m.t = choose(before | after, (f8)((i8)az & after) - root8(ball * w->inv_d2) - start, m.t);
    return m;
}

/* The entries of the ray's cell, eight at a time. */
struct cell_entries {
    const uint32_t *entry, *next, *end; /* the present eight, and those after them */
    unsigned left;
    float t[8];
};

/* Asks for the cell beyond an axis before it is needed. */
static inline void prefetch(const struct grid_walk *w, int k)
{
    int at[3] = {w->at[0], w->at[1], w->at[2]};
    at[k] += w->step[k];
    if ((unsigned)at[k] < (unsigned)w->g->n[k])
        __builtin_prefetch(w->g->entry + w->g->first[scene_grid_cell(w->g, at[0], at[1], at[2])]);
}

static inline struct cell_entries entries_of(const struct grid_walk *w)
{
    const size_t cell = scene_grid_cell(w->g, w->at[0], w->at[1], w->at[2]);
    struct cell_entries e;
    e.next = w->g->entry + w->g->first[cell];
    e.end = w->g->entry + w->g->first[cell + 1];
    e.left = 0;
    return e;
}

/* Where the ray comes into one of these segments that runs nearly along it. */
static float meet_along(const struct grid_walk *w, uint32_t entry)
{
    const float *shift = w->g->shift_mm[(uint64_t)entry >> w->g->shift_bit];
    const struct scene_vertex *v = &w->s->vertex[entry & w->g->vertex_mask];
    const float o[3] = {w->o[0] + shift[0] - v->x, w->o[1] + shift[1] - v->y, w->o[2] - v->z};
    return segment_meet(v, o, w->d, w->d2);
}

/* Looks at the next eight. False: there are none. */
static inline bool next_eight(const struct grid_walk *w, struct cell_entries *e, float t_far)
{
    e->entry = e->next;
    if (e->entry >= e->end) return false;
    e->next += 8; /* the array goes on for eight entries behind the last one */
    const unsigned there = e->end - e->entry < 8 ? (1u << (e->end - e->entry)) - 1 : 255;
    struct eight m = meet_eight(w, e->entry);
    for (unsigned along = lanes(m.along) & there; along != 0; along &= along - 1) {
        const int i = __builtin_ctz(along);
        m.t[i] = meet_along(w, e->entry[i]);
        m.met[i] = -1;
    }
    e->left = lanes(m.met & (m.t > w->t_near) & (m.t < t_far)) & there;
    memcpy(e->t, &m.t, sizeof e->t);
    return true;
}

/* Whether a face counts where the ray comes into a segment. */
static inline bool counts(const struct grid_walk *w, uint32_t entry, float t)
{
    if (!w->checked) return true;
    const float *shift = w->g->shift_mm[(uint64_t)entry >> w->g->shift_bit],
                at[3] = {w->o[0] + shift[0] + t * w->d[0], w->o[1] + shift[1] + t * w->d[1], w->o[2] + t * w->d[2]};
    return !scene_faces_inside(w->s, w->g->segment_of[entry & w->g->vertex_mask],
                               t < w->near_t ? w->i_from : SCENE_NO_SEGMENT, at);
}

/* The next segment that the ray comes into before t_far, and where; NULL: there is none. */
static inline const uint32_t *next_entry(const struct grid_walk *w, struct cell_entries *e, float t_far, float *t)
{
    for (;;) {
        while (e->left != 0) {
            const int i = __builtin_ctz(e->left);
            e->left &= e->left - 1;
            *t = e->t[i];
            if (*t < t_far && counts(w, e->entry[i], *t)) return &e->entry[i];
        }
        if (!next_eight(w, e, t_far)) return NULL;
    }
}

static inline int first_axis(const float t[3]) { return t[0] < t[1] ? (t[0] < t[2] ? 0 : 2) : t[1] < t[2] ? 1 : 2; }

bool scene_grid_trace(const struct scene *s, const struct scene_ray *r, float t_far, struct scene_face *face)
{
    struct grid_walk w;
    start(&w, s, r);
    face->t = t_far;
    face->i_segment = SCENE_NO_SEGMENT;
    for (;;) {
        const int k = first_axis(w.next);
        struct cell_entries cell = entries_of(&w);
        prefetch(&w, k);
        float t;
        for (const uint32_t *e; (e = next_entry(&w, &cell, face->t, &t)) != NULL;) {
            const int i_shift = (int)((uint64_t)*e >> w.g->shift_bit);
            face->t = t;
            face->i_segment = w.g->segment_of[*e & w.g->vertex_mask];
            face->copy[0] = w.copy[0] - w.g->shift_low[0] - i_shift % w.g->n_shift[0];
            face->copy[1] = w.copy[1] - w.g->shift_low[1] - i_shift / w.g->n_shift[0];
        }
        if (face->t <= w.next[k] || !move_on(&w, k)) return face->i_segment != SCENE_NO_SEGMENT;
    }
}

bool scene_grid_occluded(const struct scene *s, const struct scene_ray *r, float t_far)
{
    struct grid_walk w;
    start(&w, s, r);
    for (;;) {
        const int k = first_axis(w.next);
        struct cell_entries cell = entries_of(&w);
        prefetch(&w, k);
        float t;
        if (next_entry(&w, &cell, t_far, &t) != NULL) return true;
        if (t_far <= w.next[k] || !move_on(&w, k)) return false;
    }
}

bool scene_grid_visit(const struct scene *s, const struct scene_ray *r, float t_far, struct scene_visitor *v)
{
    struct grid_walk w;
    float begin = r->tnear_mm;
    start(&w, s, r);
    w.checked = true;
    w.near_t = 0;
    for (;;) {
        const int k = first_axis(w.next);
        struct cell_entries cell = entries_of(&w);
        prefetch(&w, k);
        float t;
        for (const uint32_t *e; (e = next_entry(&w, &cell, fminf(t_far, w.next[k]), &t)) != NULL;)
            if (t >= begin && !scene_visitor_see(v, w.g->segment_of[*e & w.g->vertex_mask])) return true;
        begin = w.next[k];
        if (t_far <= begin || !move_on(&w, k)) return false;
    }
}
