/* One light path through a volume of fibers, with the derivatives of its contribution by every parameter of the phase
 * model and by the density multiplier d. The volume's twin of path_tracer.h (fabric thesis 5.4 and 5.5.1).
 *
 * Flight: Woodcock tracking with one majorant mu for the whole cloth; lamp connections by ratio tracking (Novak et al.
 * 2014, "Residual ratio tracking"). All three channels follow one path: extinction has no colour, and directions are
 * drawn in proportion to the throughput of the channels.
 *
 * Derivatives of flight. Write r = sigma_t / mu with mu held fixed. A tracked flight has the probability density
 *     prod_(null) mu exp(-mu s) (1 - r)  *  mu exp(-mu s) r        (a real collision ends it)
 * and the light it stands for is that same product, so weight = 1 and, sampling held fixed,
 *     d ln = - sum_(null) r' / (1 - r)  + r'_(real) / r_(real),     r' = d r / d p.
 * With r = d rho s(w) / mu:  r' = r / d for the density multiplier, so +1/d at each real collision and -r / (d (1 - r))
 * at each null one. Nulls come at the rate mu (1 - r), so the sum's mean is -integral of sigma_t' : minus the optical
 * depth over d, without bias. Ratio tracking estimates exp(-tau) by prod (1 - r) over points at the rate mu, whose
 * derivative is the same sum over all points, times the product. Its variance holds sigma_t^2 / (mu - sigma_t), which
 * is why the majorant lies a quarter above the largest extinction. Terms by a parameter of s(w) (gamma of the
 * microflakes) are the same with r' = r s'/s.
 */
#ifndef SELVEDGE_RENDERER_VOLUME_TRACER_H
#define SELVEDGE_RENDERER_VOLUME_TRACER_H

#include "base/rng.h"
#include "renderer/scattering/phase_model.h"
#include "renderer/scene/configuration.h"
#include "renderer/transport/lights.h"
#include "renderer/transport/volume/volume_scene.h"

enum { VOLUME_MAX_BOUNCE = 10000, VOLUME_N_DERIVATIVE = 3 * SCATTERING_MAX_PARAM };

/* The model at given parameter values. */
struct volume_parameters {
    const struct phase_model *model;
    struct phase_state *state;
    double multiplier_per_m; /* d > 0 */
};

struct volume_setting {
    const struct volume_scene *scene;
    const struct phase_model *model;
    const struct phase_state *state;
    const struct phase_extinction *extinction;
    float multiplier_per_m; /* d */
    float majorant_per_mm;
    float majorant_density;                   /* density times s at which extinction would equal the majorant */
    float inv_majorant_density, mean_step_mm; /* their inverses */
    struct lights lights;
    float roulette_below; /* throughput under which paths are ended at random; 0: never */
    float shadow_below;   /* contribution under which shadow rays are thinned out at random; 0: never */
    bool want_jacobian;
};

/* The default roulette threshold, and the lights of the configuration (NULL: no lights). */
void volume_setting_init(struct volume_setting *s, const struct volume_scene *scene, const struct volume_parameters *p,
                         const struct configuration *c, bool want_jacobian);
/* Density times s at which the extinction would equal the majorant that paths are traced with. */
float volume_majorant_density(const struct volume_scene *scene, const struct volume_parameters *p);

struct volume_result {
    float radiance[3];
    float jac[VOLUME_N_DERIVATIVE]; /* [c * (model->n_param + 1) + p], last by d */
    uint32_t n_bounce, n_lookup;
};

/* The values that the radiance of a path depends on besides the phase function and the extinction, in order. r is the
 * ratio of extinction to the majorant of tracing, for the parameters in question; r_then is the same for the
 * parameters of tracing. The radiance follows from T = 1 by:
 *   null       T *= (1 - r) / (1 - r_then)       real     T *= r / r_then
 *   scatter    T *= f(wi, wo) weight[0]
 *   connect    L = T f(wi, wo) weight            passed   L *= 1 - r
 *   arrive     value += L weight[0]              beyond   value += T weight
 * (a connection that does not arrive adds nothing). */
struct volume_event {
    enum volume_event_kind {
        VOLUME_NULL,
        VOLUME_REAL,
        VOLUME_SCATTER,
        VOLUME_CONNECT,
        VOLUME_PASSED,
        VOLUME_ARRIVE,
        VOLUME_BEYOND
    } kind;
    float density, sine; /* of a look-up: 0 to 1, and sine of the angle to the fiber */
    float wi[3], wo[3], weight[3];
};

struct volume_record {
    size_t n_event, capacity;
    struct volume_event *event; /* the caller's; events beyond capacity are counted but not stored */
};

/* ray: from volume_ray_enter; ray and rng are changed. record: NULL, or with n_event = 0. */
void volume_trace(const struct volume_setting *s, struct volume_ray *ray, struct rng *rng, struct volume_result *out,
                  struct volume_record *record);

/* Traces n paths, 16 at a time in turns, so that one path computes while others wait for memory. Each has a ray and
 * random numbers of its own, which are not changed, and the result that volume_trace gives. */
void volume_trace_many(const struct volume_setting *s, size_t n, struct volume_ray *ray, struct rng *rng,
                       struct volume_result *out);

/* Sum over channels of the radiance that a recorded path has with parameters `now`, when it was traced with `then`, by
 * the formulas at volume_event. */
double volume_replay(const struct volume_scene *scene, const struct volume_parameters *now,
                     const struct volume_parameters *then, const struct volume_record *record);

#endif
