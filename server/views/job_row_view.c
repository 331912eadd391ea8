#include "server/views/job_row_view.h"
#include "optimizer/job/job_folder.h"
#include "server/files/worker_files.h"
#include "server/jobs/job_tags.h"
#include "server/jobs/queue_forecast.h"
#include "server/settings/job_paths.h"

#include <math.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { TEXT_MOST = 200 };

static void put_time(json_t *out, const char *key, double unix_s)
{
    if (unix_s > 0) json_object_set_new(out, key, json_integer((json_int_t)unix_s));
}

/* Copies whole characters of UTF-8, TEXT_MOST bytes at most. */
static json_t *shortened(const char *text)
{
    size_t n = strlen(text);
    if (n <= TEXT_MOST) return json_string(text);
    for (n = TEXT_MOST; n > 0 && ((unsigned char)text[n] & 0xC0) == 0x80;) n--;
    char part[TEXT_MOST + 4];
    snprintf(part, sizeof part, "%.*s...", (int)n, text);
    return json_string(part);
}

/* Remaining time in whole seconds, and a fraction of three digits: a row changes no more often than a reader sees. */
static void put_progress(json_t *out, const json_t *st, bool running)
{
    static const char *const key[] = {"eta_s", "eta_low_s", "eta_high_s"};
    json_t *fraction = json_object_get(st, "fraction"), *stage = json_object_get(st, "stage");
    if (json_is_number(fraction))
        json_object_set_new(out, "fraction", json_real(round(1000 * json_number_value(fraction)) / 1000));
    if (!running) return;
    if (json_is_string(stage)) json_object_set(out, "stage", stage);
    for (size_t i = 0; i < sizeof key / sizeof key[0]; i++) {
        const json_t *eta = json_object_get(st, key[i]);
        if (json_is_number(eta))
            json_object_set_new(out, key[i], json_integer((json_int_t)ceil(json_number_value(eta))));
    }
}

static void put_verdict(json_t *out, const struct job_row *row, const json_t *st)
{
    const json_t *verdict = json_object_get(st, "verdict");
    const char *words = json_string_value(json_object_get(verdict, "words"));
    if (row->verdict[0] == '\0') return;
    json_object_set_new(out, "verdict",
                        json_pack("{s:s,s:s}", "code", row->verdict, "words", words == NULL ? row->verdict : words));
}

static void put_thumbnail(struct job_service *v, json_t *out, const struct job_row *row)
{
    char path[PATH_BYTES], url[128];
    struct stat st;
    path_join(path, v->settings->data, "jobs", row->id, JOB_FOLDER_RESULTS, JOB_THUMBNAIL, NULL);
    if (stat(path, &st) != 0 || !S_ISREG(st.st_mode)) return;
    /* the time makes it another address when the picture changes, so that a browser may keep it */
    snprintf(url, sizeof url, "/v1/jobs/%s/results/" JOB_THUMBNAIL, row->id);
    json_object_set_new(out, "thumbnail_url", json_string(url));
}

static void put_queue(struct job_service *v, json_t *out, const struct job_row *row)
{
    if (row->state != JOB_QUEUED) return;
    struct queue_place place = queue_forecast_of(v, row->id);
    if (place.position > 0) json_object_set_new(out, "queue_position", json_integer((json_int_t)place.position));
    put_time(out, "expected_start_unix_s", place.start_unix_s);
    put_time(out, "expected_end_unix_s", place.end_unix_s);
}

static json_t *describe(struct job_service *v, const struct job_row *row)
{
    bool has_run = row->attempt > 0 && row->state != JOB_DRAFT && !row->dirty;
    json_t *st = has_run ? worker_status_read(v->settings->data, row->id) : NULL;
    json_t *out = json_pack("{s:s,s:s,s:s,s:I}", "id", row->id, "sample", row->sample, "state",
                            job_state_name(row->state), "created_unix_s", (json_int_t)row->created_unix_s);
    put_time(out, "started_unix_s", row->started_unix_s);
    put_time(out, "finished_unix_s", row->finished_unix_s);
    if (row->owner[0] != '\0') json_object_set_new(out, "owner", json_string(row->owner));
    if (row->tags[0] != '\0') json_object_set_new(out, "tags", job_tags_json(row));
    if (row->cancel_requested) json_object_set_new(out, "cancel_requested", json_true());
    if (row->state != JOB_SUCCEEDED) put_progress(out, st, row->state == JOB_RUNNING);
    put_verdict(out, row, st);
    put_queue(v, out, row);
    if (has_run) put_thumbnail(v, out, row);
    if (row->error_code[0] != '\0')
        json_object_set_new(out, "error",
                            json_pack("{s:s,s:s,s:o}", "code", row->error_code, "field", row->error_field, "text",
                                      shortened(row->error_text)));
    json_decref(st);
    return out;
}

json_t *job_row_view(struct job_service *v, const struct job_row *row, char digest[JOB_DIGEST_BYTES])
{
    unsigned char sum[crypto_generichash_BYTES_MIN];
    json_t *out = describe(v, row);
    char *text = json_dumps(out, JSON_COMPACT);
    if (text == NULL) {
        json_decref(out);
        return NULL;
    }
    crypto_generichash(sum, sizeof sum, (const unsigned char *)text, strlen(text), NULL, 0);
    sodium_bin2hex(digest, JOB_DIGEST_BYTES, sum, (JOB_DIGEST_BYTES - 1) / 2);
    free(text);
    json_object_set_new(out, "digest", json_string(digest));
    return out;
}
