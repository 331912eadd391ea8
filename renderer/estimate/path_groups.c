#include "renderer/estimate/path_groups.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static status allocate(struct path_groups *g, size_t n_configuration, struct error *err)
{
    memset(g, 0, sizeof *g);
    g->group = calloc(n_configuration + 1, sizeof *g->group);
    g->member = calloc(n_configuration + 1, sizeof *g->member);
    if (g->group == NULL || g->member == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: out of memory");
    return STATUS_OK;
}

status path_groups_single(struct path_groups *g, const size_t *n_path, size_t n_configuration, struct error *err)
{
    status st = allocate(g, n_configuration, err);
    if (st != STATUS_OK) return st;
    g->n = n_configuration;
    for (size_t i = 0; i < n_configuration; i++) {
        g->member[i] = i;
        g->group[i] = (struct path_group){.first = i, .n = 1, .n_path = n_path[i]};
    }
    return STATUS_OK;
}

static bool differ_in_lamp_only(const struct configuration *a, const struct configuration *b)
{
    bool lit = a->light != LIGHT_NO_LAMP && b->light != LIGHT_NO_LAMP;
    bool same_camera = a->camera == b->camera && a->camera_theta_rad == b->camera_theta_rad &&
                       a->camera_phi_rad == b->camera_phi_rad && a->camera_distance_m == b->camera_distance_m &&
                       a->crop_m == b->crop_m && a->blur_m == b->blur_m && a->aperture_m == b->aperture_m &&
                       a->focus_m == b->focus_m && a->crop_aspect == b->crop_aspect;
    return lit && same_camera && a->cloth_rotation_rad == b->cloth_rotation_rad && a->environment == b->environment &&
           memcmp(a->environment_rgb, b->environment_rgb, sizeof a->environment_rgb) == 0;
}

/* Adds configuration i, the next member of the group that is being made. */
static void join(struct path_groups *g, struct path_group *group, size_t i, size_t n_path)
{
    g->member[group->first + group->n++] = i;
    if (n_path > group->n_path) group->n_path = n_path;
}

status path_groups_shared(struct path_groups *g, const struct configuration *c, const size_t *n_path,
                          size_t n_configuration, size_t max_member, struct error *err)
{
    status st = allocate(g, n_configuration, err);
    bool *taken = calloc(n_configuration + 1, sizeof *taken);
    if (st == STATUS_OK && taken == NULL)
        st = error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: out of memory");
    for (size_t i = 0; i < n_configuration && st == STATUS_OK; i++)
        if (c[i].contrast_cells > 0)
            st = error_set_field(err, STATUS_INVALID, "configuration",
                                 "cannot estimate the contrast of configuration %zu from shared paths", i);
    for (size_t i = 0, n_member = 0; i < n_configuration && st == STATUS_OK; i++) {
        if (taken[i] || n_path[i] == 0) continue;
        struct path_group *group = &g->group[g->n++];
        group->first = n_member;
        for (size_t j = i; j < n_configuration && group->n < max_member; j++) {
            if (taken[j] || n_path[j] == 0 || (j != i && !differ_in_lamp_only(&c[i], &c[j]))) continue;
            taken[j] = true;
            join(g, group, j, n_path[j]);
        }
        n_member += group->n;
    }
    free(taken);
    return st;
}

void path_groups_release(struct path_groups *g)
{
    free(g->group);
    free(g->member);
    g->group = NULL;
    g->member = NULL;
}
