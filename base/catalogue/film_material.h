/* The metal of a film: a thread of metallised plastic (lame, lurex), or a sequin. Plain data, which a described cloth
 * states and a scene carries to the tracer. */
#ifndef SELVEDGE_BASE_FILM_MATERIAL_H
#define SELVEDGE_BASE_FILM_MATERIAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Films are groups of fibers of their own (fiber_set.h), after the kinds of yarn. */
enum { FILM_MAX_GROUP = 5 };

/* A film from near: facets one by one (renderer/glint), of the kinds of glint_kind, brushed along
 * the film; or their mean. */
enum film_surface { FILM_SMOOTH, FILM_NOISE, FILM_BRUSHED, FILM_SCRATCHES, FILM_FLAKES };
extern const char *const film_surface_names[]; /* in this order, ended by NULL */

/* How light is reflected there: by geometric optics, or as waves by one of five diffraction models
 * (renderer/glint/wave_diffraction.h), which noise, brushed films and scratches have. */
enum film_optics { FILM_RAYS, FILM_OHS, FILM_GHS, FILM_R_OHS, FILM_R_GHS, FILM_KIRCHHOFF };
extern const char *const film_optics_names[]; /* in this order, ended by NULL */

struct film_material {
    float color[3]; /* reflectance at normal incidence, in (0, 1] */
    float
        roughness;  /* alpha of the GGX distribution of facets, in (0, 1]; with glints the slope of their normals too */
    float grain_um; /* size of waves, flakes or scratches; not of a smooth film */
    uint32_t surface; /* enum film_surface */
    uint32_t optics;  /* enum film_optics */
};

/* Bounds of the slope of facets that are seen one by one, and of the grains of a height field of waves. */
#define FILM_MOST_SLOPE 0.5
#define FILM_LEAST_WAVE_GRAIN_UM 4.0
#define FILM_MOST_WAVE_GRAIN_UM 128.0
#define FILM_MOST_WAVE_HEIGHT_UM 10.0

/* Whether light is reflected as waves. */
static inline bool film_has_waves(const struct film_material *m)
{
    return m->optics != FILM_RAYS && m->surface != FILM_SMOOTH && m->surface != FILM_FLAKES;
}

/* The height field of a film with waves, in um: root mean square and correlation lengths along and across the film, and
 * scratches' depth and the standard deviation of their section, 0 without scratches. Noise has slopes of the root mean
 * square `roughness` in two dimensions, beside scratches half of it; scratches are as steep as that. */
struct film_waves {
    double rms_um, length_um[2], scratch_depth_um, scratch_width_um;
};
void film_waves_of(const struct film_material *m, struct film_waves *w);
/* Whether these heights are at most FILM_MOST_WAVE_HEIGHT_UM. */
bool film_waves_are_low(const struct film_waves *w);

/* The films of a cloth: material k belongs to group first_group + k. */
struct film_groups {
    size_t first_group, n; /* n 0: none */
    struct film_material material[FILM_MAX_GROUP];
};

/* The material of a group; NULL: it is no film. */
static inline const struct film_material *film_of_group(const struct film_groups *f, size_t group)
{
    return group >= f->first_group && group - f->first_group < f->n ? &f->material[group - f->first_group] : NULL;
}

/* Names of metals in order, ended by NULL. */
extern const char *const film_metal_names[];
/* Sets the color of a named metal: reflectance at normal incidence. False: no such metal. */
bool film_metal_color(const char *name, float color[3]);

#endif
