#include "renderer/transport/estimate.h"

#include "renderer/transport/camera.h"
#include "renderer/transport/estimate_blocks.h"
#include "renderer/transport/path_tracer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK_PATHS = 256, TASKS_PER_CONFIGURATION = 1024, N_VALUE = 3 + PATH_N_DERIVATIVE };

/* Sums over the paths of one task, in path order: n_value sums and n_value sums of squares. */
struct task_sum {
    uint64_t n_path, n_vertex;
    double *x, *x2;
};

struct task {
    uint32_t i_configuration, first_block, n_block;
};

struct run {
    const struct estimate_request *q;
    const struct progress *progress;
    struct path_setting *setting; /* per configuration */
    struct camera *camera;
    struct task *task;
    size_t n_task;
    struct task_sum *sum; /* per task */
    double *sum_storage;
    size_t n_flat, n_value; /* derivatives of a channel; radiance and derivatives */
};

static void trace_block(const struct run *r, uint32_t i_configuration, uint32_t i_block, struct task_sum *sum)
{
    const struct estimate_request *q = r->q;
    const struct path_setting *s = &r->setting[i_configuration];
    const struct rng_key key = {q->seed, q->iteration, q->replica, i_configuration};
    size_t n_jac = r->n_value - 3;
    for (uint32_t i = 0; i < BLOCK_PATHS; i++) {
        struct rng rng;
        struct scene_ray ray;
        struct path_result path;
        rng_start(&rng, &key, i_block, i);
        double x = rng_double(&rng), y = rng_double(&rng);
        sum->n_path++;
        if (!camera_ray(&r->camera[i_configuration], q->scene, x, y, &ray)) continue; /* sees nothing: adds 0 */
        path_trace(s, &ray, &rng, &path, NULL);
        sum->n_vertex += path.n_vertex;
        for (size_t k = 0; k < 3; k++) {
            double v = (double)path.radiance[k];
            sum->x[k] += v;
            sum->x2[k] += v * v;
        }
        for (size_t k = 0; k < n_jac; k++) {
            double v = (double)path.jac[k];
            sum->x[3 + k] += v;
            sum->x2[3 + k] += v * v;
        }
    }
}

static void run_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    struct run *r = context;
    const struct task *t = &r->task[i_task];
    for (uint32_t b = 0; b < t->n_block && !progress_cancelled(r->progress); b++)
        trace_block(r, t->i_configuration, t->first_block + b, &r->sum[i_task]);
}

/* Tasks of whole blocks; how many depends on the counts alone, so that sums do not depend on the threads. */
static status make_tasks(struct run *r, struct error *err)
{
    const struct estimate_request *q = r->q;
    size_t n = 0;
    for (int pass = 0; pass < 2; pass++) {
        n = 0;
        for (size_t i = 0; i < q->n_configuration; i++) {
            uint64_t n_block = ((uint64_t)q->n_path[i] + BLOCK_PATHS - 1) / BLOCK_PATHS;
            if (n_block > UINT32_MAX)
                return error_set_field(err, STATUS_TOO_LARGE, "n_path",
                                       "cannot trace %zu paths for configuration %zu: too many", q->n_path[i], i);
            uint64_t per_task = 1 + n_block / TASKS_PER_CONFIGURATION;
            for (uint64_t b = 0; b < n_block; b += per_task, n++)
                if (pass == 1)
                    r->task[n] = (struct task){(uint32_t)i, (uint32_t)b,
                                               (uint32_t)(n_block - b < per_task ? n_block - b : per_task)};
        }
        if (pass == 0) {
            r->task = malloc((n + 1) * sizeof *r->task);
            r->sum = calloc(n + 1, sizeof *r->sum);
            r->sum_storage = calloc(n + 1, 2 * r->n_value * sizeof *r->sum_storage);
            if (r->task == NULL || r->sum == NULL || r->sum_storage == NULL)
                return error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: no memory for %zu tasks", n);
        }
    }
    r->n_task = n;
    for (size_t i = 0; i < n; i++) {
        r->sum[i].x = r->sum_storage + 2 * r->n_value * i;
        r->sum[i].x2 = r->sum[i].x + r->n_value;
    }
    return STATUS_OK;
}

static double mean_variance(double x, double x2, double n)
{
    double mean = x / n, v = (x2 - x * mean) / (n - 1);
    return (v > 0 ? v : 0) / n;
}

static status reduce(const struct run *r, struct estimate *out, struct error *err)
{
    const struct estimate_request *q = r->q;
    size_t i_task = 0;
    for (size_t i = 0; i < q->n_configuration; i++) {
        double x[N_VALUE] = {0}, x2[N_VALUE] = {0};
        struct task_sum total = {0, 0, x, x2};
        for (; i_task < r->n_task && r->task[i_task].i_configuration == i; i_task++) {
            const struct task_sum *s = &r->sum[i_task];
            for (size_t k = 0; k < r->n_value; k++) {
                total.x[k] += s->x[k];
                total.x2[k] += s->x2[k];
            }
            total.n_path += s->n_path;
            total.n_vertex += s->n_vertex;
        }
        struct estimate *e = &out[i];
        memset(e, 0, sizeof *e);
        e->n_path = total.n_path;
        e->n_vertex = total.n_vertex;
        if (total.n_path == 0) continue;
        double n = (double)total.n_path;
        for (size_t k = 0; k < r->n_value; k++) {
            const char *name = k < 3 ? "" : q->model->param[(k - 3) % q->model->n_param].name;
            if (!isfinite(total.x2[k]))
                return error_set_field(
                    err, STATUS_NUMERIC, name,
                    "scattering model '%s' gave a value that is not finite in configuration %zu (%s)", q->model->id, i,
                    k < 3 ? "radiance" : name);
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

status estimate_run(const struct estimate_request *q, struct thread_pool *pool, const struct progress *progress,
                    struct estimate *out, struct error *err)
{
    struct parameter_sets sets;
    struct run r = {.q = q, .progress = progress};
    status st = estimate_check_configurations(q->configuration, q->n_configuration, q->iteration, q->replica, err);
    if (st != STATUS_OK) return st;
    st = parameter_sets_init(&sets, q->scene, q->model, q->param, q->n_set, err);
    if (st != STATUS_OK) goto out;
    r.n_flat = sets.n * q->model->n_param;
    r.n_value = 3 + (q->want_jacobian ? 3 * r.n_flat : 0);
    r.setting = malloc((q->n_configuration + 1) * sizeof *r.setting);
    r.camera = malloc((q->n_configuration + 1) * sizeof *r.camera);
    if (r.setting == NULL || r.camera == NULL) {
        st = error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: out of memory");
        goto out;
    }
    for (size_t i = 0; i < q->n_configuration; i++) {
        path_setting_init_sets(&r.setting[i], q->scene, &sets, &q->configuration[i], q->want_jacobian);
        camera_init(&r.camera[i], &q->configuration[i]);
    }
    st = make_tasks(&r, err);
    if (st != STATUS_OK) goto out;
    st = thread_pool_run(pool, r.n_task, run_task, &r, progress);
    if (st == STATUS_OK && progress_cancelled(progress)) st = STATUS_CANCELLED; /* a task may have stopped early */
    if (st != STATUS_OK) {
        error_set(err, st, "radiance estimate was cancelled");
        goto out;
    }
    st = reduce(&r, out, err);
out:
    free(r.sum);
    free(r.sum_storage);
    free(r.task);
    free(r.camera);
    free(r.setting);
    parameter_sets_release(&sets);
    return st;
}
