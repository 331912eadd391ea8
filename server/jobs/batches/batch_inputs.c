#include "server/jobs/batches/batch_inputs.h"
#include "server/cluster/job_change.h"
#include "server/jobs/inputs/known_input.h"
#include "server/jobs/job_access.h"
#include "server/jobs/job_paths.h"
#include "server/jobs/upload_file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Files that were linked, of several jobs, in the order of the jobs. */
struct linked {
    struct file_row *row;
    size_t n;
};

static const char *job_at(const struct batch_outcome *out, size_t i)
{
    return json_string_value(json_object_get(json_array_get(out->samples, i), "job"));
}

/* Whether a job is a draft without files, and the server knows all that it should have. */
static bool all_known(struct job_service *v, const char *owner, const char *job_id, const struct batch_sample *sample)
{
    struct job_row job;
    int64_t n = 0;
    bool known = sample->n_file > 0 && job_look(v, job_id, &job, NULL) == STATUS_OK && job.state == JOB_DRAFT &&
                 store_file_count(v->store, job_id, &n, NULL) == STATUS_OK && n == 0;
    for (size_t k = 0; known && k < sample->n_file; k++) known = known_input_exists(v, owner, &sample->file[k]);
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
        if (!known_input_link(v, owner, row)) {
            unlink_from(v, l, n_before);
            return;
        }
        l->n++;
    }
}

static void note_files(struct job_service *v, const struct linked *l)
{
    char folder[PATH_BYTES];
    for (size_t i = 0, n; i < l->n; i += n) {
        struct error err = {0};
        for (n = 1; i + n < l->n && strcmp(l->row[i].job_id, l->row[i + n].job_id) == 0;) n++;
        path_join(folder, v->settings->data, "jobs", l->row[i].job_id, NULL);
        const struct journal_entry entry = {.file = &l->row[i], .n_file = n};
        if (job_journal_append(&v->journal_key, folder, &entry, false, &err) != STATUS_OK)
            log_warning(v->log, "job %s: %s", l->row[i].job_id, err.text);
    }
}

static status link_locked(struct job_service *v, const struct access_grant *grant, const struct batch_table *t,
                          const struct batch_outcome *out, struct linked *l, struct error *err)
{
    for (size_t i = 0; i < t->n; i++) {
        const char *job = job_at(out, i);
        if (all_known(v, grant->owner, job, &t->sample[i])) link_job(v, grant->owner, job, &t->sample[i], l);
    }
    if (l->n == 0) return STATUS_OK;
    status s = job_sync_all(v, err); /* the links before the rows that refer to them */
    if (s == STATUS_OK) s = store_file_insert(v->store, l->row, l->n, NULL, err);
    if (s != STATUS_OK) {
        unlink_from(v, l, 0);
        return s;
    }
    note_files(v, l);
    return job_sync_all(v, err);
}

static status link_known(struct job_service *v, const struct access_grant *grant, const struct batch_table *t,
                         const struct batch_outcome *out, struct error *err)
{
    size_t n = 0;
    for (size_t i = 0; i < t->n; i++) n += t->sample[i].n_file;
    struct linked l = {.row = calloc(n + 1, sizeof *l.row)};
    if (l.row == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot submit the batch: out of memory");
    job_change_begin(v, NULL, NULL);
    status s = link_locked(v, grant, t, out, &l, err);
    job_change_end(v);
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
