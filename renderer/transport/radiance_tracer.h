/* The input of a tracer, and the table of functions that it fills in (radiance_source.h in renderer/estimate has
 * the list of tracers). */
#ifndef SELVEDGE_RENDERER_RADIANCE_TRACER_H
#define SELVEDGE_RENDERER_RADIANCE_TRACER_H

#include "base/progress.h"
#include "base/rng.h"
#include "base/status.h"
#include "renderer/scattering/appearance.h"
#include "renderer/scene/configuration.h"
#include "renderer/scene/scene.h"
#include "renderer/transport/discrepancy.h"

/* Paths of a block of an estimate, and the most that any tracer takes at once. */
enum { RADIANCE_BLOCK_PATHS = 256, RADIANCE_MOST_PATHS = 16 * RADIANCE_BLOCK_PATHS };

struct volume_scene;     /* renderer/transport/volume/volume_scene.h */
struct fast_option;      /* renderer/fast/fast_tables.h */
struct dual_option;      /* renderer/quick/dual_tables.h */
struct diffusion_option; /* renderer/quick/diffusion_tables.h */

/* One cloth in the forms in which it is at hand. */
struct appearance_scene {
    const struct scene *fibers;        /* NULL: surface models cannot be traced */
    const struct volume_scene *volume; /* NULL: volume models cannot be traced */
};

struct radiance_input {
    struct appearance_scene scene;
    const struct appearance *model;
    const double *param; /* max(n_set, 1) * model->n_param, internal units, one set after the other */
    size_t n_set;        /* parameter sets for the material groups of the fibers; 0 and 1: one set for all fibers */
    bool want_derivative;
    const struct discrepancy *discrepancy;    /* a factor on what the cloth of a surface model sends to the camera
                                              (discrepancy.h); NULL: 1. Not for recorded paths, by tables, by dual
                                              scattering or by diffusion */
    const struct fast_option *fast;           /* NULL: path tracing; otherwise fibers are rendered by tables, without
                                       derivatives */
    const struct dual_option *dual;           /* NULL, or fibers by dual scattering, without derivatives */
    const struct diffusion_option *diffusion; /* NULL, or cloths with a pile by diffusion, without derivatives */
    /* The speckle of fibers (renderer/scattering/speckle.h) on light that is scattered once: for pictures alone. Not
     * with derivatives, for recorded paths, volumes, or other ways than path tracing. */
    bool has_speckle;
    uint64_t speckle_seed;
    uint32_t n_hit;   /* more than 0: paths of surface models end at their n_hit-th hit, with the light that reaches it
                       from the lights: without derivatives, records, or other ways than path tracing */
    double pixel_m;   /* edge of a pixel of the picture at the orbit center: films show glints; 0: they do not */
    bool plain_paths; /* trace neither guided shadow paths nor to strips of lamps (path_tracer.h): same means, more
                         variance; volumes have none */
};

/* Paths that are traced together: at most max_path of the tracer. The same paths serve every member: members
 * differ in their lamp only. */
struct radiance_block {
    const size_t *member; /* n_member indices of configurations */
    size_t n_member;      /* at least 1; more only as far as the tracer's max_member */
    size_t n_path;
    double (*xy)[2];                 /* per path: a point of the crop, both in [0, 1), x to the right and y downwards */
    struct rng *rng;                 /* per path; changed */
    const struct progress *progress; /* tracing may stop early when it is cancelled; the values are then incomplete */
};

/* A recorded path, for radiance_tracer.replay. */
struct radiance_record {
    void *entry; /* the caller's: capacity * entry_bytes of the tracer */
    size_t capacity;
    size_t n_entry;  /* out; more than capacity: the path was too long, and the rest of it is missing */
    size_t n_bounce; /* out: effort of a replay, in scattering events */
};

/* The table of an implementation; state is its own. */
struct radiance_tracer {
    size_t max_path;    /* in one call of trace: whole blocks, at most RADIANCE_MOST_PATHS */
    size_t max_member;  /* configurations that one path can serve */
    size_t entry_bytes; /* of a record */
    /* STATUS_INVALID: a parameter (field: its name) or n_set; STATUS_NO_MEMORY. Leaves nothing to release on
     * failure. */
    status (*prepare)(const struct radiance_input *in, const struct configuration *c, size_t n_configuration,
                      void **state, struct error *err);
    void (*release)(void *state);
    /* value[n_path][n_member][3 + n_jac], preset to 0: radiance, then derivatives. Returns the number of bounces. */
    uint64_t (*trace)(const void *state, const struct radiance_block *b, float *value);
    /* One path of configuration i through xy of the crop with its derivatives, value[3 + n_jac] preset to 0. */
    void (*record)(const void *state, size_t i_configuration, const double xy[2], struct rng *rng,
                   struct radiance_record *record, float *value);
    /* Sum over channels of the radiance that the recorded path has at the parameters of state `at`, with the sampling
     * densities of state `traced`, which recorded it. */
    double (*replay)(const void *at, const void *traced, const struct radiance_record *record);
};

#endif
