/* Where in the flat cloth a hit lies, and what else the fast renderer must know of a scene: its segments, and whether
 * the shell of a bent cloth stands before a light. Millimetres, in the frame of scene_ray.h.
 */
#ifndef SELVEDGE_RENDERER_SCENE_PLACE_H
#define SELVEDGE_RENDERER_SCENE_PLACE_H

#include "renderer/scene/scene_ray.h"

#include <math.h>

/* A hit in the flat cloth. */
struct scene_place {
    float position_mm[3]; /* x and y within the tile */
    float to_cloth[3][3]; /* rows: takes a direction here to one in the flat cloth, nearly without stretching it */
};

/* A segment of the scene, whose fibers may be cut into more segments than the fiber set has. */
struct scene_segment {
    float middle_mm[3], tangent[3], length_mm, radius_mm;
};

/* A direction of the scene in the flat cloth, of length 1. */
static inline void scene_place_to_cloth(const struct scene_place *p, const float d[3], float out[3])
{
    float length2 = 0;
    for (int a = 0; a < 3; a++) {
        out[a] = p->to_cloth[a][0] * d[0] + p->to_cloth[a][1] * d[1] + p->to_cloth[a][2] * d[2];
        length2 += out[a] * out[a];
    }
    float inv = 1 / sqrtf(length2);
    for (int a = 0; a < 3; a++) out[a] *= inv;
}

bool scene_is_bent(const struct scene *scene);
void scene_segment_at(const struct scene *scene, uint32_t i_segment, struct scene_segment *segment);
/* Maps a hit to the flat cloth. offset_mm: offset_mm of the ray that hit (scene_ray.h). */
void scene_place_find(const struct scene *scene, const struct scene_hit *hit, const double offset_mm[2],
                      struct scene_place *place);
/* Rows of the rotation into the flat cloth that is nearest to place->to_cloth among those that keep the normal of the
 * cloth: for angles between a light and the cloth, which to_cloth changes where threads are sheared. */
void scene_place_rotation(const struct scene_place *place, float row[3][3]);
/* The hit moved by a way in the plane of the flat cloth, at its depth; it stays on the border of a mesh that ends
 * before. Only its position and its place in a bent cloth change. */
void scene_hit_beside(const struct scene *scene, const struct scene_hit *hit, const float shift_mm[2],
                      struct scene_hit *beside);
/* A point of the surface of a bent cloth, a little outside: of the upper side if the direction points out of it, of the
 * lower one otherwise. It lies over the hit, moved by shift_mm in the plane of the cloth there. */
void scene_surface_point(const struct scene *scene, const struct scene_hit *hit, const struct scene_place *place,
                         const float shift_mm[2], const float direction[3], float point_mm[3]);
/* Whether the shell of a bent cloth lies in a direction from there. Flat cloth never shades itself so. */
bool scene_shell_shades(const struct scene *scene, const struct scene_hit *hit, const struct scene_place *place,
                        const float shift_mm[2], const float direction[3]);
/* Whether a ray that met a hit, and comes from direction `back` of it, came in through the border of a bent cloth,
 * where its edge is cut, between the upper and the lower side. Then the place there, a little outside, and normal. */
bool scene_border_seen(const struct scene *scene, const struct scene_hit *hit, const float back[3], float point_mm[3],
                       float normal[3]);
/* Whether a bent cloth lies in a direction from a place outside of it. */
bool scene_shell_covers(const struct scene *scene, const float point_mm[3], const float direction[3]);
/* What lies in a direction from a place outside of a bent cloth, or between two layers that nearly touch: the places a
 * little outside of the side that faces the ray and of the other one, and the normal towards the ray. */
struct scene_layer {
    float front_mm[3], behind_mm[3], normal[3];
};
bool scene_shell_meets(const struct scene *scene, const float point_mm[3], const float direction[3],
                       struct scene_layer *layer);
/* FNV-1a over vertices, radii, groups and tile of the flat cloth, going on from `from`. */
uint64_t scene_checksum(const struct scene *scene, uint64_t from);

#endif
