/* Submits a batch: compares its table with the jobs that are there, and makes those that are missing. */
#include "base/clock.h"
#include "optimizer/job/job_folder.h"
#include "server/batches/batch_inputs.h"
#include "server/batches/batch_places.h"
#include "server/jobs/job_access.h"
#include "server/jobs/job_change.h"
#include "server/settings/job_paths.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { TRY_MOST = 4 };

/* A submission while it is under way. */
struct submission {
    struct job_service *v;
    const struct batch_table *table;
    struct batch_row batch;
    bool exists;
    struct job_row *old; /* the jobs of the batch as it is, without documents */
    size_t n_old;
    size_t *taken;       /* for each row of the table, the place in `old` of the job that is taken over, or n_old */
    bool *keep, *other;  /* for each old job: it is taken over; its row changes */
    json_t *place;       /* place in `old` by the name of the sample */
    struct job_row *job; /* the new jobs, with documents that belong to the table */
    size_t n_new, n_other;
    size_t *row_of_new;
};

static int by_name(const void *a, const void *b)
{
    const struct file_row *x = a, *y = b;
    return strcmp(x->name, y->name);
}

/* Whether a job has the files of a row. A file that was not declared yet makes no difference: it will be. */
static bool same_files(struct submission *s, const char *job_id, const struct batch_sample *sample)
{
    struct file_row *file = NULL;
    size_t n = 0;
    if (store_file_list(s->v->store, job_id, &file, &n, NULL) != STATUS_OK) return false;
    bool same = true;
    for (size_t i = 0; same && i < n; i++) {
        const struct file_row *found =
            sample->n_file == 0 ? NULL : bsearch(&file[i], sample->file, sample->n_file, sizeof file[i], by_name);
        same = found != NULL && found->size_bytes == file[i].size_bytes && strcmp(found->role, file[i].role) == 0 &&
               strcmp(found->sha256, file[i].sha256) == 0;
    }
    free(file);
    return same;
}

static bool same_document(const char *a, const char *b)
{
    if (strcmp(a, b) == 0) return true;
    json_t *x = json_loads(a, 0, NULL), *y = json_loads(b, 0, NULL);
    bool same = x != NULL && y != NULL && json_equal(x, y);
    json_decref(x);
    json_decref(y);
    return same;
}

static bool same_job(struct submission *s, const struct job_row *old, const struct batch_sample *sample)
{
    struct job_row row;
    if (store_job_get(s->v->store, old->id, &row, NULL) != STATUS_OK) return false;
    bool same = same_document(row.document, sample->document) && same_files(s, old->id, sample);
    job_row_release(&row);
    return same;
}

/* Finds which jobs are taken over. */
static status compare(struct submission *s, struct error *err)
{
    const struct batch_table *t = s->table;
    s->taken = calloc(t->n, sizeof *s->taken);
    s->row_of_new = calloc(t->n, sizeof *s->row_of_new);
    s->keep = calloc(s->n_old + 1, sizeof *s->keep);
    s->other = calloc(s->n_old + 1, sizeof *s->other);
    s->place = json_object();
    if (s->taken == NULL || s->row_of_new == NULL || s->keep == NULL || s->other == NULL || s->place == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot submit the batch: out of memory");
    for (size_t i = 0; i < s->n_old; i++) json_object_set_new(s->place, s->old[i].sample, json_integer((json_int_t)i));
    for (size_t i = 0; i < t->n; i++) {
        const json_t *place = json_object_get(s->place, t->sample[i].sample);
        size_t k = place == NULL ? s->n_old : (size_t)json_integer_value(place);
        if (k < s->n_old && !same_job(s, &s->old[k], &t->sample[i])) k = s->n_old;
        s->taken[i] = k;
        if (k == s->n_old) {
            s->row_of_new[s->n_new++] = i;
            continue;
        }
        s->keep[k] = true;
        s->other[k] = s->old[k].batch_place != (int64_t)i;
        s->old[k].batch_place = (int64_t)i;
    }
    for (size_t k = 0; k < s->n_old; k++) s->other[k] = s->other[k] || !s->keep[k];
    for (size_t k = 0; k < s->n_old; k++) s->n_other += s->other[k];
    return STATUS_OK;
}

/* A job that is no part of the batch any more. */
static void leave(struct submission *s, struct job_row *row, json_t *left)
{
    bool active = row->state < JOB_SUCCEEDED;
    row->batch[0] = '\0';
    row->batch_place = 0;
    if (row->state == JOB_RUNNING)
        row->cancel_requested = true;
    else if (active) {
        row->state = JOB_CANCELLED;
        row->finished_unix_s = clock_wall_s();
        atomic_fetch_add(&s->v->n_finished_total[JOB_CANCELLED], 1);
    }
    json_array_append_new(left, json_pack("{s:s,s:s,s:b}", "sample", row->sample, "job", row->id, "cancelled", active));
}

static status check_room(struct submission *s, const struct access_grant *grant, struct job_refusal *refusal,
                         struct error *err)
{
    struct owner_use more = {.jobs = (int64_t)s->n_new};
    int64_t count[JOB_N_STATE], n = 0;
    for (size_t i = 0; i < s->n_new; i++) {
        const struct batch_sample *sample = &s->table->sample[s->row_of_new[i]];
        for (size_t k = 0; k < sample->n_file; k++) more.bytes += sample->file[k].size_bytes;
    }
    status st = store_job_count(s->v->store, count, err);
    if (st != STATUS_OK) return st;
    for (int i = 0; i < JOB_N_STATE; i++) n += count[i];
    if (n + more.jobs > s->v->settings->max_jobs) {
        refusal->code = "too_many";
        return error_set(err, STATUS_TOO_LARGE, "cannot keep more than %lld jobs, and %lld more are asked for",
                         (long long)s->v->settings->max_jobs, (long long)more.jobs);
    }
    st = job_check_quota(s->v, grant, s->batch.owner, &more, refusal, err);
    return st == STATUS_OK ? job_disk_check(s->v, 0, err) : st;
}

static status make_jobs(struct submission *s, struct error *err)
{
    s->job = calloc(s->n_new + 1, sizeof *s->job);
    if (s->job == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot submit the batch: out of memory");
    for (size_t i = 0; i < s->n_new; i++) {
        const struct batch_sample *sample = &s->table->sample[s->row_of_new[i]];
        struct job_row *row = &s->job[i];
        row->state = JOB_DRAFT;
        row->document = sample->document;
        row->created_unix_s = clock_wall_s();
        row->batch_place = (int64_t)s->row_of_new[i];
        job_new_id(row->id);
        snprintf(row->sample, sizeof row->sample, "%s", sample->sample);
        snprintf(row->owner, sizeof row->owner, "%s", s->batch.owner);
        snprintf(row->batch, sizeof row->batch, "%s", s->batch.id);
        snprintf(row->batch_name, sizeof row->batch_name, "%s", s->batch.name);
    }
    return STATUS_OK;
}

/* Writes the changes in one transaction. */
static status write_batch(struct submission *s, struct batch_outcome *out, struct error *err)
{
    struct job_row *changed = calloc(s->n_other + 1, sizeof *changed);
    size_t n = 0;
    if (changed == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot submit the batch: out of memory");
    for (size_t k = 0; k < s->n_old; k++) {
        if (!s->other[k]) continue;
        changed[n] = s->old[k];
        if (!s->keep[k]) leave(s, &changed[n], out->left);
        n++;
    }
    s->batch.template_text = s->table->template_text;
    status st = store_batch_write(s->v->store, &s->batch, s->job, s->n_new, changed, n, err);
    if (st == STATUS_OK) job_note_all(s->v, changed, n);
    free(changed);
    return st;
}

static void report(struct submission *s, struct batch_outcome *out)
{
    for (size_t i = 0, i_new = 0; i < s->table->n; i++) {
        const char *sample = s->table->sample[i].sample;
        bool taken = s->taken[i] < s->n_old;
        json_array_append_new(out->samples, json_pack("{s:s,s:s,s:s}", "sample", sample, "job",
                                                      taken ? s->old[s->taken[i]].id : s->job[i_new].id, "outcome",
                                                      taken                                       ? "taken_over"
                                                      : json_object_get(s->place, sample) != NULL ? "changed"
                                                                                                  : "new"));
        if (!taken) i_new++;
    }
    snprintf(out->id, sizeof out->id, "%s", s->batch.id);
    out->created = !s->exists;
    out->replayed = s->exists && s->n_new == 0 && s->n_other == 0;
}

/* Makes the folder of a job, unless it was deleted meanwhile. */
static status complete_place(struct job_service *v, const char *id, const char *folder, struct error *err)
{
    struct job_row row;
    job_change_begin(v, id, NULL);
    status st = job_get(v, id, &row, err);
    if (st == STATUS_OK) st = job_fill_place(v, &row, folder, err);
    job_change_end(v);
    job_row_release(&row);
    return st == STATUS_NOT_FOUND ? STATUS_OK : st;
}

/* Makes the folders that are missing after a kill or a full disk, and syncs them. */
static status complete_places(struct submission *s, struct error *err)
{
    char folder[PATH_BYTES], path[PATH_BYTES];
    struct stat info;
    status st = STATUS_OK;
    size_t n_made = s->n_new;
    for (size_t i = 0, i_new = 0; st == STATUS_OK && i < s->table->n; i++) {
        const char *id = s->taken[i] < s->n_old ? s->old[s->taken[i]].id : s->job[i_new++].id;
        path_join(folder, s->v->settings->data, "jobs", id, NULL);
        path_join(path, folder, JOB_FILE_JOURNAL, NULL);
        if (lstat(path, &info) == 0) continue;
        st = complete_place(s->v, id, folder, err);
        n_made++;
    }
    return st == STATUS_OK && n_made > 0 ? job_sync_all(s->v, err) : st;
}

/* Finds the owner's batch of this name with its jobs, or begins a new one. *text: it has another template. */
static status find_batch(struct submission *s, const char *owner, bool *text, struct error *err)
{
    struct batch_row found = {0};
    status st = store_batch_find(s->v->store, owner, s->table->name, &found, err);
    s->exists = st == STATUS_OK;
    if (st != STATUS_OK && st != STATUS_NOT_FOUND) return st;
    s->batch = found;
    *text = !s->exists || strcmp(found.template_text, s->table->template_text) != 0;
    batch_row_release(&found);
    s->batch.template_text = NULL;
    if (s->exists) return batch_jobs(s->v, s->batch.id, &s->old, &s->n_old, err);
    job_new_id(s->batch.id);
    snprintf(s->batch.owner, sizeof s->batch.owner, "%s", owner);
    snprintf(s->batch.name, sizeof s->batch.name, "%s", s->table->name);
    return STATUS_OK;
}

/* STATUS_EXISTS when the batch would change and nobody has asked for that. */
static status check_update(const struct submission *s, struct job_refusal *refusal, struct error *err)
{
    size_t n_left = 0;
    for (size_t k = 0; k < s->n_old; k++) n_left += !s->keep[k];
    if (!s->exists || s->table->update || s->n_new + s->n_other == 0) return STATUS_OK;
    refusal->extra =
        json_pack("{s:s,s:I,s:I}", "batch", s->batch.id, "n_new", (json_int_t)s->n_new, "n_left", (json_int_t)n_left);
    return error_set_field(err, STATUS_EXISTS, "name",
                           "there is a batch '%.120s' that differs from this table: %zu of its jobs would leave it and "
                           "%zu would be new; ask for that with \"update\": true, or choose another name",
                           s->batch.name, n_left, s->n_new);
}

/* Finds the changes to make. *text: the batch has another template. */
static status prepare(struct submission *s, const struct access_grant *grant, bool *text, struct job_refusal *refusal,
                      struct error *err)
{
    status st = find_batch(s, grant->owner, text, err);
    if (st == STATUS_OK) st = compare(s, err);
    if (st == STATUS_OK) st = check_update(s, refusal, err);
    if (st == STATUS_OK && s->n_new > 0) st = check_room(s, grant, refusal, err);
    return st == STATUS_OK ? make_jobs(s, err) : st;
}

/* Whether batch and jobs are as prepare has found them. */
static bool unchanged(const struct submission *s, const struct access_grant *grant)
{
    struct batch_row batch = {0};
    struct job_row *row = NULL;
    size_t n = 0;
    status st = store_batch_find(s->v->store, grant->owner, s->table->name, &batch, NULL);
    bool same = s->exists ? st == STATUS_OK && strcmp(batch.id, s->batch.id) == 0 &&
                                batch.updated_unix_s <= s->batch.updated_unix_s
                          : st == STATUS_NOT_FOUND;
    batch_row_release(&batch);
    if (!same || !s->exists) return same;
    same = batch_jobs(s->v, s->batch.id, &row, &n, NULL) == STATUS_OK && n == s->n_old;
    for (size_t k = 0; same && k < n; k++)
        same = strcmp(row[k].id, s->old[k].id) == 0 && row[k].revision == s->old[k].revision;
    job_rows_free(row, n);
    return same;
}

static status commit(struct submission *s, bool text, struct batch_outcome *out, struct error *err)
{
    status st = text || s->n_new + s->n_other > 0 ? write_batch(s, out, err) : STATUS_OK;
    if (st != STATUS_OK) return st;
    batch_places_move(s->v, s->batch.id, s->job, s->n_new);
    report(s, out);
    return STATUS_OK;
}

/* Begins again after a change by another request. */
static void forget(struct submission *s)
{
    job_rows_free(s->old, s->n_old);
    free(s->taken);
    free(s->row_of_new);
    free(s->keep);
    free(s->other);
    json_decref(s->place);
    free(s->job);
    *s = (struct submission){.v = s->v, .table = s->table};
}

/* Holds the lock to find the changes and to write them. The folders of many jobs take longer, so they are made between
 * the two, without the lock. Changes of other requests meanwhile are found by another try; in the last try the lock is
 * held throughout. */
static status submit(struct submission *s, const struct access_grant *grant, struct batch_outcome *out,
                     struct job_refusal *refusal, struct error *err)
{
    status st = STATUS_OK;
    bool text = false, done = false;
    for (int n_try = 1; st == STATUS_OK && !done; n_try++) {
        const bool last = n_try == TRY_MOST;
        forget(s);
        job_change_begin(s->v, NULL, NULL);
        st = prepare(s, grant, &text, refusal, err);
        if (!last && st == STATUS_OK && s->n_new > 0) {
            job_change_end(s->v);
            st = batch_places_make(s->v, s->batch.id, s->job, s->n_new, err);
            job_change_begin(s->v, NULL, NULL);
        }
        done = last || s->n_new == 0 || unchanged(s, grant);
        if (st == STATUS_OK && done && s->n_new > 0) st = check_room(s, grant, refusal, err);
        if (st == STATUS_OK && done) st = commit(s, text, out, err);
        job_change_end(s->v);
        if (s->n_new > 0) batch_places_discard(s->v, s->batch.id);
    }
    return st == STATUS_OK ? complete_places(s, err) : st;
}

status batch_submit(struct job_service *v, const struct access_grant *grant, const struct batch_table *table,
                    struct batch_outcome *out, struct job_refusal *refusal, struct error *err)
{
    struct submission s = {.v = v, .table = table};
    *out = (struct batch_outcome){.samples = json_array(), .left = json_array()};
    status st = submit(&s, grant, out, refusal, err);
    if (st == STATUS_OK && json_array_size(out->left) > 0) job_wake_runner(v);
    if (st == STATUS_OK) st = batch_declare_files(v, grant, table, out, refusal, err);
    if (st == STATUS_OK && !out->replayed)
        log_info(v->log, "batch %s '%s': %zu samples, %zu of them new", out->id, table->name, table->n, s.n_new);
    forget(&s);
    return st;
}
