#include "server/batches/batch_view.h"
#include "base/clock.h"
#include "server/batches/batch_service.h"
#include "server/files/worker_files.h"
#include "server/jobs/queue_forecast.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static json_t *describe(const struct batch_row *row, const int64_t count[JOB_N_STATE])
{
    int64_t n = 0;
    json_t *states = json_object();
    for (int i = 0; i < JOB_N_STATE; i++) {
        n += count[i];
        json_object_set_new(states, job_state_name((enum job_state)i), json_integer((json_int_t)count[i]));
    }
    json_t *out =
        json_pack("{s:s,s:s,s:f,s:f,s:I,s:o}", "id", row->id, "name", row->name, "created_unix_s", row->created_unix_s,
                  "updated_unix_s", row->updated_unix_s, "n_sample", (json_int_t)n, "states", states);
    json_object_set_new(out, "owner", row->owner[0] != '\0' ? json_string(row->owner) : json_null());
    return out;
}

status batch_summary(struct job_service *v, const struct batch_row *row, json_t **view, struct error *err)
{
    int64_t count[JOB_N_STATE];
    status s = store_batch_count(v->store, row->id, count, err);
    if (s == STATUS_OK) *view = describe(row, count);
    return s;
}

/* Progress of the jobs of a batch together. */
struct progress {
    double n_done;     /* jobs, with the fractions of running ones */
    double end_unix_s; /* of the last one that is queued or runs; 0: none */
    bool end_unknown;  /* of one of them */
    int64_t count[JOB_N_STATE];
    json_t *failures, *verdicts;
};

static void add_running(struct job_service *v, const struct job_row *row, struct progress *p)
{
    json_t *st = worker_status_read(v->settings->data, row->id);
    const json_t *eta = json_object_get(st, "eta_s"), *fraction = json_object_get(st, "fraction");
    bool present = json_integer_value(json_object_get(st, "attempt")) == row->attempt;
    if (present && json_is_number(fraction)) p->n_done += fmin(fmax(json_number_value(fraction), 0), 1);
    if (present && json_is_number(eta))
        p->end_unix_s = fmax(p->end_unix_s, clock_wall_s() + fmax(json_number_value(eta), 0));
    else
        p->end_unknown = true;
    json_decref(st);
}

static void add_queued(struct job_service *v, const struct job_row *row, struct progress *p)
{
    struct queue_place place = queue_forecast_of(v, row->id);
    if (place.end_unix_s > 0)
        p->end_unix_s = fmax(p->end_unix_s, place.end_unix_s);
    else
        p->end_unknown = true;
}

static void add_job(struct job_service *v, const struct job_row *row, struct progress *p)
{
    p->count[row->state]++;
    if (row->state >= JOB_SUCCEEDED) p->n_done++;
    if (row->state == JOB_RUNNING) add_running(v, row, p);
    if (row->state == JOB_QUEUED) add_queued(v, row, p);
    if (row->state == JOB_PAUSED) p->end_unknown = true;
    if (row->state == JOB_SUCCEEDED && row->verdict[0] != '\0') {
        json_int_t n = json_integer_value(json_object_get(p->verdicts, row->verdict));
        json_object_set_new(p->verdicts, row->verdict, json_integer(n + 1));
    }
    if (row->state == JOB_FAILED)
        json_array_append_new(p->failures,
                              json_pack("{s:s,s:s,s:s,s:s,s:s}", "sample", row->sample, "job", row->id, "code",
                                        row->error_code, "field", row->error_field, "text", row->error_text));
}

status batch_view(struct job_service *v, const struct batch_row *batch, json_t **view, struct error *err)
{
    struct job_row *row = NULL;
    size_t n = 0;
    struct progress p = {0};
    status s = batch_jobs(v, batch->id, &row, &n, err);
    if (s != STATUS_OK) return s;
    p.failures = json_array();
    p.verdicts = json_object();
    for (size_t i = 0; i < n; i++) add_job(v, &row[i], &p);
    job_rows_free(row, n);
    json_t *out = describe(batch, p.count);
    /* rounded, so that a batch changes no more often than a reader sees */
    json_object_set_new(out, "fraction", json_real(n == 0 ? 0 : round(1000 * p.n_done / (double)n) / 1000));
    json_object_set_new(out, "expected_end_unix_s",
                        p.end_unknown || p.end_unix_s <= 0 ? json_null()
                                                           : json_integer(30 * (json_int_t)ceil(p.end_unix_s / 30)));
    json_object_set_new(out, "verdicts", p.verdicts);
    json_object_set_new(out, "failures", p.failures);
    json_t *template_ = batch->template_text == NULL ? NULL : json_loads(batch->template_text, 0, NULL);
    json_object_set_new(out, "template", template_ != NULL ? template_ : json_null());
    *view = out;
    return STATUS_OK;
}
