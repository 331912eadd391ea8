/* The stage table: one list for the resume points and the API's names of the stages. */
#ifndef SELVEDGE_OPTIMIZER_STAGE_TABLE_H
#define SELVEDGE_OPTIMIZER_STAGE_TABLE_H

#include "optimizer/job/document/job_sections.h"

#include <stdbool.h>
#include <stddef.h>

struct pipeline_stage_info {
    const char *name;  /* "volume", "orientation", "fibers", "directions", "scene", "fit", "validation", "report" */
    const char *title; /* for people */
    double weight;     /* share of the time of a typical job; the weights sum to 1 */
    bool of_scan;      /* skipped when the job gives fibers */
    bool of_model;     /* skipped when the job ends with the geometry */
    bool of_fit;       /* skipped when the job has no measurements */
    bool of_profile;   /* done for the profile of a fiber; such a job skips the others */
};

/* Constant data; the daemon links it without the code that computes. */
const struct pipeline_stage_info *pipeline_stage_table(size_t *n_stage);
/* Whether a job of this kind, with a scan or without one, has the stage. */
bool pipeline_stage_applies(const struct pipeline_stage_info *stage, enum job_kind kind, bool has_scan);

#endif
