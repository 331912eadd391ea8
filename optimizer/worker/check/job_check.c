#include "optimizer/worker/check/job_check.h"
#include "base/files/alike_name.h"
#include "base/files/durable.h"
#include "base/option_id.h"
#include "base/process.h"
#include "optimizer/job/checks/job_faults.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/job_parse.h"
#include "optimizer/worker/check/input_check.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

/* The file exists, is a file and has content. */
static void look_for(void *context, const char *name, const char *role)
{
    struct input_check *c = context;
    char path[INPUT_PATH_BYTES];
    struct stat file;
    struct error fault = {0};
    input_check_path(c, name, path);
    c->n_file++;
    if (name[0] == '\0') return; /* a fault of the document */
    if (stat(path, &file) != 0) {
        char hint[400];
        alike_name_hint(c->folder, name, hint, sizeof hint);
        error_set_field(&fault, STATUS_NOT_FOUND, name, "input file '%s' (%s) does not exist in '%s'%s", name, role,
                        c->folder, hint);
    } else if (!S_ISREG(file.st_mode))
        error_set_field(&fault, STATUS_INVALID, name, "input '%s' (%s) is not a regular file", name, role);
    else if (file.st_size == 0)
        error_set_field(&fault, STATUS_INVALID, name, "input file '%s' (%s) is empty", name, role);
    if (fault.code != STATUS_OK) job_faults_add(c->fault, &fault);
}

/* Warns of a PDF that this machine cannot make. */
static void check_pdf(struct input_check *c)
{
    char folder[INPUT_PATH_BYTES];
    if (c->section.results->export_pdf && !program_find(JOB_PDF_PROGRAM, folder, sizeof folder))
        input_check_warn(c, OPTION_REPORT_PDF,
                         "report.pdf will not be made: this machine has no program '" JOB_PDF_PROGRAM
                         "' (Debian package " JOB_PDF_PROGRAM ")");
}

static json_t *report_of(struct input_check *c)
{
    return json_pack("{s:o, s:o, s:o, s:I}", "faults", job_faults_json(c->fault), "warnings", c->warnings, "files",
                     c->files, "n_file", (json_int_t)c->n_file);
}

status job_check(const char *path, const char *folder, json_t **report, struct error *err)
{
    char *text = NULL;
    size_t n = 0;
    struct input_check c = {.folder = folder};
    struct job_document *doc = NULL;
    status s = file_read_all(path, JOB_MAX_DOCUMENT_BYTES, &text, &n, err);
    if (s != STATUS_OK) return s;
    c.fault = calloc(1, sizeof *c.fault);
    c.warnings = json_array();
    c.files = json_array();
    if (c.fault == NULL || c.warnings == NULL || c.files == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot check '%s': out of memory", path);
        json_decref(c.warnings);
        json_decref(c.files);
        goto out;
    }
    job_document_inspect(text, n, &doc, c.fault);
    if (doc != NULL) {
        c.section = job_document_sections(doc);
        c.setup = doc->setup;
        c.rows = doc->rows;
        job_sections_visit_files(&c.section, look_for, &c);
        input_check_cloth(&c);
        input_check_rows(&c);
        input_check_pictures(&c);
        check_pdf(&c);
    }
    *report = report_of(&c);
out:
    job_document_free(doc);
    free(c.fault);
    free(text);
    return s;
}
