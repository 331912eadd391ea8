/* Phantom cloth with photographs of it, for the figures of fits: made once, kept in a folder, scored against the truth.
 *
 * Photographs are path-traced mean radiances of the 16 + 24 built-in configurations (phantom_view_table.h) with seeds that no fit uses,
 * by plain paths (an error of the guided shadow paths that fits use would show as a misfit), in chunks of at most FIT_CHUNK paths a configuration; a
 * chunk is a file, so an interrupted run goes on. A file's name states everything that it depends on but the renderer itself: empty the
 * folder after a change of that.
 *
 * Score of a parameter set: relative RMS error of the held-out means (objective.h) from two independent replicas,
 * without Monte-Carlo bias. Estimates at the truth (kept as well) and at the parameters are carried to one another by
 * their derivatives and averaged (linear_model.h), so that truth and fit are compared on largely the same paths.
 * Everything here ends the program when something fails.
 */
#ifndef SELVEDGE_TESTS_FIT_PHANTOM_H
#define SELVEDGE_TESTS_FIT_PHANTOM_H

#include "geometry/phantom/phantom.h"
#include "optimizer/fit/descent/trace_estimator.h"
#include "renderer/transport/volume/volume_scene.h"

enum { FIT_CHUNK = 100000, FIT_N_VIEW = 40, FIT_MAX_OBSERVATION = 64 };

struct fit_cloth {
    struct fiber_set fiber;
    struct scene *scene;
    struct direction_volume volume; /* only when asked for */
    struct volume_scene volume_scene;
    bool has_volume;
};

struct fit_phantom {
    struct thread_pool *pool;
    const char *folder; /* of kept estimates */
    struct fit_cloth cloth;
    bool shares_cloth; /* with its maker, who releases it */
    struct appearance model;
    double truth[SCATTERING_MAX_PARAM];         /* internal units */
    struct observation_set observation, fitted; /* all; those of the set fit */
    struct configuration *configuration;        /* of `observation` */
};

/* Status and error to standard error, then exit(1), unless s is STATUS_OK. */
void fit_check(status s, const struct error *err);

/* One tile of a phantom: fibers of 14 um, black sheet below. */
struct fit_cloth_option {
    enum phantom_weave weave;
    const char *
        yarn_file; /* of a real yarn's parameters (phantom_yarn_read): plied, with hairs; NULL: 37 smooth parallel fibers */
    double flatness; /* of yarns; 0: the phantom's own, 1.8 */
    bool
        lofty; /* felt of 1 x 1 x 1 mm, an eighth of it fiber, as craft felts are; else 0.6 x 0.6 x 0.25 mm and a half */
    bool with_volume; /* also as densities and directions, on a grid of 2 um (plied or lofty: of half a radius) */
};

void fit_cloth_init(struct fit_cloth *c, const struct fit_cloth_option *option, struct thread_pool *pool);
void fit_cloth_release(struct fit_cloth *c);

/* Cloth and model; no observations yet. truth_file_unit: NULL leaves the truth at the model's start. */
void fit_phantom_init(struct fit_phantom *f, const char *folder, struct thread_pool *pool, enum phantom_weave weave,
                      const char *model_id, const double *truth_file_unit);
/* The same on a cloth that was made before, and outlives f. */
void fit_phantom_init_on(struct fit_phantom *f, const char *folder, struct thread_pool *pool,
                         const struct fit_cloth *cloth, const char *model_id, const double *truth_file_unit);
void fit_phantom_release(struct fit_phantom *f);

struct fit_photography {
    size_t n_path; /* a configuration, cut into equal chunks */
    double noise;  /* relative error that every number gets (0.005) */
    uint64_t noise_seed;
    size_t part; /* photographs of the same n_path and another part have other paths, so their errors are independent */
};

/* Photographs at the truth. Stated standard errors hold both kinds of noise. Replaces earlier ones. */
void fit_phantom_photograph(struct fit_phantom *f, const struct fit_photography *how);
/* Observations from elsewhere (kept: copied). */
void fit_phantom_observe(struct fit_phantom *f, const struct observation_set *o);

/* Estimates of all observations' configurations at param with n_path paths each, without derivatives. */
void fit_phantom_render(const struct fit_phantom *f, const double *param, size_t n_path, struct estimate *out);

/* Of cloth, model and fitted means: what a checkpoint of a fit depends on. */
uint64_t fit_phantom_fingerprint(const struct fit_phantom *f);

struct fit_score {
    double rel_rms, se; /* se: of rel_rms, Monte-Carlo only */
};

/* On the observations of one set. at: where the kept estimates of 2 x n_kept paths a configuration are taken (usually
 * the truth; NULL: none); n_path: new paths a configuration and replica at param (0: the kept ones only). */
struct fit_score fit_phantom_score(const struct fit_phantom *f, enum job_set set, const double *at, size_t n_kept,
                                   const double *param, size_t n_path);

/* Paths a configuration and replica: `first` to learn how noisy each is, `most` on average. */
struct fit_score_goal {
    double se;
    size_t first, most;
};

/* With paths at param only, traced as fits do (with guided shadow paths), spread over the configurations so that se is reached with the fewest:
 * each round's paths are fresh and as many as the round before asks for, so that neither their number nor their spread depends on
 * what they came to; four rounds at most. se may be larger than the goal's where `most` does not reach it. */
struct fit_score fit_phantom_score_to(const struct fit_phantom *f, enum job_set set, const double *param,
                                      const struct fit_score_goal *goal);

/* What errors of the fit with covariance cov (n_param x n_param, fit coordinates) add to the squared relative RMS error of one set,
 * to first order and from the kept estimates at the truth alone: mean over rows of J cov J', J's own noise left out. */
double fit_phantom_expected(const struct fit_phantom *f, enum job_set set, size_t n_kept, const double *cov);
/* The same of one fit: mean over rows of (J (x - x_truth))^2. Score paths would have to be many to tell it as well. */
double fit_phantom_first_order(const struct fit_phantom *f, enum job_set set, size_t n_kept, const double *param);

#endif
