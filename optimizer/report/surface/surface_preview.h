/* Pictures of the method `sheared`: previews of the smooth surface of a bent cloth (renderer/preview/proxy). */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_PREVIEW_H
#define SELVEDGE_OPTIMIZER_SURFACE_PREVIEW_H

#include "optimizer/report/findings/report.h"
#include "optimizer/report/surface/surface_passes.h"
#include "renderer/preview/appearance_table.h"

/* Renders picture i, whose request is q, at once with all its samples; their variances are not known. look: of the flat
 * cloth. Errors of proxy_picture_render. */
status surface_preview_render(const struct report *report, size_t i, const struct appearance_table *look,
                              const struct render_request *q, const struct progress *progress,
                              struct surface_passes *so_far, struct error *err);

#endif
