#include "base/files/file_ledger_json.h"
#include "base/option_id.h"
#include "base/warning.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/volume/format/volume_source.h"
#include "geometry/weave/weave_detect.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/photographs/reader/photograph.h"
#include "optimizer/stages/scene/fiber_file.h"
#include "optimizer/stages/scene/scan_order.h"
#include "optimizer/worker/check/input_check.h"
#include "renderer/transport/environment.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Slices of a scan that are read, evenly over its height. */
enum { LOOKED_SLICES = 16 };

/* ---- the scan ---- */

/* Voxels that the job states against those that the file states. */
static void check_voxel_size(struct input_check *c, const struct volume_source_info *info)
{
    struct error fault = {0};
    for (int a = 0; a < 3; a++) {
        double given_um = c->section.scan->voxel_size_um[a], stated_um = 1e6 * info->voxel_size_m[a];
        if (isnan(given_um) && isnan(stated_um)) {
            error_set_field(&fault, STATUS_INVALID, OPTION_VOXEL_SIZE,
                            "the voxel size is not given, and the file does not state it");
            input_check_fault(c, &fault);
            return;
        }
        if (!(given_um > 0.0) || !(stated_um > 0.0) || fabs(given_um / stated_um - 1.0) < 0.01) continue;
        error_set_field(&fault, STATUS_INVALID, OPTION_VOXEL_SIZE,
                        "the job says %.4g um along %c, the file says %.4g um: correct the job, or leave it out",
                        given_um, "xyz"[a], stated_um);
        input_check_fault(c, &fault);
        return;
    }
}

/* Reads some slices: all of them have numbers, and not all the same one. */
static status look_at_slices(struct volume_source *source, double range[2], struct error *fault)
{
    const struct volume_source_info *info = volume_source_describe(source);
    size_t n = info->n[0] * info->n[1], n_look = info->n[2] < LOOKED_SLICES ? info->n[2] : LOOKED_SLICES;
    float *slice = malloc(n * sizeof *slice);
    status s = slice != NULL ? STATUS_OK : error_set(fault, STATUS_NO_MEMORY, "cannot read the scan: out of memory");
    range[0] = INFINITY;
    range[1] = -INFINITY;
    for (size_t k = 0; k < n_look && s == STATUS_OK; k++) {
        s = volume_source_read(source, k * info->n[2] / n_look, 1, slice, fault);
        for (size_t i = 0; i < n && s == STATUS_OK; i++) {
            if (!isfinite(slice[i]))
                s = error_set_field(fault, STATUS_FORMAT, OPTION_SCAN_FILES, "the scan has voxels that are no numbers");
            range[0] = fmin(range[0], (double)slice[i]);
            range[1] = fmax(range[1], (double)slice[i]);
        }
    }
    free(slice);
    if (s == STATUS_OK && !(range[1] > range[0]))
        s = error_set_field(fault, STATUS_FORMAT, OPTION_SCAN_FILES, "all voxels of the scan have the value %g",
                            range[0]);
    return s;
}

static void check_volume(struct input_check *c)
{
    const struct job_scan *scan = c->section.scan;
    const char **path = calloc(scan->n_file, sizeof *path);
    char(*text)[INPUT_PATH_BYTES] = calloc(scan->n_file, sizeof *text);
    struct volume_raw_declaration raw = {.n = {scan->raw_shape[0], scan->raw_shape[1], scan->raw_shape[2]},
                                         .big_endian = scan->raw_big_endian,
                                         .header_bytes = scan->raw_header_bytes};
    struct volume_source *source = NULL;
    struct error fault = {0};
    double range[2];
    if (scan_order_check(scan, c->files, &(struct warning_sink){input_check_warn, c}, &fault) != STATUS_OK)
        input_check_fault(c, &fault);
    fault = (struct error){0};
    bool all = path != NULL && text != NULL;
    for (size_t i = 0; i < scan->n_file && all; i++) {
        all = input_check_has(c, scan->file[i]);
        input_check_path(c, scan->file[i], text[i]);
        path[i] = text[i];
    }
    if (!all) goto out;
    snprintf(raw.type, sizeof raw.type, "%s", scan->raw_type);
    status s = volume_source_open_declared(path, scan->n_file, &raw, &source, &fault);
    if (s == STATUS_OK) check_voxel_size(c, volume_source_describe(source));
    if (s == STATUS_OK) file_ledger_append(c->files, scan->file[0], &volume_source_describe(source)->ledger);
    if (s == STATUS_OK) s = look_at_slices(source, range, &fault);
    if (s != STATUS_OK) input_check_fault(c, &fault);
    volume_source_close(source);
out:
    free(text);
    free(path);
}

/* ---- fibers ---- */

static void check_fibers(struct input_check *c)
{
    char path[INPUT_PATH_BYTES];
    struct fiber_set f;
    struct error fault = {0};
    struct file_ledger ledger = {0};
    if (!input_check_has(c, c->section.cloth->fiber_file)) return;
    input_check_path(c, c->section.cloth->fiber_file, path);
    fiber_set_init(&f);
    status s = fiber_file_read(path, c->section.cloth, &f, &ledger, &fault);
    if (s == STATUS_OK) file_ledger_append(c->files, c->section.cloth->fiber_file, &ledger);
    if (s == STATUS_OK) fiber_file_warn(&f, c->section.cloth, &(struct warning_sink){input_check_warn, c});
    if (s != STATUS_OK) input_check_fault(c, &fault);
    fiber_set_release(&f);
}

static void check_environment(struct input_check *c)
{
    char path[INPUT_PATH_BYTES];
    struct environment *environment = NULL;
    struct error fault = {0};
    if (!input_check_has(c, c->section.setup->environment_file)) return;
    input_check_path(c, c->section.setup->environment_file, path);
    if (environment_read_exr(path, c->section.setup->environment_scale, &environment, &fault) != STATUS_OK) {
        snprintf(fault.field, sizeof fault.field, OPTION_ENVIRONMENT_FILE);
        input_check_fault(c, &fault);
    }
    environment_free(environment);
}

/* The photograph that shows the weave: as the job will read it. */
static void check_texture(struct input_check *c)
{
    char path[INPUT_PATH_BYTES];
    struct image im;
    struct weave_guess guess;
    struct error fault = {0};
    const struct job_photograph photograph = photograph_plain(JOB_TRANSFER_SRGB);
    if (!input_check_has(c, c->section.cloth->texture)) return;
    input_check_path(c, c->section.cloth->texture, path);
    status s = photograph_read(path, &photograph, &im, NULL, &fault);
    if (s == STATUS_OK) {
        s = weave_detect(&(struct weave_picture){im.pixel, im.width, im.height}, &guess, &fault);
        image_release(&im);
    }
    if (s == STATUS_NOT_FOUND && !c->section.cloth->draft_from_texture) {
        input_check_warn(c, OPTION_CLOTH_TEXTURE, fault.text);
        return;
    }
    if (s == STATUS_OK) return;
    if (s == STATUS_NOT_FOUND) fault.code = STATUS_INVALID;
    snprintf(fault.field, sizeof fault.field, OPTION_CLOTH_TEXTURE);
    input_check_fault(c, &fault);
}

void input_check_cloth(struct input_check *c)
{
    if (c->section.scan->n_file > 0) check_volume(c);
    check_fibers(c);
    check_environment(c);
    check_texture(c);
}
