/* The source of a descent method's estimates: mean radiances of every fitted configuration at given parameters.
 * Production calls the path tracer (estimate.h) through a journal (estimate_journal.h); tests put an analytic function
 * here. */
#ifndef SELVEDGE_OPTIMIZER_ESTIMATOR_H
#define SELVEDGE_OPTIMIZER_ESTIMATOR_H

#include "base/progress.h"
#include "renderer/estimate/estimate.h"

/* Replica numbers (rng.h) of the different uses of an estimator. Each use has its own random streams. */
enum estimator_replica {
    REPLICA_FIT_A = 0,
    REPLICA_FIT_B = 1,
    REPLICA_RESCALE = 2,
    REPLICA_FINAL_A = 3,
    REPLICA_FINAL_B = 4,
    REPLICA_CERTIFICATE = 5,
    REPLICA_PICTURE = 6,
    REPLICA_CANDIDATE_A = 7,
    REPLICA_CANDIDATE_B = 8
};

/* The next call, announced in advance: the next replica at the same parameters. An estimator whose work several
 * processes share may make both replicas at the same time, because more tasks keep all processes busy. */
struct estimator_pair {
    struct estimate *next;       /* room for n_configuration */
    bool ready;                  /* `next` is filled in; the call for its numbers with `out` = next then does nothing */
    uint32_t iteration, replica; /* the numbers of `next` */
};

struct estimator_call {
    const double *param;  /* internal units */
    const size_t *n_path; /* per configuration */
    uint32_t iteration, replica;
    bool want_jacobian;
    bool plain_paths;            /* without guided shadow paths (path_tracer.h), as the published method traces them */
    struct estimator_pair *pair; /* NULL: the next call is not known */
};

struct estimator {
    void *context;
    size_t n_configuration, n_param;
    /* out: n_configuration estimates; *wall_s: seconds that the call took (when it was first made). */
    status (*run)(void *context, const struct estimator_call *call, const struct progress *progress,
                  struct estimate *out, double *wall_s, struct error *err);
};

#endif
