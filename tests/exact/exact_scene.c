/* The interface of renderer/scene (scene.h, scene_ray.h) written a second time, from the definition: a fiber is one
 * closed tube, the union of the convex hulls of the balls at both ends of its segments, over the faces of the tile too.
 * A program that is linked with this file traces these tubes in double precision, without Embree.
 *
 * A ray leaves the tubes that it starts in, each at its end, and hits the next one that it comes into. The member
 * i_cell of a ray, which flat scenes do not use, is the number of the segment that scattered it plus 1, or 0: a start
 * that single precision has moved off the surface is put back there.
 */
#include "renderer/scene/scene_ray.h"
#include "tests/exact/capsule_cloth.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MM_PER_M 1e3
#define MARGIN_MM 1e-3

/* A tube whose interval begins within this share of a radius from the start of a ray contains the start: of one that is
 * put back on the surface, and of any other. Starts farther from the surface are not put back. */
static const double slack_on_surface = 1e-6, slack_elsewhere = 1e-4, put_back_within = 1e-3;

struct scene {
    struct capsule_cloth cloth;
    uint8_t *group; /* of each fiber */
    size_t n_group;
    double bottom_mm, tile_mm[2];
    bool black_sheet;
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

void scene_free(struct scene *s)
{
    if (s == NULL) return;
    capsule_cloth_release(&s->cloth);
    free(s->group);
    free(s);
}

/* ---- rays ---- */

/* Start and direction of a ray in double precision, the start put back on the surface that it lies on. */
static double start_of(const struct scene *s, const struct scene_ray *r, double o[3], double d[3])
{
    double length2 = 0.0;
    for (int k = 0; k < 3; k++) {
        o[k] = (double)r->origin_mm[k];
        d[k] = (double)r->direction[k];
        length2 += d[k] * d[k];
    }
    for (int k = 0; k < 3; k++) d[k] /= sqrt(length2);
    const double radius = s->cloth.capsule[r->i_cell == 0 ? 0 : r->i_cell - 1].radius[0];
    const bool put_back =
        r->i_cell != 0 && capsule_cloth_project(&s->cloth, r->i_cell - 1, put_back_within * radius, o);
    return radius * (put_back ? slack_on_surface : slack_elsewhere);
}

static bool next_entrance(const struct scene *s, const struct scene_ray *r, double o[3], double d[3],
                          struct capsule_entrance *e)
{
    struct capsule_walk w;
    w.slack = start_of(s, r, o, d);
    w.n_open = w.n_part = 0;
    return capsule_walk_piece(&w, &s->cloth, o, d, 0.0, INFINITY, e);
}

static void describe(const struct scene *s, const struct capsule_entrance *e, const double x[3], struct scene_hit *hit)
{
    const struct capsule *c = &s->cloth.capsule[e->i_capsule];
    const double there[3] = {x[0] - e->shift[0] * s->tile_mm[0], x[1] - e->shift[1] * s->tile_mm[1], x[2]};
    double normal[3], radius;
    capsule_distance(c, there, normal, &radius);
    for (int k = 0; k < 3; k++) {
        hit->normal[k] = (float)normal[k];
        hit->tangent[k] = (float)c->axis[k];
    }
    hit->radius_mm = (float)radius;
    hit->i_segment = e->i_capsule;
    hit->i_cell = 0;
}

bool scene_trace(const struct scene *s, struct scene_ray *r, struct scene_hit *hit)
{
    double o[3], d[3];
    struct capsule_entrance e;
    if (!next_entrance(s, r, o, d, &e)) return false;
    for (int k = 0; k < 3; k++) o[k] += e.t * d[k];
    describe(s, &e, o, hit);
    for (int k = 0; k < 3; k++) {
        if (k < 2) {
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
    return next_entrance(s, r, o, d, &e);
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

bool scene_ray_enter(const struct scene *s, const double origin_mm[3], const double direction[3], struct scene_ray *r)
{
    const double top = MARGIN_MM, bottom = s->bottom_mm - MARGIN_MM, z = origin_mm[2];
    double t = 0.0;
    if (z > top) {
        if (direction[2] >= 0.0) return false;
        t = (top - z) / direction[2];
    } else if (z < bottom) {
        if (direction[2] <= 0.0) return false;
        t = (bottom - z) / direction[2];
    }
    for (int k = 0; k < 3; k++) {
        double p = origin_mm[k] + t * direction[k];
        if (k < 2) {
            r->offset_mm[k] = floor(p / s->tile_mm[k]) * s->tile_mm[k];
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

bool scene_sheet_hides(const struct scene *s, const float direction[3]) { return s->black_sheet && direction[2] <= 0; }
bool scene_sheet_met(const struct scene *s, const struct scene_ray *r) { return s->black_sheet && r->direction[2] < 0; }
bool scene_bent_normal(const struct scene *s, const struct scene_hit *hit, float normal[3])
{
    (void)s, (void)hit, (void)normal;
    return false;
}
bool scene_section_normal(const struct scene *s, const struct scene_hit *hit, float normal[3])
{
    (void)s, (void)hit, (void)normal;
    return false;
}
bool scene_shows_sections(const struct scene *s)
{
    (void)s;
    return false;
}
uint32_t scene_fiber_of(const struct scene *s, uint32_t i_segment) { return s->cloth.fiber[i_segment]; }
uint32_t scene_group_of(const struct scene *s, uint32_t i_segment) { return s->group[s->cloth.fiber[i_segment]]; }
size_t scene_n_group(const struct scene *s) { return s->n_group; }
void scene_tile_mm(const struct scene *s, double tile_mm[2]) { memcpy(tile_mm, s->tile_mm, sizeof s->tile_mm); }
double scene_thickness_mm(const struct scene *s) { return -s->bottom_mm; }
