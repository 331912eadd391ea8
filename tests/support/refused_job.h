/* A job folder whose inputs the worker must refuse. Included after cmocka.h. */
#ifndef SELVEDGE_TESTS_REFUSED_JOB_H
#define SELVEDGE_TESTS_REFUSED_JOB_H

#include "optimizer/stages/job_inputs.h"

/* The inputs of the job in the folder `path` are refused with an error of this field. */
static inline void refused_job_check(const char *path, const char *field)
{
    struct worker_folder f;
    struct job_inputs in;
    struct error err = {0};
    assert_int_equal(worker_folder_open(&f, path, NULL), STATUS_OK);
    struct stage_tools tools = {.folder = &f, .warn = {stage_warn, &tools}};
    job_inputs_init(&in);
    assert_int_not_equal(job_inputs_read(&tools, &in, &err), STATUS_OK);
    assert_string_equal(err.field, field);
    job_inputs_release(&in);
    worker_folder_close(&f);
}

#endif
