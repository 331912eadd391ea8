#include "server/batches/batch_inputs.h"
#include "server/files/known_input.h"
#include "server/files/upload_file.h"
#include "server/jobs/job_access.h"
#include "server/jobs/job_change.h"
#include "server/settings/job_paths.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SLICE = 50 }; /* jobs that are linked, and rows that are written, while other requests wait */

/* Files that were linked, of several jobs, in the order of the jobs. */
struct linked {
    struct file_row *row;
    size_t n;
};

static const char *job_at(const struct batch_outcome *out, size_t i)
{
    return json_string_value(json_object_get(json_array_get(out->samples, i), "job"));
}

/* Whether a job is a draft without files. */
static bool awaits_files(struct job_service *v, const char *job_id)
{
    struct job_row job;
    int64_t n = 0;
    return job_look(v, job_id, &job, NULL) == STATUS_OK && job.state == JOB_DRAFT &&
           store_file_count(v->store, job_id, &n, NULL) == STATUS_OK && n == 0;
}

/* Whether a job awaits files, and the server knows all that it should have. */
static bool all_known(struct job_service *v, const char *owner, const char *job_id, const struct batch_sample *sample)
{
    bool known = sample->n_file > 0 && awaits_files(v, job_id);
    for (size_t k = 0; known && k < sample->n_file; k++)
        known = known_input_exists(v->store, v->settings->data, owner, &sample->file[k]);
    return known;
}

static void unlink_from(struct job_service *v, struct linked *l, size_t n_kept)
{
    char path[PATH_BYTES];
    for (; l->n > n_kept; l->n--) {
        upload_input_path(v->settings->data, &l->row[l->n - 1], path);
        unlink(path);
    }
}

/* Links all files of a job, or none. */
static void link_job(struct job_service *v, const char *owner, const char *job_id, const struct batch_sample *sample,
                     struct linked *l)
{
    const size_t n_before = l->n;
    for (size_t k = 0; k < sample->n_file; k++) {
        struct file_row *row = &l->row[l->n];
        *row = sample->file[k];
        snprintf(row->job_id, sizeof row->job_id, "%s", job_id);
        job_new_id(row->id);
        if (!known_input_link(v->store, v->settings->data, owner, row)) {
            unlink_from(v, l, n_before);
            return;
        }
        l->n++;
    }
}

static void note_files(struct job_service *v, const struct file_row *row, size_t n_row)
{
    char folder[PATH_BYTES];
    for (size_t i = 0, n; i < n_row; i += n) {
        struct error err = {0};
        for (n = 1; i + n < n_row && strcmp(row[i].job_id, row[i + n].job_id) == 0;) n++;
        path_join(folder, v->settings->data, "jobs", row[i].job_id, NULL);
        const struct journal_entry entry = {.file = &row[i], .n_file = n};
        if (job_journal_append(&v->journal_key, folder, &entry, false, &err) != STATUS_OK)
            log_warning(v->log, "job %s: %s", row[i].job_id, err.text);
    }
}

/* Links the known files of all samples, a slice of them at a time. */
static void link_slices(struct job_service *v, const struct access_grant *grant, const struct batch_table *t,
                        const struct batch_outcome *out, struct linked *l)
{
    for (size_t from = 0; from < t->n; from += SLICE) {
        job_change_begin(v, NULL, NULL);
        for (size_t i = from; i < t->n && i < from + SLICE; i++) {
            const char *job = job_at(out, i);
            if (all_known(v, grant->owner, job, &t->sample[i])) link_job(v, grant->owner, job, &t->sample[i], l);
        }
        job_change_end(v);
    }
}

/* Writes the rows of linked files, whole jobs at a time. A job that was deleted or has got files since its files were
 * linked is left out; so is the rest after an error. *n_kept: rows whose files stay. */
static status write_slices(struct job_service *v, struct linked *l, size_t *n_kept, struct error *err)
{
    status s = STATUS_OK;
    for (size_t at = 0, n_at, n; s == STATUS_OK && at < l->n; at += n_at) {
        struct file_row *row = &l->row[at];
        job_change_begin(v, NULL, NULL);
        for (n = n_at = 0; at + n_at < l->n && n < SLICE;) {
            size_t n_job = 1;
            while (at + n_at + n_job < l->n && strcmp(row[n_at].job_id, row[n_at + n_job].job_id) == 0) n_job++;
            if (awaits_files(v, row[n_at].job_id)) {
                memmove(&row[n], &row[n_at], n_job * sizeof *row);
                n += n_job;
            }
            n_at += n_job;
        }
        if (n > 0) s = store_file_insert(v->store, row, n, NULL, err);
        if (s == STATUS_OK) note_files(v, row, n);
        job_change_end(v);
        if (s == STATUS_OK) *n_kept = at + n_at;
    }
    return s;
}

static status link_known(struct job_service *v, const struct access_grant *grant, const struct batch_table *t,
                         const struct batch_outcome *out, struct error *err)
{
    size_t n = 0, n_kept = 0;
    for (size_t i = 0; i < t->n; i++) n += t->sample[i].n_file;
    struct linked l = {.row = calloc(n + 1, sizeof *l.row)};
    if (l.row == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot submit the batch: out of memory");
    link_slices(v, grant, t, out, &l);
    status s = l.n > 0 ? job_sync_all(v, err) : STATUS_OK; /* the links before the rows that refer to them */
    if (s == STATUS_OK) s = write_slices(v, &l, &n_kept, err);
    if (s != STATUS_OK) unlink_from(v, &l, n_kept);
    if (s == STATUS_OK && l.n > 0) s = job_sync_all(v, err);
    free(l.row);
    return s;
}

status batch_declare_files(struct job_service *v, const struct access_grant *grant, const struct batch_table *t,
                           const struct batch_outcome *out, struct job_refusal *refusal, struct error *err)
{
    status s = link_known(v, grant, t, out, err);
    for (size_t i = 0; s == STATUS_OK && i < t->n; i++) {
        const struct batch_sample *sample = &t->sample[i];
        const char *job = json_string_value(json_object_get(json_array_get(out->samples, i), "job"));
        struct job_declaration *file = calloc(sample->n_file + 1, sizeof *file);
        size_t i_fault = 0;
        if (file == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot submit the batch: out of memory");
        for (size_t k = 0; k < sample->n_file; k++) file[k].row = sample->file[k];
        if (sample->n_file > 0) s = job_declare_files(v, grant, job, file, sample->n_file, &i_fault, refusal, err);
        free(file);
    }
    return s;
}
