#include "optimizer/stages/scene/mesh_file.h"
#include "base/files/file_ledger_json.h"
#include "base/option_id.h"
#include "renderer/mesh/mesh.h"

#include <stdio.h>

/* Stretches of cloth, or the inverses, from which on the texture coordinates hardly are millimetres of it. */
static const double STRETCH_MOST = 2.0;

static bool is_odd(double stretch) { return !(stretch <= STRETCH_MOST && stretch >= 1.0 / STRETCH_MOST); }

static void warn_stretch(const char *option, const char *name, const struct mesh *m, const struct warning_sink *warn)
{
    const struct mesh_stretch s = mesh_stretch(m);
    if (!is_odd(s.area) && !is_odd(s.along[0]) && !is_odd(s.along[1])) return;
    warning_send(warn, option,
                 "mesh '%s': its surface has %.3g times the area of its texture, so the cloth is stretched to %.3g "
                 "times its length along u and %.3g along v: texture coordinates (vt) are lengths of cloth in the unit "
                 "of the positions; multiply u by %.4g and v by %.4g",
                 name, s.area, s.along[0], s.along[1], s.along[0], s.along[1]);
}

status mesh_file_examine(const char *path, const struct job_surface_picture *picture, size_t i, json_t *files,
                         const struct warning_sink *warn, struct error *err)
{
    char option[64];
    struct mesh m = {0};
    struct file_ledger ledger = {0};
    snprintf(option, sizeof option, OPTION_MESH_FILE "[%zu]", i);
    status s = mesh_read_obj_ledger(path, picture->mesh_unit_mm, &m, &ledger, err);
    if (s == STATUS_OK) {
        warn_stretch(option, picture->mesh_file, &m, warn);
        file_ledger_append(files, picture->mesh_file, &ledger);
    } else if (err != NULL)
        snprintf(err->field, sizeof err->field, OPTION_MESH_FILE "[%zu]", i);
    mesh_release(&m);
    return s == STATUS_OK ? s : error_prefix(err, s, "picture %zu", i + 1);
}
