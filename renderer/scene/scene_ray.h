/* Rays through an endless cloth: the inner interface between scene and tracer.
 *
 * Frame: the cloth frame in millimetres, x and y as the fiber set has them, z shifted so that the highest fiber surface
 * is z = 0 (the plane of the orbit centre). A ray's origin is local: wrapped into the centre tile; local + offset is
 * where it really is. A hit is where a ray comes into a fiber. A scattering event stands for the whole way through its
 * fiber: rays do not meet fibers that they start in (scene_faces.h). Threads: any number on one scene; flush-to-zero
 * should be set (thread_pool does).
 */
#ifndef SELVEDGE_RENDERER_SCENE_RAY_H
#define SELVEDGE_RENDERER_SCENE_RAY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct scene;

#define SCENE_NO_SEGMENT UINT32_MAX

struct scene_ray {
    double offset_mm[2]; /* whole tiles */
    float origin_mm[3];  /* local */
    float direction[3];  /* unit */
    float tnear_mm;
    bool inside;     /* the ray may start in fibers; false: the next member counts for nothing */
    uint32_t i_from; /* the segment that the ray leaves inwards, or SCENE_NO_SEGMENT */
    uint32_t i_cell; /* of a bent cloth: where the origin lies (bent_scene.h) */
};

struct scene_hit {
    float position_mm[3]; /* local to the ray's final offset, where the segment is where its vertices are */
    float normal[3];      /* unit, out of the fiber */
    float tangent[3];     /* unit, along the fiber */
    float radius_mm;      /* of an elliptical section: its least radius of curvature */
    uint32_t i_segment;   /* scene_fiber_of gives its fiber */
    uint32_t i_cell;      /* of a bent cloth */
};

/* The nearest hit. The ray is moved along by whole tiles (offset and origin change together). False: the ray leaves
 * the cloth upwards or downwards, or, after SCENE_MAX_WRAP blocks within it, is taken to have left. */
bool scene_trace(const struct scene *scene, struct scene_ray *ray, struct scene_hit *hit);
/* Whether any hit lies ahead; the ray itself is not changed. */
bool scene_occluded(const struct scene *scene, const struct scene_ray *ray);

/* A fiber that a ray goes through: its segment, and the sine of the angle between the ray and the plane across the
 * fiber (positive: the ray runs along the segment's direction). False: no further ones are wanted. */
typedef bool scene_visit(void *context, uint32_t i_segment, float sin_theta);
/* Visits every front face ahead of a ray once, in no particular order, in one traversal. The ray itself is not changed.
 * False: the ray ends on the black sheet of a bent cloth, or visit has asked to stop. */
bool scene_visit_ahead(const struct scene *scene, const struct scene_ray *ray, scene_visit *visit, void *context);

/* Ray leaving a hit point, through the fiber when it points into it. */
void scene_ray_leave(const struct scene_hit *hit, const double offset_mm[2], const float direction[3],
                     struct scene_ray *ray);
/* Ray leaving the fiber of a hit from a place of its width as seen against direction: place in [0, 1) goes from one
 * edge to the other. It starts on the side that faces direction, so never within the fiber. */
void scene_ray_leave_across(const struct scene_hit *hit, const double offset_mm[2], const float direction[3],
                            float place, struct scene_ray *ray);
/* Ray from a point outside (double precision, unwrapped), brought to the top or bottom plane of the cloth.
 * False when it never meets the cloth. */
bool scene_ray_enter(const struct scene *scene, const double origin_mm[3], const double direction[3],
                     struct scene_ray *ray);

/* Index in the fiber set of a hit segment's fiber. */
uint32_t scene_fiber_of(const struct scene *scene, uint32_t i_segment);
/* Material group of that fiber, below scene_n_group unless it is a film. */
uint32_t scene_group_of(const struct scene *scene, uint32_t i_segment);

/* Whether the cloth has films; and the material of a segment that is one. NULL: it is a fiber. The pointer holds as
 * long as the scene. */
bool scene_has_films(const struct scene *scene);
const struct film_groups *scene_films(const struct scene *scene);
const struct film_material *scene_film(const struct scene *scene, uint32_t i_segment);

/* The parameter set of a segment: its group if there is one for each, else the first; the first also of a film. */
size_t scene_set_of(const struct scene *scene, uint32_t i_segment, size_t n_set);

bool scene_has_black_sheet(const struct scene *scene);
/* Whether the black sheet hides what lies in a direction from anywhere in the cloth. Of a bent cloth the direction does
 * not tell: rays that meet its sheet are occluded. */
bool scene_sheet_hides(const struct scene *scene, const float direction[3]);
/* Whether a ray for which scene_trace has found nothing has ended on the black sheet. */
bool scene_sheet_met(const struct scene *scene, const struct scene_ray *ray);
/* The unit normal of a bent cloth where a fiber was hit. False: the cloth is flat, and its normal is z. */
bool scene_bent_normal(const struct scene *scene, const struct scene_hit *hit, float normal[3]);
/* The direction of the short axis of the fiber's section where it was hit, unit and across the fiber. False: the fiber
 * is no film, and the sections of the cloth were not measured, or are round (mean ratio of axes up to
 * FIBER_RATIO_FLAT). */
bool scene_section_normal(const struct scene *scene, const struct scene_hit *hit, float normal[3]);
/* Whether that direction is known of fibers that are no films: sections were measured and are not round. */
bool scene_has_sections(const struct scene *scene);
/* Whether surfaces are elliptical cylinders with these sections (scene_option.sections), and not round tubes. */
bool scene_shows_sections(const struct scene *scene);
/* z of the lowest fiber surface (the top is 0). */
double scene_thickness_mm(const struct scene *scene);

enum { SCENE_MAX_WRAP = 256 };

#endif
