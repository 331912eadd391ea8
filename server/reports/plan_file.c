#include "server/reports/plan_file.h"
#include "base/json/foreign_json.h"
#include "optimizer/job/job_folder.h"
#include "server/reports/worker_words.h"
#include "server/settings/job_paths.h"

static const struct foreign_bounds plan_bounds = {.file_bytes = 1 << 20, .held_bytes = 4 << 20, .depth = 16};

json_t *plan_file_read(const char *data, const char *job_id)
{
    char folder[PATH_BYTES];
    json_t *plan = NULL;
    path_join(folder, data, "jobs", job_id, NULL);
    if (foreign_json_read(folder, JOB_FILE_PLAN, &plan_bounds, &plan, NULL) == STATUS_OK) worker_words_of_plan(plan);
    if (json_is_number(json_object_get(plan, "cpu_s"))) return plan;
    json_decref(plan);
    return NULL;
}
