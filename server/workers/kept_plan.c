#include "server/workers/kept_plan.h"
#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"
#include "server/jobs/job_paths.h"

#include <stdlib.h>

enum { MAX_PLAN_BYTES = 1 << 20 };

json_t *kept_plan_read(const char *data, const char *job_id)
{
    char path[PATH_BYTES], *text = NULL;
    size_t n = 0;
    path_join(path, data, "jobs", job_id, JOB_FILE_PLAN, NULL);
    if (file_read_all(path, MAX_PLAN_BYTES, &text, &n, NULL) != STATUS_OK) return NULL;
    json_t *plan = json_loadb(text, n, 0, NULL);
    free(text);
    if (json_is_number(json_object_get(plan, "cpu_s"))) return plan;
    json_decref(plan);
    return NULL;
}
