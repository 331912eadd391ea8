/* The filtered view of a picture for the eye (renderer/preview): pictures/on-<number>-filtered.png. */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_FILTER_H
#define SELVEDGE_OPTIMIZER_SURFACE_FILTER_H

#include "optimizer/report/findings/report.h"
#include "optimizer/report/surface/surface_ground.h"
#include "optimizer/report/surface/surface_passes.h"
#include "optimizer/report/surface/surface_tables.h"
#include "renderer/estimate/render_guides.h"

struct surface_filter {
    struct render_guides guides; /* without features: the picture is not filtered */
};

/* Renders the guides of picture i, whose request is q, if the document asks for a filtered view. Pictures of volumes
 * have none, which a warning says. Errors of render_guides_make. Release in any case. */
status surface_filter_init(const struct report *report, size_t i, const struct render_request *q,
                           const struct surface_tables *tables, const struct progress *progress,
                           struct surface_filter *filter, struct error *err);
void surface_filter_release(struct surface_filter *filter);
/* Returns whether the picture so far can be filtered: the document asks for it, and there are two samples to compare.
 */
bool surface_filter_can(const struct surface_filter *filter, const struct surface_passes *so_far);
/* The picture so far, filtered. out, error: of joint_filter, as are the errors. */
status surface_filter_view(const struct report *report, const struct surface_filter *filter,
                           const struct surface_passes *so_far, struct image *out, double *error, struct error *err);
/* Filters the picture so far, which is of the cloth alone and has two samples or more, adds the filtered ground, and
 * writes it. *entry: an object for "filtered" of the picture's entry, or NULL if the picture is not filtered yet. */
status surface_filter_write(const struct report *report, const struct surface_filter *filter,
                            const struct surface_ground *ground, const struct surface_passes *so_far, double exposure,
                            json_t **entry, struct error *err);

#endif
