#include "renderer/scene/scene_faces.h"

#include "renderer/scene/scene_ends.h"

/* A ray that starts in a fiber meets none of its faces within this part of its radius: the surfaces of neighbouring
 * segments lie less deep there than places are rounded by. */
#define START_RADII 0.1f

/* A segment, and the tiles from the copy that is looked at. */
struct piece {
    uint32_t i_segment;
    int copy[2];
};

static inline float dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* A point from a vertex of a piece. */
static inline void from_vertex(const struct scene *s, const struct piece *p, const struct scene_vertex *v,
                               const float at[3], float from[3])
{
    from[0] = at[0] - v->x;
    from[1] = at[1] - v->y;
    from[2] = at[2] - v->z;
    for (int a = 0; a < 2; a++)
        if (p->copy[a] != 0) from[a] -= (float)(p->copy[a] * s->tile_mm[a]);
}

/* Whether a point lies inside of a round segment, deeper than 1e-4 radii, which is rounding. */
static bool holds(const struct scene *s, const struct piece *p, const float at[3])
{
    const struct scene_vertex *v = &s->vertex[s->segment_vertex[p->i_segment]];
    const float u[3] = {v[1].x - v[0].x, v[1].y - v[0].y, v[1].z - v[0].z};
    float from[3], off2 = 0;
    from_vertex(s, p, v, at, from);
    const float along = dot(from, u), u2 = dot(u, u),
                place = along <= 0    ? 0
                        : along >= u2 ? 1
                                      : along / u2,
                radius = v[0].radius + place * (v[1].radius - v[0].radius);
    for (int a = 0; a < 3; a++) {
        const float off = from[a] - place * u[a];
        off2 += off * off;
    }
    return off2 < 0.9998f * radius * radius;
}

/* Whether the segment beyond an end of this one may hold a point: fibers bend by less than a right angle from segment
 * to segment. */
static bool is_near(const struct scene *s, const struct piece *p, bool after, const float at[3])
{
    const struct scene_vertex *v = &s->vertex[s->segment_vertex[p->i_segment] + (after ? 1u : 0u)];
    float from[3];
    from_vertex(s, p, v, at, from);
    return dot(from, from) < 2 * v->radius * v->radius;
}

/* Moves to the segment beyond an end of this one, on this fiber or on the one that continues it. False: it ends
 * there. */
static bool move_along(const struct scene *s, struct piece *p, bool *after)
{
    const unsigned flag = *after ? RTC_CURVE_FLAG_NEIGHBOR_RIGHT : RTC_CURVE_FLAG_NEIGHBOR_LEFT;
    if ((s->segment_flag[p->i_segment] & flag) != 0) {
        p->i_segment += *after ? 1u : UINT32_MAX;
        return true;
    }
    const struct scene_link *l = scene_ends_find(s->ends, p->i_segment, *after);
    if (l == NULL) return false;
    p->i_segment = l->i_other;
    for (int a = 0; a < 2; a++) p->copy[a] += l->copy[a];
    *after = !l->other_after;
    return true;
}

bool scene_faces_inside(const struct scene *s, uint32_t i_segment, uint32_t i_from, const float at[3])
{
    if (i_segment == i_from) return true;
    for (int sense = 0; sense < 2; sense++) {
        struct piece p = {.i_segment = i_segment};
        bool after = sense == 1;
        while (is_near(s, &p, after, at) && move_along(s, &p, &after))
            if (p.i_segment == i_from || holds(s, &p, at)) return true;
    }
    return false;
}

float scene_faces_near(const struct scene *s, uint32_t i_from)
{
    return i_from != SCENE_NO_SEGMENT ? START_RADII * s->vertex[s->segment_vertex[i_from]].radius : 0;
}
