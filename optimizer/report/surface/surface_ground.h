/* The plane under the cloth of a picture, with the cloth's shadow (renderer/preview/ground_shadow.h). */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_GROUND_H
#define SELVEDGE_OPTIMIZER_SURFACE_GROUND_H

#include "optimizer/report/findings/report.h"
#include "optimizer/report/surface/surface_passes.h"

struct surface_ground {
    bool present;
    bool sheared; /* filtered is by sheared filtering; of a directional lamp it is layer */
    double z_mm;
    struct image layer;    /* rgb and variances, of as many samples as the picture has in the end */
    struct image filtered; /* rgb; without pixels: no filtered view is wanted */
};

/* Renders the plane of picture i, whose request is q, if the document asks for one. Pictures of volumes have none,
 * which a warning says. Errors of ground_render. Release in any case. */
status surface_ground_init(const struct report *report, size_t i, const struct render_request *q,
                           const struct progress *progress, struct surface_ground *ground, struct error *err);
void surface_ground_release(struct surface_ground *ground);
/* The picture so far with the plane. shown: a copy, to be released with surface_passes_release. STATUS_NO_MEMORY. */
status surface_ground_add(const struct surface_ground *ground, const struct surface_passes *so_far,
                          struct surface_passes *shown, struct error *err);
/* Adds the plane to a filtered view of the cloth. */
void surface_ground_add_filtered(const struct surface_ground *ground, struct image *view);

#endif
