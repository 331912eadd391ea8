#include "optimizer/worker/stages/scene/pipeline_adopt.h"
#include "base/files/durable.h"
#include "base/option_id.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/worker/document_fingerprint.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const struct {
    const char *stage, *file;
} checkpoint[] = {{"volume", "volume.bin"},
                  {"orientation", "direction.bin"},
                  {"fibers", "fibers.bin"},
                  {"directions", "direction.bin"}};
enum { N_CHECKPOINT = sizeof checkpoint / sizeof *checkpoint };

/* The folder of the other job, for reading only: without a lock. */
static status other_folder(const struct pipeline_context *c, struct worker_folder *f, struct error *err)
{
    const char *own = c->folder->path, *slash = strrchr(own, '/');
    int length = slash == NULL ? 0 : (int)(slash - own) + 1;
    int n = snprintf(f->path, sizeof f->path, "%.*s%s", length, own, c->doc->geometry_job);
    if (n < 0 || (size_t)n >= sizeof f->path)
        return error_set(err, STATUS_INVALID, "the job folder's path is too long");
    if (access(f->path, F_OK) == 0) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, OPTION_GEOMETRY_JOB,
                           "cannot take over the geometry of job '%s': there is no such job", c->doc->geometry_job);
}

/* The first half of a fingerprint depends on the document and on the program (document_fingerprint.h). */
static status check_program(const struct pipeline_context *c, const struct worker_folder *f, struct error *err)
{
    char path[WORKER_PATH_BYTES], *document = NULL, *claimed = NULL;
    size_t n_document = 0, n_claimed = 0;
    uint64_t have = 0;
    worker_folder_path(f, JOB_FILE_DOCUMENT, NULL, path);
    status s = file_read_all(path, JOB_MAX_DOCUMENT_BYTES, &document, &n_document, err);
    worker_folder_path(f, JOB_FOLDER_WORK, "inputs.fingerprint", path);
    if (s == STATUS_OK) s = file_read_all(path, 64, &claimed, &n_claimed, NULL);
    bool same = s == STATUS_OK && sscanf(claimed, "%16" SCNx64, &have) == 1 &&
                have >> 32 == (document_fingerprint(document, n_document) & 0xffffffffu);
    free(document);
    free(claimed);
    if (same) return STATUS_OK;
    return error_set_field(
        err, STATUS_INVALID, OPTION_GEOMETRY_JOB,
        "cannot take over the geometry of job '%s': it was made by another version of the program, or "
        "has not begun; run it again",
        c->doc->geometry_job);
}

static status adopt(struct pipeline_context *c, const struct worker_folder *f, size_t i, struct error *err)
{
    char from[WORKER_PATH_BYTES], to[WORKER_PATH_BYTES], part[160];
    if (!worker_folder_stage_done(f, checkpoint[i].stage))
        return error_set_field(err, STATUS_INVALID, OPTION_GEOMETRY_JOB,
                               "cannot take over the geometry of job '%s': its stage '%s' is not done",
                               c->doc->geometry_job, checkpoint[i].stage);
    snprintf(part, sizeof part, "%s/%s", checkpoint[i].stage, checkpoint[i].file);
    worker_folder_path(f, JOB_FOLDER_WORK, part, from);
    status s = pipeline_work_path(c, checkpoint[i].stage, checkpoint[i].file, to, err);
    if (s == STATUS_OK) s = worker_folder_check(c->folder, err);
    if (s != STATUS_OK) return s;
    /* Checkpoints are replaced, never changed, so both jobs can share a file. */
    if ((unlink(to) != 0 && errno != ENOENT) || link(from, to) != 0)
        return error_set_errno(err, "cannot take over '%s' of job '%s'", part, c->doc->geometry_job);
    s = durable_sync_folder_of(to, err);
    return s == STATUS_OK ? worker_folder_mark_stage(c->folder, checkpoint[i].stage, err) : s;
}

status pipeline_adopt_geometry(struct pipeline_context *c, struct error *err)
{
    struct worker_folder other = {.lock_fd = -1};
    bool done = true;
    if (c->doc->geometry_job[0] == '\0') return STATUS_OK;
    for (size_t i = 0; i < N_CHECKPOINT; i++) done = done && worker_folder_stage_done(c->folder, checkpoint[i].stage);
    if (done) return STATUS_OK;
    status s = other_folder(c, &other, err);
    if (s == STATUS_OK) s = check_program(c, &other, err);
    for (size_t i = 0; i < N_CHECKPOINT && s == STATUS_OK; i++) s = adopt(c, &other, i, err);
    if (s == STATUS_OK) log_info(c->log, "the geometry is that of job %s", c->doc->geometry_job);
    return s;
}

status pipeline_geometry_lost(const struct pipeline_context *c, const char *why, struct error *err)
{
    return error_set_field(err, STATUS_INVALID, OPTION_GEOMETRY_JOB,
                           "cannot use the geometry that was taken over from job '%s': %s", c->doc->geometry_job, why);
}
