/* Lamp, camera, lights and ground of a picture, from the document or by the studio
 * (renderer/preview/studio_light.h). */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_VIEW_H
#define SELVEDGE_OPTIMIZER_SURFACE_VIEW_H

#include "optimizer/report/findings/report.h"
#include "renderer/estimate/render.h"

struct job_surface_picture;

struct surface_view {
    struct configuration configuration;
    struct environment *environment; /* of the studio; NULL: the job's, or none */
};

/* The view of picture i, from the document or by its kind. STATUS_NO_MEMORY. Release in any case. */
status surface_view_init(const struct report *report, size_t i, struct surface_view *view, struct error *err);
void surface_view_release(struct surface_view *view);

bool surface_studio_is(const struct job_surface_picture *p);
/* A factor on the lengths of a bent cloth in the studio and of its view, so that thick cloth need not bend tightly. */
double surface_studio_scale(const struct job_surface_picture *p, const struct made_cloth *made);
/* Renders the layer of the ground under the cloth of request q. Errors of studio_ground_render. */
status surface_studio_ground(const struct report *report, const struct render_request *q, double z_mm,
                             const struct progress *progress, struct image *layer, struct error *err);

#endif
