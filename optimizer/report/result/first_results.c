#include "optimizer/report/result/first_results.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/result/result_pictures.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Returns a report without findings, or NULL. The caller frees it. */
static struct report *begin(const struct cloth_job *job, struct error *err)
{
    struct report *report = calloc(1, sizeof *report);
    if (report == NULL)
        error_set(err, STATUS_NO_MEMORY, "cannot write the first results: out of memory");
    else
        report->in.job = job;
    return report;
}

status first_photographs_write(const struct cloth_job *job, const struct job_rows *photographs, struct error *err)
{
    struct report *report = begin(job, err);
    if (report == NULL) return STATUS_NO_MEMORY;
    report->in.photographs = photographs;
    status s = result_photographs_write(report, err);
    free(report);
    return s;
}

static status write_slices(const struct cloth_job *job, const struct volume *volume, const struct fiber_set *traced,
                           struct error *err)
{
    if (volume->density == NULL) return STATUS_OK;
    struct report *report = begin(job, err);
    if (report == NULL) return STATUS_NO_MEMORY;
    status s = result_slices_write(report, volume, traced, err);
    free(report);
    return s;
}

static status write_geometry(const struct cloth_job *job, struct made_cloth *made, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(job->tools->folder, JOB_FOLDER_RESULTS, "scan/contrast.u8", path); /* written last */
    if (access(path, F_OK) == 0) return STATUS_OK;
    struct report *report = begin(job, err);
    if (report == NULL) return STATUS_NO_MEMORY;
    report->in.made = made;
    status s = result_geometry_write(report, err);
    volume_release(&report->volume.volume);
    free(report);
    return s;
}

status first_results_write(const struct cloth_job *job, const char *stage, const struct volume_output *volume,
                           const struct fiber_set *traced, struct made_cloth *made, struct error *err)
{
    if (strcmp(stage, "volume") == 0 || strcmp(stage, "fibers") == 0)
        return write_slices(job, &volume->volume, traced, err);
    return strcmp(stage, "scene") == 0 ? write_geometry(job, made, err) : STATUS_OK;
}
