/* Rays through the fibers of a bent cloth, in each cell of the shell straight through those of the flat one. */
#include "renderer/scene/bent_scene.h"
#include "renderer/scene/scene_visitor.h"

#include <math.h>
#include <string.h>

enum { MOST_CELLS = 100000 };

struct walk_on_shell {
    const struct scene *s;
    const struct bent_cloth *b;
    struct shell_walk on;
    struct scene_visitor *visitor; /* or NULL */
    bool inside;                   /* as in scene_ray, as is the next one */
    uint32_t i_from;
};

/* The ray in the flat cloth, from where it is now. */
static void to_flat(const struct walk_on_shell *w, struct scene_ray *r)
{
    double p[3], d[3];
    shell_walk_flat(&w->on, p, d);
    for (int a = 0; a < 3; a++) {
        if (a < 2) {
            r->offset_mm[a] = floor(p[a] / w->s->tile_mm[a]) * w->s->tile_mm[a];
            p[a] -= r->offset_mm[a];
        }
        r->origin_mm[a] = (float)p[a];
        r->direction[a] = (float)d[a];
    }
    r->tnear_mm = 0;
    r->inside = w->inside;
    r->i_from = w->i_from;
}

/* A hit in the flat cloth as it is seen. Normals go through the inverse transpose, so that they stay at a right angle
 * with what they are normals of. */
static void hit_here(const struct walk_on_shell *w, double t, struct scene_hit *hit)
{
    const struct shell_cell *c = &w->b->space.shell.cell[w->on.i_cell];
    double x[3], tangent[3], normal[3], length[2] = {0.0, 0.0};
    shell_walk_point(&w->on, t, x);
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
    hit->i_cell = w->on.i_cell;
}

/* Whether any hit lies in this cell, or with a visitor, whether it has asked to stop there. */
static bool occluded_here(struct walk_on_shell *w, const struct scene_ray *r, double span)
{
    const struct shell_cell *c = &w->b->space.shell.cell[w->on.i_cell];
    for (int a = 0; a < 3 && w->visitor != NULL; a++) w->visitor->to_seen[a] = c->to_world[a];
    return scene_occluded_span(&w->b->flat, r, (float)span, w->visitor);
}

/* hit NULL: any hit, which it need not describe. */
static bool walk(struct walk_on_shell *w, double tnear, struct scene_hit *hit)
{
    struct shell_walk *on = &w->on;
    if (on->i_cell != SHELL_OUTSIDE) {
        on->t = tnear;
        shell_walk_find_start(on);
        on->from_face = -1;
    }
    for (int i = 0; i < MOST_CELLS; i++) {
        if (on->i_cell == SHELL_OUTSIDE && !shell_walk_enter(on)) return false;
        if (on->i_cell == SHELL_ON_SHEET) return false;
        int face;
        double t = shell_walk_exit(on, &face), span = t - on->t + SHELL_OVERLAP_MM;
        struct scene_ray r;
        float distance;
        to_flat(w, &r);
        if (hit == NULL) {
            if (occluded_here(w, &r, span)) return true;
        } else if (scene_trace_span(&w->b->flat, &r, (float)span, hit, &distance)) {
            hit_here(w, on->t + (double)distance, hit);
            return true;
        }
        shell_walk_on(on, t, face);
    }
    return false;
}

static void start_walk(const struct scene *s, const struct scene_ray *ray, struct walk_on_shell *w)
{
    *w = (struct walk_on_shell){
        .s = s,
        .b = s->bent,
        .inside = ray->inside,
        .i_from = ray->i_from,
        .on = {.space = &s->bent->space, .black_sheet = s->black_sheet, .i_cell = ray->i_cell, .from_face = -1}};
    for (int a = 0; a < 3; a++) {
        w->on.origin[a] = (double)ray->origin_mm[a] + (a < 2 ? ray->offset_mm[a] : 0.0);
        w->on.direction[a] = (double)ray->direction[a];
    }
}

bool bent_trace(const struct scene *s, struct scene_ray *ray, struct scene_hit *hit)
{
    struct walk_on_shell w;
    start_walk(s, ray, &w);
    if (walk(&w, (double)ray->tnear_mm, hit)) return true;
    ray->i_cell = w.on.i_cell;
    return false;
}

bool bent_occluded(const struct scene *s, const struct scene_ray *ray, struct scene_visitor *visitor)
{
    struct walk_on_shell w;
    start_walk(s, ray, &w);
    w.visitor = visitor;
    if (visitor != NULL) visitor->flat = &s->bent->flat;
    return walk(&w, (double)ray->tnear_mm, NULL) || w.on.i_cell == SHELL_ON_SHEET;
}

bool bent_enter(const struct scene *s, const double origin_mm[3], const double direction[3], struct scene_ray *r)
{
    const struct shell *h = &s->bent->space.shell;
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
    r->inside = false;
    r->i_from = SCENE_NO_SEGMENT;
    r->i_cell = SHELL_OUTSIDE;
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
    return s->bent != NULL ? ray->i_cell == SHELL_ON_SHEET : ray->direction[2] < 0;
}

bool scene_bent_normal(const struct scene *s, const struct scene_hit *hit, float normal[3])
{
    if (s->bent == NULL) return false;
    const double *n = s->bent->space.shell.cell[hit->i_cell].to_cloth[2];
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int a = 0; a < 3; a++) normal[a] = (float)(n[a] / length);
    return true;
}
