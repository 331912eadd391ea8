/* Stage "scene": the cloth ready for ray tracing, as fibers and, for volume models, as a volume. */
#include "base/option_id.h"
#include "geometry/fibers/shape/fiber_correct.h"
#include "geometry/fibers/voxelise.h"
#include "geometry/reconstruct.h"
#include "optimizer/worker/pipeline_context.h"
#include "optimizer/worker/report/surface/surface_cloth.h"
#include "renderer/scene/scene_ray.h"

#include <math.h>
#include <stdio.h>

enum { VOXELISE_MEMORY_SHARE = 4 };
static const double um = 1e-6;

static bool wants_volume_scene(const struct pipeline_context *c)
{
    for (size_t i = 0; i < c->n_model; i++)
        if (c->model[i].appearance.kind == MODEL_VOLUME) return true;
    return false;
}

/* Computes the density of a cloth that was given as fibers, for volume models. It is cheap enough to be done again
 * after a resume. */
static status voxelise(struct pipeline_context *c, struct error *err)
{
    const struct voxelise_option option = {
        .voxel_size_m = c->doc->cloth.voxel_um * um,
        .limit_bytes = c->memory_limit_bytes > 0 ? c->memory_limit_bytes / VOXELISE_MEMORY_SHARE : SIZE_MAX};
    double radius_m = 0.0, voxel_m;
    status s = fibers_voxelise(&c->fiber, &option, c->pool, &c->progress, &c->direction, &voxel_m, err);
    if (s != STATUS_OK) {
        if (err != NULL && s != STATUS_CANCELLED) snprintf(err->field, sizeof err->field, OPTION_DENSITY_VOXEL);
        return s;
    }
    for (size_t i = 0; i < c->fiber.n_fiber; i++) radius_m += (double)c->fiber.radius_m[i] / (double)c->fiber.n_fiber;
    if (isnan(option.voxel_size_m) && voxel_m > 0.51 * radius_m) {
        worker_status_warn(
            c->status,
            "volume models see the fibers in voxels of %.3g um instead of %.3g um (half a radius): finer ones do "
            "not fit into the memory setting",
            voxel_m / um, 0.5 * radius_m / um);
    }
    return STATUS_OK;
}

static status make_volume_scene(struct pipeline_context *c, struct error *err)
{
    const struct volume_scene_option option = {.black_sheet = c->doc->setup.black_sheet};
    status s = volume_scene_init(&c->volume_scene, &c->direction, &option, err);
    c->has_volume_scene = s == STATUS_OK;
    if (s == STATUS_OK)
        log_info(c->log, "volume: %zu x %zu x %zu voxels of %.3g um, %.0f MB", c->direction.n[0], c->direction.n[1],
                 c->direction.n[2], c->direction.voxel_size_m[0] / um,
                 (double)volume_scene_memory_bytes(&c->volume_scene) / 1e6);
    return s;
}

static void release_scenes(struct pipeline_context *c)
{
    scene_free(c->scene);
    scene_free(c->section_scene);
    c->scene = c->section_scene = NULL;
    if (c->has_volume_scene) volume_scene_release(&c->volume_scene);
    c->has_volume_scene = false;
}

/* Whether a model sees the sections of the fibers: one that states the width that a section shows. The others are made
 * for round tubes. */
static bool sees_sections(const struct appearance *a) { return a->kind == MODEL_SURFACE && a->surface->width != NULL; }

static status make_fiber_scene(const struct pipeline_context *c, const struct fiber_set *f, bool sections,
                               struct scene **scene, struct error *err)
{
    return scene_new(f, &(struct scene_option){.black_sheet = c->doc->setup.black_sheet, .sections = sections}, scene,
                     err);
}

status pipeline_fiber_scene(const struct pipeline_context *c, size_t i_model, const struct fiber_set *f,
                            struct scene **scene, struct error *err)
{
    return make_fiber_scene(c, f, sees_sections(&c->model[i_model].appearance), scene, err);
}

struct appearance_scene pipeline_scene(const struct pipeline_context *c, const struct pipeline_model *m)
{
    const bool sections = c->section_scene != NULL && sees_sections(&m->appearance);
    return (struct appearance_scene){.fibers = sections ? c->section_scene : c->scene,
                                     .volume = c->has_volume_scene ? &c->volume_scene : NULL};
}

status pipeline_make_surface_scene(struct pipeline_context *c, struct error *err)
{
    bool sections = false, tubes = false;
    release_scenes(c);
    for (size_t i = 0; i < c->n_model; i++) {
        const struct appearance *a = &c->model[i].appearance;
        sections |= sees_sections(a);
        tubes |= a->kind == MODEL_SURFACE && !sees_sections(a);
    }
    status s = make_fiber_scene(c, &c->fiber, sections, &c->scene, err);
    if (s != STATUS_OK || !tubes || !scene_shows_sections(c->scene)) return s;
    c->section_scene = c->scene;
    c->scene = NULL;
    return make_fiber_scene(c, &c->fiber, false, &c->scene, err);
}

status pipeline_make_scene(struct pipeline_context *c, struct error *err)
{
    status s = pipeline_make_surface_scene(c, err);
    if (s != STATUS_OK) return s;
    log_info(c->log, "scene: %zu fibers, %zu segments, %.0f MB", c->fiber.n_fiber, scene_n_segment(c->scene),
             (double)scene_memory_bytes(c->scene) / 1e6);
    if (c->section_scene != NULL)
        log_info(c->log, "scene of their flat sections, for models that state the width: %.0f MB",
                 (double)scene_memory_bytes(c->section_scene) / 1e6);
    if (!wants_volume_scene(c)) return STATUS_OK;
    if (!c->doc->scan.given) {
        direction_volume_release(&c->direction);
        s = voxelise(c, err);
    }
    return s == STATUS_OK ? make_volume_scene(c, err) : s;
}

/* Keeps the fibers as they came, and applies the corrections at the values of the document. */
static status correct_fibers(struct pipeline_context *c, struct error *err)
{
    double value[CORRECTION_N];
    for (int k = 0; k < CORRECTION_N; k++) value[k] = c->doc->cloth.correction[k].value;
    status s = fiber_set_copy(&c->fiber, &c->uncorrected, err);
    return s == STATUS_OK ? fiber_correct(&c->uncorrected, value, &c->fiber, err) : s;
}

status stage_scene(struct pipeline_context *c, struct error *err)
{
    reconstruct_warn_fibers(
        &c->geometry, &c->fiber,
        &(struct warning_sink){pipeline_warn, c}); /* this stage runs in every attempt, so the warnings are not lost */
    if (c->doc->cloth.has_correction && c->doc->scan.given && wants_volume_scene(c))
        pipeline_warn(c, OPTION_CORRECTION,
                      "volume models see the densities and directions of the scan, which corrections of fibers do not "
                      "change: they are without effect on such models");
    status s = c->doc->cloth.has_correction ? correct_fibers(c, err) : STATUS_OK;
    if (s == STATUS_OK) s = pipeline_make_scene(c, err);
    return s == STATUS_OK ? surface_cloth_check(c, err) : s;
}
