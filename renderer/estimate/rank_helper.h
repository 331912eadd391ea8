/* The work of a helper rank: it traces the estimates and pictures that the root of its team orders. */
#ifndef SELVEDGE_RENDERER_RANK_HELPER_H
#define SELVEDGE_RENDERER_RANK_HELPER_H

#include "base/ranks/rank_team.h"
#include "base/thread_pool.h"

/* Follows orders until the root ends it. mine: the text that rank_orders_agree compares. The pool is joined to the
 * team. STATUS_IO when the root is gone. */
status rank_helper_serve(struct rank_team *team, struct thread_pool *pool, const char *mine, struct error *err);

#endif
