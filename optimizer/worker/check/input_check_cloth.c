#include "base/catalogue/cloth_description.h"
#include "base/files/file_ledger_json.h"
#include "base/option_id.h"
#include "base/warning.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/reconstruct/noise_refusal.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/weave/weave_detect.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/photographs/reader/photograph.h"
#include "optimizer/stages/scene/draft_file.h"
#include "optimizer/stages/scene/fiber_file.h"
#include "optimizer/stages/scene/pipeline_volume.h"
#include "optimizer/stages/scene/scan_order.h"
#include "optimizer/worker/check/input_check.h"
#include "renderer/transport/environment.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- the scan ---- */

/* Whether an option has a fault already: what its default then lacks is no second one. */
static bool has_fault(const struct input_check *c, const struct error *like)
{
    struct error named = *like;
    job_option_name_field(named.code, &named);
    for (size_t i = 0; i < c->fault->n; i++)
        if (strcmp(c->fault->fault[i].field, named.field) == 0) return true;
    return false;
}

static void check_volume(struct input_check *c)
{
    const struct job_scan *scan = c->section.scan;
    const char **path = calloc(scan->n_file, sizeof *path);
    char(*text)[INPUT_PATH_BYTES] = calloc(scan->n_file, sizeof *text);
    struct reconstruct_option option;
    struct file_ledger ledger = {0};
    struct error fault = {0};
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
    volume_options(scan, &option);
    status s = reconstruct_examine(path, scan->n_file, &option, &ledger, &fault);
    if (s == STATUS_OK)
        s = noise_refuse_early(path, scan->n_file, &option, &(struct warning_sink){input_check_warn, c}, &fault);
    if (s != STATUS_OK && !(strcmp(fault.field, OPTION_VOXEL_SIZE) == 0 && has_fault(c, &fault)))
        input_check_fault(c, &fault);
    file_ledger_append(c->files, scan->file[0], &ledger);
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
    if (!input_check_has(c, c->section.cloth->fiber_file)) return;
    input_check_path(c, c->section.cloth->fiber_file, path);
    fiber_set_init(&f);
    status s = fiber_file_read(path, c->section.cloth, &f, &fault);
    if (s == STATUS_OK) fiber_file_note(path, c->section.cloth, c->files);
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

static void check_draft(struct input_check *c)
{
    char path[INPUT_PATH_BYTES];
    struct error fault = {0};
    struct file_ledger ledger = {0};
    const struct job_cloth *cloth = c->section.cloth;
    if (cloth->description == NULL || cloth->description->n_kind == 0 || !input_check_has(c, cloth->draft_file)) return;
    input_check_path(c, cloth->draft_file, path);
    status s = draft_file_take(path, c->section.cloth, &ledger, &fault);
    if (s == STATUS_OK) file_ledger_append(c->files, cloth->draft_file, &ledger);
    if (s != STATUS_OK) input_check_fault(c, &fault);
}

/* The photograph that shows the weave: as the job will read it. */
static void check_texture(struct input_check *c)
{
    char path[INPUT_PATH_BYTES];
    struct image im;
    struct weave_guess guess;
    struct error fault = {0};
    const struct job_photograph photograph = photograph_assumed(JOB_TRANSFER_SRGB);
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
    check_draft(c);
    check_environment(c);
    check_texture(c);
}
