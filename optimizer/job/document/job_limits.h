/* Limits of the job document that other parts of the program share. */
#ifndef SELVEDGE_OPTIMIZER_JOB_LIMITS_H
#define SELVEDGE_OPTIMIZER_JOB_LIMITS_H

#include <stddef.h>

enum {
    JOB_MAX_DOCUMENT_BYTES = 1 << 20,
    JOB_MAX_NAME_BYTES = 128, /* input file names (job_file_name.h) */
    JOB_MAX_SAMPLE_BYTES = 256,
    JOB_MAX_ID_BYTES = 64, /* ids of jobs */
    JOB_MAX_PHOTOGRAPH = 1024,
    JOB_MAX_MORE_EXPOSURES = 15, /* of a photograph */
    JOB_MAX_BOWL_MARK = 100,
    JOB_MAX_BOWL_PHOTOGRAPH = 64,
    JOB_MAX_MODEL = 32 /* more than there are models, so that a job can compare all of them */
};

#endif
