/* Stages "volume" to "directions": from the scan, or from a fiber file, to the fibers of the cloth. */
#include "base/option_id.h"
#include "geometry/cloth/cloth.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/worker/fiber_file.h"
#include "optimizer/worker/pipeline_context.h"
#include "optimizer/worker/progress/pipeline_plan.h"
#include "optimizer/worker/stages/scene/pipeline_volume.h"
#include "optimizer/worker/work_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- volume ---- */

/* Share of the stage's fraction that reading the scan has. Filling the lumens of hollow fibers has the rest, of whose
 * time it takes nearly all; other scans have no such part. */
static const double read_share = 0.4;

static status read_volume(struct pipeline_context *c, struct error *err)
{
    const char **path = pipeline_scan_paths(c);
    if (path == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the volume: out of memory");
    struct progress_part part;
    const struct progress inner = progress_begin_part(&part, &c->progress, 0.0, read_share);
    status s = reconstruct_read(path, c->doc->scan.n_file, &c->option, c->space, c->pool, &inner, &c->volume,
                                &c->geometry, err);
    if (s == STATUS_OK && scratch_file_bytes(c->space) > 0)
        log_info(c->log, "volume: beyond the memory setting of %zu MB, worked on in files",
                 c->memory_limit_bytes / 1000000);
    free(path);
    return s;
}

/* Fills the lumens of hollow fibers. That the fibers are hollow may not have been known before the scan was read. */
static status fill_lumens(struct pipeline_context *c, struct error *err)
{
    if (c->volume.filled.n == 0) return STATUS_OK;
    struct progress_part part;
    const struct progress inner = progress_begin_part(&part, &c->progress, read_share, 1.0 - read_share);
    pipeline_plan_hollow(c);
    log_info(c->log, "volume: the fibers are hollow and are traced to fill their lumens");
    return reconstruct_refill_lumens(&c->volume, &c->option, c->pool, &inner, &c->geometry, err);
}

status stage_volume(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    pipeline_volume_options(c->doc, &c->option);
    status s = read_volume(c, err);
    if (s == STATUS_OK) s = fill_lumens(c, err);
    if (s == STATUS_OK) s = pipeline_work_path(c, "volume", "volume.bin", path, err);
    if (s == STATUS_OK) s = worker_folder_check(c->folder, err);
    if (s != STATUS_OK) return s;
    reconstruct_warn_volume(&c->option, &c->geometry, &(struct warning_sink){pipeline_warn, c});
    const struct volume_filled *filled = &c->volume.filled;
    struct work_section section[] = {{&c->option, sizeof c->option},
                                     {&c->geometry, sizeof c->geometry},
                                     {c->volume.n, sizeof c->volume.n},
                                     {c->volume.voxel_size_m, sizeof c->volume.voxel_size_m},
                                     {c->volume.density, volume_n_voxel(c->volume.n) * sizeof(float), c->space},
                                     {filled->voxel, filled->n * sizeof *filled->voxel, c->space},
                                     {filled->density, filled->n * sizeof *filled->density, c->space}};
    return work_file_write(path, "volume.2", section, 7, err);
}

status stage_volume_load(struct pipeline_context *c, struct error *err)
{
    status s = pipeline_load_volume(c, &c->option, &c->geometry, err);
    if (s == STATUS_OK) reconstruct_warn_volume(&c->option, &c->geometry, &(struct warning_sink){pipeline_warn, c});
    return s;
}

/* ---- direction volume: the stages "orientation" and "directions" store the same things ---- */

static status store_direction(struct pipeline_context *c, const char *stage, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    status s = pipeline_work_path(c, stage, "direction.bin", path, err);
    if (s == STATUS_OK) s = worker_folder_check(c->folder, err);
    if (s != STATUS_OK) return s;
    struct direction_volume *d = &c->direction;
    size_t n = volume_n_voxel(d->n);
    struct work_section section[] = {{&c->option, sizeof c->option},
                                     {&c->geometry, sizeof c->geometry},
                                     {d->n, sizeof d->n},
                                     {d->voxel_size_m, sizeof d->voxel_size_m},
                                     {d->density, n, c->space},
                                     {d->octahedral, 4 * n, c->space}};
    return work_file_write(path, "direction.1", section, 6, err);
}

static status load_direction(struct pipeline_context *c, const char *stage, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct direction_volume d = {.space = c->space};
    status s = pipeline_work_path(c, stage, "direction.bin", path, err);
    if (s != STATUS_OK) return s;
    struct work_section section[] = {{&c->option, sizeof c->option},
                                     {&c->geometry, sizeof c->geometry},
                                     {d.n, sizeof d.n},
                                     {d.voxel_size_m, sizeof d.voxel_size_m},
                                     {NULL, 0, c->space},
                                     {NULL, 0, c->space}};
    s = work_file_read(path, "direction.1", section, 6, err);
    if (s != STATUS_OK) return s;
    d.density = section[4].data;
    d.octahedral = section[5].data;
    direction_volume_release(&c->direction);
    c->direction = d;
    return STATUS_OK;
}

status stage_orientation(struct pipeline_context *c, struct error *err)
{
    struct reconstruct_report *g = &c->geometry;
    struct progress_part part;
    const double filter = reconstruct_redirects(g) ? 0.2 : 1.0;
    const struct progress inner = progress_begin_part(&part, &c->progress, 0.0, filter);
    status s = pipeline_need_volume(c, err);
    if (s == STATUS_OK) s = reconstruct_orientation(&c->volume, &c->option, c->pool, &inner, &c->direction, g, err);
    part = (struct progress_part){&c->progress, filter, 1.0 - filter};
    if (s == STATUS_OK && reconstruct_redirects(g))
        s = reconstruct_redirect(&c->volume, &c->direction, &c->option, c->pool, &inner, g, err);
    return s == STATUS_OK ? store_direction(c, "orientation", err) : s;
}

status stage_orientation_load(struct pipeline_context *c, struct error *err)
{
    return load_direction(c, "orientation", err);
}

/* Whether a model of the job needs fibers, and not only density and directions. */
static bool wants_fibers(const struct pipeline_context *c)
{
    for (size_t i = 0; i < c->n_model; i++)
        if (c->model[i].appearance.kind == MODEL_SURFACE) return true;
    return c->doc->scan.unresolved_fibers;
}

/* Drops the fibers that the scan does not show, unless they are wanted. The voxels have taken their directions, which
 * are smoother than those of the filter. */
static void drop_unseen(struct pipeline_context *c)
{
    if (wants_fibers(c)) c->geometry.grade.n_dropped = 0;
    scan_grade_drop(&c->fiber, &c->geometry.grade);
    c->geometry.n_fiber = c->fiber.n_fiber;
    c->geometry.n_vertex = c->fiber.n_vertex;
    c->geometry.total_length_m = fiber_set_length_m(&c->fiber);
}

/* Joins the ends of the fibers across the seams of the tile, once the voxels of the scan have taken their
 * directions: the joined fibers no longer lie where the scan shows them near the faces. */
static status join_seams(struct pipeline_context *c, struct error *err)
{
    struct reconstruct_report *g = &c->geometry;
    if (c->fiber.n_fiber == 0) return STATUS_OK;
    status s = fiber_set_copy(&c->fiber, &c->traced, err);
    if (s == STATUS_OK) s = fiber_seam_measure(&c->fiber, &g->seam_found, err);
    if (s == STATUS_OK && c->doc->scan.join_seams) s = fiber_seam_join(&c->fiber, &g->seam_join, err);
    if (s == STATUS_OK) s = fiber_set_validate(&c->fiber, err);
    return s == STATUS_OK ? fiber_seam_measure(&c->fiber, &g->seam_fiber, err) : s;
}

status stage_directions(struct pipeline_context *c, struct error *err)
{
    status s = reconstruct_transfer(&c->fiber, &c->direction, c->pool, &c->progress, &c->geometry, err);
    if (s == STATUS_OK) drop_unseen(c);
    if (s == STATUS_OK) s = join_seams(c, err);
    return s == STATUS_OK ? store_direction(c, "directions", err) : s;
}

status stage_directions_load(struct pipeline_context *c, struct error *err)
{
    status s = load_direction(c, "directions", err);
    if (s == STATUS_OK) drop_unseen(c);
    return s == STATUS_OK ? join_seams(c, err) : s;
}

/* ---- fibers ---- */

static status read_fiber_file(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(c->folder, JOB_FOLDER_INPUT, c->doc->cloth.fiber_file, path);
    status s = fiber_file_read(path, c->doc, &c->fiber, err);
    if (s == STATUS_OK) fiber_file_warn(&c->fiber, c->doc, &(struct warning_sink){pipeline_warn, c});
    return s;
}

/* Makes the described cloth at the values of the document. */
static status build_cloth(struct pipeline_context *c, struct error *err)
{
    status s = cloth_build(c->doc->cloth.description, NULL, c->pool, &c->progress, &c->fiber, &c->cloth, err);
    if (s == STATUS_INVALID) job_cloth_name_field(err);
    return s;
}

/* Compares the groups of the fibers with those that the job names. */
static status check_groups(struct pipeline_context *c, struct error *err)
{
    size_t n_fiber[FIBER_MAX_GROUP] = {0}, n_group = fiber_set_n_group(&c->fiber);
    for (size_t i = 0; i < c->fiber.n_fiber; i++) n_fiber[c->fiber.group[i]]++;
    if (c->doc->cloth.n_group == 0) {
        if (n_group > 1 && c->doc->cloth.description == NULL)
            worker_status_warn(
                c->status,
                "the fibers belong to %zu groups, but are fitted with one set of parameters: name the groups "
                "in '%s' to give each its own",
                n_group, job_option_key(OPTION_GROUPS));
        return STATUS_OK;
    }
    const char *id = c->doc->cloth.description != NULL ? OPTION_YARNS : OPTION_GROUPS, *key = job_option_key(id);
    if (n_group > c->doc->cloth.n_group)
        return error_set_field(err, STATUS_INVALID, id, "'%s' names %zu groups, but the fibers belong to %zu", key,
                               c->doc->cloth.n_group, n_group);
    for (size_t g = 0; g < c->doc->cloth.n_group; g++)
        if (n_fiber[g] == 0)
            return error_set_field(err, STATUS_INVALID, id, "'%s' names the group %zu '%s', but no fiber belongs to it",
                                   key, g, c->doc->cloth.group[g]);
    return STATUS_OK;
}

/* Grades the scan. Where it does not resolve the fibers, those that it does not show are put last. */
static status grade_fibers(struct pipeline_context *c, struct error *err)
{
    struct reconstruct_report *g = &c->geometry;
    float *safe = malloc((c->fiber.n_fiber + 1) * sizeof *safe);
    if (safe == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot grade the scan: out of memory");
    status s = scan_grade_measure(&c->volume, &c->fiber, c->pool, NULL, &g->grade, safe, err);
    if (s == STATUS_OK && g->grade.verdict == GRADE_UNRESOLVED) s = scan_grade_sort(&c->fiber, safe, &g->grade, err);
    free(safe);
    if (s == STATUS_OK) reconstruct_tell_lumens(&c->volume, g);
    return s;
}

/* Traces the fibers of the scan, grades them, and makes the trial if the job asks for it. */
static status trace_fibers(struct pipeline_context *c, struct error *err)
{
    struct progress_part part;
    const struct progress inner = progress_begin_part(&part, &c->progress, 0.0, c->doc->scan.trial ? 0.5 : 1.0);
    status s = pipeline_need_volume(c, err);
    if (s == STATUS_OK)
        s = reconstruct_fibers(&c->volume, &c->direction, &c->option, c->pool, &inner, &c->fiber, &c->geometry, err);
    if (s == STATUS_OK) s = grade_fibers(c, err);
    part = (struct progress_part){&c->progress, 0.5, 0.5};
    if (s == STATUS_OK && c->doc->scan.trial) {
        struct reconstruct_option asked;
        pipeline_volume_options(c->doc, &asked);
        s = reconstruct_trial(&c->volume, &c->fiber, &asked, c->pool, &inner, &c->geometry, err);
    }
    volume_release(&c->volume);
    memset(&c->volume, 0, sizeof c->volume);
    return s;
}

/* A wrong voxel size makes fibers that no cloth has. */
static void warn_diameter(struct pipeline_context *c)
{
    double sum = 0.0;
    for (size_t i = 0; i < c->fiber.n_fiber; i++) sum += 2.0 * (double)c->fiber.radius_m[i];
    if (c->fiber.n_fiber > 0)
        fiber_file_warn_diameter(sum / (double)c->fiber.n_fiber, OPTION_VOXEL_SIZE,
                                 &(struct warning_sink){pipeline_warn, c});
}

status stage_fibers(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    status s;
    if (c->doc->scan.given) {
        s = trace_fibers(c, err);
        if (s == STATUS_OK) warn_diameter(c);
    } else {
        s = c->doc->cloth.description != NULL ? build_cloth(c, err) : read_fiber_file(c, err);
        c->geometry.n_fiber = c->fiber.n_fiber;
        c->geometry.n_vertex = c->fiber.n_vertex;
        if (s == STATUS_OK) c->geometry.total_length_m = fiber_set_length_m(&c->fiber);
    }
    if (s == STATUS_OK) s = fiber_set_validate(&c->fiber, err);
    if (s == STATUS_OK) s = check_groups(c, err);
    if (s == STATUS_OK && !c->doc->scan.given) s = fiber_seam_measure(&c->fiber, &c->geometry.seam_fiber, err);
    if (s == STATUS_OK) s = pipeline_work_path(c, "fibers", "fibers.bin", path, err);
    if (s == STATUS_OK) s = worker_folder_check(c->folder, err);
    if (s != STATUS_OK) return s;
    struct fiber_set *f = &c->fiber;
    struct work_section section[] = {{&c->option, sizeof c->option},
                                     {&c->geometry, sizeof c->geometry},
                                     {&c->cloth, sizeof c->cloth},
                                     {&f->n_fiber, sizeof f->n_fiber},
                                     {&f->n_vertex, sizeof f->n_vertex},
                                     {f->tile_size_m, sizeof f->tile_size_m},
                                     {f->first_vertex, (f->n_fiber + 1) * sizeof *f->first_vertex},
                                     {f->position_m, 3 * f->n_vertex * sizeof *f->position_m},
                                     {f->radius_m, f->n_fiber * sizeof *f->radius_m},
                                     {f->axis_class, f->n_fiber},
                                     {f->group, f->n_fiber},
                                     {f->shape, f->shape != NULL ? f->n_vertex * sizeof *f->shape : 0}};
    return work_file_write(path, "fibers.5", section, 12, err);
}

status stage_fibers_load(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct fiber_set f;
    fiber_set_init(&f);
    status s = pipeline_work_path(c, "fibers", "fibers.bin", path, err);
    if (s != STATUS_OK) return s;
    struct work_section section[] = {{&c->option, sizeof c->option},
                                     {&c->geometry, sizeof c->geometry},
                                     {&c->cloth, sizeof c->cloth},
                                     {&f.n_fiber, sizeof f.n_fiber},
                                     {&f.n_vertex, sizeof f.n_vertex},
                                     {f.tile_size_m, sizeof f.tile_size_m},
                                     {NULL, 0},
                                     {NULL, 0},
                                     {NULL, 0},
                                     {NULL, 0},
                                     {NULL, 0},
                                     {NULL, 0}};
    s = work_file_read(path, "fibers.5", section, 12, err);
    if (s != STATUS_OK) return s;
    f.first_vertex = section[6].data;
    f.position_m = section[7].data;
    f.radius_m = section[8].data;
    f.axis_class = section[9].data;
    f.group = section[10].data;
    f.shape = section[11].n_bytes > 0 ? section[11].data : NULL;
    if (f.shape == NULL) free(section[11].data);
    fiber_set_release(&c->fiber);
    c->fiber = f;
    return STATUS_OK;
}
