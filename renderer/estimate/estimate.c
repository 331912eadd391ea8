#include "renderer/estimate/estimate.h"

#include "renderer/estimate/estimate_blocks.h"
#include "renderer/estimate/radiance_source.h"
#include "renderer/estimate/rank_orders.h"
#include "renderer/estimate/rotation_mean.h"

#include <stdint.h>

static status numeric_error(const struct estimate_request *q, const struct estimate_fault *f, struct error *err)
{
    const struct appearance *m = q->input.model;
    const char *name = f->i_value < 3 ? "" : m->param[(f->i_value - 3) % m->n_param].name;
    char view[CONFIGURATION_TEXT];
    configuration_describe(&q->configuration[f->i_configuration], view);
    return error_set_field(err, STATUS_NUMERIC, name, "model '%s' gave a value that is not finite (%s; %s)", m->id,
                           name[0] != '\0' ? name : "radiance", view);
}

static status make_groups(const struct estimate_request *q, const struct radiance_source *source,
                          struct path_groups *groups, struct error *err)
{
    size_t fitting = (3 + 3 * SCATTERING_MAX_FLAT) / (3 + 3 * source->n_flat); /* into one path's values */
    size_t max_member = source->tracer->max_member < fitting ? source->tracer->max_member : fitting;
    if (!q->share_camera_paths || max_member == 1)
        return path_groups_single(groups, q->n_path, q->n_configuration, err);
    return path_groups_shared(groups, q->configuration, q->n_path, q->n_configuration, max_member, err);
}

static status announce(struct rank_team *team, const void *context, struct error *err)
{
    return rank_orders_estimate(team, context, err);
}

static status estimate_separate(const struct estimate_request *q, struct thread_pool *pool,
                                const struct progress *progress, struct estimate *out, struct error *err)
{
    struct radiance_source source;
    struct path_groups groups = {0};
    struct estimate_fault fault;
    status st = configuration_check(q->configuration, q->n_configuration, err);
    if (st == STATUS_OK) st = estimate_check_key(q->iteration, q->replica + q->next_replica_too, err);
    if (st != STATUS_OK) return st;
    st = radiance_source_init(&source, &q->input, q->configuration, q->n_configuration, err);
    if (st != STATUS_OK) return st;
    st = make_groups(q, &source, &groups, err);
    const struct estimate_blocks blocks = {
        .source = &source,
        .configuration = q->configuration,
        .n_configuration = q->n_configuration,
        .groups = &groups,
        .key = {.seed = q->seed, .iteration = q->iteration, .replica = q->replica},
        .next_replica_too = q->next_replica_too,
        .progress = progress,
        .announce = rank_orders_can_share(q->configuration, q->n_configuration, &q->input) ? announce : NULL,
        .announce_context = q};
    if (st == STATUS_OK) st = estimate_blocks_run(&blocks, pool, out, &fault, err);
    if (st == STATUS_NUMERIC) st = numeric_error(q, &fault, err);
    path_groups_release(&groups);
    radiance_source_release(&source);
    return st;
}

static status estimate_rotations(const struct estimate_request *q, struct thread_pool *pool,
                                 const struct progress *progress, struct estimate *out, struct error *err)
{
    struct rotation_mean mean;
    struct estimate_request turned = *q;
    status s = rotation_mean_init(&mean, q->configuration, q->n_path, q->n_configuration, err);
    turned.configuration = mean.turned;
    turned.n_configuration = mean.n_turned;
    turned.n_path = mean.n_path;
    if (s == STATUS_OK) s = estimate_separate(&turned, pool, progress, mean.estimate, err);
    if (s == STATUS_OK) rotation_mean_take(&mean, out);
    rotation_mean_release(&mean);
    return s;
}

status estimate_run(const struct estimate_request *q, struct thread_pool *pool, const struct progress *progress,
                    struct estimate *out, struct error *err)
{
    return rotation_mean_wanted(q->configuration, q->n_configuration) ? estimate_rotations(q, pool, progress, out, err)
                                                                      : estimate_separate(q, pool, progress, out, err);
}

void estimate_move_partners(struct estimate *e, const size_t *place)
{
    uint32_t n = 0;
    for (uint32_t k = 0; k < e->n_partner; k++) {
        struct estimate_partner moved = e->partner[k];
        if (place[moved.configuration] == SIZE_MAX) continue;
        moved.configuration = (uint32_t)place[moved.configuration];
        e->partner[n++] = moved;
    }
    e->n_partner = n;
}

size_t estimate_n_path(const struct configuration *c, size_t n_path)
{
    size_t n_cell = (size_t)c->contrast_cells * c->contrast_cells, n_rotation = c->n_rotation > 1 ? c->n_rotation : 1;
    size_t n_part = n_cell > 0 ? n_cell : n_rotation, part = (n_path + n_part - 1) / n_part;
    if (n_cell > 0)
        return n_cell * (part > 4 ? part + part % 2 : 4); /* two sets of two paths at least: contrast_plan_init */
    return n_rotation * ((part + RADIANCE_BLOCK_PATHS - 1) / RADIANCE_BLOCK_PATHS * RADIANCE_BLOCK_PATHS);
}
