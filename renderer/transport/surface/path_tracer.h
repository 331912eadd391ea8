/* One light path from the camera, with the derivatives of its contribution by every scattering parameter (fabric
 * thesis 5.5.1, figure 5.3): beside the throughput T runs the sum H of scores d ln S / d p, and every light connection
 * adds L and L (H + score). The sampling densities, the roulette and the weights that combine lamp and scattering
 * samples (power heuristic) and those of probes and the walk (balance heuristic) are held fixed.
 */
#ifndef SELVEDGE_RENDERER_PATH_TRACER_H
#define SELVEDGE_RENDERER_PATH_TRACER_H

#include "base/rng.h"
#include "renderer/scattering/scattering.h"
#include "renderer/scene/scene_ray.h"
#include "renderer/transport/light/light_guide.h"
#include "renderer/transport/light/lights.h"
#include "renderer/transport/surface/parameter_sets.h"

enum { PATH_MAX_BOUNCE = 10000, PATH_N_DERIVATIVE = 3 * SCATTERING_MAX_FLAT, PATH_MAX_LAMP = 16 };

struct path_setting {
    const struct scene *scene;
    const struct scattering_model *model;
    const struct scattering_state *state[SCATTERING_MAX_SET]; /* by material group */
    size_t n_set;                                             /* 1: the first serves all groups */
    struct lights lights;
    bool
        guided_paths; /* from vertices rays towards the lamp and a connection from the fiber that they meet: less variance, same mean */
    struct light_guide_energy
        energy[SCATTERING_MAX_SET]; /* by material group: probes are as frequent as light goes on forwards */
    float roulette_below;           /* throughput under which paths are ended at random; 0: never */
    bool want_jacobian;
};

/* Roulette at the usual place, the configuration's lights, one parameter set. */
void path_setting_init(struct path_setting *s, const struct scene *scene, const struct scattering_model *model,
                       const struct scattering_state *state, const struct configuration *c, bool want_jacobian);

/* The same with a parameter set for each material group; they must outlive the setting. */
void path_setting_init_sets(struct path_setting *s, const struct scene *scene, const struct parameter_sets *sets,
                            const struct configuration *c, bool want_jacobian);

/* Only the first 3 * n_set * n_param derivatives are set. */
struct path_result {
    float radiance[3];
    float jac[PATH_N_DERIVATIVE]; /* [c * n_set * n_param + i_set * n_param + p] */
    uint32_t n_bounce;
};

/* All that a path's value depends on besides S: value = sum over steps of
 * T (S(light_wi, wo) light + S(image_wi, wo) image + S(guided_wi, wo) S'(guided_light_wi, guided_wo) guided_light) + T' escape
 * with T' = T S(wi, wo) weight after each step. Re-evaluating it for other parameters needs no ray. */
struct path_step {
    float wo[3], wi[3];
    float weight; /* cos th_i / (density * survival) */
    float light_wi[3];
    float light; /* lamp sample, same for all channels: radiance cos th_i * heuristic / density; 0 when in shadow */
    float image_wi[3], image[3];                          /* the same for a sample of the image environment, rgb */
    float guided_wi[3], guided_wo[3], guided_light_wi[3]; /* the last two at the fiber that the probe met */
    float guided_light;                                   /* with all weights of the probe; 0: no light found */
    uint32_t i_guided_group;                              /* material group of that fiber: S' is that group's */
    uint32_t i_group;                                     /* material group: S is that group's */
    float escape[3]; /* radiance that the scattered ray meets on leaving the cloth, times its heuristic */
};

struct path_record {
    size_t n_step, capacity;
    struct path_step *step; /* the caller's; steps beyond capacity are counted but not stored */
};

/* ray: as camera_ray made it; changed. record: NULL, or n_step set to 0 by the caller. */
void path_trace(const struct path_setting *s, struct scene_ray *ray, struct rng *rng, struct path_result *out,
                struct path_record *record);

/* The same path under n_lamp lamps in turn, in place of the setting's: each result is that of path_trace with this lamp
 * alone (environments count in all), and costs its lamp connections only. The results' errors go together. */
void path_trace_lamps(const struct path_setting *s, const struct lamp *lamp, size_t n_lamp, struct scene_ray *ray,
                      struct rng *rng, struct path_result *out);

/* Sum over channels of the radiance that a recorded path has with other parameters, by the formula at path_step. */
double path_replay(const struct parameter_sets *sets, const struct path_record *record);

#endif
