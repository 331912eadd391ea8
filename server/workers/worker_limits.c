#include "server/workers/worker_limits.h"
#include "server/settings/job_paths.h"

#include <dirent.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

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

static bool is_folder(int folder_fd, const struct dirent *e)
{
    struct stat st;
    if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0) return false;
    if (e->d_type != DT_UNKNOWN) return e->d_type == DT_DIR;
    return fstatat(folder_fd, e->d_name, &st, AT_SYMLINK_NOFOLLOW) == 0 && S_ISDIR(st.st_mode);
}

/* Takes ownership of folder_fd. Calls itself `left` times at the most. */
static bool is_deeper(int folder_fd, int64_t left)
{
    bool deeper = false;
    DIR *d = folder_fd < 0 ? NULL : fdopendir(folder_fd);
    if (d == NULL && folder_fd >= 0) close(folder_fd);
    if (d == NULL) return false; /* it was removed meanwhile */
    for (struct dirent *e; !deeper && (e = readdir(d)) != NULL;) {
        if (!is_folder(dirfd(d), e)) continue;
        deeper = left == 0 ||
                 is_deeper(openat(dirfd(d), e->d_name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC), left - 1);
    }
    closedir(d);
    return deeper;
}

/* Returns whether a folder is more than `most` levels below `path`. Links are not followed. */
static bool folder_is_deeper(const char *path, int64_t most)
{
    return is_deeper(open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC), most);
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
