#include "server/files/known_input.h"
#include "server/files/upload_file.h"
#include "server/settings/job_paths.h"

#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Whether a file is as it was uploaded: *run: after its job has run, its seal says so, because a worker may replace the
 * inputs of its own job. path: of the file. */
static bool intact(struct store *store, const char *data, const struct file_row *source, char path[PATH_BYTES],
                   bool *run)
{
    struct job_row job;
    struct stat st;
    upload_input_path(data, source, path);
    if (lstat(path, &st) != 0 || !S_ISREG(st.st_mode) || (int64_t)st.st_size != source->size_bytes ||
        store_job_look(store, source->job_id, &job, NULL) != STATUS_OK)
        return false;
    *run = job.attempt > 0;
    job_row_release(&job);
    return !*run || upload_is_sealed(path, source);
}

status known_input_find(struct store *store, const char *data, const char *owner, const char *sha256,
                        struct file_row *source, struct error *err)
{
    char path[PATH_BYTES];
    bool run;
    status s = store_file_known(store, owner, sha256, -1, source, err);
    if (s == STATUS_OK && !intact(store, data, source, path, &run))
        s = error_set(err, STATUS_NOT_FOUND, "the input '%s' of job %s has changed", source->name, source->job_id);
    return s;
}

/* Finds the file with the bytes of `row`. */
static bool find(struct store *store, const char *data, const char *owner, const struct file_row *row,
                 char path[PATH_BYTES], bool *run)
{
    struct file_row source;
    return row->sha256[0] != '\0' &&
           store_file_known(store, owner, row->sha256, row->size_bytes, &source, NULL) == STATUS_OK &&
           intact(store, data, &source, path, run);
}

bool known_input_exists(struct store *store, const char *data, const char *owner, const struct file_row *row)
{
    char path[PATH_BYTES];
    bool run;
    return find(store, data, owner, row, path, &run);
}

bool known_input_link(struct store *store, const char *data, const char *owner, struct file_row *row)
{
    char from[PATH_BYTES], to[PATH_BYTES];
    bool run;
    if (!find(store, data, owner, row, from, &run)) return false;
    upload_input_path(data, row, to);
    unlink(to); /* no row has this name: a file that a killed daemon may have left */
    if (link(from, to) != 0) return false;
    /* looked at again under its own name, because a worker that runs may have replaced the other one meanwhile */
    if (run ? !upload_is_sealed(to, row) : chmod(to, S_IRUSR) != 0) {
        unlink(to);
        return false;
    }
    upload_hash_restart(row);
    row->state = FILE_COMPLETE;
    row->offset_bytes = row->size_bytes;
    return true;
}
