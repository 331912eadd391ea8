#include "server/files/worker_files.h"
#include "base/files/foreign_json.h"
#include "optimizer/job/job_folder.h"
#include "server/files/worker_words.h"
#include "server/settings/job_paths.h"

/* The largest part is the list of at most 50 warnings of 512 bytes each. */
static const struct foreign_bounds status_bounds = {.file_bytes = 256 << 10, .held_bytes = 1 << 20, .depth = 16};

json_t *worker_status_read(const char *data, const char *job_id)
{
    char folder[PATH_BYTES];
    json_t *j = NULL;
    path_join(folder, data, "jobs", job_id, NULL);
    if (foreign_json_read(folder, JOB_FILE_STATUS, &status_bounds, &j, NULL) == STATUS_OK) worker_words_of_status(j);
    return j;
}

static const struct foreign_bounds plan_bounds = {.file_bytes = 1 << 20, .held_bytes = 4 << 20, .depth = 16};

json_t *worker_plan_read(const char *data, const char *job_id)
{
    char folder[PATH_BYTES];
    json_t *plan = NULL;
    path_join(folder, data, "jobs", job_id, NULL);
    if (foreign_json_read(folder, JOB_FILE_PLAN, &plan_bounds, &plan, NULL) == STATUS_OK) worker_words_of_plan(plan);
    if (json_is_number(json_object_get(plan, "cpu_s"))) return plan;
    json_decref(plan);
    return NULL;
}
