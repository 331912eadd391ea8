#include "server/retention/job_keep.h"
#include "base/files/durable.h"
#include "base/files/foreign_file.h"
#include "server/jobs/job_access.h"
#include "server/jobs/job_change.h"
#include "server/settings/job_paths.h"

#include <errno.h>
#include <unistd.h>

static void mark_path(const struct job_service *v, const char *id, char path[PATH_BYTES])
{
    path_join(path, v->settings->data, "jobs", id, "kept", NULL);
}

bool job_is_kept(const struct job_service *v, const char *id)
{
    char path[PATH_BYTES];
    mark_path(v, id, path);
    return access(path, F_OK) == 0;
}

static status set_mark(const struct job_service *v, const char *id, bool keep, struct error *err)
{
    char path[PATH_BYTES];
    mark_path(v, id, path);
    if (keep) return foreign_file_replace(path, "", 0, true, err);
    status s = foreign_file_clear(path, err);
    if (s != STATUS_OK) return s;
    if (unlink(path) != 0 && errno != ENOENT) return error_set_errno(err, "cannot remove '%s'", path);
    return durable_sync_folder_of(path, err);
}

status job_keep(struct job_service *v, const char *id, bool keep, struct error *err)
{
    struct job_row row;
    job_change_begin(v, id, NULL);
    status s = job_look(v, id, &row, err);
    if (s == STATUS_OK && job_is_kept(v, id) != keep) {
        s = set_mark(v, id, keep, err);
        if (s == STATUS_OK) s = job_update_surely(v, &row, err); /* a new revision: those who watch the job see it */
        if (s == STATUS_OK) log_info(v->log, "job %s is %s", id, keep ? "kept from now on" : "no longer kept");
    }
    job_change_end(v);
    return s;
}
