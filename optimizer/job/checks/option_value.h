/* A value of a job document for a check of the option table. */
#ifndef SELVEDGE_OPTIMIZER_OPTION_VALUE_H
#define SELVEDGE_OPTIMIZER_OPTION_VALUE_H

#include <jansson.h>

#include "optimizer/job/document/job_sections.h"

struct job_option;

/* A value for a check. It and all options of earlier rows have been read. */
struct option_value {
    const struct job_option *row;
    const json_t *value;
    const char *path; /* "photographs[3].crop_px" */
    void *target;
    void *own; /* the section struct that target is in, which a check may complete */
    const struct job_sections *section;
};

#endif
