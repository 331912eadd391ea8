/* The orders that the root of a team gives its helpers. */
#ifndef SELVEDGE_RENDERER_RANK_ORDERS_H
#define SELVEDGE_RENDERER_RANK_ORDERS_H

#include "base/ranks/rank_team.h"
#include "renderer/transport/radiance_request.h"

/* Whether helpers can trace it: a flat cloth by path tracing, one environment at most. */
bool rank_orders_can_share(const struct configuration *c, size_t n_configuration, const struct radiance_input *in);
/* Root: orders that come right before rank_team_share. The team's companion is a struct shared_cloth. STATUS_IO,
 * STATUS_NO_MEMORY. */
status rank_orders_estimate(struct rank_team *team, const struct estimate_request *q, struct error *err);
status rank_orders_picture(struct rank_team *team, const struct render_request *q, struct error *err);
/* Root: makes sure that all ranks run the same program on like processors. STATUS_INVALID, naming the rank. */
status rank_orders_agree(struct rank_team *team, const char *mine, struct error *err);

#endif
