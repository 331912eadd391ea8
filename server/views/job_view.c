#include "server/views/job_view.h"
#include "base/clock.h"
#include "base/version.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/stage_table.h"
#include "server/files/backend_note.h"
#include "server/files/worker_files.h"
#include "server/jobs/job_tags.h"
#include "server/jobs/queue_forecast.h"
#include "server/retention/job_keep.h"
#include "server/settings/job_paths.h"

#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static json_t *time_or_null(double t) { return t > 0 ? json_real(t) : json_null(); }

static bool has_run(const struct job_row *row) { return row->attempt > 0 && !row->dirty; }

/* Copies member `name` of the worker's status, or sets the fallback (owned by the callee). */
static void put(json_t *out, const char *key, const json_t *from, const char *name, json_type type, json_t *fallback)
{
    json_t *x = json_object_get(from, name);
    bool fits = x != NULL && (json_typeof(x) == type || (type == JSON_REAL && json_is_number(x)));
    if (fits) {
        json_decref(fallback);
        json_object_set(out, key, x);
    } else
        json_object_set_new(out, key, fallback);
}

static void put_error(json_t *out, const struct job_row *row)
{
    json_object_set_new(out, "error",
                        row->error_code[0] == '\0' ? json_null()
                                                   : json_pack("{s:s,s:s,s:s}", "code", row->error_code, "field",
                                                               row->error_field, "text", row->error_text));
}

static void put_progress(json_t *out, const struct job_row *row, const json_t *st)
{
    size_t n_stage = 0;
    pipeline_stage_table(&n_stage);
    bool running = row->state == JOB_RUNNING;
    put(out, "stage", st, "stage", JSON_STRING, json_null());
    put(out, "i_stage", st, "i_stage", JSON_INTEGER, json_null());
    json_object_set_new(out, "n_stage", json_integer((json_int_t)n_stage));
    put(out, "stage_fraction", st, "stage_fraction", JSON_REAL, json_real(0));
    put(out, "fraction", st, "fraction", JSON_REAL, json_real(0));
    if (row->state == JOB_SUCCEEDED) json_object_set_new(out, "fraction", json_real(1));
    put(out, "eta_s", running ? st : NULL, "eta_s", JSON_REAL, json_null());
    put(out, "eta_low_s", running ? st : NULL, "eta_low_s", JSON_REAL, json_null());
    put(out, "eta_high_s", running ? st : NULL, "eta_high_s", JSON_REAL, json_null());
    json_object_set_new(out, "heartbeat_age_s", json_null());
    put(out, "message", st, "message", JSON_STRING, json_string(""));
    if (row->state == JOB_PAUSED)
        json_object_set_new(out, "message",
                            json_string("the disk of the service is nearly full; the job goes on where it was when "
                                        "there is space again"));
    put(out, "objective", st, "objective", JSON_REAL, json_null());
    put(out, "objective_se", st, "objective_se", JSON_REAL, json_null());
    put(out, "step", st, "step", JSON_INTEGER, json_null());
    put(out, "warnings", st, "warnings", JSON_ARRAY, json_array());
    put(out, "verdict", row->state == JOB_SUCCEEDED ? st : NULL, "verdict", JSON_OBJECT, json_null());
    json_int_t peak = json_integer_value(json_object_get(st, "peak_rss_bytes"));
    json_object_set_new(out, "peak_rss_bytes", json_integer(peak > row->peak_rss_bytes ? peak : row->peak_rss_bytes));
}

/* Where an engine has the job, and why it waits there. The engine is asked now and then, so a worker that has written
 * its status computes, whatever the engine said last. */
static void put_backend(struct job_service *v, json_t *out, const struct job_row *row, const json_t *st)
{
    char message[512];
    json_object_set_new(out, "backend", backend_note_view(v->settings->data, row, message, sizeof message));
    if (row->state == JOB_QUEUED && v->runner.trouble != NULL)
        v->runner.trouble(v->runner.context, message, sizeof message);
    bool computes = row->state == JOB_RUNNING && json_integer_value(json_object_get(st, "attempt")) == row->attempt;
    if (message[0] != '\0' && !computes) json_object_set_new(out, "message", json_string(message));
}

static void put_place(struct job_service *v, json_t *out, const struct job_row *row)
{
    struct queue_place place = {0};
    if (row->state == JOB_QUEUED) place = queue_forecast_of(v, row->id);
    json_object_set_new(out, "queue_position",
                        place.position > 0 ? json_integer((json_int_t)place.position) : json_null());
    json_object_set_new(out, "expected_start_unix_s", time_or_null(place.start_unix_s));
    json_object_set_new(out, "expected_end_unix_s", time_or_null(place.end_unix_s));
}

json_t *job_view_heartbeat_age(struct job_service *v, const struct job_row *row)
{
    if (row->state != JOB_RUNNING) return json_null();
    json_t *st = worker_status_read(v->settings->data, row->id), *age = json_null();
    json_t *at = json_object_get(st, "heartbeat_unix_s");
    if (json_is_number(at) && json_integer_value(json_object_get(st, "attempt")) == row->attempt) {
        double s = clock_wall_s() - json_number_value(at);
        age = json_real(s > 0 ? s : 0);
    }
    json_decref(st);
    return age;
}

/* The address of the result, or null; *identity tells two contents of the file apart. */
static json_t *result_url(struct job_service *v, const struct job_row *row, char *identity, size_t n_identity)
{
    char path[PATH_BYTES], url[128];
    struct stat st;
    identity[0] = '\0';
    path_join(path, v->settings->data, "jobs", row->id, JOB_FOLDER_RESULTS, "result.json", NULL);
    if (!has_run(row) || stat(path, &st) != 0 || !S_ISREG(st.st_mode)) return json_null();
    snprintf(identity, n_identity, "%llu %lld %lld.%09ld", (unsigned long long)st.st_ino, (long long)st.st_size,
             (long long)st.st_mtim.tv_sec, st.st_mtim.tv_nsec);
    snprintf(url, sizeof url, "/v1/jobs/%s/results/result.json", row->id);
    return json_string(url);
}

json_t *file_view(const struct file_row *f)
{
    char upload[128], url[320];
    snprintf(upload, sizeof upload, "/v1/uploads/%s", f->id);
    snprintf(url, sizeof url, "/v1/jobs/%s/files/%s", f->job_id, f->name);
    bool complete = f->state == FILE_COMPLETE;
    return json_pack("{s:s,s:s,s:I,s:o,s:s,s:I,s:o,s:s}", "name", f->name, "role", f->role, "size",
                     (json_int_t)f->size_bytes, "sha256", f->sha256[0] ? json_string(f->sha256) : json_null(), "state",
                     complete ? "complete" : "uploading", "offset", (json_int_t)f->offset_bytes, "upload_url",
                     complete ? json_null() : json_string(upload), "url", url);
}

status job_view_files(struct job_service *v, const struct job_row *row, json_t **out, struct error *err)
{
    struct file_row *file = NULL;
    size_t n = 0;
    json_t *missing = NULL;
    status s = store_file_list(v->store, row->id, &file, &n, err);
    if (s != STATUS_OK) goto out;
    s = job_missing_files(v, row, &missing, err);
    if (s == STATUS_INVALID || s == STATUS_TOO_LARGE) {
        /* a document that was valid under earlier rules: its job can be read, but not started again */
        missing = json_array();
        s = STATUS_OK;
    }
    if (s != STATUS_OK) goto out;
    json_t *list = json_array();
    for (size_t i = 0; i < n; i++) {
        upload_refresh(v->upload, &file[i]);
        json_array_append_new(list, file_view(&file[i]));
    }
    *out = json_pack("{s:o,s:o}", "files", list, "missing_files", missing);
out:
    free(file);
    return s;
}

static status put_details(struct job_service *v, const struct job_row *row, json_t *out, struct error *err)
{
    json_t *files = NULL;
    status s = job_view_files(v, row, &files, err);
    if (s != STATUS_OK) return s;
    json_t *document = json_loads(row->document, JSON_REJECT_DUPLICATES, NULL);
    json_object_set_new(out, "document", document != NULL ? document : json_object());
    json_object_update(out, files);
    json_decref(files);
    char identity[80];
    json_object_set_new(out, "kept", json_boolean(job_is_kept(v, row->id)));
    json_object_set_new(out, "result_url", result_url(v, row, identity, sizeof identity));
    return STATUS_OK;
}

status job_view(struct job_service *v, const struct job_row *row, bool full, json_t **view, struct error *err)
{
    json_t *st = has_run(row) ? worker_status_read(v->settings->data, row->id) : NULL;
    json_t *out = json_pack("{s:s,s:s,s:s,s:b,s:f,s:f,s:o,s:o,s:I,s:I,s:I}", "id", row->id, "sample", row->sample,
                            "state", job_state_name(row->state), "cancel_requested", row->cancel_requested,
                            "created_unix_s", row->created_unix_s, "updated_unix_s", row->updated_unix_s,
                            "started_unix_s", time_or_null(row->started_unix_s), "finished_unix_s",
                            time_or_null(row->finished_unix_s), "attempt", (json_int_t)row->attempt, "lost_attempts",
                            (json_int_t)row->lost_attempts, "generation", (json_int_t)row->generation);
    json_object_set_new(out, "priority", json_integer((json_int_t)row->priority));
    json_object_set_new(out, "owner", row->owner[0] != '\0' ? json_string(row->owner) : json_null());
    json_object_set_new(out, "tags", job_tags_json(row));
    json_object_set_new(out, "batch",
                        row->batch[0] == '\0' ? json_null()
                                              : json_pack("{s:s,s:s}", "id", row->batch, "name", row->batch_name));
    put_place(v, out, row);
    put_progress(out, row, st);
    put_backend(v, out, row, st);
    put_error(out, row);
    json_decref(st);
    status s = full ? put_details(v, row, out, err) : STATUS_OK;
    if (s != STATUS_OK)
        json_decref(out);
    else
        *view = out;
    return s;
}

static void tag_of(char out[JOB_TAG_BYTES], const char *text)
{
    unsigned char sum[16];
    char hex[33];
    crypto_generichash(sum, sizeof sum, (const unsigned char *)text, strlen(text), NULL, 0);
    sodium_bin2hex(hex, sizeof hex, sum, sizeof sum);
    snprintf(out, JOB_TAG_BYTES, "\"%s\"", hex);
}

void job_view_files_tag(struct job_service *v, const struct job_row *row, char tag[JOB_TAG_BYTES])
{
    char text[160];
    snprintf(text, sizeof text, "%s %s %lld %llx", SELVEDGE_VERSION, row->id, (long long)row->revision,
             (unsigned long long)upload_progress(v->upload, row->id));
    tag_of(tag, text);
}

status job_view_tag(struct job_service *v, const struct job_row *row, char tag[JOB_TAG_BYTES], struct error *err)
{
    char files[JOB_TAG_BYTES], identity[80];
    json_t *summary = NULL;
    status s = job_view(v, row, false, &summary, err);
    if (s != STATUS_OK) return s;
    job_view_files_tag(v, row, files);
    json_object_set_new(summary, "files", json_string(files));
    json_object_set_new(summary, "result_url", result_url(v, row, identity, sizeof identity));
    json_object_set_new(summary, "result", json_string(identity));
    char *text = json_dumps(summary, JSON_COMPACT);
    json_decref(summary);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot describe the job: out of memory");
    tag_of(tag, text);
    free(text);
    return STATUS_OK;
}
