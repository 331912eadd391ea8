#include "optimizer/stages/scene/pipeline_adopt.h"
#include "base/files/durable.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_limits.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/stages/run/worker_folder.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const struct {
    const char *stage, *file;
} checkpoint[] = {{"volume", "volume.bin"},
                  {"orientation", "direction.bin"},
                  {"fibers", "fibers.bin"},
                  {"directions", "direction.bin"}};
enum { N_CHECKPOINT = sizeof checkpoint / sizeof *checkpoint };

bool pipeline_other_folder(const struct worker_folder *own, const char *job, struct worker_folder *other)
{
    const char *slash = strrchr(own->path, '/');
    int length = slash == NULL ? 0 : (int)(slash - own->path) + 1;
    int n = snprintf(other->path, sizeof other->path, "%.*s%s", length, own->path, job);
    return n > 0 && (size_t)n < sizeof other->path;
}

static bool stages_done(const struct worker_folder *f)
{
    for (size_t i = 0; i < N_CHECKPOINT; i++)
        if (!worker_folder_stage_done(f, checkpoint[i].stage)) return false;
    return true;
}

/* Makes JOB/adopted/<name> a link to the other job's file, or removes it when there is none. Files of two jobs are for
 * reading only: checkpoints are replaced, never changed, and in its sandbox no worker can change a mode or write
 * against one, so a worker that its input has taken over cannot change the geometry of the other job. */
static void link_file(const struct worker_folder *other, const struct worker_folder *own, const char *name)
{
    char from[WORKER_PATH_BYTES], to[WORKER_PATH_BYTES];
    worker_folder_path(other, name, NULL, from);
    worker_folder_path(own, JOB_FOLDER_ADOPTED, name, to);
    unlink(to);
    if (link(from, to) != 0 || chmod(to, S_IRUSR) != 0) return; /* pipeline_adopt_geometry finds that it is missing */
}

/* Visits the files of another job that are linked: its document, its fingerprint, and for each stage the mark and the
 * checkpoint. */
static void visit_files(const struct worker_folder *other, const struct worker_folder *own,
                        void (*visit)(const struct worker_folder *other, const struct worker_folder *own,
                                      const char *name))
{
    char name[160];
    visit(other, own, JOB_FILE_DOCUMENT);
    visit(other, own, JOB_FOLDER_WORK "/inputs.fingerprint");
    for (size_t i = 0; i < N_CHECKPOINT; i++) {
        snprintf(name, sizeof name, JOB_FOLDER_WORK "/%s/%s", checkpoint[i].stage, checkpoint[i].file);
        visit(other, own, name);
        snprintf(name, sizeof name, JOB_FOLDER_WORK "/%s.done", checkpoint[i].stage);
        visit(other, own, name);
    }
}

static void unlink_file(const struct worker_folder *other, const struct worker_folder *own, const char *name)
{
    char path[WORKER_PATH_BYTES];
    (void)other;
    worker_folder_path(own, JOB_FOLDER_ADOPTED, name, path);
    unlink(path);
}

void pipeline_link_geometry(const struct worker_folder *own, const char *geometry_job)
{
    struct worker_folder other = {.lock_fd = -1};
    char folder[WORKER_PATH_BYTES], name[160];
    if (geometry_job[0] == '\0' || stages_done(own) || !pipeline_other_folder(own, geometry_job, &other)) return;
    if (access(own->path, F_OK) != 0 || access(other.path, F_OK) != 0) return;
    for (size_t i = 0; i < N_CHECKPOINT; i++) {
        snprintf(name, sizeof name, JOB_FOLDER_WORK "/%s", checkpoint[i].stage);
        worker_folder_path(own, JOB_FOLDER_ADOPTED, name, folder);
        durable_make_folder(folder, NULL);
    }
    visit_files(&other, own, link_file);
}

/* The links to the other job's files, laid out as a job folder. */
static status other_folder(const struct worker_folder *own, const char *geometry_job, struct worker_folder *f,
                           struct error *err)
{
    struct worker_folder other = {.lock_fd = -1};
    if (!pipeline_other_folder(own, geometry_job, &other))
        return error_set(err, STATUS_INVALID, "the job folder's path is too long");
    snprintf(f->path, sizeof f->path, "%.2000s/%s", own->path, JOB_FOLDER_ADOPTED);
    if (access(other.path, F_OK) == 0) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, OPTION_GEOMETRY_JOB,
                           "cannot take over the geometry of job '%s': there is no such job", geometry_job);
}

/* The first half of a fingerprint depends on the document and on the program (document_fingerprint.h). */
static status check_program(const char *geometry_job, const struct worker_folder *f, struct error *err)
{
    char path[WORKER_PATH_BYTES], *document = NULL, *stored = NULL;
    size_t n_document = 0, n_stored = 0;
    uint64_t have = 0;
    worker_folder_path(f, JOB_FILE_DOCUMENT, NULL, path);
    status s = file_read_all(path, JOB_MAX_DOCUMENT_BYTES, &document, &n_document, err);
    worker_folder_path(f, JOB_FOLDER_WORK, "inputs.fingerprint", path);
    if (s == STATUS_OK) s = file_read_all(path, 64, &stored, &n_stored, NULL);
    bool same = s == STATUS_OK && sscanf(stored, "%16" SCNx64, &have) == 1 &&
                have >> 32 == (document_fingerprint(document, n_document) & 0xffffffffu);
    free(document);
    free(stored);
    if (same) return STATUS_OK;
    return error_set_field(
        err, STATUS_INVALID, OPTION_GEOMETRY_JOB,
        "cannot take over the geometry of job '%s': it was made by another version of the program, or "
        "has not begun; run it again",
        geometry_job);
}

static status adopt(const struct stage_tools *tools, const char *geometry_job, const struct worker_folder *f, size_t i,
                    struct error *err)
{
    char from[WORKER_PATH_BYTES], to[WORKER_PATH_BYTES], part[160];
    if (!worker_folder_stage_done(f, checkpoint[i].stage))
        return error_set_field(err, STATUS_INVALID, OPTION_GEOMETRY_JOB,
                               "cannot take over the geometry of job '%s': its stage '%s' is not done", geometry_job,
                               checkpoint[i].stage);
    snprintf(part, sizeof part, "%s/%s", checkpoint[i].stage, checkpoint[i].file);
    worker_folder_path(f, JOB_FOLDER_WORK, part, from);
    status s = stage_work_path(tools, checkpoint[i].stage, checkpoint[i].file, to, err);
    if (s == STATUS_OK) s = worker_folder_check(tools->folder, err);
    if (s != STATUS_OK) return s;
    /* Checkpoints are replaced, never changed, so both jobs can share a file. */
    if ((unlink(to) != 0 && errno != ENOENT) || link(from, to) != 0)
        return error_set_errno(err, "cannot take over '%s' of job '%s'", part, geometry_job);
    s = durable_sync_folder_of(to, err);
    return s == STATUS_OK ? worker_folder_mark_stage(tools->folder, checkpoint[i].stage, err) : s;
}

status pipeline_adopt_geometry(const struct stage_tools *tools, const char *geometry_job, struct error *err)
{
    struct worker_folder other = {.lock_fd = -1};
    if (geometry_job[0] == '\0' || stages_done(tools->folder)) return STATUS_OK;
    status s = other_folder(tools->folder, geometry_job, &other, err);
    if (s == STATUS_OK) s = check_program(geometry_job, &other, err);
    for (size_t i = 0; i < N_CHECKPOINT && s == STATUS_OK; i++) s = adopt(tools, geometry_job, &other, i, err);
    if (s == STATUS_OK) visit_files(&other, tools->folder, unlink_file);
    if (s == STATUS_OK) log_info(tools->log, "the geometry is that of job %s", geometry_job);
    return s;
}

status pipeline_geometry_lost(const char *geometry_job, const char *why, struct error *err)
{
    return error_set_field(err, STATUS_INVALID, OPTION_GEOMETRY_JOB,
                           "cannot use the geometry that was taken over from job '%s': %s", geometry_job, why);
}
