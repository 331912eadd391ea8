/* A cloth with a texture of known contrast, and an estimator of it. The radiances of its paths are invented, but the
 * renderer's own code collects them in blocks. */
#ifndef SELVEDGE_TESTS_CHESS_BOARD_H
#define SELVEDGE_TESTS_CHESS_BOARD_H

#include "base/thread_pool.h"
#include "optimizer/fit/descent/estimator.h"

/* The cloth is a chess board of 8 x 8 fields with radiances a_c (1 + t) and a_c (1 - t) in channel c. The radiance of a
 * path is that of its field times an exponential deviate (relative variance 1). Parameters: a_r, a_g, a_b, t. */
enum { BOARD_N_PARAM = 4, BOARD_SIDE = 8, BOARD_CELL = BOARD_SIDE * BOARD_SIDE, BOARD_N_VIEW = 3 };

extern const struct param_info board_param[BOARD_N_PARAM];
extern const double board_truth[BOARD_N_PARAM];

/* For views 0 .. BOARD_N_VIEW - 1 the mean is estimated, for the others the contrast. */
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
/* The function of struct estimator, with the board as its context. If fail_after is not 0, the call after
 * fail_after successful ones fails with STATUS_IO. */
status board_estimate(void *context, const struct estimator_call *call, const struct progress *progress,
                      struct estimate *out, double *wall_s, struct error *err);
/* Estimates all views with n_path paths each. */
void board_ask(struct board *b, const double *param, size_t n_path, uint32_t iteration, struct estimate *e);

#endif
