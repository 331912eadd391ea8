/* A value of a job document for a check of the option table. */
#ifndef SELVEDGE_OPTIMIZER_OPTION_VALUE_H
#define SELVEDGE_OPTIMIZER_OPTION_VALUE_H

#include <jansson.h>

struct job_document;
struct job_option;

/* A value for a check. It and all options of earlier rows have been read. */
struct option_value {
    const struct job_option *row;
    const json_t *value;
    const char *path; /* "photographs[3].crop_px" */
    void *target;
    struct job_document *doc;
};

#endif
