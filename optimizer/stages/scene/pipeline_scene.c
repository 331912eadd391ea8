/* Stage "scene": the cloth ready for ray tracing, as fibers and, for volume models, as a volume. */
#include "base/option_id.h"
#include "geometry/fibers/shape/fiber_correct.h"
#include "geometry/fibers/voxelise.h"
#include "geometry/reconstruct/reconstruct.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/stages/made_cloth.h"
#include "renderer/scene/scene_ray.h"

#include <math.h>
#include <stdio.h>

enum { VOXELISE_MEMORY_SHARE = 4 };
static const double um = 1e-6;

static bool wants_volume_scene(const struct cloth_job *job)
{
    for (size_t i = 0; i < job->n_model; i++)
        if (job->model[i].appearance.kind == MODEL_VOLUME) return true;
    return false;
}

/* Computes the density of a cloth that was given as fibers, for volume models. It is cheap enough to be done again
 * after a resume. */
static status voxelise(const struct cloth_job *job, struct made_cloth *made, struct error *err)
{
    const struct voxelise_option option = {.voxel_size_m = job->cloth->voxel_um * um,
                                           .limit_bytes = job->tools->memory_limit_bytes > 0
                                                              ? job->tools->memory_limit_bytes / VOXELISE_MEMORY_SHARE
                                                              : SIZE_MAX};
    double radius_m = 0.0, voxel_m;
    status s = fibers_voxelise(&made->fiber, &option, job->tools->pool, &job->tools->progress, &made->direction,
                               &voxel_m, err);
    if (s != STATUS_OK) {
        if (err != NULL && s != STATUS_CANCELLED) snprintf(err->field, sizeof err->field, OPTION_DENSITY_VOXEL);
        return s;
    }
    for (size_t i = 0; i < made->fiber.n_fiber; i++)
        radius_m += (double)made->fiber.radius_m[i] / (double)made->fiber.n_fiber;
    if (isnan(option.voxel_size_m) && voxel_m > 0.51 * radius_m) {
        worker_status_warn(
            job->tools->status,
            "volume models see the fibers in voxels of %.3g um instead of %.3g um (half a radius): finer ones do "
            "not fit into the memory setting",
            voxel_m / um, 0.5 * radius_m / um);
    }
    return STATUS_OK;
}

static status make_volume_scene(const struct cloth_job *job, struct made_cloth *made, struct error *err)
{
    const struct volume_scene_option option = {.black_sheet = job->setup->black_sheet};
    status s = volume_scene_init(&made->volume_scene, &made->direction, &option, err);
    made->has_volume_scene = s == STATUS_OK;
    if (s == STATUS_OK)
        log_info(job->tools->log, "volume: %zu x %zu x %zu voxels of %.3g um, %.0f MB", made->direction.n[0],
                 made->direction.n[1], made->direction.n[2], made->direction.voxel_size_m[0] / um,
                 (double)volume_scene_memory_bytes(&made->volume_scene) / 1e6);
    return s;
}

static void release_scenes(struct made_cloth *made)
{
    scene_free(made->scene);
    scene_free(made->section_scene);
    made->scene = made->section_scene = NULL;
    if (made->has_volume_scene) volume_scene_release(&made->volume_scene);
    made->has_volume_scene = false;
}

/* Returns whether a model sees the sections of the fibers: one that states the width that a section shows. The others
 * are made for round tubes. */
static bool sees_sections(const struct appearance *a) { return a->kind == MODEL_SURFACE && a->surface->width != NULL; }

static status make_fiber_scene(const struct cloth_job *job, const struct fiber_set *f, bool sections,
                               struct scene **scene, struct error *err)
{
    struct film_groups films;
    job_cloth_films(job->cloth, &films);
    return scene_new(
        f, &(struct scene_option){.black_sheet = job->setup->black_sheet, .sections = sections, .films = &films}, scene,
        err);
}

status made_cloth_fiber_scene(const struct cloth_job *job, size_t i_model, const struct fiber_set *f,
                              struct scene **scene, struct error *err)
{
    return make_fiber_scene(job, f, sees_sections(&job->model[i_model].appearance), scene, err);
}

struct appearance_scene made_cloth_scene(const struct made_cloth *made, const struct model_setup *m)
{
    const bool sections = made->section_scene != NULL && sees_sections(&m->appearance);
    return (struct appearance_scene){.fibers = sections ? made->section_scene : made->scene,
                                     .volume = made->has_volume_scene ? &made->volume_scene : NULL};
}

status made_cloth_make_surface_scene(const struct cloth_job *job, struct made_cloth *made, struct error *err)
{
    bool sections = false, tubes = false;
    release_scenes(made);
    for (size_t i = 0; i < job->n_model; i++) {
        const struct appearance *a = &job->model[i].appearance;
        sections |= sees_sections(a);
        tubes |= a->kind == MODEL_SURFACE && !sees_sections(a);
    }
    status s = make_fiber_scene(job, &made->fiber, sections, &made->scene, err);
    if (s != STATUS_OK || !tubes || !scene_shows_sections(made->scene)) return s;
    made->section_scene = made->scene;
    made->scene = NULL;
    return make_fiber_scene(job, &made->fiber, false, &made->scene, err);
}

status made_cloth_make_scene(const struct cloth_job *job, struct made_cloth *made, struct error *err)
{
    status s = made_cloth_make_surface_scene(job, made, err);
    if (s != STATUS_OK) return s;
    log_info(job->tools->log, "scene: %zu fibers, %zu segments, %.0f MB", made->fiber.n_fiber,
             scene_n_segment(made->scene), (double)scene_memory_bytes(made->scene) / 1e6);
    if (made->section_scene != NULL)
        log_info(job->tools->log, "scene of their flat sections, for models that state the width: %.0f MB",
                 (double)scene_memory_bytes(made->section_scene) / 1e6);
    if (!wants_volume_scene(job)) return STATUS_OK;
    if (!job->scan->given) {
        direction_volume_release(&made->direction);
        s = voxelise(job, made, err);
    }
    if (made->geometry.tiles.n_move > 1)
        worker_status_warn(job->tools->status,
                           "the large tile of '%s' is made of fibers: volume models see the voxels of the scan, one "
                           "block of it",
                           job_option_key(OPTION_TILES));
    return s == STATUS_OK ? make_volume_scene(job, made, err) : s;
}

double made_cloth_radius_error(const struct cloth_job *job, const struct made_cloth *made)
{
    const struct reconstruct_report *g = &made->geometry;
    const struct fiber_set *f = made->uncorrected.n_fiber > 0 ? &made->uncorrected : &made->fiber;
    double mean_m = 0.0, se_m = 0.0;
    if (isnan(g->radius_se_m[0]) || job->fit->fit_radius) return 0.0;
    for (size_t i = 0; i < f->n_fiber; i++) mean_m += (double)f->radius_m[i] / (double)f->n_fiber;
    for (int a = 0; a < 3; a++)
        if (isfinite(g->radius_se_m[a])) se_m = fmax(se_m, g->radius_se_m[a]);
    return se_m / mean_m;
}

void made_cloth_release(struct made_cloth *made)
{
    fiber_set_release(&made->fiber);
    fiber_set_release(&made->traced);
    fiber_set_release(&made->uncorrected);
    direction_volume_release(&made->direction);
    release_scenes(made);
}

/* Keeps the fibers as they came, and applies the corrections at the values of the document. */
static status correct_fibers(const struct cloth_job *job, struct made_cloth *made, struct error *err)
{
    double value[CORRECTION_N];
    for (int k = 0; k < CORRECTION_N; k++) value[k] = job->cloth->correction[k].value;
    status s = fiber_set_copy(&made->fiber, &made->uncorrected, err);
    return s == STATUS_OK ? fiber_correct(&made->uncorrected, value, &made->fiber, err) : s;
}

/* Gives a fitted radius of scanned fibers that has no prior the error of the reconstruction as its prior. */
static void add_radius_prior(const struct cloth_job *job, struct made_cloth *made)
{
    if (!job->cloth->has_correction || !job->scan->given) return;
    const double se = made_cloth_radius_error(job, made);
    for (size_t k = 0; k < made->number.n; k++) {
        struct cloth_number_item *item = &made->number.item[k];
        if (item->index != CORRECT_RADIUS || !isnan(item->prior_sd) || !(se > 0.0)) continue;
        item->prior_mean = 1.0;
        item->prior_sd = se;
    }
}

status stage_scene(const struct cloth_job *in, struct made_cloth *out, struct error *err)
{
    reconstruct_warn_fibers(&out->geometry, &out->fiber,
                            &in->tools->warn); /* this stage runs in every attempt, so the warnings are not lost */
    if (in->cloth->has_correction && in->scan->given && wants_volume_scene(in))
        warning_send(&in->tools->warn, OPTION_CORRECTION, "%s",
                     "volume models see the densities and directions of the scan, which corrections of fibers do not "
                     "change: they are without effect on such models");
    struct film_groups films;
    job_cloth_films(in->cloth, &films);
    if (films.n > 0 && wants_volume_scene(in))
        warning_send(
            &in->tools->warn, OPTION_CLOTH, "%s",
            "volume models see the films and sequins of the cloth as fibers of their own material, not as metal");
    out->number = *in->number;
    status s = in->cloth->has_correction ? correct_fibers(in, out, err) : STATUS_OK;
    if (s == STATUS_OK) s = made_cloth_make_scene(in, out, err);
    if (s == STATUS_OK) add_radius_prior(in, out);
    return s;
}
