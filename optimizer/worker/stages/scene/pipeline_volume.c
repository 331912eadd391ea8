/* The densities of a scan: the options that it is reconstructed with, its files, and its checkpoint. */
#include "optimizer/worker/stages/scene/pipeline_volume.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/worker/pipeline_context.h"
#include "optimizer/worker/work_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double um = 1e-6;

void pipeline_volume_options(const struct job_document *doc, struct reconstruct_option *o)
{
    reconstruct_option_default(o);
    memcpy(o->raw.n, doc->scan.raw_shape, sizeof o->raw.n);
    memcpy(o->raw.type, doc->scan.raw_type, sizeof o->raw.type);
    o->raw.big_endian = doc->scan.raw_big_endian;
    o->raw.header_bytes = doc->scan.raw_header_bytes;
    for (int a = 0; a < 3; a++) o->voxel_size_m[a] = doc->scan.voxel_size_um[a] * um; /* NaN stays NaN */
    memcpy(o->axes, doc->scan.axes, sizeof o->axes);
    memcpy(o->matrix, doc->scan.matrix, sizeof o->matrix);
    memcpy(o->crop_voxel, doc->scan.crop_voxel, sizeof o->crop_voxel);
    o->align = doc->scan.align;
    o->crop = doc->scan.crop;
    if (!isnan(doc->scan.crop_keep)) o->crop_keep = doc->scan.crop_keep;
    o->density_low = doc->scan.density_low;
    o->density_high = doc->scan.density_high;
    o->fiber_diameter_voxel = doc->scan.fiber_diameter_voxel;
    o->hollow_fibers = doc->scan.hollow_fibers;
    if (!isnan(doc->scan.filter_s)) o->s = doc->scan.filter_s;
    if (!isnan(doc->scan.filter_t)) o->t = doc->scan.filter_t;
    if (doc->scan.filter_h > 0) o->h = doc->scan.filter_h;
    if (!isnan(doc->scan.filter_eps_d)) o->eps_d = doc->scan.filter_eps_d;
    if (!isnan(doc->scan.filter_eps_j)) o->eps_j = doc->scan.filter_eps_j;
    if (!isnan(doc->scan.link_sigma_voxel)) o->link_sigma_voxel = doc->scan.link_sigma_voxel;
    if (doc->scan.min_vertex > 0) o->min_vertex = doc->scan.min_vertex;
    if (!isnan(doc->scan.radius_um))
        for (int a = 0; a < 3; a++) o->radius_m[a] = doc->scan.radius_um * um;
    o->radius_rule = doc->scan.radius_per_axis < 0   ? RADIUS_AUTO
                     : doc->scan.radius_per_axis > 0 ? RADIUS_PER_AXIS
                                                     : RADIUS_COMMON;
}

const char **pipeline_scan_paths(const struct pipeline_context *c)
{
    const size_t n = c->doc->scan.n_file;
    const char **path = malloc(n * (sizeof *path + WORKER_PATH_BYTES));
    for (size_t i = 0; path != NULL && i < n; i++) {
        char *text = (char *)(path + n) + i * WORKER_PATH_BYTES;
        worker_folder_path(c->folder, JOB_FOLDER_INPUT, c->doc->scan.file[i], text);
        path[i] = text;
    }
    return path;
}

status pipeline_scan_size(const struct pipeline_context *c, size_t n[3], struct error *err)
{
    struct reconstruct_option option;
    struct volume_source *source = NULL;
    const char **path = pipeline_scan_paths(c);
    if (path == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the volume: out of memory");
    pipeline_volume_options(c->doc, &option);
    status s = volume_source_open_declared(path, c->doc->scan.n_file, &option.raw, &source, err);
    if (s == STATUS_OK) memcpy(n, volume_source_describe(source)->n, 3 * sizeof *n);
    volume_source_close(source);
    free(path);
    return s;
}

status pipeline_load_volume(struct pipeline_context *c, struct reconstruct_option *option,
                            struct reconstruct_report *report, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct volume v = {.space = c->space};
    status s = pipeline_work_path(c, "volume", "volume.bin", path, err);
    if (s != STATUS_OK) return s;
    struct work_section section[] = {
        {option, sizeof *option}, {report, sizeof *report}, {v.n, sizeof v.n},  {v.voxel_size_m, sizeof v.voxel_size_m},
        {NULL, 0, c->space},      {NULL, 0, c->space},      {NULL, 0, c->space}};
    s = work_file_read(path, "volume.2", section, 7, err);
    if (s != STATUS_OK) return s;
    v.density = section[4].data;
    v.filled = (struct volume_filled){section[5].n_bytes / sizeof(size_t), section[5].data, section[6].data};
    volume_release(&c->volume);
    c->volume = v;
    return STATUS_OK;
}

status pipeline_need_volume(struct pipeline_context *c, struct error *err)
{
    struct reconstruct_option option;
    struct reconstruct_report report;
    return c->volume.density != NULL ? STATUS_OK : pipeline_load_volume(c, &option, &report, err);
}
