/* Stage "scene": the cloth ready for ray tracing, as fibers and, for volume models, as a volume. */
#include "base/option_id.h"
#include "geometry/fibers/shape/fiber_correct.h"
#include "geometry/fibers/voxelise.h"
#include "geometry/reconstruct.h"
#include "optimizer/worker/pipeline_context.h"
#include "optimizer/worker/report/surface/surface_cloth.h"

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
        .voxel_size_m = c->doc->voxel_um * um,
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
    const struct volume_scene_option option = {.black_sheet = c->doc->black_sheet};
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
    c->scene = NULL;
    if (c->has_volume_scene) volume_scene_release(&c->volume_scene);
    c->has_volume_scene = false;
}

/* Whether fibers are traced with their measured sections: where all models of fibers state the width that a section
 * shows. The others are made for round tubes. */
static bool wants_sections(const struct pipeline_context *c)
{
    bool has_surface = false;
    for (size_t i = 0; i < c->n_model; i++) {
        const struct appearance *a = &c->model[i].appearance;
        if (a->kind != MODEL_SURFACE) continue;
        if (a->surface->width == NULL) return false;
        has_surface = true;
    }
    return has_surface;
}

status pipeline_fiber_scene(const struct pipeline_context *c, const struct fiber_set *f, struct scene **scene,
                            struct error *err)
{
    const struct scene_option option = {.black_sheet = c->doc->black_sheet, .sections = wants_sections(c)};
    return scene_new(f, &option, scene, err);
}

status pipeline_make_surface_scene(struct pipeline_context *c, struct error *err)
{
    release_scenes(c);
    return pipeline_fiber_scene(c, &c->fiber, &c->scene, err);
}

status pipeline_make_scene(struct pipeline_context *c, struct error *err)
{
    status s = pipeline_make_surface_scene(c, err);
    if (s != STATUS_OK) return s;
    log_info(c->log, "scene: %zu fibers, %zu segments, %.0f MB", c->fiber.n_fiber, scene_n_segment(c->scene),
             (double)scene_memory_bytes(c->scene) / 1e6);
    if (!wants_volume_scene(c)) return STATUS_OK;
    if (!c->doc->has_volume) {
        direction_volume_release(&c->direction);
        s = voxelise(c, err);
    }
    return s == STATUS_OK ? make_volume_scene(c, err) : s;
}

/* Keeps the fibers as they came, and applies the corrections at the values of the document. */
static status correct_fibers(struct pipeline_context *c, struct error *err)
{
    double value[CORRECTION_N];
    for (int k = 0; k < CORRECTION_N; k++) value[k] = c->doc->correction[k].value;
    status s = fiber_set_copy(&c->fiber, &c->uncorrected, err);
    return s == STATUS_OK ? fiber_correct(&c->uncorrected, value, &c->fiber, err) : s;
}

status stage_scene(struct pipeline_context *c, struct error *err)
{
    reconstruct_warn_fibers(
        &c->geometry, &c->fiber,
        &(struct warning_sink){pipeline_warn, c}); /* this stage runs in every attempt, so the warnings are not lost */
    status s = c->doc->has_correction ? correct_fibers(c, err) : STATUS_OK;
    if (s == STATUS_OK) s = pipeline_make_scene(c, err);
    return s == STATUS_OK ? surface_cloth_check(c, err) : s;
}
