/* The densities of a scan: the options that it is reconstructed with, its files, and its checkpoint. */
#include "optimizer/stages/scene/pipeline_volume.h"
#include "base/files/file_ledger_json.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/volume/format/volume_source.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/stages/run/work_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double um = 1e-6;

void volume_options(const struct job_scan *scan, struct reconstruct_option *o)
{
    reconstruct_option_default(o);
    memcpy(o->raw.n, scan->raw_shape, sizeof o->raw.n);
    memcpy(o->raw.type, scan->raw_type, sizeof o->raw.type);
    o->raw.big_endian = scan->raw_big_endian;
    o->raw.header_bytes = scan->raw_header_bytes;
    o->part = (struct volume_part){scan->channel, scan->time, ""};
    memcpy(o->part.dataset, scan->dataset, sizeof o->part.dataset);
    for (int a = 0; a < 3; a++) o->voxel_size_m[a] = scan->voxel_size_um[a] * um; /* NaN stays NaN */
    memcpy(o->axes, scan->axes, sizeof o->axes);
    memcpy(o->matrix, scan->matrix, sizeof o->matrix);
    memcpy(o->crop_voxel, scan->crop_voxel, sizeof o->crop_voxel);
    o->align = scan->align;
    o->crop = scan->crop;
    if (!isnan(scan->crop_keep)) o->crop_keep = scan->crop_keep;
    o->density_low = scan->density_low;
    o->density_high = scan->density_high;
    o->fiber_diameter_voxel = scan->fiber_diameter_voxel;
    o->hollow_fibers = scan->hollow_fibers;
    o->three_subvolumes = scan->three_subvolumes;
    if (!isnan(scan->filter_s)) o->s = scan->filter_s;
    if (!isnan(scan->filter_t)) o->t = scan->filter_t;
    if (scan->filter_h > 0) o->h = scan->filter_h;
    if (!isnan(scan->filter_eps_d)) o->eps_d = scan->filter_eps_d;
    if (!isnan(scan->filter_eps_j)) o->eps_j = scan->filter_eps_j;
    if (!isnan(scan->link_sigma_voxel)) o->link_sigma_voxel = scan->link_sigma_voxel;
    if (scan->min_vertex > 0) o->min_vertex = scan->min_vertex;
    if (!isnan(scan->radius_um))
        for (int a = 0; a < 3; a++) o->radius_m[a] = scan->radius_um * um;
    o->radius_rule = scan->radius_per_axis < 0   ? RADIUS_AUTO
                     : scan->radius_per_axis > 0 ? RADIUS_PER_AXIS
                                                 : RADIUS_COMMON;
}

const char **scan_paths(const struct worker_folder *folder, const struct job_scan *scan)
{
    const size_t n = scan->n_file;
    const char **path = malloc(n * (sizeof *path + WORKER_PATH_BYTES));
    for (size_t i = 0; path != NULL && i < n; i++) {
        char *text = (char *)(path + n) + i * WORKER_PATH_BYTES;
        worker_folder_path(folder, JOB_FOLDER_INPUT, scan->file[i], text);
        path[i] = text;
    }
    return path;
}

status scan_size(const struct worker_folder *folder, const struct job_scan *scan, size_t n[3], struct error *err)
{
    struct reconstruct_option option;
    struct volume_source *source = NULL;
    const char **path = scan_paths(folder, scan);
    if (path == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the volume: out of memory");
    volume_options(scan, &option);
    status s = volume_source_open_declared(path, scan->n_file, &option.raw, &option.part, &source, err);
    if (s == STATUS_OK) memcpy(n, volume_source_describe(source)->n, 3 * sizeof *n);
    volume_source_close(source);
    free(path);
    return s;
}

status scan_examine(const struct worker_folder *folder, const struct job_scan *scan, json_t *files, struct error *err)
{
    struct reconstruct_option option;
    struct file_ledger ledger = {0};
    const char **path = scan_paths(folder, scan);
    if (path == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the volume: out of memory");
    volume_options(scan, &option);
    status s = reconstruct_examine(path, scan->n_file, &option, &ledger, err);
    file_ledger_append(files, scan->file[0], &ledger);
    free(path);
    return s;
}

status volume_checkpoint_read(const struct stage_tools *tools, struct volume_output *out, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct volume v = {.space = tools->space};
    double light_density = 0.0;
    status s = stage_work_path(tools, "volume", "volume.bin", path, err);
    if (s != STATUS_OK) return s;
    struct work_section section[] = {{&out->option, sizeof out->option},
                                     {&out->geometry, sizeof out->geometry},
                                     {v.n, sizeof v.n},
                                     {v.voxel_size_m, sizeof v.voxel_size_m},
                                     {NULL, 0, tools->space},
                                     {NULL, 0, tools->space},
                                     {NULL, 0, tools->space},
                                     {NULL, 0, tools->space},
                                     {NULL, 0, tools->space},
                                     {&light_density, sizeof light_density}};
    s = work_file_read(path, "volume.4", section, 10, err);
    if (s != STATUS_OK) return s;
    v.density = section[4].data;
    v.filled = (struct volume_filled){section[5].n_bytes / sizeof(size_t), section[5].data, section[6].data};
    v.unknown = (struct volume_unknown){section[7].n_bytes / sizeof(struct volume_run), section[7].data};
    v.light = (struct volume_light){light_density, section[8].n_bytes / sizeof(struct volume_run), section[8].data};
    volume_release(&out->volume);
    out->volume = v;
    return STATUS_OK;
}
