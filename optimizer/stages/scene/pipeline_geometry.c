/* Stages "volume" to "directions": from the scan, or from a fiber file, to the fibers of the cloth. */
#include "base/option_id.h"
#include "geometry/cloth/cloth.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/stages/geometry_stages.h"
#include "optimizer/stages/job_inputs.h"
#include "optimizer/stages/run/work_file.h"
#include "optimizer/stages/scene/fiber_file.h"
#include "optimizer/stages/scene/pipeline_volume.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- volume ---- */

/* Share of the stage's fraction that reading the scan has. Filling the lumens of hollow fibers has the rest, of whose
 * time it takes nearly all; other scans have no such part. */
static const double read_share = 0.4;

static status read_volume(const struct volume_input *in, struct volume_output *out, struct error *err)
{
    const char **path = scan_paths(in->tools->folder, in->scan);
    if (path == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the volume: out of memory");
    struct progress_part part;
    const struct progress inner = progress_begin_part(&part, &in->tools->progress, 0.0, read_share);
    status s = reconstruct_read(path, in->scan->n_file, &out->option, in->tools->space, in->tools->pool, &inner,
                                &out->volume, &out->geometry, err);
    if (s == STATUS_OK && scratch_file_bytes(in->tools->space) > 0)
        log_info(in->tools->log, "volume: beyond the memory setting of %zu MB, worked on in files",
                 in->tools->memory_limit_bytes / 1000000);
    free(path);
    return s;
}

/* Fills the lumens of hollow fibers. That the fibers are hollow may not have been known before the scan was read. */
static status fill_lumens(const struct volume_input *in, struct volume_output *out, struct error *err)
{
    if (!reconstruct_refills(&out->volume, &out->geometry)) return STATUS_OK;
    struct progress_part part;
    const struct progress inner = progress_begin_part(&part, &in->tools->progress, read_share, 1.0 - read_share);
    if (in->tools->plan.hollow != NULL) in->tools->plan.hollow(in->tools->plan.context, out->geometry.n);
    log_info(in->tools->log, "volume: the fibers are hollow and are traced to fill their lumens");
    return reconstruct_refill_lumens(&out->volume, &out->option, in->tools->pool, &inner, &out->geometry, err);
}

status stage_volume(const struct volume_input *in, struct volume_output *out, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    volume_options(in->scan, &out->option);
    status s = read_volume(in, out, err);
    if (s == STATUS_OK) s = fill_lumens(in, out, err);
    if (s == STATUS_OK) s = stage_work_path(in->tools, "volume", "volume.bin", path, err);
    if (s == STATUS_OK) s = worker_folder_check(in->tools->folder, err);
    if (s != STATUS_OK) return s;
    reconstruct_warn_volume(&out->option, &out->geometry, &in->tools->warn);
    const struct volume_filled *filled = &out->volume.filled;
    struct work_section section[] = {
        {&out->option, sizeof out->option},
        {&out->geometry, sizeof out->geometry},
        {out->volume.n, sizeof out->volume.n},
        {out->volume.voxel_size_m, sizeof out->volume.voxel_size_m},
        {out->volume.density, volume_n_voxel(out->volume.n) * sizeof(float), in->tools->space},
        {filled->voxel, filled->n * sizeof *filled->voxel, in->tools->space},
        {filled->density, filled->n * sizeof *filled->density, in->tools->space},
        {out->volume.unknown.run, out->volume.unknown.n * sizeof *out->volume.unknown.run, in->tools->space},
        {out->volume.light.run, out->volume.light.n * sizeof *out->volume.light.run, in->tools->space},
        {&out->volume.light.density, sizeof out->volume.light.density}};
    return work_file_write(path, "volume.4", section, 10, err);
}

status stage_volume_load(const struct volume_input *in, struct volume_output *out, struct error *err)
{
    status s = volume_checkpoint_read(in->tools, out, err);
    if (s == STATUS_OK) reconstruct_warn_volume(&out->option, &out->geometry, &in->tools->warn);
    return s;
}

/* ---- direction volume: the stages "orientation" and "directions" store the same things ---- */

/* The parts of such a checkpoint. */
struct direction_file {
    struct reconstruct_option *option;
    struct reconstruct_report *geometry;
    struct direction_volume *direction;
};

static status store_direction(const struct stage_tools *tools, const char *stage, const struct direction_file *f,
                              struct error *err)
{
    char path[WORKER_PATH_BYTES];
    status s = stage_work_path(tools, stage, "direction.bin", path, err);
    if (s == STATUS_OK) s = worker_folder_check(tools->folder, err);
    if (s != STATUS_OK) return s;
    struct direction_volume *d = f->direction;
    size_t n = volume_n_voxel(d->n);
    struct work_section section[] = {{f->option, sizeof *f->option},
                                     {f->geometry, sizeof *f->geometry},
                                     {d->n, sizeof d->n},
                                     {d->voxel_size_m, sizeof d->voxel_size_m},
                                     {d->density, n, tools->space},
                                     {d->octahedral, 4 * n, tools->space}};
    return work_file_write(path, "direction.1", section, 6, err);
}

static status load_direction(const struct stage_tools *tools, const char *stage, const struct direction_file *f,
                             struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct direction_volume d = {.space = tools->space};
    status s = stage_work_path(tools, stage, "direction.bin", path, err);
    if (s != STATUS_OK) return s;
    struct work_section section[] = {{f->option, sizeof *f->option},
                                     {f->geometry, sizeof *f->geometry},
                                     {d.n, sizeof d.n},
                                     {d.voxel_size_m, sizeof d.voxel_size_m},
                                     {NULL, 0, tools->space},
                                     {NULL, 0, tools->space}};
    s = work_file_read(path, "direction.1", section, 6, err);
    if (s != STATUS_OK) return s;
    d.density = section[4].data;
    d.octahedral = section[5].data;
    direction_volume_release(f->direction);
    *f->direction = d;
    return STATUS_OK;
}

status stage_orientation(const struct orientation_input *in, struct orientation_output *out, struct error *err)
{
    struct reconstruct_report *g = &out->geometry;
    const struct volume *volume = &in->volume->volume;
    out->option = in->volume->option;
    *g = in->volume->geometry;
    struct progress_part part;
    const double filter = reconstruct_redirects(g) ? RECONSTRUCT_FILTER_SHARE : 1.0;
    const struct progress inner = progress_begin_part(&part, &in->tools->progress, 0.0, filter);
    status s = reconstruct_orientation(volume, &out->option, in->tools->pool, &inner, &out->direction, g, err);
    part = (struct progress_part){&in->tools->progress, RECONSTRUCT_FILTER_SHARE, 1.0 - RECONSTRUCT_FILTER_SHARE};
    if (s == STATUS_OK && reconstruct_redirects(g))
        s = reconstruct_redirect(volume, &out->direction, &out->option, in->tools->pool, &inner, g, err);
    return s == STATUS_OK
               ? store_direction(in->tools, "orientation",
                                 &(struct direction_file){&out->option, &out->geometry, &out->direction}, err)
               : s;
}

status stage_orientation_load(const struct orientation_input *in, struct orientation_output *out, struct error *err)
{
    return load_direction(in->tools, "orientation",
                          &(struct direction_file){&out->option, &out->geometry, &out->direction}, err);
}

/* Returns whether a model of the job needs fibers, and not only density and directions. */
static bool wants_fibers(const struct directions_input *in)
{
    for (size_t i = 0; i < in->n_model; i++)
        if (in->model[i].appearance.kind == MODEL_SURFACE) return true;
    return in->scan->unresolved_fibers;
}

/* Drops the fibers that the scan does not show, unless they are wanted. The voxels have taken the fibers' directions,
 * which are smoother than the filter's. */
static void drop_unseen(const struct directions_input *in, struct directions_output *out)
{
    if (wants_fibers(in)) out->geometry.grade.n_dropped = 0;
    scan_grade_drop(&out->fiber, &out->geometry.grade);
    out->geometry.n_fiber = out->fiber.n_fiber;
    out->geometry.n_vertex = out->fiber.n_vertex;
    out->geometry.total_length_m = fiber_set_length_m(&out->fiber);
}

/* Makes the large tile that the document asks for. */
static status make_tiles(const struct directions_input *in, struct directions_output *out, struct error *err)
{
    const uint64_t seed = 1;
    if (in->scan->tiles < 2) return STATUS_OK;
    status s = fiber_tiles_make(&out->fiber, in->scan->tiles, seed, &out->geometry.tiles, err);
    if (s == STATUS_OK && out->geometry.tiles.n_move < 2)
        worker_status_warn(in->tools->status,
                           "the tile of the scan shows no repeat, so it is not made larger: see '%s'",
                           job_option_key(OPTION_TILES));
    return s;
}

/* Joins the ends of the fibers across the seams of the tile, once the voxels of the scan have taken their
 * directions: the joined fibers no longer lie where the scan shows them near the faces. */
static status join_seams(const struct directions_input *in, struct directions_output *out, struct error *err)
{
    struct reconstruct_report *g = &out->geometry;
    if (out->fiber.n_fiber == 0) {
        if (in->scan->tiles > 1)
            worker_status_warn(in->tools->status, "'%s' has no effect: there are no fibers to make a large tile of",
                               job_option_key(OPTION_TILES));
        return STATUS_OK;
    }
    status s = fiber_set_copy(&out->fiber, &out->traced, err);
    if (s == STATUS_OK) s = fiber_seam_measure(&out->fiber, &g->seam_found, err);
    if (s == STATUS_OK && in->scan->join_seams) s = fiber_seam_join(&out->fiber, &g->seam_join, err);
    if (s == STATUS_OK) s = make_tiles(in, out, err);
    if (s == STATUS_OK) s = fiber_set_validate(&out->fiber, err);
    return s == STATUS_OK ? fiber_seam_measure(&out->fiber, &g->seam_fiber, err) : s;
}

status stage_directions(const struct directions_input *in, struct directions_output *out, struct error *err)
{
    status (*const step)(const struct fiber_set *, struct direction_volume *, struct thread_pool *,
                         const struct progress *, struct reconstruct_report *, struct error *) =
        in->scan->transfer_directions ? reconstruct_transfer : reconstruct_keep_directions;
    status s = step(&out->fiber, &out->direction, in->tools->pool, &in->tools->progress, &out->geometry, err);
    if (s == STATUS_OK) drop_unseen(in, out);
    if (s == STATUS_OK) s = join_seams(in, out, err);
    return s == STATUS_OK
               ? store_direction(in->tools, "directions",
                                 &(struct direction_file){&out->option, &out->geometry, &out->direction}, err)
               : s;
}

status stage_directions_load(const struct directions_input *in, struct directions_output *out, struct error *err)
{
    status s = load_direction(in->tools, "directions",
                              &(struct direction_file){&out->option, &out->geometry, &out->direction}, err);
    if (s == STATUS_OK) drop_unseen(in, out);
    return s == STATUS_OK ? join_seams(in, out, err) : s;
}

/* ---- fibers ---- */

static status read_fiber_file(const struct fibers_input *in, struct fibers_output *out, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(in->tools->folder, JOB_FOLDER_INPUT, in->cloth->fiber_file, path);
    status s = fiber_file_read(path, in->cloth, &out->fiber, err);
    if (s == STATUS_OK) fiber_file_warn(&out->fiber, in->cloth, &in->tools->warn);
    return s;
}

/* Makes the described cloth at the values of the document. */
static status build_cloth(const struct fibers_input *in, struct fibers_output *out, struct error *err)
{
    status s =
        cloth_build(in->cloth->description, NULL, in->tools->pool, &in->tools->progress, &out->fiber, &out->cloth, err);
    if (s == STATUS_INVALID) job_cloth_name_field(err);
    return s;
}

/* Compares the groups of the fibers with those that the job names. */
static status check_groups(const struct fibers_input *in, struct fibers_output *out, struct error *err)
{
    size_t n_fiber[FIBER_MAX_GROUP] = {0}, n_group = fiber_set_n_group(&out->fiber);
    struct film_groups films;
    job_cloth_films(in->cloth, &films);
    if (films.n > 0 && n_group > films.first_group) n_group = films.first_group;
    for (size_t i = 0; i < out->fiber.n_fiber; i++) n_fiber[out->fiber.group[i]]++;
    if (in->cloth->n_group == 0) {
        if (n_group > 1 && in->cloth->description == NULL)
            worker_status_warn(
                in->tools->status,
                "the fibers belong to %zu groups, but are fitted with one set of parameters: name the groups "
                "in '%s' to give each its own",
                n_group, job_option_key(OPTION_GROUPS));
        return STATUS_OK;
    }
    const char *id = in->cloth->description != NULL ? OPTION_YARNS : OPTION_GROUPS, *key = job_option_key(id);
    if (n_group > in->cloth->n_group)
        return error_set_field(err, STATUS_INVALID, id, "'%s' names %zu groups, but the fibers belong to %zu", key,
                               in->cloth->n_group, n_group);
    for (size_t g = 0; g < in->cloth->n_group; g++)
        if (n_fiber[g] == 0)
            return error_set_field(err, STATUS_INVALID, id, "'%s' names the group %zu '%s', but no fiber belongs to it",
                                   key, g, in->cloth->group[g]);
    return STATUS_OK;
}

/* Grades the scan. Where it does not resolve the fibers, those that it does not show are put last. */
static status grade_fibers(const struct fibers_input *in, struct fibers_output *out, struct error *err)
{
    struct reconstruct_report *g = &out->geometry;
    float *safe = malloc((out->fiber.n_fiber + 1) * sizeof *safe);
    if (safe == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot grade the scan: out of memory");
    status s = reconstruct_grade(&in->volume->volume, &out->fiber, in->tools->pool, g, safe, err);
    if (s == STATUS_OK && g->grade.verdict == GRADE_UNRESOLVED) s = scan_grade_sort(&out->fiber, safe, &g->grade, err);
    free(safe);
    if (s == STATUS_OK) reconstruct_tell_lumens(&in->volume->volume, g);
    return s;
}

/* Traces the fibers of the scan, grades them, and makes the trial if the job asks for it. */
static status trace_fibers(const struct fibers_input *in, struct fibers_output *out, struct error *err)
{
    struct progress_part part;
    const struct progress inner = progress_begin_part(&part, &in->tools->progress, 0.0, in->scan->trial ? 0.5 : 1.0);
    out->option = in->orientation->option;
    out->geometry = in->orientation->geometry;
    status s = reconstruct_fibers(&in->volume->volume, &in->orientation->direction, &out->option, in->tools->pool,
                                  &inner, &out->fiber, &out->geometry, err);
    if (s == STATUS_OK) s = grade_fibers(in, out, err);
    part = (struct progress_part){&in->tools->progress, 0.5, 0.5};
    if (s == STATUS_OK && in->scan->trial) {
        struct reconstruct_option asked;
        volume_options(in->scan, &asked);
        s = reconstruct_trial(&in->volume->volume, &out->fiber, &asked, in->tools->pool, &inner, &out->geometry, err);
    }
    return s;
}

/* A wrong voxel size makes fibers that no cloth has. */
static void warn_diameter(const struct fibers_input *in, const struct fibers_output *out)
{
    double sum = 0.0;
    for (size_t i = 0; i < out->fiber.n_fiber; i++) sum += 2.0 * (double)out->fiber.radius_m[i];
    if (out->fiber.n_fiber > 0)
        fiber_file_warn_diameter(sum / (double)out->fiber.n_fiber, OPTION_VOXEL_SIZE, &in->tools->warn);
}

status stage_fibers(const struct fibers_input *in, struct fibers_output *out, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    status s;
    if (in->scan->given) {
        s = trace_fibers(in, out, err);
        if (s == STATUS_OK) warn_diameter(in, out);
    } else {
        s = in->cloth->description != NULL ? build_cloth(in, out, err) : read_fiber_file(in, out, err);
        out->geometry.n_fiber = out->fiber.n_fiber;
        out->geometry.n_vertex = out->fiber.n_vertex;
        if (s == STATUS_OK) out->geometry.total_length_m = fiber_set_length_m(&out->fiber);
    }
    if (s == STATUS_OK) s = fiber_set_validate(&out->fiber, err);
    if (s == STATUS_OK) s = check_groups(in, out, err);
    if (s == STATUS_OK && !in->scan->given) s = fiber_seam_measure(&out->fiber, &out->geometry.seam_fiber, err);
    if (s == STATUS_OK) s = stage_work_path(in->tools, "fibers", "fibers.bin", path, err);
    if (s == STATUS_OK) s = worker_folder_check(in->tools->folder, err);
    if (s != STATUS_OK) return s;
    struct fiber_set *f = &out->fiber;
    struct work_section section[] = {{&out->option, sizeof out->option},
                                     {&out->geometry, sizeof out->geometry},
                                     {&out->cloth, sizeof out->cloth},
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

status stage_fibers_load(const struct fibers_input *in, struct fibers_output *out, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct fiber_set f;
    fiber_set_init(&f);
    status s = stage_work_path(in->tools, "fibers", "fibers.bin", path, err);
    if (s != STATUS_OK) return s;
    struct work_section section[] = {{&out->option, sizeof out->option},
                                     {&out->geometry, sizeof out->geometry},
                                     {&out->cloth, sizeof out->cloth},
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
    fiber_set_release(&out->fiber);
    out->fiber = f;
    return STATUS_OK;
}
