#include "server/retention/retention.h"
#include "base/clock.h"
#include "base/files/durable.h"
#include "base/files/file_tree.h"
#include "optimizer/job/job_outline.h"
#include "server/retention/job_keep.h"
#include "server/settings/job_paths.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define DAY_S 86400.0

const char *retention_reason_name(enum retention_reason reason)
{
    static const char *const name[] = {"age", "size", "request"};
    return name[reason];
}

static bool has_ended(enum job_state state)
{
    return state == JOB_SUCCEEDED || state == JOB_FAILED || state == JOB_CANCELLED;
}

static int64_t folder_bytes(const struct job_service *v, const char *id)
{
    char path[PATH_BYTES];
    path_join(path, v->settings->data, "jobs", id, NULL);
    return disk_use_bytes(path);
}

/* ---- jobs whose geometry, or whose fit to a profile, others ask for ---- */

struct id_set {
    char (*id)[STORE_ID_BYTES];
    size_t n;
};

static bool set_holds(const struct id_set *set, const char *id)
{
    for (size_t i = 0; i < set->n; i++)
        if (strcmp(set->id[i], id) == 0) return true;
    return false;
}

/* "": none. */
static status add_id(struct id_set *set, const char *id, struct error *err)
{
    if (id[0] == '\0' || set_holds(set, id)) return STATUS_OK;
    void *more = realloc(set->id, (set->n + 1) * sizeof *set->id);
    if (more == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot list the jobs that others need: out of memory");
    set->id = more;
    snprintf(set->id[set->n++], STORE_ID_BYTES, "%.*s", STORE_ID_BYTES - 1, id);
    return STATUS_OK;
}

/* Adds the jobs that a document asks for, if it does. */
static status add_source(struct id_set *set, const char *document, struct error *err)
{
    struct job_outline outline = {.n_file = 0};
    if (document == NULL || job_outline_read(document, strlen(document), &outline, NULL) != STATUS_OK) return STATUS_OK;
    status s = add_id(set, outline.geometry_job, err);
    if (s == STATUS_OK) s = add_id(set, outline.profile_job, err);
    job_outline_release(&outline);
    return s;
}

/* Collects the jobs that a job asks for which has not ended. */
static status find_sources(struct job_service *v, struct id_set *set, struct error *err)
{
    static const enum job_state open[] = {JOB_DRAFT, JOB_QUEUED, JOB_RUNNING, JOB_PAUSED};
    status found = STATUS_OK;
    *set = (struct id_set){0};
    for (size_t k = 0; found == STATUS_OK && k < sizeof open / sizeof *open; k++) {
        struct job_row *row = NULL;
        size_t n = 0;
        const struct job_query q = {.states = 1U << open[k], .limit = SIZE_MAX >> 1};
        found = store_job_list(v->store, &q, &row, &n, err);
        for (size_t i = 0; found == STATUS_OK && i < n; i++) {
            struct job_row full = {0};
            if (store_job_get(v->store, row[i].id, &full, NULL) == STATUS_OK)
                found = add_source(set, full.document, err);
            job_row_release(&full);
        }
        job_rows_free(row, n);
    }
    return found;
}

/* ---- the plan ---- */

static void describe(struct job_service *v, const struct job_row *row, struct retention_job *job)
{
    *job = (struct retention_job){.state = row->state, .finished_unix_s = row->finished_unix_s};
    snprintf(job->id, sizeof job->id, "%s", row->id);
    snprintf(job->sample, sizeof job->sample, "%s", row->sample);
    job->bytes = folder_bytes(v, row->id);
}

static int by_end(const void *a, const void *b)
{
    const struct retention_job *x = a, *y = b;
    int order = (x->finished_unix_s > y->finished_unix_s) - (x->finished_unix_s < y->finished_unix_s);
    return order != 0 ? order : strcmp(x->id, y->id);
}

/* Keeps of the jobs, which are in the order of their end, those that must go. */
static void choose(struct retention_plan *p, const struct retention_limits *limits)
{
    double oldest_s = clock_wall_s() - (double)limits->max_age_days * DAY_S;
    int64_t left_bytes = p->total_bytes;
    size_t n = 0;
    for (size_t i = 0; i < p->n; i++) {
        struct retention_job job = p->job[i];
        bool old = limits->max_age_days > 0 && job.finished_unix_s < oldest_s;
        if (!old && (limits->max_bytes <= 0 || left_bytes <= limits->max_bytes)) continue;
        job.reason = old ? RETENTION_AGE : RETENTION_SIZE;
        left_bytes -= job.bytes;
        p->removed_bytes += job.bytes;
        p->job[n++] = job;
    }
    p->n = n;
}

status retention_plan_make(struct job_service *v, const struct retention_limits *limits, struct retention_plan *p,
                           struct error *err)
{
    struct job_row *row = NULL;
    size_t n = 0;
    struct id_set source = {0};
    const struct job_query q = {.limit = SIZE_MAX >> 1};
    *p = (struct retention_plan){0};
    status s = store_job_list(v->store, &q, &row, &n, err);
    if (s == STATUS_OK) s = find_sources(v, &source, err);
    if (s == STATUS_OK && (p->job = calloc(n > 0 ? n : 1, sizeof *p->job)) == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot list the jobs to remove: out of memory");
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        struct retention_job job = {0};
        describe(v, &row[i], &job);
        bool kept = job_is_kept(v, job.id);
        p->total_bytes += job.bytes;
        p->n_kept += kept;
        if (has_ended(job.state) && !kept && !set_holds(&source, job.id)) p->job[p->n++] = job;
    }
    if (s == STATUS_OK) {
        qsort(p->job, p->n, sizeof *p->job, by_end);
        choose(p, limits);
    } else
        retention_plan_release(p);
    free(source.id);
    job_rows_free(row, n);
    return s;
}

void retention_plan_release(struct retention_plan *p)
{
    free(p->job);
    *p = (struct retention_plan){0};
}

/* ---- removal ---- */

json_t *retention_job_view(const struct retention_job *job)
{
    return json_pack("{s:s,s:s,s:s,s:f,s:I,s:s}", "id", job->id, "sample", job->sample, "state",
                     job_state_name(job->state), "finished_unix_s", job->finished_unix_s, "bytes",
                     (json_int_t)job->bytes, "reason", retention_reason_name(job->reason));
}

static void record_path(const struct job_service *v, char path[PATH_BYTES])
{
    path_join(path, v->settings->data, "removed.rec", NULL);
}

/* The job is gone already, so a record that cannot be written is only logged; the log has the removal too. */
static void record(struct job_service *v, const struct retention_job *job)
{
    char path[PATH_BYTES];
    struct error err = {0};
    json_t *view = retention_job_view(job);
    json_object_set_new(view, "removed_unix_s", json_real(clock_wall_s()));
    char *text = json_dumps(view, JSON_COMPACT);
    record_path(v, path);
    if (text == NULL || record_append(path, text, true, &err) != STATUS_OK)
        log_warning(v->log, "the removal of job %s is not recorded: %s", job->id, err.text);
    free(text);
    json_decref(view);
}

struct removal {
    struct job_service *v;
    const struct id_set *source;
    struct retention_job *removed;
};

static status may_go(void *context, const struct job_row *row, struct error *err)
{
    const struct removal *m = context;
    if (!has_ended(row->state))
        return error_set(err, STATUS_CONFLICT, "job %s is %s; only jobs that have ended are removed", row->id,
                         job_state_name(row->state));
    if (job_is_kept(m->v, row->id)) return error_set(err, STATUS_CONFLICT, "job %s is kept", row->id);
    if (set_holds(m->source, row->id))
        return error_set(err, STATUS_CONFLICT, "a job that has not ended asks for the geometry of job %s", row->id);
    describe(m->v, row, m->removed);
    return STATUS_OK;
}

status retention_remove(struct job_service *v, const char *id, enum retention_reason reason,
                        struct retention_job *removed, struct error *err)
{
    struct id_set source = {0};
    struct removal m = {v, &source, removed};
    status s = find_sources(v, &source, err);
    if (s == STATUS_OK) s = job_remove(v, id, may_go, &m, err);
    free(source.id);
    if (s != STATUS_OK) return s;
    removed->reason = reason;
    log_info(v->log, "job %s ('%s', %.1f MB) was removed by retention, for its %s", id, removed->sample,
             (double)removed->bytes / 1e6, retention_reason_name(reason));
    record(v, removed);
    return STATUS_OK;
}

struct last_records {
    json_t *list;
    size_t most;
};

static bool keep_last(void *context, const char *text, size_t n)
{
    struct last_records *last = context;
    json_t *one = json_loadb(text, n, JSON_REJECT_DUPLICATES, NULL);
    if (one != NULL) json_array_append_new(last->list, one);
    if (json_array_size(last->list) > last->most) json_array_remove(last->list, 0);
    return true;
}

status retention_removals(const struct job_service *v, size_t most, json_t **list, struct error *err)
{
    char path[PATH_BYTES];
    struct last_records last = {json_array(), most};
    record_path(v, path);
    status s = record_read(path, 0, keep_last, &last, NULL, err);
    if (s != STATUS_OK && s != STATUS_NOT_FOUND) {
        json_decref(last.list);
        return s;
    }
    *list = json_array();
    for (size_t i = json_array_size(last.list); i > 0; i--) json_array_append(*list, json_array_get(last.list, i - 1));
    json_decref(last.list);
    return STATUS_OK;
}
