/* The members of struct scene. Only the files of this folder include this header. Lengths are in millimetres. */
#ifndef SELVEDGE_RENDERER_SCENE_DATA_H
#define SELVEDGE_RENDERER_SCENE_DATA_H

#include "base/catalogue/film_material.h"
#include "base/status.h"
#include "renderer/scene/scene_ray.h"

#include <embree3/rtcore.h>
#include <stdatomic.h>
#include <stddef.h>

enum { SCENE_MAX_HALF_BLOCK = 12 };

/* Positions have 24 bits, so that a fiber of this share of the tile still is round to some percent. */
#define SCENE_SMALLEST_RADIUS_OF_TILE 2e-6

/* The top and the bottom plane of the cloth lie so far outside of its fibers. */
#define SCENE_MARGIN_MM 1e-3f

struct bent_cloth;
struct scene_ellipse;
struct scene_ends;
struct scene_glints;
struct scene_grid;

struct scene_vertex {
    float x, y, z, radius;
};

struct scene {
    RTCDevice device; /* of elliptical sections (scene_embree.h) */
    RTCScene tile, block;
    size_t n_vertex, n_segment;
    struct scene_vertex *vertex;
    uint32_t *segment_vertex; /* first of two */
    uint32_t *segment_fiber;
    unsigned char *segment_flag;
    uint8_t *segment_group; /* NULL: all 0 */
    float (*long_axis)[3];  /* of the section at each vertex, a unit vector; NULL: sections are taken to be round */
    float *ratio;           /* of each vertex: long over short axis; NULL: surfaces are round tubes */
    bool has_sections, shows_sections; /* of fibers that are no films (scene_ray.h) */
    struct film_groups films;
    float *arc_mm;                 /* of each vertex from the begin of its fiber; NULL without glints */
    struct scene_glints *glints;   /* NULL: no film has them (scene_glint.h) */
    struct scene_ellipse *ellipse; /* of each segment, where there are ratios (scene_ellipse.h) */
    struct scene_ends *ends;       /* scene_ends.h */
    struct scene_grid *grid;       /* of round fibers (scene_grid.h) */
    size_t n_group;
    double tile_mm[2];
    int half_block[2];                       /* a block has 2 h + 1 tiles a side, the centre one at [0, tile) */
    float inset_low_mm[2], inset_high_mm[2]; /* where every fiber of the endless cloth is present */
    float bottom_mm;                         /* < 0; the top is 0 */
    bool black_sheet, no_avx512;
    bool is_lifted;          /* all but the struct belongs to another scene (scene_lift) */
    uint64_t number;         /* that no other scene of this process has had */
    struct bent_cloth *bent; /* NULL: the cloth is flat. Otherwise device, tile and block are those of the flat cloth */
    atomic_llong device_bytes;
};

/* scene_group_of, without a call. */
static inline uint32_t scene_group_at(const struct scene *s, uint32_t i_segment)
{
    return s->segment_group == NULL ? 0 : s->segment_group[i_segment];
}

/* Builds the grid or the trees of a scene whose other members are filled in. STATUS_UNSUPPORTED, STATUS_NO_MEMORY. */
status scene_build(struct scene *s, struct error *err);
/* The short axis of the section of a segment whose unit tangent is given, unit and across it. False: its long axis runs
 * along the segment. */
bool scene_short_axis(const struct scene *s, size_t i_segment, const float tangent[3], float axis[3]);
/* A front face on a ray: the ray comes into a segment of the copy of the tile. */
struct scene_face {
    float t;
    uint32_t i_segment;
    int copy[2];
    float normal[3]; /* of elliptical sections only, of any length */
};

/* The nearest hit of the flat cloth over `span` of a ray, whose direction may have any length; *distance and
 * span are in units of it. The ray is moved by whole tiles. */
bool scene_trace_span(const struct scene *scene, struct scene_ray *ray, float span, struct scene_hit *hit,
                      float *distance);

#endif
