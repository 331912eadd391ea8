#include "renderer/transport/contrast_blocks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK_PATHS = ESTIMATE_BLOCK_PATHS, TASKS_PER_CONFIGURATION = 1024, N_VALUE = 3 + 3 * SCATTERING_MAX_FLAT };

/* Sums over the paths of one task, in path order: 3 + n_jac sums and as many sums of squares. */
struct task_sum {
    uint64_t n_path, n_vertex;
    double *x, *x2;
};

struct task {
    uint32_t i_configuration, first_block, n_block;
};

struct run {
    const struct estimate_blocks *b;
    const struct progress *progress;
    struct task *task;
    size_t n_task;
    struct task_sum *sum;           /* per task */
    struct contrast_plan *contrast; /* per configuration; n_cell 0: its mean is wanted */
    double *sum_storage;
};

static void trace_block(const struct run *r, uint32_t i_configuration, uint32_t i_block, struct task_sum *sum,
                        float *value)
{
    const struct estimate_blocks *b = r->b;
    const struct rng_key key = {b->seed, b->iteration, b->replica, i_configuration};
    size_t n_value = 3 + b->n_jac;
    struct rng rng[BLOCK_PATHS];
    double xy[BLOCK_PATHS][2];
    memset(value, 0, BLOCK_PATHS * n_value * sizeof *value);
    for (uint32_t i = 0; i < BLOCK_PATHS; i++) {
        if (progress_cancelled(r->progress)) return; /* a block of white cloth takes longer than a caller will wait */
        rng_start(&rng[i], &key, i_block, i);
        for (int a = 0; a < 2; a++) xy[i][a] = rng_double(&rng[i]);
        if (b->trace_block == NULL)
            sum->n_vertex += b->trace(b->context, i_configuration, xy[i][0], xy[i][1], &rng[i], value + i * n_value);
    }
    if (b->trace_block != NULL) sum->n_vertex += b->trace_block(b->context, i_configuration, xy, rng, value);
    sum->n_path += BLOCK_PATHS;
    for (size_t i = 0; i < BLOCK_PATHS; i++)
        for (size_t k = 0; k < n_value; k++) {
            double v = (double)value[i * n_value + k];
            sum->x[k] += v;
            sum->x2[k] += v * v;
        }
}

static void run_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    struct run *r = context;
    const struct task *t = &r->task[i_task];
    float value[BLOCK_PATHS * N_VALUE];
    const struct contrast_plan *contrast = &r->contrast[t->i_configuration];
    if (contrast->n_cell > 0) {
        r->sum[i_task].n_vertex =
            contrast_trace_task(r->b, contrast, t->i_configuration, t->first_block, r->progress, value);
        return;
    }
    for (uint32_t b = 0; b < t->n_block && !progress_cancelled(r->progress); b++)
        trace_block(r, t->i_configuration, t->first_block + b, &r->sum[i_task], value);
}

static status plan_contrasts(struct run *r, struct error *err)
{
    const struct estimate_blocks *q = r->b;
    r->contrast = calloc(q->n_configuration + 1, sizeof *r->contrast);
    if (r->contrast == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: out of memory");
    for (size_t i = 0; i < q->n_configuration && q->configuration != NULL; i++) {
        if (q->configuration[i].contrast_cells == 0 || q->n_path[i] == 0) continue;
        if (q->n_path[i] > UINT32_MAX)
            return error_set_field(err, STATUS_TOO_LARGE, "n_path",
                                   "cannot trace %zu paths for configuration %zu: too many", q->n_path[i], i);
        status s = contrast_plan_init(&r->contrast[i], q->configuration[i].contrast_cells, q->n_path[i], q->n_jac, err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

/* Tasks of whole blocks (of a contrast: of whole cells, numbered); how many depends on the counts alone, so that sums do not depend on the threads. */
static status make_tasks(struct run *r, struct error *err)
{
    const struct estimate_blocks *q = r->b;
    size_t n = 0, n_value = 3 + q->n_jac;
    for (int pass = 0; pass < 2; pass++) {
        n = 0;
        for (size_t i = 0; i < q->n_configuration; i++) {
            uint64_t n_block = ((uint64_t)q->n_path[i] + BLOCK_PATHS - 1) / BLOCK_PATHS;
            if (n_block > UINT32_MAX)
                return error_set_field(err, STATUS_TOO_LARGE, "n_path",
                                       "cannot trace %zu paths for configuration %zu: too many", q->n_path[i], i);
            uint64_t per_task = 1 + n_block / TASKS_PER_CONFIGURATION;
            if (r->contrast[i].n_cell > 0) {
                n_block = r->contrast[i].n_task;
                per_task = 1;
            }
            for (uint64_t b = 0; b < n_block; b += per_task, n++)
                if (pass == 1)
                    r->task[n] = (struct task){(uint32_t)i, (uint32_t)b,
                                               (uint32_t)(n_block - b < per_task ? n_block - b : per_task)};
        }
        if (pass == 0) {
            r->task = malloc((n + 1) * sizeof *r->task);
            r->sum = calloc(n + 1, sizeof *r->sum);
            r->sum_storage = calloc(n + 1, 2 * n_value * sizeof *r->sum_storage);
            if (r->task == NULL || r->sum == NULL || r->sum_storage == NULL)
                return error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: no memory for %zu tasks", n);
        }
    }
    r->n_task = n;
    for (size_t i = 0; i < n; i++) {
        r->sum[i].x = r->sum_storage + 2 * n_value * i;
        r->sum[i].x2 = r->sum[i].x + n_value;
    }
    return STATUS_OK;
}

static double mean_variance(double x, double x2, double n)
{
    double mean = x / n, v = (x2 - x * mean) / (n - 1);
    return (v > 0 ? v : 0) / n;
}

static status reduce(const struct run *r, struct estimate *out, size_t *bad_configuration, size_t *bad_value,
                     struct error *err)
{
    const struct estimate_blocks *q = r->b;
    size_t i_task = 0;
    for (size_t i = 0; i < q->n_configuration; i++) {
        double x[N_VALUE] = {0}, x2[N_VALUE] = {0};
        struct task_sum total = {0, 0, x, x2};
        for (; i_task < r->n_task && r->task[i_task].i_configuration == i; i_task++) {
            const struct task_sum *s = &r->sum[i_task];
            for (size_t k = 0; k < 3 + q->n_jac; k++) {
                total.x[k] += s->x[k];
                total.x2[k] += s->x2[k];
            }
            total.n_path += s->n_path;
            total.n_vertex += s->n_vertex;
        }
        struct estimate *e = &out[i];
        memset(e, 0, sizeof *e);
        if (r->contrast[i].n_cell > 0 && !contrast_reduce(&r->contrast[i], e, bad_value)) {
            *bad_configuration = i;
            return error_set(err, STATUS_NUMERIC, "a path gave a value that is not finite in configuration %zu", i);
        }
        if (r->contrast[i].n_cell == 0) e->n_path = total.n_path;
        e->n_vertex = total.n_vertex;
        if (total.n_path == 0) continue;
        double n = (double)total.n_path;
        for (size_t k = 0; k < 3 + q->n_jac; k++) {
            if (!isfinite(total.x2[k])) {
                *bad_configuration = i;
                *bad_value = k;
                return error_set(err, STATUS_NUMERIC, "a path gave a value that is not finite in configuration %zu", i);
            }
            double mean = total.x[k] / n, var = mean_variance(total.x[k], total.x2[k], n);
            if (k < 3) {
                e->mean[k] = mean;
                e->var[k] = var;
            } else {
                e->jac[k - 3] = mean;
                e->jac_var[k - 3] = var;
            }
        }
    }
    return STATUS_OK;
}

status estimate_blocks_run(const struct estimate_blocks *b, struct thread_pool *pool, const struct progress *progress,
                           struct estimate *out, size_t *bad_configuration, size_t *bad_value, struct error *err)
{
    struct run r = {.b = b, .progress = progress};
    status st = plan_contrasts(&r, err);
    if (st == STATUS_OK) st = make_tasks(&r, err);
    if (st != STATUS_OK) goto out;
    st = thread_pool_run(pool, r.n_task, run_task, &r, progress);
    if (st == STATUS_OK && progress_cancelled(progress)) st = STATUS_CANCELLED; /* a task may have stopped early */
    if (st != STATUS_OK) {
        error_set(err, st, "radiance estimate was cancelled");
        goto out;
    }
    st = reduce(&r, out, bad_configuration, bad_value, err);
out:
    for (size_t i = 0; i < b->n_configuration && r.contrast != NULL; i++) contrast_plan_release(&r.contrast[i]);
    free(r.contrast);
    free(r.sum_storage);
    free(r.sum);
    free(r.task);
    return st;
}

static bool configuration_makes_sense(const struct configuration *c)
{
    double sum =
        c->light_theta_rad + c->light_phi_rad + c->camera_theta_rad + c->camera_phi_rad + c->cloth_rotation_rad;
    bool lamp = c->light != LIGHT_SQUARE_LAMP || (c->light_distance_m > 0 && c->lamp_side_m > 0);
    bool environment = true;
    for (int k = 0; k < 3; k++) environment &= c->environment_rgb[k] >= 0 && isfinite(c->environment_rgb[k]);
    return isfinite(sum) && c->camera_theta_rad >= 0 && c->camera_theta_rad < M_PI_2 && lamp && environment &&
           c->light <= LIGHT_NO_LAMP && c->camera <= CAMERA_FAR_FIELD && c->crop_m > 0 && c->crop_aspect >= 0 &&
           isfinite(c->crop_aspect) && c->contrast_cells != 1 && c->contrast_cells <= CONFIGURATION_MAX_CELLS &&
           (c->camera == CAMERA_FAR_FIELD || c->camera_distance_m > 0);
}

status estimate_check_configurations(const struct configuration *configuration, size_t n_configuration,
                                     uint32_t iteration, uint32_t replica, struct error *err)
{
    if (n_configuration > CONFIGURATION_MAX_COUNT)
        return error_set_field(err, STATUS_INVALID, "n_configuration",
                               "cannot estimate %zu configurations: at most %d have random numbers of their own",
                               n_configuration, CONFIGURATION_MAX_COUNT);
    if (iteration > 65535 || replica > 15)
        return error_set_field(err, STATUS_INVALID, "iteration",
                               "cannot estimate iteration %u, replica %u: at most 65535 and 15", iteration, replica);
    for (size_t i = 0; i < n_configuration; i++) {
        if (!configuration_makes_sense(&configuration[i]))
            return error_set_field(err, STATUS_INVALID, "configuration",
                                   "cannot estimate configuration %zu: angles, distances or lights make no sense", i);
    }
    return STATUS_OK;
}
