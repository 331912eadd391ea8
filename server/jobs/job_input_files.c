/* The input files of a job: which files its document names are missing, declarations, and deletion. */
#include "base/files/durable.h"
#include "optimizer/job/document/job_file_name.h"
#include "optimizer/job/job_outline.h"
#include "server/files/known_input.h"
#include "server/files/upload_file.h"
#include "server/jobs/disk_reserve.h"
#include "server/jobs/job_access.h"
#include "server/jobs/job_change.h"
#include "server/settings/job_paths.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct missing {
    const struct file_row *file;
    size_t n_file;
    json_t *name;
};

static void visit_file(void *context, const char *name, const char *role)
{
    struct missing *m = context;
    (void)role;
    for (size_t i = 0; i < m->n_file; i++)
        if (m->file[i].state == FILE_COMPLETE && strcmp(m->file[i].name, name) == 0) return;
    json_array_append_new(m->name, json_string(name));
}

status job_missing_files(struct job_service *v, const struct job_row *row, json_t **out, struct error *err)
{
    struct job_outline outline = {.n_file = 0};
    struct file_row *file = NULL;
    struct missing m = {0};
    status s = job_outline_read(row->document, strlen(row->document), &outline, err);
    if (s != STATUS_OK) return s;
    s = store_file_list(v->store, row->id, &file, &m.n_file, err);
    if (s != STATUS_OK) goto out;
    m.file = file;
    m.name = json_array();
    for (size_t i = 0; i < outline.n_file; i++) visit_file(&m, outline.file[i].name, outline.file[i].role);
    *out = m.name;
out:
    free(file);
    job_outline_release(&outline);
    return s;
}

/* A job that a document names, "" where it names none, belongs to the same owner. */
static status check_other_job(struct job_service *v, const struct job_row *row, const char *key, const char *id,
                              struct error *err)
{
    char owner[STORE_OWNER_BYTES] = "";
    if (id[0] == '\0') return STATUS_OK;
    status s = store_job_owner(v->store, id, owner, err);
    if (s == STATUS_NOT_FOUND || (s == STATUS_OK && strcmp(owner, row->owner) != 0))
        return error_set_field(err, STATUS_INVALID, key, "job '%.40s' does not exist", id);
    return s;
}

status job_check_adopted(struct job_service *v, const struct job_row *row, struct error *err)
{
    struct job_outline outline = {.n_file = 0};
    status s = job_outline_read(row->document, strlen(row->document), &outline, err);
    if (s == STATUS_OK) s = check_other_job(v, row, "geometry.job", outline.geometry_job, err);
    if (s == STATUS_OK) s = check_other_job(v, row, "fit.profile_job", outline.profile_job, err);
    job_outline_release(&outline);
    return s;
}

static bool role_valid(const char *role)
{
    static const char *const known[] = {"volume", "fibers",     "measurements", "photograph",      "environment",
                                        "chart",  "dark_frame", "camera_noise", "white_reference", "rig",
                                        "mesh",   "profile",    "draft",        "result",          "report"};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
        if (strcmp(role, known[i]) == 0) return true;
    return false;
}

status job_check_declaration(struct job_service *v, struct file_row *row, struct error *err)
{
    if (!job_file_name_valid(row->name))
        return error_set_field(
            err, STATUS_INVALID, "name",
            "file name '%.127s' is not allowed: 1..127 bytes of UTF-8 without '/', '\\' and control characters, not "
            "starting with a dot",
            row->name);
    if (!role_valid(row->role))
        return error_set_field(
            err, STATUS_INVALID, "role",
            "role '%.31s' is not one of volume, fibers, measurements, photograph, environment, chart, dark_frame, "
            "camera_noise, white_reference, rig, mesh, profile, draft, result, "
            "report",
            row->role);
    if (row->size_bytes < 1)
        return error_set_field(err, STATUS_INVALID, "size",
                               "file '%s' is declared with %lld bytes, but must not be empty", row->name,
                               (long long)row->size_bytes);
    if (row->size_bytes > v->settings->max_file_bytes)
        return error_set_field(err, STATUS_TOO_LARGE, "size",
                               "file '%s' is declared with %lld bytes, but the limit is %lld", row->name,
                               (long long)row->size_bytes, (long long)v->settings->max_file_bytes);
    size_t n = strlen(row->sha256);
    for (size_t i = 0; i < n; i++) {
        if (row->sha256[i] >= 'A' && row->sha256[i] <= 'F') row->sha256[i] = (char)(row->sha256[i] - 'A' + 'a');
        char c = row->sha256[i];
        if (!((c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'))) n = 1;
    }
    if (n != 0 && n != 64)
        return error_set_field(err, STATUS_INVALID, "sha256", "sha256 of '%s' is not 64 hexadecimal digits", row->name);
    return STATUS_OK;
}

/* Whether a file is declared already: *existed. STATUS_EXISTS if it is declared differently. */
static status find_declared(struct job_service *v, struct job_declaration *d, struct error *err)
{
    struct file_row before, *row = &d->row;
    status s = store_file_find(v->store, row->job_id, row->name, &before, err);
    d->existed = s == STATUS_OK;
    if (s == STATUS_NOT_FOUND) return STATUS_OK;
    if (s != STATUS_OK) return s;
    bool same = before.size_bytes == row->size_bytes && strcmp(before.role, row->role) == 0 &&
                (row->sha256[0] == '\0' || before.sha256[0] == '\0' || strcmp(before.sha256, row->sha256) == 0);
    if (!same)
        return error_set_field(err, STATUS_EXISTS, "name", "file '%s' was declared differently; delete it first",
                               row->name);
    if (before.sha256[0] == '\0' && row->sha256[0] != '\0') {
        s = upload_set_checksum(v->upload, before.id, row->sha256, row, err);
        if (s == STATUS_OK) job_note(v, row->job_id, &(struct journal_entry){.file = row, .n_file = 1});
        return s;
    }
    *row = before;
    return STATUS_OK;
}

/* Makes room for the files whose bytes must be uploaded, and links the others: n new files. */
static status make_places(struct job_service *v, const char *owner, struct file_row *row, size_t n, struct error *err)
{
    status s = STATUS_OK;
    size_t n_part = 0, n_linked = 0;
    struct file_row *part = calloc(n, sizeof *part);
    if (part == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot declare files: out of memory");
    for (size_t i = 0; i < n; i++)
        if (known_input_link(v->store, v->settings->data, owner, &row[i]))
            n_linked++;
        else
            part[n_part++] = row[i];
    if (n_part > 0) s = upload_reserve(v->settings->data, part, n_part, err);
    for (size_t i = 0, k = 0; i < n; i++)
        if (row[i].state != FILE_COMPLETE) row[i] = part[k++];
    char path[PATH_BYTES];
    upload_input_path(v->settings->data, &row[0], path);
    if (s == STATUS_OK && n_linked > 0) s = durable_sync_folder_of(path, err);
    for (size_t i = 0; s != STATUS_OK && i < n; i++) upload_discard(v->upload, &row[i]);
    free(part);
    return s;
}

/* Makes places for the files that are new, n_new of them, and inserts them. */
static status insert_new(struct job_service *v, struct job_row *job, struct job_declaration *file, size_t n,
                         size_t n_new, struct error *err)
{
    size_t k = 0;
    struct file_row *row = calloc(n_new, sizeof *row);
    if (row == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot declare files: out of memory");
    for (size_t i = 0; i < n; i++) {
        if (file[i].existed) continue;
        job_new_id(file[i].row.id);
        row[k++] = file[i].row;
    }
    status s = make_places(v, job->owner, row, n_new, err);
    if (s == STATUS_OK) {
        job_mark_edited(job);
        s = store_file_insert(v->store, row, n_new, job, err);
        for (k = 0; s != STATUS_OK && k < n_new; k++) upload_discard(v->upload, &row[k]);
        if (s == STATUS_OK) job_note(v, job->id, &(struct journal_entry){.job = job, .file = row, .n_file = n_new});
        if (s == STATUS_OK) job_forget_plan(v, job->id);
    }
    for (size_t i = 0, j = 0; s == STATUS_OK && i < n; i++)
        if (!file[i].existed) file[i].row = row[j++];
    free(row);
    return s;
}

/* Space for new files. */
struct room {
    size_t n_file;
    int64_t n_bytes, n_upload_bytes; /* all files; files that must be uploaded */
};

static status check_room(struct job_service *v, const struct access_grant *grant, const struct job_row *job,
                         const struct room *room, struct job_refusal *refusal, struct error *err)
{
    int64_t n_before = 0;
    status s = store_file_count(v->store, job->id, &n_before, err);
    if (s != STATUS_OK) return s;
    if (n_before + (int64_t)room->n_file > v->settings->max_files_per_job) {
        refusal->code = "too_many";
        return error_set(err, STATUS_TOO_LARGE, "a job may have at most %lld files",
                         (long long)v->settings->max_files_per_job);
    }
    s = job_check_editable(job, err);
    if (s == STATUS_OK)
        s = job_check_quota(v, grant, job->owner, &(struct owner_use){.bytes = room->n_bytes}, refusal, err);
    return s == STATUS_OK ? job_disk_check(v, room->n_upload_bytes, err) : s;
}

static status declare_locked(struct job_service *v, const struct access_grant *grant, const char *id,
                             struct job_declaration *file, size_t n, size_t *i_fault, struct job_refusal *refusal,
                             struct error *err)
{
    struct job_row job;
    struct room room = {0};
    status s = job_look(v, id, &job, err);
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        snprintf(file[i].row.job_id, sizeof file[i].row.job_id, "%s", id);
        s = find_declared(v, &file[i], err);
        if (s != STATUS_OK) *i_fault = i;
        if (file[i].existed) continue;
        file[i].known = s == STATUS_OK && known_input_exists(v->store, v->settings->data, job.owner, &file[i].row);
        room.n_file++;
        if (!file[i].known) room.n_upload_bytes += file[i].row.size_bytes;
        room.n_bytes += file[i].row.size_bytes; /* at most max_file_bytes each, of at most a megabyte of declarations */
    }
    if (s == STATUS_OK && room.n_file > 0) s = check_room(v, grant, &job, &room, refusal, err);
    return s == STATUS_OK && room.n_file > 0 ? insert_new(v, &job, file, n, room.n_file, err) : s;
}

static int by_name(const void *a, const void *b)
{
    const struct job_declaration *const *x = a, *const *y = b;
    return strcmp((*x)->row.name, (*y)->row.name);
}

/* A name may appear once in a request. */
static status check_names(const struct job_declaration *file, size_t n, size_t *i_fault, struct error *err)
{
    status s = STATUS_OK;
    const struct job_declaration **sorted = calloc(n, sizeof *sorted);
    if (sorted == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot declare files: out of memory");
    for (size_t i = 0; i < n; i++) sorted[i] = &file[i];
    qsort(sorted, n, sizeof *sorted, by_name);
    for (size_t i = 1; s == STATUS_OK && i < n; i++)
        if (by_name(&sorted[i - 1], &sorted[i]) == 0) {
            *i_fault = (size_t)(sorted[i] - file);
            s = error_set_field(err, STATUS_INVALID, "name", "file '%s' is declared twice", sorted[i]->row.name);
        }
    free(sorted);
    return s;
}

status job_declare_files(struct job_service *v, const struct access_grant *grant, const char *id,
                         struct job_declaration *file, size_t n, size_t *i_fault, struct job_refusal *refusal,
                         struct error *err)
{
    *i_fault = n;
    status s = STATUS_OK;
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        s = job_check_declaration(v, &file[i].row, err);
        if (s != STATUS_OK) *i_fault = i;
    }
    if (s == STATUS_OK) s = check_names(file, n, i_fault, err);
    if (s != STATUS_OK) return s;
    job_change_begin(v, id, grant->owner);
    s = declare_locked(v, grant, id, file, n, i_fault, refusal, err);
    job_change_end(v);
    return s;
}

status job_delete_file(struct job_service *v, const char *id, const char *name, struct error *err)
{
    struct job_row job;
    struct file_row file;
    job_change_begin(v, id, NULL);
    status s = job_look(v, id, &job, err);
    if (s == STATUS_OK) s = store_file_find(v->store, id, name, &file, err);
    if (s == STATUS_OK) s = job_check_editable(&job, err);
    if (s != STATUS_OK) goto out;
    job_mark_edited(&job);
    /* the row first: bytes without a row are removed at the next start, but a row must not refer to missing bytes */
    s = store_file_erase(v->store, file.id, &job, err);
    for (int step = 0; s == STATUS_DISK_FULL && disk_reserve_make_room(v, &step);)
        s = store_file_erase(v->store, file.id, &job, err);
    if (s == STATUS_OK) job_note(v, id, &(struct journal_entry){.job = &job, .removed = name});
    if (s == STATUS_OK) job_forget_plan(v, id);
    if (s == STATUS_OK) upload_discard(v->upload, &file);
out:
    job_change_end(v);
    return s;
}

status job_delete_upload(struct job_service *v, const char *upload_id, struct error *err)
{
    struct file_row file;
    if (!id_valid(upload_id)) return error_set(err, STATUS_NOT_FOUND, "upload '%.40s' does not exist", upload_id);
    status s = store_file_get(v->store, upload_id, &file, err);
    return s == STATUS_OK ? job_delete_file(v, file.job_id, file.name, err) : s;
}
