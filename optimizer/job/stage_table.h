/* The stage table: one list for the resume points and the API's names of the stages. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_H
#define SELVEDGE_OPTIMIZER_PIPELINE_H

#include <stddef.h>

struct pipeline_context; /* inside the worker */

struct pipeline_stage_info {
    const char *name;  /* "volume", "orientation", "fibers", "directions", "scene", "fit", "validation", "report" */
    const char *title; /* for people */
    double weight;     /* share of the time of a typical job; the weights sum to 1 */
};

/* Constant data; the daemon links it without the code that computes. */
const struct pipeline_stage_info *pipeline_stage_table(size_t *n_stage);

#endif
