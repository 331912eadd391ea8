/* A job folder whose inputs the worker must refuse. Included after cmocka.h. */
#ifndef SELVEDGE_TESTS_REFUSED_JOB_H
#define SELVEDGE_TESTS_REFUSED_JOB_H

#include "optimizer/worker/pipeline_context.h"

/* The inputs of the job in the folder `path` are refused with an error of this field. */
static inline void refused_job_check(const char *path, const char *field)
{
    struct worker_folder f;
    struct pipeline_context c;
    struct error err = {0};
    assert_int_equal(worker_folder_open(&f, path, NULL), STATUS_OK);
    pipeline_context_init(&c);
    c.folder = &f;
    assert_int_not_equal(pipeline_read_inputs(&c, &err), STATUS_OK);
    assert_string_equal(err.field, field);
    pipeline_context_release(&c);
    worker_folder_close(&f);
}

#endif
