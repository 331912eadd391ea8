/* The interface of renderer/scene (scene.h, scene_ray.h) written a second time, from the definition: a fiber is one
 * closed tube, the union of the convex hulls of the balls at both ends of its segments, over the faces of the tile too.
 * A program that is linked with this file traces these tubes in double precision, without Embree.
 *
 * A ray leaves the tubes that it starts in, each at its end, and hits the next one that it comes into. A bent cloth is
 * the image of these tubes under the map of its shell. The member i_cell of a ray is the number of the segment that
 * scattered it plus 1, or 0: a start that single precision has moved off the surface is put back there.
 */
#include "renderer/scene/scene.h"
#include "renderer/scene/scene_ray.h"
#include "tests/exact/exact_bent.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MM_PER_M 1e3
#define MARGIN_MM 1e-3

/* A tube whose interval begins within this share of a radius from the start of a ray contains the start: of one that is
 * put back on the surface, and of any other. Starts farther from the surface are not put back. */
static const double slack_on_surface = 1e-6, slack_elsewhere = 1e-4, put_back_within = 1e-3;

/* i_cell of a ray that has ended on the sheet of a bent cloth. */
#define ON_SHEET UINT32_MAX

struct scene {
    struct capsule_cloth cloth; /* of a bent scene: a copy, which the flat one owns */
    uint8_t *group;             /* of each fiber */
    size_t n_group;
    double bottom_mm, tile_mm[2];
    bool black_sheet, is_bent;
    struct exact_bent bent;
};

status scene_new(const struct fiber_set *f, const struct scene_option *o, struct scene **scene, struct error *err)
{
    status st = fiber_set_validate(f, err);
    if (st != STATUS_OK) return st;
    struct scene *s = calloc(1, sizeof *s);
    double z_min_m, z_max_m;
    fiber_set_z_range_m(f, &z_min_m, &z_max_m);
    if (s != NULL) s->group = malloc(f->n_fiber);
    if (s == NULL || s->group == NULL || !capsule_cloth_init(&s->cloth, f, z_max_m)) {
        scene_free(s);
        return error_set(err, STATUS_NO_MEMORY, "cannot build the exact scene: out of memory");
    }
    memcpy(s->group, f->group, f->n_fiber);
    s->bottom_mm = (z_min_m - z_max_m) * MM_PER_M;
    s->black_sheet = o->black_sheet;
    s->n_group = fiber_set_n_group(f);
    memcpy(s->tile_mm, s->cloth.tile_mm, sizeof s->tile_mm);
    *scene = s;
    return STATUS_OK;
}

status scene_bend(const struct scene *flat, const struct mesh *mesh, bool black_sheet, struct scene **bent,
                  struct error *err)
{
    struct scene *s = malloc(sizeof *s);
    if (s != NULL) {
        memcpy(s, flat, sizeof *s);
        s->black_sheet = black_sheet;
        s->is_bent = true;
    }
    if (s == NULL || !exact_bent_init(&s->bent, mesh, MARGIN_MM, MARGIN_MM - flat->bottom_mm)) {
        scene_free(s);
        return error_set(err, STATUS_NO_MEMORY, "cannot bend the exact scene: out of memory");
    }
    *bent = s;
    return STATUS_OK;
}

void scene_free(struct scene *s)
{
    if (s == NULL) return;
    if (s->is_bent) {
        exact_bent_release(&s->bent);
    } else {
        capsule_cloth_release(&s->cloth);
        free(s->group);
    }
    free(s);
}

/* ---- rays ---- */

/* Puts a start back on the surface of a segment. False: it lies too far from there. */
static bool put_back(const struct scene *s, uint32_t i_segment, double o[3])
{
    const double within = put_back_within * s->cloth.capsule[i_segment].radius[0];
    if (!s->is_bent) return capsule_cloth_project(&s->cloth, i_segment, within, o);
    const struct exact_cell *cell = &s->bent.cell[exact_bent_cell(&s->bent, o)];
    double flat[3], way[3];
    exact_cell_to_cloth(cell, o, flat);
    memcpy(way, flat, sizeof way);
    if (!capsule_cloth_project(&s->cloth, i_segment, within, flat)) return false;
    for (int k = 0; k < 3; k++) way[k] = flat[k] - way[k];
    exact_cell_move(cell, way, o);
    return true;
}

/* The start of a ray as it is known to double precision. */
static void start_of(const struct scene *s, const struct scene_ray *r, struct capsule_walk *w, double o[3], double d[3])
{
    double length2 = 0.0;
    for (int k = 0; k < 3; k++) {
        o[k] = (double)r->origin_mm[k];
        d[k] = (double)r->direction[k];
        length2 += d[k] * d[k];
    }
    for (int k = 0; k < 3; k++) d[k] /= sqrt(length2);
    const bool is_back = r->i_cell != 0 && put_back(s, r->i_cell - 1, o);
    w->slack = s->cloth.capsule[0].radius[0] * (is_back ? slack_on_surface : slack_elsewhere);
    w->n_open = w->n_part = 0;
}

static enum exact_end next_entrance(const struct scene *s, const struct scene_ray *r, double o[3], double d[3],
                                    struct capsule_entrance *e, uint32_t *i_cell)
{
    struct capsule_walk w;
    start_of(s, r, &w, o, d);
    if (s->is_bent) return exact_bent_walk(&s->bent, &s->cloth, &w, o, d, s->black_sheet, e, i_cell);
    return capsule_walk_piece(&w, &s->cloth, o, d, 0.0, INFINITY, e) ? EXACT_MET : EXACT_LEFT;
}

/* Fills in a hit at x, all but its position. */
static void describe(const struct scene *s, const struct capsule_entrance *e, uint32_t i_cell, const double x[3],
                     struct scene_hit *hit)
{
    const struct capsule *c = &s->cloth.capsule[e->i_capsule];
    const struct exact_cell *cell = s->is_bent ? &s->bent.cell[i_cell] : NULL;
    double flat[3] = {x[0], x[1], x[2]}, normal[3], radius, length[2] = {0.0, 0.0}, n[3], t[3];
    if (cell != NULL) exact_cell_to_cloth(cell, x, flat);
    for (int k = 0; k < 2; k++) flat[k] -= e->shift[k] * s->tile_mm[k];
    capsule_distance(c, flat, normal, &radius);
    for (int a = 0; a < 3; a++) {
        n[a] = cell == NULL ? normal[a] : 0.0;
        t[a] = cell == NULL ? c->axis[a] : 0.0;
        for (int k = 0; k < 3 && cell != NULL; k++) { /* normals go through the inverse transpose */
            n[a] += cell->to_cloth[k][a] * normal[k];
            t[a] += cell->to_world[a][k] * c->axis[k];
        }
        length[0] += n[a] * n[a];
        length[1] += t[a] * t[a];
    }
    for (int a = 0; a < 3; a++) {
        hit->normal[a] = (float)(n[a] / sqrt(length[0]));
        hit->tangent[a] = (float)(t[a] / sqrt(length[1]));
    }
    hit->radius_mm = (float)(cell != NULL ? radius * cell->scale : radius);
    hit->i_segment = e->i_capsule;
    hit->i_cell = i_cell;
}

bool scene_trace(const struct scene *s, struct scene_ray *r, struct scene_hit *hit)
{
    double o[3], d[3];
    struct capsule_entrance e;
    uint32_t i_cell = 0;
    const enum exact_end end = next_entrance(s, r, o, d, &e, &i_cell);
    if (end == EXACT_ON_SHEET) r->i_cell = ON_SHEET;
    if (end != EXACT_MET) return false;
    for (int k = 0; k < 3; k++) o[k] += e.t * d[k];
    describe(s, &e, i_cell, o, hit);
    for (int k = 0; k < 3; k++) {
        if (k < 2 && !s->is_bent) {
            const double whole = floor(o[k] / s->tile_mm[k]) * s->tile_mm[k];
            r->offset_mm[k] += whole;
            o[k] -= whole;
            r->origin_mm[k] = (float)((double)r->origin_mm[k] - whole);
        }
        hit->position_mm[k] = (float)o[k];
    }
    return true;
}

bool scene_occluded(const struct scene *s, const struct scene_ray *r)
{
    double o[3], d[3];
    struct capsule_entrance e;
    uint32_t i_cell;
    return next_entrance(s, r, o, d, &e, &i_cell) != EXACT_LEFT;
}

void scene_ray_leave(const struct scene_hit *hit, const double offset_mm[2], const float direction[3],
                     struct scene_ray *r)
{
    memcpy(r->offset_mm, offset_mm, sizeof r->offset_mm);
    memcpy(r->origin_mm, hit->position_mm, sizeof r->origin_mm);
    memcpy(r->direction, direction, sizeof r->direction);
    r->tnear_mm = 0;
    r->i_cell = hit->i_segment + 1;
}

/* The place on the straight cylinder about the axis at the hit. */
void scene_ray_leave_across(const struct scene_hit *hit, const double offset_mm[2], const float direction[3],
                            float place, struct scene_ray *r)
{
    double front[3], side[3], along = 0.0, length2 = 0.0;
    const double across = 2.0 * (double)place - 1.0, towards = sqrt(1.0 - across * across);
    for (int k = 0; k < 3; k++) along += (double)direction[k] * (double)hit->tangent[k];
    for (int k = 0; k < 3; k++) {
        front[k] = (double)direction[k] - along * (double)hit->tangent[k];
        length2 += front[k] * front[k];
    }
    for (int k = 0; k < 3; k++) front[k] = length2 > 0.0 ? front[k] / sqrt(length2) : 0.0;
    for (int k = 0; k < 3; k++)
        side[k] = (double)hit->tangent[(k + 1) % 3] * front[(k + 2) % 3] -
                  (double)hit->tangent[(k + 2) % 3] * front[(k + 1) % 3];
    for (int k = 0; k < 3; k++)
        r->origin_mm[k] =
            (float)((double)hit->position_mm[k] +
                    (double)hit->radius_mm * (across * side[k] + towards * front[k] - (double)hit->normal[k]));
    memcpy(r->offset_mm, offset_mm, sizeof r->offset_mm);
    memcpy(r->direction, direction, sizeof r->direction);
    r->tnear_mm = 0;
    r->i_cell = hit->i_segment + 1;
}

/* To the plane above or below a flat cloth. False: the ray never meets it. */
static bool to_slab(const struct scene *s, const double o[3], const double d[3], double *t)
{
    const double top = MARGIN_MM, bottom = s->bottom_mm - MARGIN_MM;
    *t = 0.0;
    if ((o[2] > top && d[2] >= 0.0) || (o[2] < bottom && d[2] <= 0.0)) return false;
    if (o[2] > top) *t = (top - o[2]) / d[2];
    if (o[2] < bottom) *t = (bottom - o[2]) / d[2];
    return true;
}

/* To a box around a bent cloth, or nowhere when the ray misses it. */
static double to_box(const struct exact_bent *b, const double o[3], const double d[3])
{
    double near = 0.0, far = INFINITY;
    for (int k = 0; k < 3; k++) {
        if (d[k] == 0.0) continue;
        const double low = (b->low_mm[k] - 0.01 - o[k]) / d[k], high = (b->high_mm[k] + 0.01 - o[k]) / d[k];
        near = fmax(near, fmin(low, high));
        far = fmin(far, fmax(low, high));
    }
    return near > far ? 0.0 : near;
}

bool scene_ray_enter(const struct scene *s, const double origin_mm[3], const double direction[3], struct scene_ray *r)
{
    double t;
    if (s->is_bent)
        t = to_box(&s->bent, origin_mm, direction);
    else if (!to_slab(s, origin_mm, direction, &t))
        return false;
    for (int k = 0; k < 3; k++) {
        double p = origin_mm[k] + t * direction[k];
        if (k < 2) {
            r->offset_mm[k] = s->is_bent ? 0.0 : floor(p / s->tile_mm[k]) * s->tile_mm[k];
            p -= r->offset_mm[k];
        }
        r->origin_mm[k] = (float)p;
        r->direction[k] = (float)direction[k];
    }
    r->tnear_mm = 0;
    r->i_cell = 0;
    return true;
}

/* ---- the cloth ---- */

bool scene_sheet_hides(const struct scene *s, const float direction[3])
{
    return s->black_sheet && !s->is_bent && direction[2] <= 0;
}

bool scene_sheet_met(const struct scene *s, const struct scene_ray *r)
{
    return s->black_sheet && (s->is_bent ? r->i_cell == ON_SHEET : r->direction[2] < 0);
}

bool scene_bent_normal(const struct scene *s, const struct scene_hit *hit, float normal[3])
{
    if (!s->is_bent) return false;
    const double *n = s->bent.cell[hit->i_cell].to_cloth[2];
    for (int k = 0; k < 3; k++) normal[k] = (float)(n[k] / sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]));
    return true;
}

bool scene_section_normal(const struct scene *s, const struct scene_hit *hit, float normal[3])
{
    (void)s, (void)hit, (void)normal;
    return false;
}
bool scene_has_films(const struct scene *s)
{
    (void)s;
    return false;
}
const struct film_groups *scene_films(const struct scene *s)
{
    static const struct film_groups none;
    (void)s;
    return &none;
}
const struct film_material *scene_film(const struct scene *s, uint32_t i_segment)
{
    (void)s, (void)i_segment;
    return NULL;
}
bool scene_shows_sections(const struct scene *s)
{
    (void)s;
    return false;
}
uint32_t scene_fiber_of(const struct scene *s, uint32_t i_segment) { return s->cloth.fiber[i_segment]; }
uint32_t scene_group_of(const struct scene *s, uint32_t i_segment) { return s->group[s->cloth.fiber[i_segment]]; }
size_t scene_set_of(const struct scene *s, uint32_t i_segment, size_t n_set)
{
    return n_set > 1 ? scene_group_of(s, i_segment) : 0;
}
size_t scene_n_group(const struct scene *s) { return s->n_group; }
void scene_tile_mm(const struct scene *s, double tile_mm[2]) { memcpy(tile_mm, s->tile_mm, sizeof s->tile_mm); }
double scene_thickness_mm(const struct scene *s) { return -s->bottom_mm; }
