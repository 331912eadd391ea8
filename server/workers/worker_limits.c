#include "server/workers/worker_limits.h"
#include "server/settings/job_paths.h"
#include "server/workers/folder_depth.h"

enum attempt_stop worker_limit_exceeded(const struct job_service *v, const struct job_backend *backend,
                                        const struct backend_run *run, const char *job_id)
{
    const int64_t most_bytes = v->settings->resident_limit_bytes, most_threads = v->settings->thread_limit;
    const int64_t held_bytes = most_bytes > 0 ? backend->memory_bytes(run) : 0;
    const int64_t n_thread = most_threads > 0 && backend->thread_count != NULL ? backend->thread_count(run) : 0;
    if (most_bytes > 0 && held_bytes > most_bytes) {
        log_warning(v->log, "job %s: the worker holds %.1f MB of memory, more than %.1f MB, and is killed", job_id,
                    (double)held_bytes / 1e6, (double)most_bytes / 1e6);
        return STOP_MEMORY;
    }
    if (most_threads <= 0 || n_thread <= most_threads) return STOP_NONE;
    log_warning(v->log, "job %s: the worker has %lld threads, more than %lld, and is killed", job_id,
                (long long)n_thread, (long long)most_threads);
    return STOP_THREADS;
}

enum attempt_stop worker_depth_exceeded(const struct job_service *v, const char *job_id)
{
    const int64_t most = v->settings->folder_depth;
    char folder[PATH_BYTES];
    path_join(folder, v->settings->data, "jobs", job_id, NULL);
    if (most <= 0 || !folder_is_deeper(folder, most)) return STOP_NONE;
    log_warning(v->log, "job %s: the worker has nested more than %lld folders", job_id, (long long)most);
    return STOP_DEPTH;
}
