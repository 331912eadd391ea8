#include "optimizer/report/export/blend_file.h"

#include "base/files/durable.h"
#include "base/process.h"
#include "optimizer/job/job_folder.h"

#include <stdio.h>
#include <unistd.h>

bool blend_file_possible(char prefix[WORKER_PATH_BYTES])
{
    char folder[WORKER_PATH_BYTES - 8];
    const bool found = program_find(JOB_BLEND_PROGRAM, folder, sizeof folder);
    /* the whole program of Blender's own archive lies beside it */
    snprintf(prefix, WORKER_PATH_BYTES, "%s", found ? folder : "");
    return found;
}

void blend_file_paths(const struct worker_folder *folder, struct blend_paths *p)
{
    worker_folder_path(folder, JOB_FOLDER_RESULTS, "export/blender/cloth.py", p->script);
    worker_folder_path(folder, JOB_FOLDER_RESULTS, "export/blender/.part-cloth.blend", p->part);
    worker_folder_path(folder, JOB_FOLDER_RESULTS, "export/blender/cloth.blend", p->to);
}

status blend_file_write(struct report *report, struct error *err)
{
    const struct stage_tools *tools = report->in.job->tools;
    char prefix[WORKER_PATH_BYTES];
    struct blend_paths path;
    blend_file_paths(tools->folder, &path);
    if (!blend_file_possible(prefix)) {
        worker_status_warn(tools->status, "cloth.blend was not made, because this machine has no Blender: run cloth.py "
                                          "where there is one");
        return STATUS_OK;
    }
    if (program_helper_run(&report->in.helper.blend, &tools->progress) && access(path.part, F_OK) == 0) {
        status s = worker_folder_check(tools->folder, err);
        return s == STATUS_OK ? durable_rename(path.part, path.to, err) : s;
    }
    unlink(path.part);
    if (progress_cancelled(&tools->progress))
        return error_set(err, STATUS_CANCELLED, "cancelled while making cloth.blend");
    worker_status_warn(tools->status,
                       "cloth.blend was not made, because Blender failed: run cloth.py in another Blender");
    return STATUS_OK;
}
