#include "optimizer/stages/scene/scan_order.h"
#include "base/catalogue/volume_format.h"
#include "base/files/file_ledger_json.h"
#include "base/natural_order.h"
#include "base/option_id.h"
#include "geometry/volume/format/slice_order.h"
#include "optimizer/job/options/option_key.h"

#include <stdlib.h>
#include <string.h>

/* Whether every file can be a slice whose name gives its place: a header and its data are no set. */
static bool is_set(const struct job_scan *scan)
{
    for (size_t i = 0; i < scan->n_file; i++) {
        const struct volume_format *format = volume_format_of(scan->file[i]);
        if (format == NULL || !format->may_be_slices || format->orders_itself) return false;
    }
    return scan->n_file > 1;
}

/* Adds to an error of the set how the job allows it. */
static status name_option(status s, struct error *err)
{
    if (s != STATUS_INVALID || err == NULL) return s;
    const size_t n = strlen(err->text);
    snprintf(err->text + n, sizeof err->text - n, " (if the numbers mean nothing, set '%s' to true)",
             job_option_key(OPTION_IGNORE_NUMBERS));
    return s;
}

static void note_order(const char *const *name, size_t n, bool ignored, json_t *files)
{
    char text[FILE_STATEMENT_BYTES];
    struct file_ledger ledger = {0};
    natural_order_text(name, n, text, sizeof text);
    file_ledger_add(&ledger, "the order", NULL, "%s%s", text, ignored ? " (numbers ignored)" : "");
    file_ledger_append(files, job_option_key(OPTION_SCAN_FILES), &ledger);
}

status scan_order_check(const struct job_scan *scan, json_t *files, const struct warning_sink *warn, struct error *err)
{
    struct slice_order order = {0};
    if (!is_set(scan)) return STATUS_OK;
    const char **name = calloc(scan->n_file, sizeof *name);
    if (name == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot check the order of the slices: out of memory");
    for (size_t i = 0; i < scan->n_file; i++) name[i] = scan->file[i];
    status s = scan->ignore_numbers ? STATUS_OK : slice_order_check(name, scan->n_file, &order, err);
    if (s == STATUS_OK) note_order(name, scan->n_file, scan->ignore_numbers, files);
    if (s == STATUS_OK && order.step > 1)
        warning_send(warn, OPTION_SCAN_FILES,
                     "the numbers of the slices go by %llu: the voxel size along z must be the distance of the slices "
                     "that are there",
                     order.step);
    free(name);
    return name_option(s, err);
}
