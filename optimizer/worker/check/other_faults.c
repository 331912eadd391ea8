#include "optimizer/worker/check/other_faults.h"

#include "optimizer/job/job_folder.h"
#include "optimizer/worker/check/job_check.h"

#include <stdio.h>
#include <string.h>

/* Takes the folder of the inputs out of a text: users know their files by their names alone. */
static void shorten_paths(const struct stage_tools *tools, char *text)
{
    char folder[WORKER_PATH_BYTES];
    worker_folder_path(tools->folder, JOB_FOLDER_INPUT, NULL, folder);
    const size_t n = strlen(folder);
    for (char *at = text; (at = strstr(at, folder)) != NULL;)
        if (at[n] == '/')
            memmove(at, at + n + 1, strlen(at + n + 1) + 1);
        else
            at += n;
}

/* Warns of every fault of the inputs besides the one that has ended the job, so that all can be repaired at once. */
static void name_other_faults(const struct stage_tools *tools, const struct error *first)
{
    char path[WORKER_PATH_BYTES], folder[WORKER_PATH_BYTES];
    json_t *report = NULL;
    const json_t *fault;
    size_t i;
    struct error err = {0};
    worker_folder_path(tools->folder, JOB_FILE_DOCUMENT, NULL, path);
    worker_folder_path(tools->folder, JOB_FOLDER_INPUT, NULL, folder);
    if (job_check(path, folder, &report, &err) != STATUS_OK) return;
    json_array_foreach(json_object_get(report, "faults"), i, fault)
    {
        const char *field = json_string_value(json_object_get(fault, "field")),
                   *detail = json_string_value(json_object_get(fault, "detail"));
        char text[sizeof err.text];
        if (field == NULL || detail == NULL) continue;
        if (strcmp(field, first->field) == 0 || strcmp(detail, first->text) == 0) continue;
        snprintf(text, sizeof text, "%s", detail);
        shorten_paths(tools, text);
        worker_status_warn(tools->status, "this is wrong, too: %s: %s", field, text);
    }
    json_decref(report);
}

static bool is_of_input(status s)
{
    return s == STATUS_INVALID || s == STATUS_NOT_FOUND || s == STATUS_FORMAT || s == STATUS_UNSUPPORTED;
}

void other_faults_name(const struct stage_tools *tools, status s, struct error *err)
{
    if (is_of_input(s)) name_other_faults(tools, err);
    if (s != STATUS_OK) shorten_paths(tools, err->text);
}
