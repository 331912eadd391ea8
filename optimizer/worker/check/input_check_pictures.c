#include "base/files/file_ledger_json.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/worker/check/input_check.h"
#include "renderer/mesh/mesh.h"

#include <stdio.h>

/* Stretches of cloth, or the inverses, from which on the texture coordinates hardly are millimetres of it. */
static const double STRETCH_MOST = 2.0;

static bool is_odd(double stretch) { return !(stretch <= STRETCH_MOST && stretch >= 1.0 / STRETCH_MOST); }

/* Warns of cloth that would be stretched, as by texture coordinates that run from 0 to 1. */
static void check_stretch(struct input_check *c, size_t i, const char *name, const struct mesh *m)
{
    const struct mesh_stretch s = mesh_stretch(m);
    char option[64], text[400];
    if (!is_odd(s.area) && !is_odd(s.along[0]) && !is_odd(s.along[1])) return;
    snprintf(option, sizeof option, OPTION_MESH_FILE "[%zu]", i);
    snprintf(text, sizeof text,
             "mesh '%s': its surface has %.3g times the area of its texture, so the cloth is stretched to %.3g times "
             "its length along u and %.3g along v: texture coordinates (vt) are lengths of cloth in the unit of the "
             "positions; multiply u by %.4g and v by %.4g",
             name, s.area, s.along[0], s.along[1], s.along[0], s.along[1]);
    input_check_warn(c, option, text);
}

void input_check_pictures(struct input_check *c)
{
    for (size_t i = 0; i < c->section.results->n_surface_picture; i++) {
        const struct job_surface_picture *p = &c->section.results->surface_picture[i];
        char path[INPUT_PATH_BYTES];
        struct mesh m = {0};
        struct error fault = {0};
        struct file_ledger ledger = {0};
        if (p->on != JOB_ON_MESH || !input_check_has(c, p->mesh_file)) continue;
        input_check_path(c, p->mesh_file, path);
        if (mesh_read_obj_ledger(path, p->mesh_unit_mm, &m, &ledger, &fault) == STATUS_OK) {
            check_stretch(c, i, p->mesh_file, &m);
            file_ledger_append(c->files, p->mesh_file, &ledger);
        } else {
            snprintf(fault.field, sizeof fault.field, OPTION_MESH_FILE "[%zu]", i);
            input_check_fault(c, &fault);
        }
        mesh_release(&m);
    }
}
