#include "renderer/transport/estimate.h"

#include "renderer/transport/camera.h"
#include "renderer/transport/estimate_blocks.h"
#include "renderer/transport/surface/path_tracer.h"

#include <stdlib.h>
#include <string.h>

/* Configurations that are estimated from the same paths: alone, or those that differ in the lamp only. */
struct group {
    size_t first, n;
};

struct run {
    const struct estimate_request *q;
    struct path_setting *setting; /* per configuration */
    struct camera *camera;
    size_t n_jac;
    size_t n_group;
    struct group *group;
    size_t *member;     /* configurations, group by group */
    struct lamp *lamp;  /* the same order */
    size_t *n_path;     /* per group */
    struct estimate *e; /* per group: the members' values one after the other */
};

static uint32_t trace(void *context, size_t i_configuration, double x, double y, struct rng *rng, float *value)
{
    const struct run *r = context;
    struct scene_ray ray;
    struct path_result path;
    if (!camera_ray(&r->camera[i_configuration], r->q->scene, x, y, &ray)) return 0; /* sees nothing: adds 0 */
    path_trace(&r->setting[i_configuration], &ray, rng, &path, NULL);
    memcpy(value, path.radiance, sizeof path.radiance);
    memcpy(value + 3, path.jac, r->n_jac * sizeof *value);
    return path.n_vertex;
}

/* All members' values, each 3 + n_jac. */
static uint32_t trace_group(void *context, size_t i_group, double x, double y, struct rng *rng, float *value)
{
    const struct run *r = context;
    const struct group *g = &r->group[i_group];
    size_t i = r->member[g->first];
    struct scene_ray ray;
    struct path_result path[PATH_MAX_LAMP];
    if (!camera_ray(&r->camera[i], r->q->scene, x, y, &ray)) return 0;
    path_trace_lamps(&r->setting[i], r->lamp + g->first, r->setting[i].has_lamp ? g->n : 0, &ray, rng, path);
    for (size_t k = 0; k < g->n; k++, value += 3 + r->n_jac) {
        memcpy(value, path[k].radiance, sizeof path[k].radiance);
        memcpy(value + 3, path[k].jac, r->n_jac * sizeof *value);
    }
    return path[0].n_vertex;
}

static bool differ_in_lamp_only(const struct configuration *a, const struct configuration *b)
{
    bool lit = a->light != LIGHT_NO_LAMP && b->light != LIGHT_NO_LAMP;
    bool same_camera = a->camera == b->camera && a->camera_theta_rad == b->camera_theta_rad &&
                       a->camera_phi_rad == b->camera_phi_rad && a->camera_distance_m == b->camera_distance_m &&
                       a->crop_m == b->crop_m && a->crop_aspect == b->crop_aspect;
    return lit && same_camera && a->cloth_rotation_rad == b->cloth_rotation_rad && a->environment == b->environment &&
           memcmp(a->environment_rgb, b->environment_rgb, sizeof a->environment_rgb) == 0;
}

/* Greedy, in the order of the configurations; one that wants no paths is left out. */
static status make_groups(struct run *r, struct error *err)
{
    const struct estimate_request *q = r->q;
    size_t n = q->n_configuration, most = (3 + 3 * SCATTERING_MAX_FLAT) / (3 + r->n_jac), n_member = 0;
    if (most > PATH_MAX_LAMP) most = PATH_MAX_LAMP;
    r->group = calloc(n + 1, sizeof *r->group);
    r->member = calloc(n + 1, sizeof *r->member);
    r->lamp = calloc(n + 1, sizeof *r->lamp);
    r->n_path = calloc(n + 1, sizeof *r->n_path);
    r->e = malloc((n + 1) * sizeof *r->e);
    bool *taken = calloc(n + 1, sizeof *taken);
    if (r->group == NULL || r->member == NULL || r->lamp == NULL || r->n_path == NULL || r->e == NULL ||
        taken == NULL) {
        free(taken);
        return error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: out of memory");
    }
    for (size_t i = 0; i < n; i++) {
        if (taken[i] || q->n_path[i] == 0) continue;
        struct group *g = &r->group[r->n_group];
        g->first = n_member;
        for (size_t j = i; j < n && g->n < most; j++) {
            if (taken[j] || q->n_path[j] == 0) continue;
            if (j != i && !differ_in_lamp_only(&q->configuration[i], &q->configuration[j])) continue;
            taken[j] = true;
            r->member[n_member] = j;
            if (r->setting[j].has_lamp) r->lamp[n_member] = r->setting[j].lamp;
            n_member++;
            g->n++;
            if (q->n_path[j] > r->n_path[r->n_group]) r->n_path[r->n_group] = q->n_path[j];
        }
        r->n_group++;
    }
    free(taken);
    return STATUS_OK;
}

/* The members' parts of a group's values, as estimates of their own. */
static void take_apart(const struct run *r, struct estimate *out)
{
    memset(out, 0, r->q->n_configuration * sizeof *out);
    for (size_t g = 0; g < r->n_group; g++) {
        const struct estimate *from = &r->e[g];
        double mean[3 + PATH_N_DERIVATIVE], var[3 + PATH_N_DERIVATIVE]; /* one behind the other, as traced */
        memcpy(mean, from->mean, sizeof from->mean);
        memcpy(mean + 3, from->jac, sizeof from->jac);
        memcpy(var, from->var, sizeof from->var);
        memcpy(var + 3, from->jac_var, sizeof from->jac_var);
        for (size_t k = 0; k < r->group[g].n; k++) {
            struct estimate *e = &out[r->member[r->group[g].first + k]];
            const double *own_mean = mean + k * (3 + r->n_jac), *own_var = var + k * (3 + r->n_jac);
            e->n_path = from->n_path;
            e->n_vertex = from->n_vertex;
            memcpy(e->mean, own_mean, sizeof e->mean);
            memcpy(e->var, own_var, sizeof e->var);
            memcpy(e->jac, own_mean + 3, r->n_jac * sizeof *e->jac);
            memcpy(e->jac_var, own_var + 3, r->n_jac * sizeof *e->jac_var);
        }
    }
}

static status numeric_error(const struct scattering_model *m, const struct configuration *c, size_t i_value,
                            struct error *err)
{
    const char *name = i_value < 3 ? "" : m->param[(i_value - 3) % m->n_param].name;
    char view[CONFIGURATION_TEXT];
    configuration_describe(c, view);
    return error_set_field(err, STATUS_NUMERIC, name, "scattering model '%s' gave a value that is not finite (%s; %s)",
                           m->id, name[0] != '\0' ? name : "radiance", view);
}

status estimate_run(const struct estimate_request *q, struct thread_pool *pool, const struct progress *progress,
                    struct estimate *out, struct error *err)
{
    struct parameter_sets sets;
    struct run r = {.q = q};
    size_t bad_configuration = 0, bad_value = 0;
    status st = estimate_check_configurations(q->configuration, q->n_configuration, q->iteration, q->replica, err);
    if (st != STATUS_OK) return st;
    st = parameter_sets_init(&sets, q->scene, q->model, q->param, q->n_set, err);
    if (st != STATUS_OK) goto out;
    r.n_jac = q->want_jacobian ? 3 * sets.n * q->model->n_param : 0;
    r.setting = malloc((q->n_configuration + 1) * sizeof *r.setting);
    r.camera = malloc((q->n_configuration + 1) * sizeof *r.camera);
    if (r.setting == NULL || r.camera == NULL) {
        st = error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: out of memory");
        goto out;
    }
    for (size_t i = 0; i < q->n_configuration; i++) {
        if (q->share_camera_paths && q->configuration[i].contrast_cells > 0) {
            st = error_set_field(err, STATUS_INVALID, "configuration",
                                 "cannot estimate the contrast of configuration %zu from shared paths", i);
            goto out;
        }
        path_setting_init_sets(&r.setting[i], q->scene, &sets, &q->configuration[i], q->want_jacobian);
        r.setting[i].probes = r.setting[i].probes && !q->no_probes;
        camera_init(&r.camera[i], &q->configuration[i]);
    }
    struct estimate_blocks blocks = {.n_configuration = q->n_configuration,
                                     .n_path = q->n_path,
                                     .configuration = q->configuration,
                                     .seed = q->seed,
                                     .iteration = q->iteration,
                                     .replica = q->replica,
                                     .n_jac = r.n_jac,
                                     .trace = trace,
                                     .context = &r};
    if (q->share_camera_paths) {
        st = make_groups(&r, err);
        if (st != STATUS_OK) goto out;
        size_t largest = 1;
        for (size_t g = 0; g < r.n_group; g++) largest = r.group[g].n > largest ? r.group[g].n : largest;
        blocks.n_configuration = r.n_group;
        blocks.n_path = r.n_path;
        blocks.configuration = NULL;
        blocks.n_jac = largest * (3 + r.n_jac) - 3;
        blocks.trace = trace_group;
    }
    st = estimate_blocks_run(&blocks, pool, progress, r.e != NULL ? r.e : out, &bad_configuration, &bad_value, err);
    if (st == STATUS_NUMERIC && q->share_camera_paths) {
        bad_configuration = r.member[r.group[bad_configuration].first + bad_value / (3 + r.n_jac)];
        bad_value %= 3 + r.n_jac;
    }
    if (st == STATUS_NUMERIC) st = numeric_error(q->model, &q->configuration[bad_configuration], bad_value, err);
    if (st == STATUS_OK && q->share_camera_paths) take_apart(&r, out);
out:
    free(r.e);
    free(r.n_path);
    free(r.lamp);
    free(r.member);
    free(r.group);
    free(r.camera);
    free(r.setting);
    parameter_sets_release(&sets);
    return st;
}
