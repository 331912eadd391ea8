#include "tests/support/tracer/chess_board.h"

#include "renderer/estimate/estimate_blocks.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

const struct param_info board_param[BOARD_N_PARAM] = {
    {"a.r", "a", PARAM_COLOUR, PARAM_UNIT_NONE, 0, 0.01, 1.0, 0.5, PARAM_LOG, ""},
    {"a.g", "a", PARAM_COLOUR, PARAM_UNIT_NONE, 1, 0.01, 1.0, 0.5, PARAM_LOG, ""},
    {"a.b", "a", PARAM_COLOUR, PARAM_UNIT_NONE, 2, 0.01, 1.0, 0.5, PARAM_LOG, ""},
    {"t", "t", PARAM_SHAPE, PARAM_UNIT_NONE, -1, 0.01, 0.9, 0.1, PARAM_LOGIT, ""},
};

const double board_truth[BOARD_N_PARAM] = {0.3, 0.2, 0.4, 0.3};

double board_contrast(double t) { return t * t * BOARD_CELL / (BOARD_CELL - 1.0); }

static void trace_one(const struct board *b, const double xy[2], struct rng *rng, float *value)
{
    double sign = ((size_t)(xy[0] * BOARD_SIDE) + (size_t)(xy[1] * BOARD_SIDE)) % 2 == 0 ? 1.0 : -1.0;
    double bright = -log(1.0 - rng_double(rng));
    for (size_t c = 0; c < 3; c++) {
        value[c] = (float)(b->param[c] * (1.0 + sign * b->param[3]) * bright);
        if (!b->want_jacobian) continue;
        value[3 + c * BOARD_N_PARAM + c] = (float)((1.0 + sign * b->param[3]) * bright);
        value[3 + c * BOARD_N_PARAM + 3] = (float)(b->param[c] * sign * bright);
    }
}

static uint64_t trace(const void *state, const struct radiance_block *block, float *value)
{
    const struct board *b = state;
    size_t n_value = 3 + (b->want_jacobian ? 3 * BOARD_N_PARAM : 0);
    for (size_t i = 0; i < block->n_path; i++) trace_one(b, block->xy[i], &block->rng[i], value + i * n_value);
    return block->n_path;
}

static const struct radiance_tracer board_tracer = {.max_path = RADIANCE_BLOCK_PATHS, .max_member = 1, .trace = trace};

status board_estimate(void *context, const struct estimator_call *call, const struct progress *progress,
                      struct estimate *out, double *wall_s, struct error *err)
{
    struct board *b = context;
    if (b->fail_after > 0 && b->n_call == b->fail_after) return error_set(err, STATUS_IO, "killed here");
    b->n_call++;
    b->param = call->param;
    b->want_jacobian = call->want_jacobian;
    struct path_groups groups;
    struct estimate_fault fault;
    const struct radiance_source source = {
        .tracer = &board_tracer, .state = b, .n_set = 1, .n_flat = call->want_jacobian ? BOARD_N_PARAM : 0};
    const struct estimate_blocks q = {.source = &source,
                                      .configuration = b->configuration,
                                      .n_configuration = 2 * BOARD_N_VIEW,
                                      .groups = &groups,
                                      .key = {.seed = 5, .iteration = call->iteration, .replica = call->replica},
                                      .progress = progress};
    *wall_s = 0.0;
    assert_int_equal(path_groups_single(&groups, call->n_path, 2 * BOARD_N_VIEW, err), STATUS_OK);
    status s = estimate_blocks_run(&q, b->pool, out, &fault, err);
    path_groups_release(&groups);
    return s;
}

void board_init(struct board *b, size_t n_thread)
{
    memset(b, 0, sizeof *b);
    for (size_t i = 0; i < BOARD_N_VIEW; i++) b->configuration[BOARD_N_VIEW + i].contrast_cells = BOARD_SIDE;
    assert_int_equal(thread_pool_new(n_thread, &b->pool, NULL), STATUS_OK);
}

void board_ask(struct board *b, const double *param, size_t n_path, uint32_t iteration, struct estimate *e)
{
    const size_t count[2 * BOARD_N_VIEW] = {n_path, n_path, n_path, n_path, n_path, n_path};
    struct estimator_call call = {param, count, iteration, 0, true};
    double wall_s;
    assert_int_equal(board_estimate(b, &call, NULL, e, &wall_s, NULL), STATUS_OK);
}
