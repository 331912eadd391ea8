#include "renderer/scene/scene_place.h"
#include "renderer/scene/bent_scene.h"

#include <math.h>
#include <string.h>

/* A ray that begins on the shell begins so far above it, so that the surface it leaves does not shade it. */
static const float lift_mm = 0.02f;
enum { MOST_CELLS_BESIDE = 64 };

bool scene_is_bent(const struct scene *s) { return s->bent != NULL; }

void scene_segment_at(const struct scene *s, uint32_t i_segment, struct scene_segment *out)
{
    const struct scene_vertex *v = &s->vertex[s->segment_vertex[i_segment]];
    const float d[3] = {v[1].x - v[0].x, v[1].y - v[0].y, v[1].z - v[0].z};
    out->length_mm = sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    float inv = 1 / out->length_mm;
    out->middle_mm[0] = 0.5f * (v[0].x + v[1].x);
    out->middle_mm[1] = 0.5f * (v[0].y + v[1].y);
    out->middle_mm[2] = 0.5f * (v[0].z + v[1].z);
    for (int a = 0; a < 3; a++) out->tangent[a] = d[a] * inv;
    out->radius_mm = 0.5f * (v[0].radius + v[1].radius);
}

static float within(double x, double period) { return (float)(x - floor(x / period) * period); }

void scene_place_find(const struct scene *s, const struct scene_hit *hit, const double offset_mm[2],
                      struct scene_place *p)
{
    memset(p, 0, sizeof *p);
    if (s->bent == NULL) {
        for (int a = 0; a < 3; a++) {
            p->position_mm[a] = a < 2 ? within((double)hit->position_mm[a], s->tile_mm[a]) : hit->position_mm[a];
            p->to_cloth[a][a] = 1;
        }
        return;
    }
    const struct shell_cell *c = &s->bent->space.shell.cell[hit->i_cell];
    for (int a = 0; a < 3; a++) {
        double x = c->to_cloth[a][3];
        for (int k = 0; k < 3; k++) {
            x += c->to_cloth[a][k] * ((double)hit->position_mm[k] + (k < 2 ? offset_mm[k] : 0.0));
            p->to_cloth[a][k] = (float)c->to_cloth[a][k];
        }
        p->position_mm[a] = a < 2 ? within(x, s->tile_mm[a]) : (float)x;
    }
}

/* The mean long axis of both ends of a segment; an axis has no sign. */
static void long_axis_of(const struct scene *s, size_t i_segment, float axis[3])
{
    const size_t v = s->segment_vertex[i_segment];
    const float *a = s->long_axis[v], *b = s->long_axis[v + 1];
    const float sign = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] < 0 ? -1.0f : 1.0f;
    for (int i = 0; i < 3; i++) axis[i] = a[i] + sign * b[i];
}

/* Unit vector at right angles with a long axis and a tangent. */
static bool across_both(const float axis[3], const float t[3], float normal[3])
{
    float length2 = 0;
    for (int i = 0; i < 3; i++) {
        normal[i] = axis[(i + 1) % 3] * t[(i + 2) % 3] - axis[(i + 2) % 3] * t[(i + 1) % 3];
        length2 += normal[i] * normal[i];
    }
    if (!(length2 > 1e-6f)) return false;
    for (int i = 0; i < 3; i++) normal[i] /= sqrtf(length2);
    return true;
}

bool scene_short_axis(const struct scene *s, size_t i_segment, const float tangent[3], float axis[3])
{
    float along[3];
    long_axis_of(s, i_segment, along);
    return across_both(along, tangent, axis);
}

bool scene_section_normal(const struct scene *s, const struct scene_hit *hit, float normal[3])
{
    if (!s->has_sections && scene_film(s, hit->i_segment) == NULL) return false;
    float axis[3];
    long_axis_of(s, hit->i_segment, axis);
    if (s->bent != NULL) {
        const struct shell_cell *c = &s->bent->space.shell.cell[hit->i_cell];
        const float flat[3] = {axis[0], axis[1], axis[2]};
        for (int i = 0; i < 3; i++)
            axis[i] = (float)(c->to_world[i][0] * (double)flat[0] + c->to_world[i][1] * (double)flat[1] +
                              c->to_world[i][2] * (double)flat[2]);
    }
    return across_both(axis, hit->tangent, normal);
}

bool scene_has_sections(const struct scene *s) { return s->has_sections; }
bool scene_shows_sections(const struct scene *s) { return s->shows_sections; }

bool scene_has_films(const struct scene *s) { return s->films.n > 0; }

const struct film_material *scene_film(const struct scene *s, uint32_t i_segment)
{
    return s->films.n > 0 ? film_of_group(&s->films, scene_group_at(s, i_segment)) : NULL;
}

size_t scene_set_of(const struct scene *s, uint32_t i_segment, size_t n_set)
{
    return n_set > 1 && scene_film(s, i_segment) == NULL ? scene_group_at(s, i_segment) : 0;
}

const struct film_groups *scene_films(const struct scene *s) { return &s->films; }

static void scaled_to_one(float v[3])
{
    float length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int a = 0; a < 3; a++) v[a] /= length;
}

void scene_place_rotation(const struct scene_place *p, float row[3][3])
{
    float sum[3], difference[3];
    memcpy(row, p->to_cloth, sizeof p->to_cloth);
    scaled_to_one(row[2]);
    for (int k = 0; k < 2; k++) {
        float along = row[k][0] * row[2][0] + row[k][1] * row[2][1] + row[k][2] * row[2][2];
        for (int a = 0; a < 3; a++) row[k][a] -= along * row[2][a];
        scaled_to_one(row[k]);
    }
    /* sum and difference of two vectors of equal length are at right angles: those between weft and warp stay */
    for (int a = 0; a < 3; a++) sum[a] = row[0][a] + row[1][a], difference[a] = row[0][a] - row[1][a];
    scaled_to_one(sum);
    scaled_to_one(difference);
    for (int a = 0; a < 3; a++) {
        row[0][a] = (sum[a] + difference[a]) * (float)M_SQRT1_2;
        row[1][a] = (sum[a] - difference[a]) * (float)M_SQRT1_2;
    }
}

void scene_hit_beside(const struct scene *s, const struct scene_hit *hit, const float shift_mm[2],
                      struct scene_hit *beside)
{
    *beside = *hit;
    if (s->bent == NULL) {
        for (int a = 0; a < 2; a++) beside->position_mm[a] += shift_mm[a];
        return;
    }
    struct shell_walk w = {.space = &s->bent->space, .i_cell = hit->i_cell, .from_face = -1};
    double left = 1.0; /* of the way, which is straight in the flat cloth and has a direction of its own in each cell */
    for (int a = 0; a < 3; a++) w.origin[a] = (double)hit->position_mm[a];
    for (int i = 0; i < MOST_CELLS_BESIDE && left > 0.0; i++) {
        const struct shell_cell *c = &w.space->shell.cell[w.i_cell];
        int face;
        for (int a = 0; a < 3; a++)
            w.direction[a] = (double)(c->to_world[a][0] * shift_mm[0] + c->to_world[a][1] * shift_mm[1]);
        w.t = 0.0;
        double t = fmin(shell_walk_exit(&w, &face), left);
        beside->i_cell = w.i_cell;
        shell_walk_point(&w, t, w.origin);
        left -= t;
        if (left > 0.0) shell_walk_on(&w, 0.0, face);
        if (w.i_cell == SHELL_OUTSIDE) break;
    }
    for (int a = 0; a < 3; a++) beside->position_mm[a] = (float)w.origin[a];
}

bool scene_shell_covers(const struct scene *s, const float point_mm[3], const float direction[3])
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRay q = {.org_x = point_mm[0],
                       .org_y = point_mm[1],
                       .org_z = point_mm[2],
                       .dir_x = direction[0],
                       .dir_y = direction[1],
                       .dir_z = direction[2],
                       .tfar = INFINITY,
                       .mask = ~0u};
    rtcOccluded1(s->bent->space.outer, &context, &q);
    return q.tfar < 0;
}

void scene_surface_point(const struct scene *s, const struct scene_hit *hit, const struct scene_place *place,
                         const float shift_mm[2], const float direction[3], float point_mm[3])
{
    const struct shell_cell *c = &s->bent->space.shell.cell[hit->i_cell];
    float out = 0;
    for (int a = 0; a < 3; a++) out += place->to_cloth[2][a] * direction[a];
    float to_surface = out > 0 ? lift_mm - place->position_mm[2] : s->bottom_mm - lift_mm - place->position_mm[2];
    const float move[3] = {shift_mm[0], shift_mm[1], to_surface};
    for (int a = 0; a < 3; a++) {
        point_mm[a] = hit->position_mm[a];
        for (int k = 0; k < 3; k++) point_mm[a] += c->to_world[a][k] * move[k];
    }
}

bool scene_shell_shades(const struct scene *s, const struct scene_hit *hit, const struct scene_place *place,
                        const float shift_mm[2], const float direction[3])
{
    float start[3];
    if (s->bent == NULL) return false;
    scene_surface_point(s, hit, place, shift_mm, direction, start);
    return scene_shell_covers(s, start, direction);
}

/* The first outer face in a direction; false: there is none. */
static bool meet_outer(const struct scene *s, const float from[3], const float direction[3], struct RTCRayHit *q)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    memset(q, 0, sizeof *q);
    q->ray = (struct RTCRay){.org_x = from[0],
                             .org_y = from[1],
                             .org_z = from[2],
                             .dir_x = direction[0],
                             .dir_y = direction[1],
                             .dir_z = direction[2],
                             .tfar = INFINITY,
                             .mask = ~0u};
    q->hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(s->bent->space.outer, &context, q);
    return q->hit.geomID != RTC_INVALID_GEOMETRY_ID;
}

bool scene_shell_meets(const struct scene *s, const float point_mm[3], const float direction[3],
                       struct scene_layer *layer)
{
    struct RTCRayHit q;
    if (!meet_outer(s, point_mm, direction, &q)) return false;
    float n[3] = {q.hit.Ng_x, q.hit.Ng_y, q.hit.Ng_z}, along = 0;
    scaled_to_one(n);
    for (int a = 0; a < 3; a++) along += n[a] * direction[a];
    const bool leaves = along > 0; /* it began in the layer, whose other side it meets */
    const float thickness = -s->bottom_mm + lift_mm;
    for (int a = 0; a < 3; a++) {
        const float at = point_mm[a] + q.ray.tfar * direction[a];
        layer->normal[a] = leaves ? -n[a] : n[a];
        layer->front_mm[a] = at + layer->normal[a] * (leaves ? thickness : lift_mm);
        layer->behind_mm[a] = at - layer->normal[a] * (leaves ? lift_mm : thickness);
    }
    return true;
}

/* Whether an outer face belongs to the border: it has nodes of both ends of the prisms. */
static bool is_border(const uint32_t node[3])
{
    const uint32_t n_upper = (node[0] & 1u) + (node[1] & 1u) + (node[2] & 1u);
    return n_upper == 1 || n_upper == 2;
}

/* Whether the prism of a cell has a face on the border. */
static bool is_at_border(const struct shell *h, uint32_t i_cell)
{
    const uint32_t first = i_cell - i_cell % 3;
    for (uint32_t i = first; i < first + 3; i++)
        for (int k = 0; k < 4; k++) {
            uint32_t node[3];
            int n = 0;
            if (h->cell[i].neighbour[k] != SHELL_NONE) continue;
            for (int j = 0; j < 4; j++)
                if (j != k) node[n++] = h->corner[i][j];
            if (is_border(node)) return true;
        }
    return false;
}

bool scene_border_seen(const struct scene *s, const struct scene_hit *hit, const float back[3], float point_mm[3],
                       float normal[3])
{
    if (s->bent == NULL || !is_at_border(&s->bent->space.shell, hit->i_cell)) return false;
    struct RTCRayHit q;
    if (!meet_outer(s, hit->position_mm, back, &q) || !is_border(s->bent->space.shell.outer[q.hit.primID]))
        return false;
    normal[0] = q.hit.Ng_x, normal[1] = q.hit.Ng_y, normal[2] = q.hit.Ng_z;
    scaled_to_one(normal);
    for (int a = 0; a < 3; a++) point_mm[a] = hit->position_mm[a] + q.ray.tfar * back[a] + lift_mm * normal[a];
    return true;
}

static uint64_t add_bytes(uint64_t h, const void *data, size_t n)
{
    const unsigned char *p = data;
    for (size_t i = 0; i < n; i++) h = (h ^ p[i]) * 0x100000001b3u;
    return h;
}

uint64_t scene_checksum(const struct scene *s, uint64_t from)
{
    uint64_t h = add_bytes(from, s->vertex, s->n_vertex * sizeof *s->vertex);
    h = add_bytes(h, s->segment_vertex, s->n_segment * sizeof *s->segment_vertex);
    if (s->segment_group != NULL) h = add_bytes(h, s->segment_group, s->n_segment);
    if (s->long_axis != NULL) h = add_bytes(h, s->long_axis, s->n_vertex * sizeof *s->long_axis);
    if (s->ratio != NULL) h = add_bytes(h, s->ratio, s->n_vertex * sizeof *s->ratio);
    return add_bytes(h, s->tile_mm, sizeof s->tile_mm);
}
