/* Phantom cloth and photographs of it, for benchmarks of fits. Photographs are made once and kept in a folder, and
 * fits are scored against the true parameters.
 *
 * Photographs are path-traced mean radiances of the 16 + 24 built-in configurations (phantom_view_table.h). They use
 * seeds that no fit uses, and plain paths unless fit_phantom.guided is set, so that a fault of the guided shadow
 * paths of fits would appear as a misfit. They are made in chunks of at most FIT_CHUNK paths for each configuration.
 * Each chunk is a file, so that an interrupted run can be continued. The name of a file is a checksum of everything
 * that it depends on, except the renderer itself: empty the folder after a change of the renderer.
 *
 * The score of a parameter set is the relative RMS error of the held-out means (objective.h), from two independent
 * replicas and without Monte-Carlo bias. Estimates at the truth, which are also kept, and estimates at the parameters
 * are extrapolated to one another by their derivatives and averaged (linear_model.h). Truth and fit are thus compared
 * largely on the same paths.
 *
 * All functions end the program when something fails.
 */
#ifndef SELVEDGE_TESTS_FIT_PHANTOM_H
#define SELVEDGE_TESTS_FIT_PHANTOM_H

#include "geometry/phantom/phantom.h"
#include "optimizer/fit/descent/trace_estimator.h"
#include "optimizer/fit/objective/coordinate.h"
#include "renderer/transport/volume/volume_scene.h"

enum { FIT_CHUNK = 100000, FIT_N_VIEW = 40, FIT_MAX_OBSERVATION = 64 };

struct fit_cloth {
    struct fiber_set fiber;
    struct scene *scene;
    struct direction_volume volume; /* only with fit_cloth_option.with_volume */
    struct volume_scene volume_scene;
    bool has_volume;
};

struct fit_phantom {
    struct thread_pool *pool;
    const char *folder; /* where estimates are kept */
    struct fit_cloth cloth;
    bool shares_cloth; /* true: the caller owns and releases the cloth */
    /* true: photographs and scores have guided shadow paths, too: less noise with as many paths */
    bool guided;
    struct appearance model;
    double truth[FIT_MAX_PARAM];                /* internal units */
    struct observation_set observation, fitted; /* all observations; those of the set "fit" */
    struct configuration *configuration;        /* of `observation` */
};

/* Unless s is STATUS_OK, prints status and error to standard error and calls exit(1). */
void fit_check(status s, const struct error *err);

/* One tile of a phantom: fibers of 14 um, black sheet below. */
struct fit_cloth_option {
    enum phantom_weave weave;
    /* File of a real yarn's parameters (phantom_yarn_read), for plied yarns with hairs. NULL: yarns of 37 smooth
     * parallel fibers. */
    const char *yarn_file;
    double flatness; /* width over height of yarns; 0: the phantom's default, 1.8 */
    /* true: felt of 1 x 1 x 1 mm, of which an eighth is fiber, like craft felt. false: felt of 0.6 x 0.6 x 0.25 mm,
     * half of it fiber. */
    bool lofty;
    /* Also make densities and directions, on a grid of 2 um (for plied yarns or lofty felt, of half a fiber radius). */
    bool with_volume;
};

void fit_cloth_init(struct fit_cloth *c, const struct fit_cloth_option *option, struct thread_pool *pool);
void fit_cloth_release(struct fit_cloth *c);

/* Makes cloth and model, without observations. truth_file_unit NULL: the true parameters are the model's start. */
void fit_phantom_init(struct fit_phantom *f, const char *folder, struct thread_pool *pool, enum phantom_weave weave,
                      const char *model_id, const double *truth_file_unit);
/* The same with an existing cloth, which must outlive f. */
void fit_phantom_init_on(struct fit_phantom *f, const char *folder, struct thread_pool *pool,
                         const struct fit_cloth *cloth, const char *model_id, const double *truth_file_unit);
void fit_phantom_release(struct fit_phantom *f);

struct fit_photography {
    size_t n_path; /* for each configuration, divided into equal chunks */
    double noise;  /* standard deviation of the relative error of every number (0.005) */
    uint64_t noise_seed;
    size_t part; /* photographs with different parts use different paths, so that their errors are independent */
};

/* Makes photographs at the true parameters and replaces the present observations. The standard errors that they state
 * include Monte-Carlo noise and the relative error. */
void fit_phantom_photograph(struct fit_phantom *f, const struct fit_photography *how);
/* Replaces the observations by a copy of others. */
void fit_phantom_observe(struct fit_phantom *f, const struct observation_set *o);

/* Estimates all observations' configurations at param with n_path paths each, without derivatives. */
void fit_phantom_render(const struct fit_phantom *f, const double *param, size_t n_path, struct estimate *out);

/* Checksum of cloth, model and fitted means, on which a checkpoint of a fit depends. */
uint64_t fit_phantom_fingerprint(const struct fit_phantom *f);

struct fit_score {
    double rel_rms, se; /* se: standard error of rel_rms from Monte-Carlo noise alone */
};

/* The score of the truth that follows from the stated errors of one set's photographs, without rendering. */
double fit_phantom_stated_score(const struct fit_phantom *f, enum job_set set);

/* Score of param on the observations of one set. at: parameters of the kept estimates, which have 2 x n_kept paths for
 * each configuration (usually the truth; NULL: no kept estimates). n_path: new paths for each configuration and replica
 * at param (0: only the kept estimates are used). */
struct fit_score fit_phantom_score(const struct fit_phantom *f, enum job_set set, const double *at, size_t n_kept,
                                   const double *param, size_t n_path);

/* The relative RMS error of the means at param against those at the truth, which have no noise of photographs. The
 * paths are those of fit_phantom_score; means at param and at the truth are pooled from the same paths, so most of
 * their noise cancels, and the product of two replicas has no bias by what is left. */
double fit_phantom_true_error(const struct fit_phantom *f, enum job_set set, size_t n_kept, const double *param,
                              size_t n_path);

/* Wanted standard error of a score. `first` and `most` are paths for each configuration and replica: those of the first
 * round, which measures the noise of each configuration, and the largest mean over the configurations. */
struct fit_score_goal {
    double se;
    size_t first, most;
};

/* Score by paths at param alone, which include guided shadow paths as in fits. They are distributed over the
 * configurations so that the goal's se needs the fewest. There are at most four rounds, each with fresh paths. The
 * noise of the earlier rounds determines the counts of the next, so that counts do not depend on the values that they
 * estimate. The se of the result is larger than the goal's when `most` paths are not enough. */
struct fit_score fit_phantom_score_to(const struct fit_phantom *f, enum job_set set, const double *param,
                                      const struct fit_score_goal *goal);

/* What errors of the fit with covariance cov (n_param x n_param, fit coordinates) add to the squared relative RMS
 * error of one set, to first order: the mean over rows of J cov J', without the bias by the noise of J. J is from the
 * kept estimates at the truth. */
double fit_phantom_expected(const struct fit_phantom *f, enum job_set set, size_t n_kept, const double *cov);
/* The same for the result x of one fit: the mean over rows of (J (x - x_truth))^2. A score by paths at param would need
 * many paths for the same precision. */
double fit_phantom_first_order(const struct fit_phantom *f, enum job_set set, size_t n_kept, const double *param);

#endif
