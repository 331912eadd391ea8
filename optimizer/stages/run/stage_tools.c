#include "optimizer/stages/run/stage_tools.h"
#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/options/option_key.h"

#include <stdio.h>
#include <string.h>

void stage_warn(void *context, const char *option, const char *text)
{
    const struct stage_tools *tools = context;
    char key[64];
    job_option_resolve(option, key, sizeof key);
    worker_status_warn(tools->status, "%s%s%s", key, key[0] != '\0' ? ": " : "", text);
}

status stage_work_path(const struct stage_tools *tools, const char *stage, const char *name,
                       char path[WORKER_PATH_BYTES], struct error *err)
{
    char relative[256];
    snprintf(relative, sizeof relative, "%s/%s", JOB_FOLDER_WORK, stage);
    worker_folder_path(tools->folder, relative, NULL, path);
    status s = durable_make_folder(path, err);
    if (s == STATUS_OK) worker_folder_path(tools->folder, relative, name, path);
    return s;
}

status stage_model_path(const struct stage_tools *tools, const char *stage, const char *name, size_t i_model,
                        char path[WORKER_PATH_BYTES], struct error *err)
{
    char numbered[128];
    const char *dot = strrchr(name, '.');
    int n = dot != NULL ? (int)(dot - name) : (int)strlen(name);
    if (i_model == 0)
        snprintf(numbered, sizeof numbered, "%s", name);
    else
        snprintf(numbered, sizeof numbered, "%.*s-%zu%s", n, name, i_model, name + n);
    return stage_work_path(tools, stage, numbered, path, err);
}
