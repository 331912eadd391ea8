/* The quality report of a job's geometry: results/quality.json, and for people results/quality.html with quality.css and pictures/
 * (fiber-lengths.svg, top.png, the slices). Nothing in the page is inline, so that the server's content security policy lets it through. */
#ifndef SELVEDGE_OPTIMIZER_QUALITY_H
#define SELVEDGE_OPTIMIZER_QUALITY_H

#include "optimizer/worker/pipeline_context.h"
#include "optimizer/worker/report/fiber_lengths.h"

#include <stdio.h>

/* All files; after result_geometry_write has made the slices. */
status quality_write(struct pipeline_context *c, struct error *err);
/* The page alone (quality_page.c). */
void quality_page(struct pipeline_context *c, const struct fiber_lengths *l, FILE *out);

#endif
