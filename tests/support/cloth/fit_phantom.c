#include "tests/support/cloth/fit_phantom.h"

#include "base/files/durable.h"
#include "base/rng.h"
#include "geometry/fibers/voxelise.h"
#include "optimizer/fit/objective/objective.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/tools/phantom/phantom_view_table.h"
#include "tests/support/cloth/cached_estimate.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

void fit_check(status s, const struct error *err)
{
    if (s == STATUS_OK) return;
    fprintf(stderr, "%s\n", err->text);
    exit(1);
}

static void make_volume(struct fit_cloth *c, double voxel_m, struct thread_pool *pool)
{
    struct error err = {0};
    const struct voxelise_option o = {voxel_m, 1u << 30};
    fit_check(fibers_voxelise(&c->fiber, &o, pool, NULL, &c->volume, &voxel_m, &err), &err);
    fit_check(volume_scene_init(&c->volume_scene, &c->volume, &(struct volume_scene_option){.black_sheet = true}, &err),
              &err);
    c->has_volume = true;
}

/* The same as `selvedge-phantom cloth --yarn FILE --cover 1.1`. The yarns are less dense than smooth yarns, but the
 * cloth has no gaps. */
static void take_yarn(struct phantom_option *o, const char *file)
{
    struct error err = {0};
    fit_check(phantom_yarn_read(file, &o->yarn, &err), &err);
    o->packing = 0.5;
    o->cover = 1.1;
}

static void take_felt(struct phantom_option *o, bool lofty)
{
    o->n_fiber_per_yarn = lofty ? 500 : 400;
    o->felt_tile_m = lofty ? 1e-3 : 6e-4;
    o->felt_thickness_m = lofty ? 1e-3 : 2.5e-4;
}

void fit_cloth_init(struct fit_cloth *c, const struct fit_cloth_option *option, struct thread_pool *pool)
{
    struct error err = {0};
    struct phantom_option o;
    struct phantom_report report;
    *c = (struct fit_cloth){0};
    fiber_set_init(&c->fiber);
    phantom_option_default(&o, option->weave);
    o.n_fiber_per_yarn = 37;
    o.vertex_spacing_m = 8e-6;
    if (option->weave == PHANTOM_FELT) take_felt(&o, option->lofty);
    if (option->yarn_file != NULL) take_yarn(&o, option->yarn_file);
    if (option->flatness > 0.0) o.flatness = option->flatness;
    fit_check(phantom_generate(&o, pool, NULL, &c->fiber, &report, &err), &err);
    fprintf(stderr, "phantom %s%s: %zu fibers, %zu vertices, covers %.3f, volume fraction %.2f\n",
            option->yarn_file != NULL ? "plied " : "", phantom_weave_name(option->weave), c->fiber.n_fiber,
            c->fiber.n_vertex, report.cover, report.volume_fraction);
    fit_check(scene_new(&c->fiber, &(struct scene_option){.black_sheet = true}, &c->scene, &err), &err);
    bool coarse = option->yarn_file != NULL || option->lofty;
    if (option->with_volume) make_volume(c, coarse ? 0.5 * o.fiber_radius_m[0] : 2e-6, pool);
}

void fit_cloth_release(struct fit_cloth *c)
{
    if (c->has_volume) {
        volume_scene_release(&c->volume_scene);
        direction_volume_release(&c->volume);
    }
    scene_free(c->scene);
    fiber_set_release(&c->fiber);
}

static void start(struct fit_phantom *f, const char *folder, struct thread_pool *pool, const char *model_id,
                  const double *truth_file_unit)
{
    struct error err = {0};
    *f = (struct fit_phantom){.pool = pool, .folder = folder};
    fit_check(durable_make_folder(folder, &err), &err);
    if (!appearance_find(model_id, &f->model)) {
        fprintf(stderr, "no model '%s'\n", model_id);
        exit(1);
    }
    for (size_t p = 0; p < f->model.n_param; p++)
        f->truth[p] = truth_file_unit != NULL ? param_from_file_unit(&f->model.param[p], truth_file_unit[p])
                                              : f->model.param[p].start;
    observation_set_init(&f->observation);
    observation_set_init(&f->fitted);
}

void fit_phantom_init(struct fit_phantom *f, const char *folder, struct thread_pool *pool, enum phantom_weave weave,
                      const char *model_id, const double *truth_file_unit)
{
    start(f, folder, pool, model_id, truth_file_unit);
    fit_cloth_init(&f->cloth, &(struct fit_cloth_option){.weave = weave, .with_volume = f->model.kind == MODEL_VOLUME},
                   pool);
}

void fit_phantom_init_on(struct fit_phantom *f, const char *folder, struct thread_pool *pool,
                         const struct fit_cloth *cloth, const char *model_id, const double *truth_file_unit)
{
    start(f, folder, pool, model_id, truth_file_unit);
    f->cloth = *cloth;
    f->shares_cloth = true;
}

static void forget_observations(struct fit_phantom *f)
{
    observation_set_release(&f->observation);
    observation_set_release(&f->fitted);
    free(f->configuration);
    f->configuration = NULL;
}

void fit_phantom_release(struct fit_phantom *f)
{
    forget_observations(f);
    if (!f->shares_cloth) fit_cloth_release(&f->cloth);
}

void fit_phantom_observe(struct fit_phantom *f, const struct observation_set *o)
{
    struct error err = {0};
    forget_observations(f);
    if (o->n > FIT_MAX_OBSERVATION) {
        fprintf(stderr, "%zu observations are given: at most %d are allowed\n", o->n, FIT_MAX_OBSERVATION);
        exit(1);
    }
    for (size_t i = 0; i < o->n; i++) fit_check(observation_set_append(&f->observation, &o->item[i], &err), &err);
    fit_check(observation_set_select(o, JOB_SET_FIT, &f->fitted, &err), &err);
    f->configuration = trace_configurations(&f->observation);
    fit_check_memory(f->configuration);
}

void fit_phantom_render(const struct fit_phantom *f, const double *param, size_t n_path, struct estimate *out)
{
    const struct cached_call call = {param, f->configuration, f->observation.n, SEED_SCORE, 0, false};
    kept_run(f, &call, 1, n_path, out);
}

static void views(struct phantom_view_table *t, struct configuration *configuration)
{
    static const struct job_setup set_up = {
        .lamp_side_cm = 10.0, .lamp_distance_cm = 61.0, .camera_distance_cm = 100.0, .crop_cm = 1.0};
    phantom_view_table_builtin(t);
    for (size_t n = 0; n < FIT_N_VIEW; n++) {
        const struct job_photograph *v = &t->view[n];
        configuration[n] = observation_configuration(&set_up, v->light_theta_deg, v->light_phi_deg, v->camera_theta_deg,
                                                     v->camera_phi_deg, v->cloth_rotation_deg);
    }
}

void fit_phantom_photograph(struct fit_phantom *f, const struct fit_photography *how)
{
    struct phantom_view_table *t = calloc(1, sizeof *t);
    struct estimate *e = calloc(FIT_N_VIEW, sizeof *e);
    struct configuration configuration[FIT_N_VIEW];
    struct observation_set o;
    struct error err = {0};
    struct rng rng;
    fit_check_memory(t);
    fit_check_memory(e);
    views(t, configuration);
    const struct cached_call call = {
        f->truth, configuration, FIT_N_VIEW, SEED_PHOTOGRAPH, 0, .plain_paths = !f->guided};
    cached_estimate(f, &call, how->part * cached_n_chunks(how->n_path), how->n_path, e);
    rng_start(&rng, &(struct rng_key){.seed = how->noise_seed, .iteration = 65533}, 0, 0);
    observation_set_init(&o);
    for (size_t i = 0; i < FIT_N_VIEW; i++) {
        struct observation item = {.set = t->view[i].set, .configuration = configuration[i], .weight = 1.0};
        memcpy(item.name, t->view[i].file, sizeof item.name);
        for (int c = 0; c < 3; c++) {
            double normal[2];
            rng_normal_pair(&rng, normal);
            item.mean_rgb[c] = e[i].mean[c] * (1.0 + how->noise * normal[0]);
            item.se_rgb[c] = sqrt(e[i].var[c] + how->noise * how->noise * e[i].mean[c] * e[i].mean[c]);
        }
        fit_check(observation_set_append(&o, &item, &err), &err);
    }
    fit_phantom_observe(f, &o);
    observation_set_release(&o);
    free(e);
    free(t);
}

uint64_t fit_phantom_fingerprint(const struct fit_phantom *f)
{
    const struct cached_call call = {f->truth, f->configuration, f->observation.n, 0, 0, false};
    uint32_t sum = 0;
    for (size_t i = 0; i < f->fitted.n; i++)
        sum = (uint32_t)crc32_z(sum, (const void *)f->fitted.item[i].mean_rgb, sizeof f->fitted.item[i].mean_rgb);
    return (uint64_t)cached_call_sum(f, &call, 0, 0) << 32 | sum;
}
