#include "optimizer/job/job_outline.h"
#include "optimizer/job/checks/job_faults.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_exports.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/job_parse.h"

#include <stdio.h>
#include <stdlib.h>

static void count_file(void *context, const char *name, const char *role)
{
    (void)name, (void)role;
    ++*(size_t *)context;
}

static void add_file(void *context, const char *name, const char *role)
{
    struct job_outline *o = context;
    struct job_outline_file *file = &o->file[o->n_file++];
    snprintf(file->name, sizeof file->name, "%s", name);
    file->role = role;
}

static status take_sections(struct job_sections section, struct job_outline *o, struct error *err)
{
    size_t n = 0;
    *o = (struct job_outline){.n_file = 0};
    snprintf(o->sample, sizeof o->sample, "%s", section.cloth->sample);
    snprintf(o->geometry_job, sizeof o->geometry_job, "%s", section.scan->geometry_job);
    snprintf(o->profile_job, sizeof o->profile_job, "%s", section.fit->profile_job);
    o->export_pdf = section.results->export_pdf;
    o->export_blend = section.results->exported[EXPORT_blender];
    job_sections_visit_files(&section, count_file, &n);
    o->file = calloc(n + 1, sizeof *o->file);
    if (o->file == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the job document: out of memory");
    job_sections_visit_files(&section, add_file, o);
    return STATUS_OK;
}

status job_outline_read(const char *text, size_t n_bytes, struct job_outline *outline, struct error *err)
{
    struct job_document *doc = NULL;
    status s = job_document_parse(text, n_bytes, &doc, err);
    if (s == STATUS_OK) s = take_sections(job_document_sections(doc), outline, err);
    job_document_free(doc);
    return s;
}

status job_outline_take(const json_t *json, struct job_outline *outline, struct error *err)
{
    struct job_document *doc = NULL;
    status s = job_document_read(json, &doc, err);
    if (s == STATUS_OK) s = take_sections(job_document_sections(doc), outline, err);
    job_document_free(doc);
    return s;
}

void job_outline_inspect(const char *text, size_t n_bytes, struct job_outline *outline, struct job_fault_list *list)
{
    struct job_document *doc = NULL;
    struct error fault = {0};
    *outline = (struct job_outline){.n_file = 0};
    job_document_inspect(text, n_bytes, &doc, list);
    if (doc != NULL && take_sections(job_document_sections(doc), outline, &fault) != STATUS_OK)
        job_faults_add(list, &fault);
    job_document_free(doc);
}

void job_outline_release(struct job_outline *outline)
{
    free(outline->file);
    *outline = (struct job_outline){.n_file = 0};
}
