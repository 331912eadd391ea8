/* Cloths and environments that all ranks of a team have. The root sends those that are new; both sides cache the
 * SHARED_CLOTH_KEPT cloths that were used last, so that the root knows which cloths the helpers have. */
#ifndef SELVEDGE_RENDERER_SHARED_CLOTH_H
#define SELVEDGE_RENDERER_SHARED_CLOTH_H

#include "base/ranks/rank_team.h"
#include "renderer/transport/radiance_tracer.h"
#include "renderer/transport/volume/volume_scene.h"

enum { SHARED_CLOTH_KEPT = 4 };

enum shared_kind { SHARED_NOTHING = 0, SHARED_FIBERS, SHARED_VOLUME, SHARED_ENVIRONMENT };

struct shared_item {
    enum shared_kind kind;
    uint64_t number;   /* the root's: of the scene or environment; 0 for nothing */
    uint64_t last_use; /* serial of the use */
    /* helper; owned */
    struct scene *fibers;
    struct volume_scene volume;
    struct environment *environment;
};

/* All zero: nothing is shared. */
struct shared_cloth {
    struct shared_item item[SHARED_CLOTH_KEPT];
    uint64_t n_use;
};

/* Names of the forms that a request needs; 0: none. */
struct shared_numbers {
    uint64_t fibers, volume, environment;
};

/* Root: sends what the helpers lack. STATUS_IO, STATUS_NO_MEMORY. */
status shared_cloth_send(struct shared_cloth *c, struct rank_team *team, const struct appearance_scene *scene,
                         const struct environment *environment, struct shared_numbers *numbers, struct error *err);
/* Helper: takes what an order RANK_ORDER_CLOTH has brought. STATUS_FORMAT, STATUS_NO_MEMORY. */
status shared_cloth_take(struct shared_cloth *c, const struct rank_order *order, struct error *err);
/* Helper: what the numbers of a request stand for. STATUS_FORMAT for something that has not been sent. */
status shared_cloth_find(struct shared_cloth *c, const struct shared_numbers *numbers, struct appearance_scene *scene,
                         const struct environment **environment, struct error *err);
void shared_cloth_release(struct shared_cloth *c);

#endif
