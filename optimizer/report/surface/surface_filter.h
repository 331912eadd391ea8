/* The filtered view of a picture for the eye (renderer/preview): pictures/on-<number>-filtered.png. */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_FILTER_H
#define SELVEDGE_OPTIMIZER_SURFACE_FILTER_H

#include "optimizer/report/findings/report.h"
#include "optimizer/report/surface/surface_ground.h"
#include "optimizer/report/surface/surface_passes.h"
#include "optimizer/report/surface/surface_tables.h"

struct surface_filter {
    struct image feature; /* seen by the pixels; without pixels: the picture is not filtered */
};

/* Renders the features of picture i, whose request is q, if the document asks for a filtered view. Pictures of volumes
 * have none, which a warning says. Errors of feature_image_render. Release in any case. */
status surface_filter_init(const struct report *report, size_t i, const struct render_request *q,
                           const struct surface_tables *tables, const struct progress *progress,
                           struct surface_filter *filter, struct error *err);
void surface_filter_release(struct surface_filter *filter);
/* Filters the picture so far, which is of the cloth alone, adds the filtered ground, and writes it. *entry: an object
 * for "filtered" of the picture's entry, or NULL if the picture is not filtered. */
status surface_filter_write(const struct report *report, const struct surface_filter *filter,
                            const struct surface_ground *ground, const struct surface_passes *so_far, double exposure,
                            json_t **entry, struct error *err);

#endif
