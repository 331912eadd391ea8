/* The setting, the result and the record of a light path (path_tracer.h). */
#ifndef SELVEDGE_RENDERER_PATH_SETTING_H
#define SELVEDGE_RENDERER_PATH_SETTING_H

#include "base/rng.h"
#include "renderer/scattering/scattering.h"
#include "renderer/scattering/speckle.h"
#include "renderer/scene/scene_ray.h"
#include "renderer/transport/discrepancy.h"
#include "renderer/transport/lamp_strip.h"
#include "renderer/transport/light_guide.h"
#include "renderer/transport/lights.h"
#include "renderer/transport/surface/parameter_sets.h"

enum { PATH_MAX_BOUNCE = 10000, PATH_N_DERIVATIVE = 3 * SCATTERING_MAX_FLAT, PATH_MAX_LAMP = 16 };

struct path_setting {
    const struct scene *scene;
    const struct scattering_model *model;
    const struct scattering_state *state[SCATTERING_MAX_SET]; /* by material group */
    size_t n_set;                                             /* 1: the first serves all groups */
    struct lights lights;
    bool guided_paths;                                    /* trace guided shadow paths: less variance, same mean */
    struct light_guide_energy energy[SCATTERING_MAX_SET]; /* by material group: sets how many guided paths there are */
    /* Hits with a lobe that is narrow beside a square lamp are connected to two points of the lamp (lamp_strip.h): less
     * variance, same mean. Not for recorded paths. */
    bool has_strips;
    float lobe_rad[SCATTERING_MAX_SET]; /* by material group: scattering_model.lobe_rad; only with has_strips */
    bool hides_below;                   /* scene_sheet_hides all directions downwards */
    bool shows_width;     /* the scene has the sections of the fibers as surfaces, and the model states their widths */
    bool has_films;       /* the scene has films: hits ask whether they are on one */
    float pixel_um;       /* standard deviation of what a pixel sees, across the view; 0: no glints of films */
    float roulette_below; /* throughput under which paths are ended at random; 0: never */
    /* n_traced > 0 ends paths at their n_traced-th hit. Light that arrives there directly from lamps is added as usual;
     * for all other light `finish` returns the radiance in rgb that goes back along the ray. Only for one lamp without
     * derivatives. */
    uint32_t n_traced;
    void (*finish)(const void *context, const struct scene_hit *hit, const struct scene_ray *ray, struct rng *rng,
                   float rgb[3]);
    /* Radiance along the ray reversed that is added at the first hit, as finish; NULL: none. With n_traced, finish may
     * then be NULL, too, for nothing. */
    void (*begin)(const void *context, const struct scene_hit *hit, const struct scene_ray *ray, struct rng *rng,
                  float rgb[3]);
    const void *finish_context; /* of both */
    /* Factor on the light that leaves the cloth towards the camera; NULL: 1. Not for recorded paths, nor for what
     * finish adds. */
    const struct discrepancy *discrepancy;
    /* With a table: a random factor of each fiber on light that it alone scatters from the lights to the camera. Not
     * for recorded paths, nor for what finish adds. */
    struct speckle speckle;
    bool want_jacobian;
    bool plain; /* path_setting_choose has found that the paths need not ask for any of the rare parts at their hits */
};

/* The lights of the configuration, the default roulette threshold, guided paths if there is a lamp, one parameter
 * set. */
void path_setting_init(struct path_setting *s, const struct scene *scene, const struct scattering_model *model,
                       const struct scattering_state *state, const struct configuration *c, bool want_jacobian);

/* The same with a parameter set per material group. The sets must outlive the setting. */
void path_setting_init_sets(struct path_setting *s, const struct scene *scene, const struct parameter_sets *sets,
                            const struct configuration *c, bool want_jacobian);

/* path_setting.pixel_um of pixels with this edge. Samples are spread over the pixel, so each sees a part of it: half of
 * its edge as two standard deviations. */
static inline float path_setting_pixel_um(double pixel_m) { return (float)(0.25e6 * pixel_m); }

/* To be called last, when all members are set: chooses the walk that is compiled for settings without flat sections,
 * near fields, light across the width, groups, factors, an image, and ends of paths. Settings for which it is not
 * called are traced by the walk that knows all, with the same results. */
void path_setting_choose(struct path_setting *s);

/* Only the first 3 * n_set * n_param derivatives are set. */
struct path_result {
    float radiance[3];
    float jac[PATH_N_DERIVATIVE]; /* [c * n_set * n_param + i_set * n_param + p] */
    uint32_t n_bounce;
};

/* The values that the radiance of a path depends on besides S. Its radiance is the sum over steps of
 *     T (S(light_wi, wo) light + S(image_wi, wo) image + S(guided_wi, wo) S'(guided_light_wi, guided_wo) guided_light)
 *     + T' escape,
 * where T' = T S(wi, wo) weight is the throughput after the step. It can be evaluated for other parameters without
 * tracing a ray (path_replay). */
struct path_step {
    float wo[3], wi[3];
    float weight; /* cos th_i / (density * survival) */
    float light_wi[3];
    float light; /* lamp sample, the same for all channels: radiance * cos th_i * heuristic / density; 0 if occluded */
    float image_wi[3], image[3];                          /* the same for a sample of the image environment, rgb */
    float guided_wi[3], guided_wo[3], guided_light_wi[3]; /* the last two at the fiber that the guided path met */
    float guided_light;                                   /* with all weights of the guided path; 0: no light */
    uint32_t i_guided_group;                              /* material group of that fiber, whose model is S' */
    uint32_t i_group;                                     /* material group of the fiber, whose model is S */
    float escape[3]; /* radiance beyond the cloth along the scattered ray, times its multiple-importance weight */
};

struct path_record {
    size_t n_step, capacity;
    struct path_step *step; /* the caller's; steps beyond capacity are counted but not stored */
};

#endif
