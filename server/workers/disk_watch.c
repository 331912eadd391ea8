#include "server/workers/disk_watch.h"
#include "server/jobs/disk_reserve.h"
#include "server/settings/job_paths.h"
#include "server/workers/attempt.h"

bool disk_watch(struct job_service *v, bool was_below)
{
    long long free_bytes = 0;
    if (path_free_bytes(v->settings->data, &free_bytes, NULL) != STATUS_OK) return was_below;
    int64_t floor_bytes = v->settings->floor_bytes;
    /* hysteresis, so that jobs do not pause and resume repeatedly */
    bool below = free_bytes < (was_below ? floor_bytes + floor_bytes / 10 : floor_bytes);
    if (below && !was_below)
        log_warning(v->log, "%lld bytes are free, %lld are kept in reserve, so running jobs pause", free_bytes,
                    (long long)floor_bytes);
    if (!below) attempt_resume_paused(v);
    disk_reserve_keep(v->settings, false);
    return below;
}
