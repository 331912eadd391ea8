#include "renderer/estimate/shared_cloth.h"

#include "renderer/scene/scene_pack.h"
#include "renderer/transport/environment.h"

#include <string.h>

struct item_head {
    uint64_t number;
    uint32_t kind, i_item;
};

static void clear(struct shared_item *i)
{
    if (i->fibers != NULL) scene_free(i->fibers);
    if (i->volume.brick != NULL) volume_scene_release(&i->volume);
    if (i->environment != NULL) environment_free(i->environment);
    memset(i, 0, sizeof *i);
}

void shared_cloth_release(struct shared_cloth *c)
{
    for (size_t i = 0; i < SHARED_CLOTH_KEPT; i++) clear(&c->item[i]);
}

/* Marks an item as used, and returns it; NULL: it is not there. */
static struct shared_item *use(struct shared_cloth *c, enum shared_kind kind, uint64_t number)
{
    for (size_t i = 0; i < SHARED_CLOTH_KEPT; i++)
        if (c->item[i].kind == kind && c->item[i].number == number) {
            c->item[i].last_use = ++c->n_use;
            return &c->item[i];
        }
    return NULL;
}

/* The place that has not been used for the longest time. */
static size_t oldest(const struct shared_cloth *c)
{
    size_t at = 0;
    for (size_t i = 1; i < SHARED_CLOTH_KEPT; i++)
        if (c->item[i].last_use < c->item[at].last_use) at = i;
    return at;
}

static status send(struct shared_cloth *c, struct rank_team *team, const struct item_head *h, const void *form,
                   struct error *err)
{
    struct byte_pack p = {0};
    BYTE_PACK(&p, *h);
    if (h->kind == SHARED_FIBERS) scene_pack(form, &p);
    if (h->kind == SHARED_VOLUME) volume_scene_pack(form, &p);
    if (h->kind == SHARED_ENVIRONMENT) environment_pack(form, &p);
    status s = byte_pack_check(&p, err);
    if (s == STATUS_OK) s = rank_team_order(team, RANK_ORDER_CLOTH, p.data, p.n, err);
    byte_pack_release(&p);
    c->item[h->i_item] =
        (struct shared_item){.kind = (enum shared_kind)h->kind, .number = h->number, .last_use = ++c->n_use};
    return s;
}

static status need(struct shared_cloth *c, struct rank_team *team, enum shared_kind kind, uint64_t number,
                   const void *form, struct error *err)
{
    const struct item_head h = {.number = number, .kind = kind, .i_item = (uint32_t)oldest(c)};
    return number == 0 || use(c, kind, number) != NULL ? STATUS_OK : send(c, team, &h, form, err);
}

status shared_cloth_send(struct shared_cloth *c, struct rank_team *team, const struct appearance_scene *scene,
                         const struct environment *environment, struct shared_numbers *n, struct error *err)
{
    *n = (struct shared_numbers){.fibers = scene->fibers != NULL ? scene_number(scene->fibers) : 0,
                                 .volume = scene->volume != NULL ? scene->volume->number : 0,
                                 .environment = environment != NULL ? environment_number(environment) : 0};
    status s = need(c, team, SHARED_FIBERS, n->fibers, scene->fibers, err);
    if (s == STATUS_OK) s = need(c, team, SHARED_VOLUME, n->volume, scene->volume, err);
    return s == STATUS_OK ? need(c, team, SHARED_ENVIRONMENT, n->environment, environment, err) : s;
}

status shared_cloth_take(struct shared_cloth *c, const struct rank_order *order, struct error *err)
{
    struct byte_view v = {.data = order->data, .n = order->n_bytes};
    struct item_head h;
    BYTE_VIEW(&v, h);
    if (v.failed || h.i_item >= SHARED_CLOTH_KEPT || h.kind < SHARED_FIBERS || h.kind > SHARED_ENVIRONMENT)
        return error_set(err, STATUS_FORMAT, "a cloth of another rank is none");
    struct shared_item *i = &c->item[h.i_item];
    clear(i);
    status s = h.kind == SHARED_FIBERS   ? scene_unpack(&v, &i->fibers, err)
               : h.kind == SHARED_VOLUME ? volume_scene_unpack(&v, &i->volume, err)
                                         : environment_unpack(&v, &i->environment, err);
    if (s != STATUS_OK) return s;
    i->kind = (enum shared_kind)h.kind;
    i->number = h.number;
    return STATUS_OK;
}

/* NULL when it is not wanted or has not been sent. */
static struct shared_item *look_up(struct shared_cloth *c, enum shared_kind kind, uint64_t number, bool *lacks)
{
    struct shared_item *i = number != 0 ? use(c, kind, number) : NULL;
    if (number != 0 && i == NULL) *lacks = true;
    return i;
}

status shared_cloth_find(struct shared_cloth *c, const struct shared_numbers *n, struct appearance_scene *scene,
                         const struct environment **environment, struct error *err)
{
    bool lacks = false;
    const struct shared_item *fibers = look_up(c, SHARED_FIBERS, n->fibers, &lacks),
                             *volume = look_up(c, SHARED_VOLUME, n->volume, &lacks),
                             *around = look_up(c, SHARED_ENVIRONMENT, n->environment, &lacks);
    if (lacks) return error_set(err, STATUS_FORMAT, "another rank asks for a cloth that it has not sent");
    scene->fibers = fibers != NULL ? fibers->fibers : NULL;
    scene->volume = volume != NULL ? &volume->volume : NULL;
    *environment = around != NULL ? around->environment : NULL;
    return STATUS_OK;
}
