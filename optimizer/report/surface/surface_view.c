#include "optimizer/report/surface/surface_view.h"
#include "base/angle.h"
#include "optimizer/job/document/job_results.h"
#include "renderer/fast/fast_tables.h"
#include "renderer/preview/studio_ground.h"
#include "renderer/preview/studio_light.h"
#include "renderer/scene/scene_ray.h"
#include "renderer/transport/environment.h"
#include "renderer/transport/volume/volume_scene.h"

#include <math.h>
#include <string.h>

static const double mm = 1e-3, thick_mm = 0.8, camera_widths = 7.0; /* distance of the camera over the width */
enum { GROUND_RAYS = 25 };                                          /* of a pixel at the border of the cloth */

bool surface_studio_is(const struct job_surface_picture *p) { return p->kind != JOB_KIND_MEASUREMENT; }

double surface_studio_scale(const struct job_surface_picture *p, const struct made_cloth *made)
{
    if (!surface_studio_is(p) || p->on == JOB_ON_FLAT) return 1.0;
    const double thickness_mm =
        made->scene != NULL ? scene_thickness_mm(made->scene) : volume_scene_thickness_mm(&made->volume_scene);
    return fmax(1.0, thickness_mm / thick_mm);
}

static enum studio_kind light_of(const struct job_surface_picture *p)
{
    return p->kind == JOB_KIND_LIT_THROUGH ? STUDIO_LIGHT_TABLE
           : p->on == JOB_ON_FLAT          ? STUDIO_ON_GROUND
                                           : STUDIO_ABOVE_GROUND;
}

status surface_view_init(const struct report *report, size_t i, struct surface_view *view, struct error *err)
{
    const struct job_surface_picture *p = &report->in.results->surface_picture[i];
    struct configuration *c = &view->configuration;
    memset(view, 0, sizeof *view);
    c->crop_aspect = 1.0;
    if (surface_studio_is(p)) {
        const double width_mm = p->width_mm * surface_studio_scale(p, report->in.made);
        c->crop_m = mm * width_mm;
        c->camera_distance_m = camera_widths * c->crop_m;
        c->camera_theta_rad = p->camera_theta_deg * RAD_PER_DEG;
        c->camera_phi_rad = p->camera_phi_deg * RAD_PER_DEG;
        c->cloth_rotation_rad = p->cloth_rotation_deg * RAD_PER_DEG;
        return studio_light_set(light_of(p), c, &view->environment, err);
    }
    *c = observation_configuration(report->in.job->setup, p->light_theta_deg, p->light_phi_deg, p->camera_theta_deg,
                                   p->camera_phi_deg, p->cloth_rotation_deg);
    c->crop_m = mm * p->width_mm;
    c->crop_aspect = 1.0;
    c->aperture_m = mm * p->aperture_mm;
    c->focus_m = isnan(p->focus_mm) ? 0.0 : mm * p->focus_mm;
    c->environment = report->in.job->rows->environment;
    if (!isnan(p->lamp_sharpness)) {
        c->light = LIGHT_GAUSSIAN;
        c->light_sharpness = p->lamp_sharpness;
    }
    return STATUS_OK;
}

void surface_view_release(struct surface_view *view) { environment_free(view->environment); }

status surface_studio_ground(const struct report *report, const struct render_request *q, double z_mm,
                             const struct progress *progress, struct image *layer, struct error *err)
{
    const struct ground_request g = {.scene = q->input.scene.fibers,
                                     .configuration = q->configuration,
                                     .z_mm = z_mm,
                                     .albedo = STUDIO_GROUND_ALBEDO,
                                     .through = q->input.fast != NULL ? q->input.fast->tables->deep.through : NULL,
                                     .width = q->width,
                                     .height = q->height,
                                     .n_sample = GROUND_RAYS,
                                     .seed = q->seed,
                                     .stream = q->stream};
    return studio_ground_render(&g, report->in.job->tools->pool, progress, layer, err);
}
