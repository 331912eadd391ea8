#include "optimizer/job/document/job_document.h"
#include "optimizer/job/document/picture_words.h"
#include "optimizer/job/job_parse.h"
#include "optimizer/tools/camera/camera_commands.h"

#include "base/files/durable.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static struct camera_option *find(struct camera_option *option, size_t n_option, const char *name)
{
    for (size_t i = 0; i < n_option; i++)
        if (strcmp(option[i].name, name) == 0) return &option[i];
    return NULL;
}

status camera_options_parse(int argc, char **argv, struct camera_option *option, size_t n_option, struct error *err)
{
    struct camera_option *now = find(option, n_option, "");
    for (int i = 1; i < argc; i++) {
        if (strncmp(argv[i], "--", 2) == 0) {
            now = find(option, n_option, argv[i] + 2);
            if (now == NULL || argv[i][2] == '\0')
                return error_set(err, STATUS_INVALID, "unknown option '%s'", argv[i]);
            if (now->n > 0) return error_set(err, STATUS_INVALID, "'%s' is given twice", argv[i]);
            continue;
        }
        if (now == NULL) return error_set(err, STATUS_INVALID, "unexpected word '%s'", argv[i]);
        if (now->n == now->most)
            return error_set(err, STATUS_INVALID, "'--%s' takes %zu words at most", now->name, now->most);
        if (now->n++ == 0) now->word = (const char *const *)&argv[i];
    }
    for (size_t i = 0; i < n_option; i++)
        if (option[i].n < option[i].least)
            return error_set(err, STATUS_INVALID, "%s%s needs at least %zu words",
                             option[i].name[0] != '\0' ? "--" : "",
                             option[i].name[0] != '\0' ? option[i].name : "the command", option[i].least);
    return STATUS_OK;
}

status camera_option_number(const struct camera_option *o, double *out, struct error *err)
{
    *out = NAN;
    if (o->n == 0) return STATUS_OK;
    char *end;
    *out = strtod(o->word[0], &end);
    if (*end == '\0' && isfinite(*out) && *out > 0.0) return STATUS_OK;
    return error_set(err, STATUS_INVALID, "'--%s %s': it must be a positive number", o->name, o->word[0]);
}

status camera_option_transfer(const struct camera_option *o, unsigned *transfer, struct error *err)
{
    *transfer = JOB_TRANSFER_UNDECLARED;
    if (o->n == 0) return STATUS_OK;
    if (strcmp(o->word[0], "linear") == 0)
        *transfer = JOB_TRANSFER_LINEAR;
    else if (strcmp(o->word[0], "srgb") == 0)
        *transfer = JOB_TRANSFER_SRGB;
    else
        return error_set(err, STATUS_INVALID, "'--%s %s': allowed are linear, srgb", o->name, o->word[0]);
    return STATUS_OK;
}

status camera_job_read(const char *path, struct camera_job *job, struct error *err)
{
    char *text = NULL;
    size_t n = 0;
    const char *name = path_file_name(path);
    *job = (struct camera_job){.doc = NULL};
    snprintf(job->folder, sizeof job->folder, "%.*s", (int)(name - path), path);
    if (job->folder[0] == '\0') snprintf(job->folder, sizeof job->folder, ".");
    status s = file_read_all(path, JOB_MAX_DOCUMENT_BYTES, &text, &n, err);
    if (s == STATUS_OK) s = job_document_parse(text, n, &job->doc, err);
    free(text);
    if (s != STATUS_OK) return s;
    job->setup = job->doc->setup;
    job->rows = job->doc->rows;
    job->profile = job->doc->profile;
    return STATUS_OK;
}

void camera_job_release(struct camera_job *job) { job_document_free(job->doc); }
