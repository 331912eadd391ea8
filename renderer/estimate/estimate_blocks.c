#include "renderer/estimate/estimate_blocks.h"
#include "base/ranks/rank_team.h"
#include "renderer/estimate/contrast_blocks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLOCK_PATHS = RADIANCE_BLOCK_PATHS,
    SUMS_PER_GROUP = 1024, /* at most, or twice as many */
    LEAST_TASKS = 64,      /* of all groups together, if they have as many blocks */
    N_VALUE = 3 + 3 * SCATTERING_MAX_FLAT,
    N_PAIR = ESTIMATE_MAX_PARTNER * (ESTIMATE_MAX_PARTNER + 1) / 2
};

/* Blocks of one group, which has a sum for each blocks_per_sum of them. */
struct task {
    uint32_t i_group, first_block, n_block, blocks_per_sum;
    size_t first_sum, n_sum;
};

struct run {
    const struct estimate_blocks *b;
    struct task *task;
    size_t n_task, n_sum;
    struct block_sum *sum;          /* one for each sum of the tasks */
    struct contrast_plan *contrast; /* per group; n_cell 0: its mean is wanted */
    double *sum_storage;
    size_t n_value, n_pair; /* the most of any group */
};

static size_t n_pair_of(const struct estimate_blocks *b, size_t i_group)
{
    size_t n = b->groups->group[i_group].n;
    return n * (n - 1) / 2;
}

static void run_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    struct run *r = context;
    const struct task *t = &r->task[i_task];
    float value[ESTIMATE_MOST_VALUES];
    const struct contrast_plan *contrast = &r->contrast[t->i_group];
    struct block_sum *sum = &r->sum[t->first_sum];
    if (contrast->n_cell > 0) {
        sum->n_bounce = contrast_trace_task(r->b, contrast, t->i_group, t->first_block, value);
        return;
    }
    const uint32_t most = estimate_blocks_at_once(r->b, t->i_group);
    for (uint32_t i = 0; i < t->n_block && !progress_cancelled(r->b->progress); i += most) {
        const uint32_t left = t->n_block - i;
        const struct block_range range = {t->i_group, t->first_block, i, left < most ? left : most, t->blocks_per_sum};
        estimate_trace_blocks(r->b, &range, value, sum);
    }
}

static status check_count(const struct path_group *g, size_t limit, size_t i_configuration, struct error *err)
{
    if (g->n_path <= limit) return STATUS_OK;
    return error_set_field(err, STATUS_TOO_LARGE, "n_path", "cannot trace %zu paths for configuration %zu: too many",
                           g->n_path, i_configuration);
}

static status plan_contrasts(struct run *r, struct error *err)
{
    const struct path_groups *groups = r->b->groups;
    r->contrast = calloc(groups->n + 1, sizeof *r->contrast);
    if (r->contrast == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: out of memory");
    for (size_t i = 0; i < groups->n; i++) {
        const struct path_group *g = &groups->group[i];
        size_t member = groups->member[g->first], n_side = r->b->configuration[member].contrast_cells;
        if (n_side == 0 || g->n_path == 0) continue;
        status s = check_count(g, UINT32_MAX, member, err);
        if (s == STATUS_OK) s = contrast_plan_init(&r->contrast[i], n_side, g->n_path, 3 * r->b->source->n_flat, err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

static uint64_t blocks_for(const struct path_group *g) { return ((uint64_t)g->n_path + BLOCK_PATHS - 1) / BLOCK_PATHS; }

/* Blocks of a group, and how many of them have one sum: this depends on the group alone. Of a contrast: its tasks. */
static uint64_t blocks_of(const struct run *r, size_t i_group, uint32_t *per_sum)
{
    const uint64_t n_block = blocks_for(&r->b->groups->group[i_group]);
    *per_sum = 1;
    if (r->contrast[i_group].n_cell > 0) return r->contrast[i_group].n_task;
    *per_sum += (uint32_t)(n_block / SUMS_PER_GROUP);
    return n_block;
}

/* Sums of a task: as many as are traced at once, if there are tasks enough for all threads of a machine. */
static uint32_t sums_per_task(const struct run *r, size_t i_group, uint32_t per_sum)
{
    const struct path_groups *groups = r->b->groups;
    uint64_t all = 0, n = estimate_blocks_at_once(r->b, i_group);
    if (r->contrast[i_group].n_cell > 0) return 1;
    for (size_t i = 0; i < groups->n; i++) all += blocks_for(&groups->group[i]);
    n = (all / LEAST_TASKS < n ? all / LEAST_TASKS : n) / per_sum;
    return n > 1 ? (uint32_t)n : 1;
}

static void fill_tasks(struct run *r)
{
    size_t n_value = r->n_value, n_pair = r->n_pair, i_sum = 0;
    for (size_t i = 0; i < r->b->groups->n; i++) {
        uint32_t per_sum;
        const uint64_t n_block = blocks_of(r, i, &per_sum), per_task = (uint64_t)sums_per_task(r, i, per_sum) * per_sum;
        for (uint64_t b = 0; b < n_block; b += per_task) {
            const uint64_t here = n_block - b < per_task ? n_block - b : per_task,
                           n_sum = (here + per_sum - 1) / per_sum;
            r->task[r->n_task++] =
                (struct task){(uint32_t)i, (uint32_t)b, (uint32_t)here, per_sum, i_sum, (size_t)n_sum};
            i_sum += (size_t)n_sum;
        }
    }
    for (size_t k = 0; k < r->n_sum; k++) {
        r->sum[k].x = r->sum_storage + (2 * n_value + n_pair) * k;
        r->sum[k].x2 = r->sum[k].x + n_value;
        r->sum[k].pair = r->sum[k].x2 + n_value;
    }
}

/* Tasks of whole blocks; how many depends on the counts alone, so that sums do not depend on the threads. */
static status make_tasks(struct run *r, struct error *err)
{
    const struct path_groups *groups = r->b->groups;
    size_t n = 0, n_value = 0, n_pair = 0;
    for (size_t i = 0; i < groups->n; i++) {
        const struct path_group *g = &groups->group[i];
        status s = check_count(g, (size_t)UINT32_MAX * BLOCK_PATHS, groups->member[g->first], err);
        if (s != STATUS_OK) return s;
        uint32_t per_sum;
        const uint64_t n_block = blocks_of(r, i, &per_sum);
        n += (size_t)((n_block + per_sum - 1) / per_sum);
        if (estimate_n_value(r->b, i) > n_value) n_value = estimate_n_value(r->b, i);
        if (n_pair_of(r->b, i) > n_pair) n_pair = n_pair_of(r->b, i);
    }
    r->n_sum = n;
    r->task = malloc((n + 1) * sizeof *r->task); /* at most one for each sum */
    r->sum = calloc(n + 1, sizeof *r->sum);
    r->sum_storage = calloc(n + 1, (2 * n_value + n_pair + 1) * sizeof *r->sum_storage);
    if (r->task == NULL || r->sum == NULL || r->sum_storage == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: no memory for %zu sums", n);
    r->n_value = n_value;
    r->n_pair = n_pair;
    fill_tasks(r);
    return STATUS_OK;
}

static status not_finite(size_t i_configuration, size_t i_value, struct estimate_fault *fault, struct error *err)
{
    *fault = (struct estimate_fault){i_configuration, i_value};
    return error_set(err, STATUS_NUMERIC, "a path gave a value that is not finite in configuration %zu",
                     i_configuration);
}

/* One member's means and variances from its part of the sums. */
static bool member_estimate(const struct block_sum *sum, size_t n_jac, struct estimate *e, size_t *bad_value)
{
    double n = (double)sum->n_path;
    e->n_path = sum->n_path;
    e->n_bounce = sum->n_bounce;
    for (size_t k = 0; k < 3 + n_jac && sum->n_path > 0; k++) {
        *bad_value = k;
        if (!isfinite(sum->x2[k])) return false;
        double mean = sum->x[k] / n, v = (sum->x2[k] - sum->x[k] * mean) / (n - 1), var = (v > 0 ? v : 0) / n;
        if (k < 3) {
            e->mean[k] = mean;
            e->var[k] = var;
        } else {
            e->jac[k - 3] = mean;
            e->jac_var[k - 3] = var;
        }
    }
    return true;
}

/* Adds the correlation of members a and b, b < a, whose estimates are ready. */
static void add_partner(const struct path_group *g, const size_t *member, size_t a, size_t b, double pair,
                        struct estimate *out)
{
    struct estimate *e = &out[member[g->first + a]];
    const struct estimate *f = &out[member[g->first + b]];
    double n = (double)e->n_path, covariance = pair / n, scale = 0.0;
    for (size_t c = 0; c < 3; c++) {
        covariance -= e->mean[c] * f->mean[c];
        scale += sqrt(e->var[c] * f->var[c]);
    }
    double correlation = scale > 0.0 ? covariance / (n - 1.0) / scale : 0.0;
    e->partner[e->n_partner++] = (struct estimate_partner){.configuration = (uint32_t)member[g->first + b],
                                                           .correlation = (float)fmin(fmax(correlation, -1.0), 1.0)};
}

static status group_estimates(const struct run *r, size_t i_group, const struct block_sum *total, struct estimate *out,
                              struct estimate_fault *fault, struct error *err)
{
    const struct path_groups *groups = r->b->groups;
    const struct path_group *g = &groups->group[i_group];
    size_t bad_value = 0, n_jac = 3 * r->b->source->n_flat;
    if (r->contrast[i_group].n_cell > 0) {
        struct estimate *e = &out[groups->member[g->first]];
        if (!contrast_reduce(&r->contrast[i_group], e, &bad_value))
            return not_finite(groups->member[g->first], bad_value, fault, err);
        e->n_bounce = total->n_bounce;
        return STATUS_OK;
    }
    for (size_t k = 0; k < g->n; k++) {
        size_t i = groups->member[g->first + k], at = k * (3 + n_jac);
        const struct block_sum own = {total->n_path, total->n_bounce, total->x + at, total->x2 + at, NULL};
        if (!member_estimate(&own, n_jac, &out[i], &bad_value)) return not_finite(i, bad_value, fault, err);
        for (size_t b = 0; b < k && total->n_path > 0; b++)
            add_partner(g, groups->member, k, b, total->pair[k * (k - 1) / 2 + b], out);
    }
    return STATUS_OK;
}

static void add_sum(const struct block_sum *s, size_t n_value, size_t n_pair, struct block_sum *total)
{
    for (size_t k = 0; k < n_value; k++) {
        total->x[k] += s->x[k];
        total->x2[k] += s->x2[k];
    }
    for (size_t k = 0; k < n_pair; k++) total->pair[k] += s->pair[k];
    total->n_path += s->n_path;
    total->n_bounce += s->n_bounce;
}

static status reduce(const struct run *r, struct estimate *out, struct estimate_fault *fault, struct error *err)
{
    size_t i_task = 0;
    status st = STATUS_OK;
    for (size_t i = 0; i < r->b->groups->n && st == STATUS_OK; i++) {
        double x[N_VALUE] = {0}, x2[N_VALUE] = {0}, pair[N_PAIR] = {0};
        struct block_sum total = {0, 0, x, x2, pair};
        for (; i_task < r->n_task && r->task[i_task].i_group == i; i_task++) {
            const struct task *t = &r->task[i_task];
            for (size_t k = 0; k < t->n_sum; k++)
                add_sum(&r->sum[t->first_sum + k], estimate_n_value(r->b, i), n_pair_of(r->b, i), &total);
        }
        st = group_estimates(r, i, &total, out, fault, err);
    }
    return st;
}

/* ---- tasks that other ranks have run ---- */

static size_t sum_bytes(const struct run *r, size_t i_task, double **sum)
{
    const struct task *t = &r->task[i_task];
    const struct contrast_plan *contrast = &r->contrast[t->i_group];
    if (contrast->n_cell > 0) return contrast_task_sums(contrast, t->first_block, sum) * sizeof **sum;
    *sum = r->sum[t->first_sum].x;
    return t->n_sum * (2 * r->n_value + r->n_pair) * sizeof **sum;
}

static size_t most_bytes(const struct run *r)
{
    size_t most = 0;
    double *sum;
    for (size_t i = 0; i < r->n_task; i++) most = sum_bytes(r, i, &sum) > most ? sum_bytes(r, i, &sum) : most;
    return most + 2 * sizeof(uint64_t);
}

/* The tasks of one replica, then the tasks of the next one. */
struct replicas {
    struct run run[2];
    struct estimate_blocks blocks[2]; /* differ in their replica */
    size_t n;
};

static struct run *run_of(struct replicas *p, size_t *i_task)
{
    struct run *r = &p->run[*i_task / p->run[0].n_task];
    *i_task %= p->run[0].n_task;
    return r;
}

static void run_any_task(void *context, size_t i_task, size_t i_thread)
{
    struct run *r = run_of(context, &i_task);
    run_task(r, i_task, i_thread);
}

static size_t pack_task(void *context, size_t i_task, void *to)
{
    const struct run *r = run_of(context, &i_task);
    double *sum;
    const struct block_sum *first = &r->sum[r->task[i_task].first_sum]; /* counts for the whole task */
    const uint64_t count[2] = {first->n_path, first->n_bounce};
    size_t n = sum_bytes(r, i_task, &sum);
    memcpy(to, count, sizeof count);
    memcpy((char *)to + sizeof count, sum, n);
    return n + sizeof count;
}

static bool unpack_task(void *context, size_t i_task, const void *from, size_t n_bytes)
{
    struct run *r = run_of(context, &i_task);
    double *sum;
    uint64_t count[2];
    size_t n = sum_bytes(r, i_task, &sum);
    if (n_bytes != n + sizeof count) return false;
    memcpy(count, from, sizeof count);
    memcpy(sum, (const char *)from + sizeof count, n);
    struct block_sum *first = &r->sum[r->task[i_task].first_sum];
    first->n_path = count[0];
    first->n_bounce = count[1];
    return true;
}

static status share_tasks(struct replicas *p, struct rank_team *team, struct thread_pool *pool, struct error *err)
{
    const struct estimate_blocks *b = p->blocks;
    const struct rank_work work = {.n_task = p->n * p->run[0].n_task,
                                   .most_bytes = most_bytes(&p->run[0]),
                                   .run = run_any_task,
                                   .pack = pack_task,
                                   .unpack = unpack_task,
                                   .context = p};
    status st = rank_team_rank(team) == 0 ? b->announce(team, b->announce_context, err) : STATUS_OK;
    return st == STATUS_OK ? rank_team_share(team, &work, pool, b->progress, err) : st;
}

static status run_tasks(struct replicas *p, struct rank_team *team, struct thread_pool *pool, struct error *err)
{
    const struct progress *progress = p->blocks[0].progress;
    status st = team != NULL ? share_tasks(p, team, pool, err)
                             : thread_pool_run(pool, p->n * p->run[0].n_task, run_any_task, p, progress);
    if (st == STATUS_OK && progress_cancelled(progress)) st = STATUS_CANCELLED; /* a task may have stopped early */
    return st == STATUS_CANCELLED ? error_set(err, st, "radiance estimate was cancelled") : st;
}

static void release(struct run *r)
{
    for (size_t i = 0; i < r->b->groups->n && r->contrast != NULL; i++) contrast_plan_release(&r->contrast[i]);
    free(r->contrast);
    free(r->sum_storage);
    free(r->sum);
    free(r->task);
}

status estimate_blocks_run(const struct estimate_blocks *b, struct thread_pool *pool, struct estimate *out,
                           struct estimate_fault *fault, struct error *err)
{
    struct replicas p = {.n = b->next_replica_too ? 2 : 1};
    struct rank_team *team = b->announce != NULL ? thread_pool_team(pool) : NULL;
    status st = STATUS_OK;
    for (size_t i = 0; i < p.n; i++) {
        p.blocks[i] = *b;
        p.blocks[i].key.replica += (uint32_t)i;
        p.run[i].b = &p.blocks[i];
        if (st == STATUS_OK) st = plan_contrasts(&p.run[i], err);
        if (st == STATUS_OK) st = make_tasks(&p.run[i], err);
    }
    if (st == STATUS_OK) st = run_tasks(&p, team, pool, err);
    if (st == STATUS_OK) memset(out, 0, p.n * b->n_configuration * sizeof *out);
    for (size_t i = 0; i < p.n; i++) {
        if (st == STATUS_OK && (team == NULL || rank_team_rank(team) == 0))
            st = reduce(&p.run[i], out + i * b->n_configuration, fault, err);
        release(&p.run[i]);
    }
    return st;
}

status estimate_check_key(uint32_t iteration, uint32_t replica, struct error *err)
{
    if (iteration <= 65535 && replica <= 15) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, "iteration",
                           "cannot estimate iteration %u, replica %u: at most 65535 and 15", iteration, replica);
}
