/* A cloth with a texture whose contrast is known, and an estimator of it: what the renderer's blocks do with its paths is real. */
#ifndef SELVEDGE_TESTS_CHESS_BOARD_H
#define SELVEDGE_TESTS_CHESS_BOARD_H

#include "base/thread_pool.h"
#include "optimizer/fit/descent/estimator.h"

/* A cloth like a chess board of 8 x 8 fields with radiance a_c (1 + t) and a_c (1 - t); a path sees that times an
 * exponential deviate (relative variance 1). Parameters: a_r, a_g, a_b, t. */
enum { BOARD_N_PARAM = 4, BOARD_SIDE = 8, BOARD_CELL = BOARD_SIDE * BOARD_SIDE, BOARD_N_VIEW = 3 };

extern const struct param_info board_param[BOARD_N_PARAM];
extern const double board_truth[BOARD_N_PARAM];

/* Views 0 .. BOARD_N_VIEW - 1 ask for means, the others for contrasts. */
struct board {
    const double *param;
    bool want_jacobian;
    struct thread_pool *pool;
    struct configuration configuration[2 * BOARD_N_VIEW];
    size_t n_call, fail_after;
};

/* Contrast of a board with the parameter t. */
double board_contrast(double t);
/* The caller frees b->pool. */
void board_init(struct board *b, size_t n_thread);
/* For struct estimator, with the board as its context. STATUS_IO in the call fail_after + 1, unless that is 0. */
status board_estimate(void *context, const struct estimator_call *call, const struct progress *progress,
                      struct estimate *out, double *wall_s, struct error *err);
/* Estimates with n_path paths a view. */
void board_ask(struct board *b, const double *param, size_t n_path, uint32_t iteration, struct estimate *e);

#endif
