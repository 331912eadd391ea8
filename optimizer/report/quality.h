/* The quality report of a job's geometry: results/quality.json for programs, and results/quality.html for people, with
 * quality.css and pictures/ (fiber-lengths.svg, top.png, the slices). The page has no inline styles or scripts, because
 * the server's content security policy forbids them. */
#ifndef SELVEDGE_OPTIMIZER_QUALITY_H
#define SELVEDGE_OPTIMIZER_QUALITY_H

#include "optimizer/report/findings/report.h"
#include "optimizer/report/geometry/fiber_lengths.h"

#include <stdio.h>

/* Writes all files of the report. Call it after result_geometry_write, which makes the slices. */
status quality_write(struct report *report, struct error *err);
/* Writes quality.html to out. */
void quality_page(struct report *report, const struct fiber_lengths *l, FILE *out);

#endif
