#include "optimizer/report/surface/surface_cloth.h"
#include "base/files/durable.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/surface/surface_view.h"
#include "renderer/mesh/mesh_curves.h"
#include "renderer/mesh/mesh_drape.h"
#include "renderer/mesh/mesh_shapes.h"
#include "renderer/quick/diffusion_tables.h"
#include "renderer/scene/scene_ray.h"
#include "renderer/transport/volume/volume_bent.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Cells of a cylinder's mesh around all of it: chords are 1e-5 of the radius from the circle. */
enum { CYLINDER_CELLS = 720 };

/* The number of the first picture whose drape has the same shape: by the radius over the size. */
static size_t first_of_drape(const struct job_results *results, size_t i)
{
    const struct job_surface_picture *p = results->surface_picture;
    for (size_t k = 0; k < i; k++)
        if (p[k].on == JOB_ON_DRAPE && surface_studio_is(&p[k]) == surface_studio_is(&p[i]) &&
            fabs(p[k].radius_mm * p[i].size_mm - p[i].radius_mm * p[k].size_mm) <= 1e-9 * p[i].radius_mm * p[k].size_mm)
            return k;
    return i;
}

/* A drape is computed once and kept as a mesh file among the results, from which it is read, so that every attempt and
 * whoever uses the file elsewhere have the same one. */
static status make_drape(const struct surface_input *on, size_t i, struct mesh *m, struct error *err)
{
    const struct job_surface_picture *p = &on->results->surface_picture[i];
    const double scale = surface_studio_scale(p, on->made);
    char path[WORKER_PATH_BYTES], name[64], *text = NULL;
    size_t n_bytes;
    worker_folder_path(on->tools->folder, JOB_FOLDER_RESULTS, "pictures", path);
    status s = durable_make_folder(path, err);
    const size_t first = first_of_drape(on->results, i);
    const struct job_surface_picture *p0 = &on->results->surface_picture[first];
    if (p->name != NULL) /* that of no document */
        snprintf(name, sizeof name, "report/%s.obj", p->name);
    else
        snprintf(name, sizeof name, "pictures/on-%zu.obj", first + 1);
    worker_folder_path(on->tools->folder, p->name != NULL ? JOB_FOLDER_WORK : JOB_FOLDER_RESULTS, name, path);
    if (s == STATUS_OK && access(path, F_OK) != 0) {
        struct progress silent = progress_silent(&on->tools->progress);
        s = mesh_drape(scale * p0->size_mm, scale * p0->radius_mm, &silent, m, err);
        if (s == STATUS_OK) s = mesh_obj_text(m, &text, &n_bytes, err);
        if (s == STATUS_OK) s = worker_folder_replace(on->tools->folder, path, text, n_bytes, err);
        free(text);
        mesh_release(m);
    }
    return s == STATUS_OK ? mesh_read_obj(path, p->size_mm / p0->size_mm, m, err) : s;
}

/* The innermost turn of a roll and the way between turns, over the thickness of the cloth. */
static const double core_thicknesses = 4.0, pitch_thicknesses = 1.06;
static const double least_core_mm = 2.0, tail_share = 2.2; /* of the radius */
static const double fold_rad = 1.15;
enum { N_FOLD = 4 };

static status make_roll(const struct surface_input *on, const struct job_surface_picture *p, struct mesh *m,
                        struct error *err)
{
    const double scale = surface_studio_scale(p, on->made), radius_mm = scale * p->radius_mm;
    const double thickness_mm = on->made->scene != NULL ? scene_thickness_mm(on->made->scene)
                                                        : volume_scene_thickness_mm(&on->made->volume_scene);
    return mesh_roll_make(&(struct mesh_roll){.radius_mm = radius_mm,
                                              .core_mm = fmax(least_core_mm, core_thicknesses * thickness_mm),
                                              .pitch_mm = fmax(pitch_thicknesses * thickness_mm, 0.02 * radius_mm),
                                              .tail_mm = tail_share * radius_mm,
                                              .length_mm = scale * p->size_mm},
                          m, err);
}

static status make_folds(const struct surface_input *on, const struct job_surface_picture *p, struct mesh *m,
                         struct error *err)
{
    const double scale = surface_studio_scale(p, on->made);
    return mesh_folds_make(&(struct mesh_folds){.width_mm = 1.35 * scale * p->size_mm,
                                                .height_mm = scale * p->size_mm,
                                                .angle_rad = fold_rad,
                                                .n_fold = N_FOLD},
                           m, err);
}

static status make_mesh(const struct surface_input *on, size_t i, struct mesh *m, struct error *err)
{
    const struct job_surface_picture *p = &on->results->surface_picture[i];
    char path[WORKER_PATH_BYTES];
    switch (p->on) {
    case JOB_ON_CYLINDER:
        return mesh_cylinder(p->radius_mm, p->size_mm, p->wrap_deg * M_PI / 360.0,
                             (size_t)ceil(CYLINDER_CELLS * p->wrap_deg / 360.0), m, err);
    case JOB_ON_FLAT:
        return mesh_flat((const double[2]){p->size_mm, p->size_mm}, (const size_t[2]){1, 1}, m, err);
    case JOB_ON_DRAPE:
        return make_drape(on, i, m, err);
    case JOB_ON_ROLL:
        return make_roll(on, p, m, err);
    case JOB_ON_FOLD:
        return make_folds(on, p, m, err);
    default:
        worker_folder_path(on->tools->folder, JOB_FOLDER_INPUT, p->mesh_file, path);
        return mesh_read_obj(path, p->mesh_unit_mm, m, err);
    }
}

/* The picture's name before the error. Makes the field of the surface, where it has none yet: the mesh or the
 * radius. */
static status name_picture(size_t i, enum job_surface on, status s, struct error *err)
{
    if (s == STATUS_OK || s == STATUS_CANCELLED || err == NULL) return s;
    const bool of_document = (s == STATUS_INVALID || s == STATUS_FORMAT) && err->field[0] == '\0';
    if (of_document && on == JOB_ON_MESH)
        snprintf(err->field, sizeof err->field, OPTION_MESH_FILE "[%zu]", i);
    else if (of_document && on != JOB_ON_FLAT)
        snprintf(err->field, sizeof err->field, OPTION_PICTURE_RADIUS "[%zu]", i);
    return error_prefix(err, s, "picture %zu", i + 1);
}

status surface_cloth_init(const struct surface_input *on, size_t i, const struct scene *fibers,
                          struct surface_cloth *cloth, struct error *err)
{
    const struct job_surface_picture *p = &on->results->surface_picture[i];
    const bool black_sheet = p->black_sheet < 0 ? on->setup->black_sheet : p->black_sheet != 0;
    struct mesh m = {0};
    memset(cloth, 0, sizeof *cloth);
    status s = make_mesh(on, i, &m, err);
    if (s == STATUS_OK && fibers != NULL) s = scene_bend(fibers, &m, black_sheet, &cloth->fibers, err);
    if (s == STATUS_OK && fibers == NULL)
        s = volume_scene_bend(&on->made->volume_scene, &m, black_sheet, &cloth->volume, err);
    mesh_release(&m);
    return name_picture(i, p->on, s, err);
}

void surface_cloth_release(struct surface_cloth *cloth)
{
    scene_free(cloth->fibers);
    if (cloth->volume.bent != NULL) volume_scene_release(&cloth->volume);
    memset(cloth, 0, sizeof *cloth);
}

static double *point_from(double theta_deg, double phi_deg, double distance_mm, double p[3])
{
    double theta = theta_deg * M_PI / 180.0, phi = phi_deg * M_PI / 180.0;
    p[0] = distance_mm * sin(theta) * cos(phi);
    p[1] = distance_mm * sin(theta) * sin(phi);
    p[2] = distance_mm * cos(theta);
    return p;
}

/* The picture would show the inside of the cloth: an error. Parts that run through each other are a warning. */
static status check_surface(const struct surface_input *on, size_t i, const struct scene *bent, struct error *err)
{
    const struct job_setup *d = on->setup;
    const struct job_surface_picture *p = &on->results->surface_picture[i];
    const double mm_per_cm = 10.0;
    double at[3];
    if (p->method == JOB_PICTURE_DIFFUSION) {
        status s = diffusion_check_pile(on->made->scene, NULL, err);
        if (s == STATUS_INVALID && err != NULL)
            snprintf(err->field, sizeof err->field, OPTION_PICTURE_METHOD "[%zu]", i);
        if (s != STATUS_OK) return s;
    }
    if (surface_studio_is(p)) return STATUS_OK;
    point_from(p->camera_theta_deg, p->camera_phi_deg - p->cloth_rotation_deg, mm_per_cm * d->camera_distance_cm, at);
    if (!d->camera_far_field && scene_encloses(bent, at))
        return error_set(err, STATUS_INVALID,
                         "the camera, %g cm from the orbit center, stands inside the cloth: move the mesh, or the "
                         "camera",
                         d->camera_distance_cm);
    point_from(p->light_theta_deg, p->light_phi_deg - p->cloth_rotation_deg, mm_per_cm * d->lamp_distance_cm, at);
    if (!d->lamp_directional && isnan(p->lamp_sharpness) && scene_encloses(bent, at))
        return error_set(err, STATUS_INVALID,
                         "the lamp, %g cm from the orbit center, stands inside the cloth: move the mesh, or the "
                         "lamp",
                         d->lamp_distance_cm);
    if (p->on == JOB_ON_MESH && scene_crosses_itself(bent, at))
        worker_status_warn(
            on->tools->status,
            "picture %zu: parts of the mesh run through each other over the thickness of the cloth, as at "
            "(%.3g, %.3g, %.3g) mm; what is shown there is no cloth",
            i + 1, at[0], at[1], at[2]);
    return STATUS_OK;
}

status surface_cloth_check(const struct surface_input *on, struct error *err)
{
    status s = STATUS_OK;
    for (size_t i = 0; i < on->results->n_surface_picture && on->made->scene != NULL && s == STATUS_OK; i++) {
        struct surface_cloth cloth;
        s = surface_cloth_init(on, i, on->made->scene, &cloth, err);
        if (s == STATUS_OK)
            s = name_picture(i, on->results->surface_picture[i].on, check_surface(on, i, cloth.fibers, err), err);
        surface_cloth_release(&cloth);
    }
    return s;
}
