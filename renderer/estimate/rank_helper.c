#include "renderer/estimate/rank_helper.h"

#include "geometry/reconstruct/slab_helper.h"
#include "renderer/estimate/estimate.h"
#include "renderer/estimate/rank_orders.h"
#include "renderer/estimate/rank_request.h"
#include "renderer/estimate/render.h"

#include <stdlib.h>
#include <string.h>

enum { AGREE_BYTES = 200 };

/* A request that has been read; everything is owned but the cloth. */
struct request {
    struct rank_request head;
    struct appearance model;
    struct radiance_input input;
    const struct environment *environment;
    double *param;
    struct discrepancy *discrepancy;
    struct configuration *configuration;
    size_t *n_path;
};

static void release(struct request *q)
{
    free(q->param);
    free(q->discrepancy);
    free(q->configuration);
    free(q->n_path);
}

static status read_request(const struct rank_order *order, struct shared_cloth *cloth, struct request *q,
                           struct error *err)
{
    struct byte_view v = {.data = order->data, .n = order->n_bytes};
    struct radiance_input *in = &q->input;
    const struct rank_request *h = &q->head;
    BYTE_VIEW(&v, q->head);
    q->head.model[RANK_MODEL_BYTES - 1] = '\0';
    if (!appearance_find(h->model, &q->model) || h->n_set > SCATTERING_MAX_SET)
        return error_set(err, STATUS_FORMAT, "another rank asks for model '%s' with %llu sets", h->model,
                         (unsigned long long)h->n_set);
    if (order->kind == RANK_ORDER_PICTURE && h->n_configuration != 1)
        return error_set(err, STATUS_FORMAT, "another rank asks for a picture of %llu configurations",
                         (unsigned long long)h->n_configuration);
    in->model = &q->model;
    in->n_set = h->n_set;
    in->want_derivative = h->want_derivative != 0;
    in->plain_paths = h->plain_paths != 0;
    in->param = q->param = byte_view_array(&v, rank_request_n_param(in), sizeof *q->param);
    if (h->has_discrepancy) in->discrepancy = q->discrepancy = byte_view_array(&v, 1, sizeof *q->discrepancy);
    q->configuration = byte_view_array(&v, h->n_configuration, sizeof *q->configuration);
    if (order->kind == RANK_ORDER_ESTIMATE) q->n_path = byte_view_array(&v, h->n_configuration, sizeof *q->n_path);
    status s = byte_view_check(&v, err);
    if (s == STATUS_OK && in->discrepancy != NULL && in->discrepancy->n > DISCREPANCY_MAX_PLACE)
        s = error_set(err, STATUS_FORMAT, "another rank asks for a discrepancy with %zu places", in->discrepancy->n);
    if (s == STATUS_OK) s = shared_cloth_find(cloth, &h->numbers, &in->scene, &q->environment, err);
    for (size_t i = 0; s == STATUS_OK && i < h->n_configuration; i++)
        if (q->configuration[i].environment != NULL) q->configuration[i].environment = q->environment;
    return s;
}

static status run_estimate(const struct request *q, struct thread_pool *pool, const struct progress *progress,
                           struct error *err)
{
    const struct rank_request *h = &q->head;
    const struct estimate_request e = {.input = q->input,
                                       .configuration = q->configuration,
                                       .n_configuration = h->n_configuration,
                                       .n_path = q->n_path,
                                       .seed = h->seed,
                                       .iteration = h->iteration,
                                       .replica = h->replica,
                                       .share_camera_paths = h->share_camera_paths != 0,
                                       .next_replica_too = h->next_replica_too != 0};
    struct estimate *none = calloc(2 * h->n_configuration + 1, sizeof *none);
    if (none == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: out of memory");
    status s = estimate_run(&e, pool, progress, none, err);
    free(none);
    return s;
}

static status run_picture(const struct request *q, struct thread_pool *pool, const struct progress *progress,
                          struct error *err)
{
    const struct rank_request *h = &q->head;
    const struct render_request r = {.input = q->input,
                                     .configuration = q->configuration,
                                     .width = h->width,
                                     .height = h->height,
                                     .n_sample = h->n_sample,
                                     .first_sample = h->first_sample,
                                     .seed = h->seed,
                                     .stream = h->stream};
    struct image im;
    status s = render_run(&r, pool, progress, &im, err);
    if (s == STATUS_OK) image_release(&im);
    return s;
}

static status follow(struct rank_team *team, const struct rank_order *order, struct shared_cloth *cloth,
                     struct thread_pool *pool, struct error *err)
{
    const struct progress progress = {.cancel = rank_team_cancel(team)};
    struct request q = {.param = NULL};
    status s = read_request(order, cloth, &q, err);
    if (s == STATUS_OK)
        s = order->kind == RANK_ORDER_ESTIMATE ? run_estimate(&q, pool, &progress, err)
                                               : run_picture(&q, pool, &progress, err);
    release(&q);
    return s;
}

static status agree(struct rank_team *team, const struct rank_order *order, const char *mine, struct error *err)
{
    if (strlen(mine) != order->n_bytes || memcmp(mine, order->data, order->n_bytes) != 0)
        return error_set(err, STATUS_INVALID, "this rank runs '%s', rank 0 runs '%.*s': all must be the same", mine,
                         order->n_bytes < AGREE_BYTES ? (int)order->n_bytes : AGREE_BYTES, (const char *)order->data);
    rank_team_confirm(team);
    return STATUS_OK;
}

status rank_helper_serve(struct rank_team *team, struct thread_pool *pool, const char *mine, struct error *err)
{
    struct shared_cloth cloth = {.n_use = 0};
    struct slab_helper slab = {.round = NULL};
    struct error lacks = {0}; /* why a cloth could not be taken: the next request is refused with it */
    status s = STATUS_OK;
    for (bool end = false; !end && s == STATUS_OK;) {
        struct rank_order order;
        struct error refused = lacks;
        s = rank_team_wait(team, &order, err);
        end = order.kind == RANK_ORDER_END;
        if (s == STATUS_OK && !end) {
            if (order.kind == RANK_ORDER_CLOTH)
                shared_cloth_take(&cloth, &order, &lacks);
            else if (slab_helper_takes(order.kind))
                refused.code = slab_helper_follow(&slab, team, &order, pool, &refused);
            else if (order.kind == RANK_ORDER_AGREE)
                agree(team, &order, mine, &refused);
            else if (lacks.code == STATUS_OK)
                follow(team, &order, &cloth, pool, &refused);
            if (order.kind != RANK_ORDER_CLOTH && refused.code != STATUS_OK) rank_team_refuse(team, &refused);
        }
        rank_order_release(&order);
    }
    slab_helper_release(&slab);
    shared_cloth_release(&cloth);
    return s;
}
