/* Tables of light transport for the pictures of a job that are rendered by them (renderer/fast). */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_TABLES_H
#define SELVEDGE_OPTIMIZER_SURFACE_TABLES_H

#include "optimizer/worker/pipeline_context.h"
#include "renderer/fast/fast_option.h"

struct surface_tables {
    struct fast_tables tables;
    bool present; /* false: no picture asks for tables, or the model's fibers are flat, which a warning says */
};

/* Share of the pictures' time that the tables are expected to take; 0 when no picture asks for them. */
double surface_tables_share(const struct pipeline_context *c);
/* Reads the tables of the best model from the job's folder, work/report/fast.tables, if those of this cloth with these
 * parameters are there, and makes and keeps them otherwise. Errors of fast_precompute and fast_tables_write. */
status surface_tables_get(struct pipeline_context *c, const struct progress *progress, struct surface_tables *t,
                          struct error *err);
void surface_tables_release(struct surface_tables *t);
/* What a picture renders with; false: path by path. */
bool surface_tables_option(const struct surface_tables *t, const struct job_surface_picture *p,
                           struct fast_option *option);

#endif
