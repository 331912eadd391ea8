/* The stage table: one list gives resume points, progress weights, the API's stage names and the picture in the README.
 */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_H
#define SELVEDGE_OPTIMIZER_PIPELINE_H

#include <stddef.h>

struct pipeline_context; /* inside the worker */

struct pipeline_stage_info {
    const char *name;  /* "volume", "orientation", "fibers", "directions", "scene", "fit", "validation", "report" */
    const char *title; /* for people */
    double weight;     /* share of the whole job's time, sums to 1 */
};

/* Pure data: the daemon links it without the computing parts. */
const struct pipeline_stage_info *pipeline_stage_table(size_t *n_stage);

#endif
