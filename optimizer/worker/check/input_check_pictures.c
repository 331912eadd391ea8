#include "optimizer/job/document/job_results.h"
#include "optimizer/stages/scene/mesh_file.h"
#include "optimizer/worker/check/input_check.h"

void input_check_pictures(struct input_check *c)
{
    const struct warning_sink warn = {input_check_warn, c};
    for (size_t i = 0; i < c->section.results->n_surface_picture; i++) {
        const struct job_surface_picture *p = &c->section.results->surface_picture[i];
        char path[INPUT_PATH_BYTES];
        struct error fault = {0};
        if (p->on != JOB_ON_MESH || !input_check_has(c, p->mesh_file)) continue;
        input_check_path(c, p->mesh_file, path);
        if (mesh_file_examine(path, p, i, c->files, &warn, &fault) != STATUS_OK) input_check_fault(c, &fault);
    }
}
