/* Groups of configurations that are estimated from the same camera paths: each configuration on its own, or together
 * those that differ in their lamp only. */
#ifndef SELVEDGE_RENDERER_PATH_GROUPS_H
#define SELVEDGE_RENDERER_PATH_GROUPS_H

#include "base/status.h"
#include "renderer/scene/configuration.h"

#include <stddef.h>

struct path_group {
    size_t first, n; /* its members are member[first] .. member[first + n - 1] */
    size_t n_path;   /* as many as the member that asks for most */
};

struct path_groups {
    size_t n;
    struct path_group *group; /* owned */
    size_t *member;           /* owned: indices of configurations, group by group */
};

/* Every configuration on its own, group i for configuration i. STATUS_NO_MEMORY. Release in any case. */
status path_groups_single(struct path_groups *g, const size_t *n_path, size_t n_configuration, struct error *err);
/* Joins configurations that differ in their lamp only, at most max_member of them, in order; leaves out those that ask
 * for no paths. STATUS_INVALID, field "configuration", when one asks for its contrast, which needs paths of its own;
 * STATUS_NO_MEMORY. Release in any case. */
status path_groups_shared(struct path_groups *g, const struct configuration *c, const size_t *n_path,
                          size_t n_configuration, size_t max_member, struct error *err);
void path_groups_release(struct path_groups *g);

#endif
