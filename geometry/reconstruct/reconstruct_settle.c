/* The statements of a scan's files against the options of the document. */
#include "base/option_id.h"
#include "geometry/reconstruct/reconstruct.h"

#include "geometry/reconstruct/scan_look.h"
#include "geometry/volume/format/axis_directions.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Voxels that can show a textile fiber, which is 2 to 60 um thick: fibers below 4 voxels are not told apart, and a
 * fiber of 100 voxels fills no scan that is large enough for cloth. */
static const double MOST_VOXEL_M = 15e-6, LEAST_VOXEL_M = 0.02e-6;

static const char contradicted[] = "the document contradicts it";

static bool is_identity(const double m[9])
{
    for (int i = 0; i < 9; i++)
        if (m[i] != (i % 4 == 0 ? 1.0 : 0.0)) return false;
    return true;
}

static status settle_voxel_size(const struct volume_source_info *info, struct reconstruct_option *o,
                                struct file_ledger *ledger, struct error *err)
{
    bool given = false;
    for (int a = 0; a < 3; a++) {
        const double stated = info->voxel_size_m[a];
        if (isnan(o->voxel_size_m[a])) {
            o->voxel_size_m[a] = stated;
            continue;
        }
        given = true;
        if (info->is_weak_size || !(stated > 0.0) || fabs(o->voxel_size_m[a] / stated - 1.0) < 0.01) continue;
        file_ledger_settle(ledger, "voxel size", contradicted);
        return error_set_field(err, STATUS_INVALID, OPTION_VOXEL_SIZE,
                               "the job says %.4g um along %c, the file says %.4g um: correct the job, or leave it out",
                               o->voxel_size_m[a] * 1e6, "xyz"[a], stated * 1e6);
    }
    if (given && info->is_weak_size)
        file_ledger_settle(ledger, "voxel size", "the document's takes its place; programs write this one by default");
    return STATUS_OK;
}

/* Asks about voxels that show no fiber. Who states the diameter of the fibers has answered. */
static status ask_voxel_size(const struct reconstruct_option *o, struct error *err)
{
    double least = INFINITY;
    for (int a = 0; a < 3; a++) {
        if (isnan(o->voxel_size_m[a]))
            return error_set_field(
                err, STATUS_INVALID, OPTION_VOXEL_SIZE,
                "cannot use the volume: its voxel size is not given, and the file does not state it");
        least = fmin(least, o->voxel_size_m[a]);
    }
    if (!isnan(o->fiber_diameter_voxel) || (least >= LEAST_VOXEL_M && least <= MOST_VOXEL_M)) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, OPTION_VOXEL_SIZE,
                           "a voxel of %.4g um shows no textile fiber, which is 2 to 60 um thick: write the size in "
                           "micrometres, or, if it is right, state the fibers' 'fiber_diameter_voxel' as well",
                           least * 1e6);
}

static status ask_for_matrix(const struct volume_source_info *info, struct error *err)
{
    const double *m = info->oblique;
    return error_set_field(err, STATUS_INVALID, OPTION_MATRIX,
                           "the header says that the axes are oblique: write the matrix that straightens them, [%.6g, "
                           "%.6g, %.6g, %.6g, %.6g, %.6g, %.6g, %.6g, %.6g], or another one",
                           m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8]);
}

/* The document's axes count in those of the file, so they replace the directions of the header. They may turn the
 * cloth, but a mirror image makes another cloth of it. */
static status settle_axes(const struct volume_source_info *info, struct reconstruct_option *o,
                          struct file_ledger *ledger, struct error *err)
{
    const bool given = o->axes[0] != '\0';
    if (info->is_oblique) {
        const bool unanswered = is_identity(o->matrix);
        file_ledger_settle(ledger, "directions of axes",
                           unanswered ? "the document has no matrix" : "the document's matrix takes their place");
        if (unanswered) return ask_for_matrix(info, err);
    }
    if (!given) snprintf(o->axes, sizeof o->axes, "%s", info->axes[0] != '\0' ? info->axes : "xyz");
    if (!given || info->axes[0] == '\0' || strcmp(o->axes, info->axes) == 0) return STATUS_OK;
    const bool mirrored = axes_are_mirrored(o->axes) != axes_are_mirrored(info->axes);
    file_ledger_settle(ledger, "directions of axes",
                       mirrored ? "the document's axes take their place, and mirror the cloth"
                                : "the document's axes take their place");
    if (!mirrored || strcmp(info->axes, "xyz") == 0) return STATUS_OK;
    file_ledger_settle(ledger, "directions of axes", contradicted);
    return error_set_field(
        err, STATUS_INVALID, OPTION_AXES,
        "the document's axes '%s' are a mirror image of '%s', which the header says, so S twist would "
        "become Z twist: leave 'axes' out, or reverse one of them",
        o->axes, info->axes);
}

status reconstruct_settle(const struct volume_source_info *info, struct reconstruct_option *o,
                          struct file_ledger *ledger, struct error *err)
{
    status s = settle_voxel_size(info, o, ledger, err);
    if (s == STATUS_OK) s = ask_voxel_size(o, err);
    return s == STATUS_OK ? settle_axes(info, o, ledger, err) : s;
}

void reconstruct_state_padding(const struct volume_source_info *info, const struct scan_look *look,
                               struct file_ledger *ledger)
{
    char text[FILE_STATEMENT_BYTES] = "";
    for (size_t i = 0; i < look->n_padding; i++) {
        const size_t used = strlen(text);
        snprintf(text + used, sizeof text - used, "%s%.9g in %.3g %% of the voxels", i > 0 ? ", " : "",
                 (double)look->padding[i], 100.0 * look->share[i]);
    }
    if (look->n_padding > 0) file_ledger_add(ledger, "padding value", NULL, "%s: unknown, no void", text);
    if (!isnan(info->padding) && !scan_look_is_padding(look, (float)info->padding))
        file_ledger_add(ledger, "stated padding value", "it does not fill the sides of the scan", "%g", info->padding);
}

static status check_values(const struct scan_look *look, struct error *err)
{
    if (look->has_unnumbered)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "the scan has voxels that are no numbers");
    if (!(look->most > look->least))
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "all voxels of the scan have the value %g",
                               look->least);
    return STATUS_OK;
}

status reconstruct_examine(const char *const *path, size_t n_path, struct reconstruct_option *o,
                           struct file_ledger *ledger, struct error *err)
{
    struct volume_source *source = NULL;
    struct scan_look look;
    status s = volume_source_open_declared(path, n_path, &o->raw, &o->part, &source, err);
    if (s != STATUS_OK) return s;
    const struct volume_source_info *info = volume_source_describe(source);
    *ledger = info->ledger;
    s = reconstruct_settle(info, o, ledger, err);
    if (s == STATUS_OK) s = scan_look_take(source, &look, err);
    if (s == STATUS_OK) reconstruct_state_padding(info, &look, ledger);
    if (s == STATUS_OK) s = check_values(&look, err);
    volume_source_close(source);
    return s;
}
