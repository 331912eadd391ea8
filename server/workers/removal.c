#include "server/workers/removal.h"
#include "base/clock.h"
#include "server/jobs/job_access.h"
#include "server/store/store_cluster.h"

enum { REMOVE_AGAIN_S = 60 };

void removal_run(struct job_service *v, struct waiting_list *waiting,
                 bool (*is_free)(void *context, const char *job_id), void *context)
{
    struct job_row *row = NULL;
    size_t n = 0;
    bool elsewhere = false;
    struct job_query q = {.deleted = true, .limit = 64};
    if (store_job_list(v->store, &q, &row, &n, NULL) != STATUS_OK) return;
    bool mine = n > 0 && store_duty_is_mine(v->store, "removal");
    for (size_t i = 0; mine && i < n; i++) {
        if (store_job_elsewhere(v->store, row[i].id, &elsewhere, NULL) != STATUS_OK || elsewhere) continue;
        if (!is_free(context, row[i].id)) continue;
        struct error err = {0};
        status s = job_remove_folder(v, row[i].id, &err);
        if (s == STATUS_OK) s = store_job_erase(v->store, row[i].id, &err);
        if (s == STATUS_OK) continue;
        log_warning(v->log, "job %s is deleted, but a part of it could not be removed; next try in %d s: %s", row[i].id,
                    REMOVE_AGAIN_S, err.text);
        waiting_list_find(waiting, row[i].id, true)->until_s = clock_monotonic_s() + REMOVE_AGAIN_S;
    }
    job_rows_free(row, n);
}
