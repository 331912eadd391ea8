#include "optimizer/worker/report/surface/surface_cloth.h"
#include "base/option_id.h"
#include "geometry/mesh/mesh_shapes.h"
#include "optimizer/job/job_folder.h"

#include <math.h>
#include <stdio.h>

/* Cells of a cylinder's mesh around half of it: chords are 1e-5 of the radius from the circle. */
enum { CYLINDER_CELLS = 360 };

static status make_mesh(const struct pipeline_context *c, const struct job_surface_picture *p, struct mesh *m,
                        struct error *err)
{
    char path[WORKER_PATH_BYTES];
    if (p->on == JOB_ON_CYLINDER) return mesh_cylinder(p->radius_mm, p->size_mm, 0.5 * M_PI, CYLINDER_CELLS, m, err);
    if (p->on == JOB_ON_FLAT)
        return mesh_flat((const double[2]){p->size_mm, p->size_mm}, (const size_t[2]){1, 1}, m, err);
    worker_folder_path(c->folder, JOB_FOLDER_INPUT, p->mesh_file, path);
    return mesh_read_obj(path, p->mesh_unit_mm, m, err);
}

/* The picture's name before the error, and the option of its mesh, if it has one, as the field. */
static status name_picture(size_t i, enum job_surface on, status s, struct error *err)
{
    if (s == STATUS_OK || s == STATUS_CANCELLED || err == NULL) return s;
    if (on == JOB_ON_MESH && (s == STATUS_INVALID || s == STATUS_FORMAT))
        snprintf(err->field, sizeof err->field, OPTION_MESH_FILE "[%zu]", i);
    return error_prefix(err, s, "picture %zu", i + 1);
}

status surface_cloth_new(const struct pipeline_context *c, size_t i, struct scene **bent, struct error *err)
{
    struct mesh m = {0};
    status s = make_mesh(c, &c->doc->surface_picture[i], &m, err);
    if (s == STATUS_OK) s = scene_bend(c->scene, &m, bent, err);
    mesh_release(&m);
    return name_picture(i, c->doc->surface_picture[i].on, s, err);
}

status surface_cloth_check(const struct pipeline_context *c, struct error *err)
{
    status s = STATUS_OK;
    for (size_t i = 0; i < c->doc->n_surface_picture && c->scene != NULL && s == STATUS_OK; i++) {
        struct scene *bent = NULL;
        s = surface_cloth_new(c, i, &bent, err);
        scene_free(bent);
    }
    return s;
}
