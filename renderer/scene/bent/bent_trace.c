/* Rays through a shell: from cell to cell, in each of them straight through the flat cloth. Distances along a ray are
 * the same in both spaces, since the map is affine and the direction goes through it with its length. */
#include "renderer/scene/bent/bent_scene.h"

#include <math.h>
#include <string.h>

enum { MOST_CELLS = 100000, MOST_STEPS = 16 };

/* The far end of a cell is taken this much further, so that rounding leaves no gap before the next. */
#define OVERLAP_MM 1e-6

struct walk_on_shell {
    const struct scene *s;
    const struct bent_cloth *b;
    double origin[3], direction[3];
    double t;        /* how far it has come */
    uint32_t i_cell; /* BENT_OUTSIDE: in the open */
    int from_face;   /* the face through which it came into the cell; -1: it started there */
};

static inline double plane_at(const double p[4], const double x[3])
{
    return p[0] * x[0] + p[1] * x[1] + p[2] * x[2] + p[3];
}

static inline double along(const double p[4], const double d[3]) { return p[0] * d[0] + p[1] * d[1] + p[2] * d[2]; }

static void point_at(const struct walk_on_shell *w, double t, double x[3])
{
    for (int a = 0; a < 3; a++) x[a] = w->origin[a] + t * w->direction[a];
}

/* Moves to the cell that holds the start of the ray, which scattering across a fiber may have put beyond a face. Where
 * the start lies outside of the shell, the last cell's map serves. */
static void find_start(struct walk_on_shell *w)
{
    double x[3];
    point_at(w, w->t, x);
    for (int i = 0; i < MOST_STEPS; i++) {
        const struct shell_cell *c = &w->b->shell.cell[w->i_cell];
        int worst = 0;
        double least = INFINITY;
        for (int k = 0; k < 4; k++) {
            double at = plane_at(c->plane[k], x);
            if (at < least) {
                least = at;
                worst = k;
            }
        }
        if (least >= -1e-9 || c->neighbour[worst] == SHELL_NONE) return;
        w->i_cell = c->neighbour[worst];
    }
}

/* Where the ray leaves its cell, and through which face. */
static double leave_at(const struct walk_on_shell *w, int *face)
{
    const struct shell_cell *c = &w->b->shell.cell[w->i_cell];
    double t = INFINITY;
    *face = -1;
    for (int k = 0; k < 4; k++) {
        double rate = along(c->plane[k], w->direction);
        if (k == w->from_face || !(rate < 0.0)) continue;
        double at = -plane_at(c->plane[k], w->origin) / rate;
        if (at < t) {
            t = at;
            *face = k;
        }
    }
    return t > w->t ? t : w->t;
}

static int face_towards(const struct shell_cell *c, uint32_t i_cell)
{
    for (int k = 0; k < 4; k++)
        if (c->neighbour[k] == i_cell) return k;
    return -1;
}

/* The ray in the flat cloth, from where it is now. */
static void to_flat(const struct walk_on_shell *w, double tnear, struct scene_ray *r)
{
    const struct shell_cell *c = &w->b->shell.cell[w->i_cell];
    double x[3];
    point_at(w, w->t, x);
    for (int a = 0; a < 3; a++) {
        double p = plane_at(c->to_cloth[a], x);
        if (a < 2) {
            r->offset_mm[a] = floor(p / w->s->tile_mm[a]) * w->s->tile_mm[a];
            p -= r->offset_mm[a];
        }
        r->origin_mm[a] = (float)p;
        r->direction[a] = (float)along(c->to_cloth[a], w->direction);
    }
    r->tnear_mm = (float)tnear;
}

/* A hit in the flat cloth as it is seen. Normals go through the inverse transpose, so that they stay at a right angle
 * with what they are normals of. */
static void hit_here(const struct walk_on_shell *w, double t, struct scene_hit *hit)
{
    const struct shell_cell *c = &w->b->shell.cell[w->i_cell];
    double x[3], tangent[3], normal[3], length[2] = {0.0, 0.0};
    point_at(w, t, x);
    for (int a = 0; a < 3; a++) {
        tangent[a] = normal[a] = 0.0;
        for (int k = 0; k < 3; k++) {
            tangent[a] += (double)c->to_world[a][k] * (double)hit->tangent[k];
            normal[a] += c->to_cloth[k][a] * (double)hit->normal[k];
        }
        length[0] += tangent[a] * tangent[a];
        length[1] += normal[a] * normal[a];
    }
    for (int a = 0; a < 3; a++) {
        hit->position_mm[a] = (float)x[a];
        hit->tangent[a] = (float)(tangent[a] / sqrt(length[0]));
        hit->normal[a] = (float)(normal[a] / sqrt(length[1]));
    }
    hit->radius_mm *= c->scale;
    hit->i_cell = w->i_cell;
}

/* From the open to the next outer face that leads into the shell. False: there is none. */
static bool come_in(struct walk_on_shell *w)
{
    struct RTCIntersectContext context;
    struct RTCRayHit q;
    rtcInitIntersectContext(&context);
    double start = w->t;
    for (int i = 0; i < MOST_STEPS; i++) {
        double x[3];
        point_at(w, start, x);
        memset(&q, 0, sizeof q);
        q.ray = (struct RTCRay){.org_x = (float)x[0],
                                .org_y = (float)x[1],
                                .org_z = (float)x[2],
                                .dir_x = (float)w->direction[0],
                                .dir_y = (float)w->direction[1],
                                .dir_z = (float)w->direction[2],
                                .tfar = INFINITY,
                                .mask = ~0u};
        q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(w->b->outer, &context, &q);
        if (q.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
        uint32_t f = q.hit.primID;
        double inwards = (double)q.hit.Ng_x * w->direction[0] + (double)q.hit.Ng_y * w->direction[1] +
                         (double)q.hit.Ng_z * w->direction[2];
        start += (double)q.ray.tfar;
        if (inwards < 0.0) {
            w->t = start;
            w->i_cell = w->s->black_sheet && w->b->shell.outer_bottom[f] ? BENT_ON_SHEET : w->b->shell.outer_cell[f];
            w->from_face = -1;
            return w->i_cell != BENT_ON_SHEET;
        }
        start += 1e-6 * (1.0 + fabs(start)); /* a way out, which rounding has put before the ray */
    }
    return false;
}

/* Goes on into the neighbouring cell, into the open or onto the black sheet. */
static void go_on(struct walk_on_shell *w, double t, int face)
{
    const struct shell_cell *c = &w->b->shell.cell[w->i_cell];
    uint32_t next = face >= 0 ? c->neighbour[face] : SHELL_NONE;
    w->t = t;
    if (next == SHELL_NONE) {
        bool sheet = face >= 0 && (c->bottom >> face & 1) != 0 && w->s->black_sheet;
        w->i_cell = sheet ? BENT_ON_SHEET : BENT_OUTSIDE;
        w->t += OVERLAP_MM;
        return;
    }
    w->from_face = face_towards(&w->b->shell.cell[next], w->i_cell);
    w->i_cell = next;
}

/* hit NULL: any front face, which it need not describe. */
static bool walk(struct walk_on_shell *w, double tnear, struct scene_hit *hit)
{
    if (w->i_cell != BENT_OUTSIDE) {
        w->t = tnear;
        find_start(w);
        w->from_face = -1;
    }
    for (int i = 0; i < MOST_CELLS; i++) {
        if (w->i_cell == BENT_OUTSIDE && !come_in(w)) return false;
        if (w->i_cell == BENT_ON_SHEET) return false;
        int face;
        double t = leave_at(w, &face), span = t - w->t + OVERLAP_MM;
        struct scene_ray r;
        float distance;
        to_flat(w, 0.0, &r);
        if (hit == NULL) {
            if (scene_occluded_span(&w->b->flat, &r, (float)span)) return true;
        } else if (scene_trace_span(&w->b->flat, &r, (float)span, hit, &distance)) {
            hit_here(w, w->t + (double)distance, hit);
            return true;
        }
        go_on(w, t, face);
    }
    return false;
}

static void start_walk(const struct scene *s, const struct scene_ray *ray, struct walk_on_shell *w)
{
    *w = (struct walk_on_shell){.s = s, .b = s->bent, .i_cell = ray->i_cell, .from_face = -1};
    for (int a = 0; a < 3; a++) {
        w->origin[a] = (double)ray->origin_mm[a] + (a < 2 ? ray->offset_mm[a] : 0.0);
        w->direction[a] = (double)ray->direction[a];
    }
}

bool bent_trace(const struct scene *s, struct scene_ray *ray, struct scene_hit *hit)
{
    struct walk_on_shell w;
    start_walk(s, ray, &w);
    if (walk(&w, (double)ray->tnear_mm, hit)) return true;
    ray->i_cell = w.i_cell;
    return false;
}

bool bent_occluded(const struct scene *s, const struct scene_ray *ray)
{
    struct walk_on_shell w;
    start_walk(s, ray, &w);
    return walk(&w, (double)ray->tnear_mm, NULL) || w.i_cell == BENT_ON_SHEET;
}

bool bent_enter(const struct scene *s, const double origin_mm[3], const double direction[3], struct scene_ray *r)
{
    const struct shell *h = &s->bent->shell;
    double near = 0.0, far = INFINITY; /* to the box around the shell, in double precision */
    for (int a = 0; a < 3; a++) {
        double low = (h->low_mm[a] - 0.01 - origin_mm[a]) / direction[a];
        double high = (h->high_mm[a] + 0.01 - origin_mm[a]) / direction[a];
        if (direction[a] == 0.0) continue;
        near = fmax(near, fmin(low, high));
        far = fmin(far, fmax(low, high));
    }
    if (near > far) near = 0.0; /* it misses the box, and scene_trace will find nothing */
    for (int a = 0; a < 3; a++) {
        r->origin_mm[a] = (float)(origin_mm[a] + near * direction[a]);
        r->direction[a] = (float)direction[a];
    }
    r->offset_mm[0] = r->offset_mm[1] = 0.0;
    r->tnear_mm = 0;
    r->i_cell = BENT_OUTSIDE;
    return true;
}

/* ---- what differs between a flat and a bent cloth ---- */

bool scene_sheet_hides(const struct scene *s, const float direction[3])
{
    return s->black_sheet && s->bent == NULL && direction[2] <= 0;
}

bool scene_sheet_met(const struct scene *s, const struct scene_ray *ray)
{
    if (!s->black_sheet) return false;
    return s->bent != NULL ? ray->i_cell == BENT_ON_SHEET : ray->direction[2] < 0;
}

bool scene_bent_normal(const struct scene *s, const struct scene_hit *hit, float normal[3])
{
    if (s->bent == NULL) return false;
    const double *n = s->bent->shell.cell[hit->i_cell].to_cloth[2];
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int a = 0; a < 3; a++) normal[a] = (float)(n[a] / length);
    return true;
}
