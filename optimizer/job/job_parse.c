#include "optimizer/job/job_parse.h"
#include "base/catalogue/cloth_description.h"
#include "base/files/json_depth.h"
#include "base/files/json_text.h"
#include "optimizer/job/checks/job_document_parts.h"
#include "optimizer/job/checks/job_faults.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_fit_option.h"
#include "optimizer/job/options/option_reader.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void fill_nan(double *v, size_t n)
{
    for (size_t i = 0; i < n; i++) v[i] = NAN;
}

/* A document with the defaults of all options. */
static status document_new(struct job_document **doc, struct error *err)
{
    struct job_document *d = job_document_new();
    if (d == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the job document: out of memory");
    *doc = d;
    d->fit->n_model = 1;
    for (size_t i = 0; i < JOB_MAX_MODEL; i++) {
        fill_nan(d->fit->model[i].fixed, JOB_MAX_PARAM);
        fill_nan(d->fit->model[i].start, JOB_MAX_PARAM);
        job_fit_option_init(&d->fit->model[i].option);
    }
    return job_options_default(d, err);
}

/* The text as JSON; NULL with an error. */
static json_t *read_json(const char *text, size_t n_bytes, struct error *err)
{
    if (n_bytes > JOB_MAX_DOCUMENT_BYTES) {
        error_set(err, STATUS_TOO_LARGE, "the job document has %zu bytes, the limit is %d", n_bytes,
                  JOB_MAX_DOCUMENT_BYTES);
        return NULL;
    }
    if (json_depth_check(text, n_bytes, "the job document", err) != STATUS_OK) return NULL;
    return json_text_parse(text, n_bytes, "the job document", err);
}

status job_document_parse(const char *text, size_t n_bytes, struct job_document **doc, struct error *err)
{
    struct error fault = {0};
    json_t *json = read_json(text, n_bytes, &fault);
    status s = json != NULL ? job_document_read(json, doc, &fault) : fault.code;
    json_decref(json);
    if (s != STATUS_OK && err != NULL) *err = fault;
    return s;
}

status job_document_read(const json_t *json, struct job_document **doc, struct error *err)
{
    struct job_document *d = NULL;
    struct error fault = {0};
    status s = document_new(&d, &fault);
    if (s == STATUS_OK) s = job_options_read(json, d, NULL, &fault);
    if (s == STATUS_OK)
        *doc = d;
    else {
        if (err != NULL) *err = fault;
        job_document_free(d);
    }
    return s;
}

void job_document_inspect(const char *text, size_t n_bytes, struct job_document **doc, struct job_fault_list *list)
{
    struct error fault = {0};
    json_t *json = read_json(text, n_bytes, &fault);
    *doc = NULL;
    status s = json != NULL ? document_new(doc, &fault) : fault.code;
    if (s == STATUS_OK) s = job_options_read(json, *doc, list, &fault);
    json_decref(json);
    if (s != STATUS_OK) job_faults_add(list, &fault);
}

status job_parse_cloth(const json_t *section, struct cloth_description *cloth, struct error *err)
{
    struct job_document *doc = NULL;
    json_t *json =
        json_pack("{s:s, s:O, s:{s:s}}", "sample", "described", "cloth", section, "measurements", "file", "none.csv");
    if (json == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the section 'cloth': out of memory");
    status s = job_document_read(json, &doc, err);
    if (s == STATUS_OK) *cloth = *doc->cloth->description;
    job_document_free(doc);
    json_decref(json);
    return s;
}
