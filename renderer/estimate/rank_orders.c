#include "renderer/estimate/rank_orders.h"

#include "renderer/estimate/rank_request.h"
#include "renderer/estimate/shared_cloth.h"
#include "renderer/scene/scene_place.h"

#include <stdio.h>
#include <string.h>

static const struct environment *only_environment(const struct configuration *c, size_t n, bool *one)
{
    const struct environment *e = NULL;
    *one = true;
    for (size_t i = 0; i < n; i++) {
        if (c[i].environment == NULL) continue;
        *one = *one && (e == NULL || e == c[i].environment);
        e = c[i].environment;
    }
    return e;
}

bool rank_orders_can_share(const struct configuration *c, size_t n, const struct radiance_input *in)
{
    bool one, surface = in->model->kind == MODEL_SURFACE;
    only_environment(c, n, &one);
    return one && in->fast == NULL && in->dual == NULL && in->diffusion == NULL && !in->has_speckle && in->n_hit == 0 &&
           strlen(in->model->id) < RANK_MODEL_BYTES &&
           (surface ? !scene_is_bent(in->scene.fibers) : in->scene.volume->bent == NULL);
}

/* Sends the cloth if the helpers lack it, and writes what estimates and pictures have in common. */
static status begin(struct rank_team *team, const struct radiance_input *in, const struct configuration *c,
                    struct rank_request *h, struct byte_pack *p, struct error *err)
{
    bool one, surface = in->model->kind == MODEL_SURFACE;
    const struct appearance_scene needed = {.fibers = surface ? in->scene.fibers : NULL,
                                            .volume = surface ? NULL : in->scene.volume};
    snprintf(h->model, sizeof h->model, "%s", in->model->id);
    h->n_set = in->n_set;
    h->want_derivative = in->want_derivative;
    h->plain_paths = in->plain_paths;
    h->has_discrepancy = in->discrepancy != NULL;
    status s = shared_cloth_send(rank_team_companion(team), team, &needed,
                                 only_environment(c, h->n_configuration, &one), &h->numbers, err);
    BYTE_PACK(p, *h);
    byte_pack_put(p, in->param, rank_request_n_param(in) * sizeof *in->param);
    if (h->has_discrepancy) BYTE_PACK(p, *in->discrepancy);
    byte_pack_put(p, c, h->n_configuration * sizeof *c);
    return s;
}

static status finish(struct rank_team *team, enum rank_order_kind kind, struct byte_pack *p, status s,
                     struct error *err)
{
    if (s == STATUS_OK) s = byte_pack_check(p, err);
    if (s == STATUS_OK) s = rank_team_order(team, kind, p->data, p->n, err);
    byte_pack_release(p);
    return s;
}

status rank_orders_estimate(struct rank_team *team, const struct estimate_request *q, struct error *err)
{
    struct byte_pack p = {0};
    struct rank_request h = {.n_configuration = q->n_configuration,
                             .seed = q->seed,
                             .iteration = q->iteration,
                             .replica = q->replica,
                             .share_camera_paths = q->share_camera_paths,
                             .next_replica_too = q->next_replica_too};
    status s = begin(team, &q->input, q->configuration, &h, &p, err);
    byte_pack_put(&p, q->n_path, q->n_configuration * sizeof *q->n_path);
    return finish(team, RANK_ORDER_ESTIMATE, &p, s, err);
}

status rank_orders_picture(struct rank_team *team, const struct render_request *q, struct error *err)
{
    struct byte_pack p = {0};
    struct rank_request h = {.n_configuration = 1,
                             .seed = q->seed,
                             .width = q->width,
                             .height = q->height,
                             .n_sample = q->n_sample,
                             .first_sample = q->first_sample,
                             .stream = q->stream};
    status s = begin(team, &q->input, q->configuration, &h, &p, err);
    return finish(team, RANK_ORDER_PICTURE, &p, s, err);
}

status rank_orders_agree(struct rank_team *team, const char *mine, struct error *err)
{
    status s = rank_team_order(team, RANK_ORDER_AGREE, mine, strlen(mine), err);
    return s == STATUS_OK ? rank_team_gather(team, err) : s;
}
