#include "base/option_id.h"
#include "optimizer/job/document/job_document.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/worker/check/input_check.h"
#include "renderer/mesh/mesh.h"

#include <stdio.h>

void input_check_pictures(struct input_check *c)
{
    for (size_t i = 0; i < c->doc->results->n_surface_picture; i++) {
        const struct job_surface_picture *p = &c->doc->results->surface_picture[i];
        char path[INPUT_PATH_BYTES];
        struct mesh m = {0};
        struct error fault = {0};
        if (p->on != JOB_ON_MESH || !input_check_has(c, p->mesh_file)) continue;
        input_check_path(c, p->mesh_file, path);
        if (mesh_read_obj(path, p->mesh_unit_mm, &m, &fault) != STATUS_OK) {
            snprintf(fault.field, sizeof fault.field, OPTION_MESH_FILE "[%zu]", i);
            input_check_fault(c, &fault);
        }
        mesh_release(&m);
    }
}
