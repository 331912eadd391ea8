#include "server/batches/batch_plan.h"
#include "base/files/file_tree.h"
#include "server/batches/batch_service.h"
#include "server/files/worker_files.h"
#include "server/settings/job_paths.h"
#include "server/workers/input_judge.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Resources of one sample, expected or used. */
struct need {
    double wall_s, wall_low_s, wall_high_s, cpu_s, memory_bytes, disk_bytes;
    size_t n_thread;
};

struct need_list {
    struct need *item;
    size_t n;
};

static double number_of(const json_t *object, const char *key)
{
    const json_t *x = json_object_get(object, key);
    return json_is_number(x) ? json_number_value(x) : 0.0;
}

static struct need planned(const json_t *plan)
{
    enum { THREADS_MOST = 1024 };
    const double n_thread = number_of(plan, "n_thread");
    return (struct need){.wall_s = number_of(plan, "wall_s"),
                         .wall_low_s = number_of(plan, "wall_low_s"),
                         .wall_high_s = number_of(plan, "wall_high_s"),
                         .cpu_s = number_of(plan, "cpu_s"),
                         .memory_bytes = number_of(plan, "memory_bytes"),
                         .disk_bytes = number_of(plan, "disk_bytes"),
                         .n_thread = (size_t)fmin(fmax(n_thread, 1.0), THREADS_MOST)};
}

/* Returns whether the job has succeeded in the first attempt after its plan, and sets the resources that it has
 * used. */
static bool taken(struct job_service *v, const struct job_row *row, const json_t *plan, struct need *took)
{
    char folder[PATH_BYTES];
    if (row->state != JOB_SUCCEEDED || row->attempt != json_integer_value(json_object_get(plan, "attempt")) + 1)
        return false;
    json_t *said = worker_status_read(v->settings->data, row->id);
    const double cpu_s = number_of(said, "cpu_s");
    json_decref(said);
    if (!(cpu_s > 0.0)) return false;
    path_join(folder, v->settings->data, "jobs", row->id, NULL);
    *took = (struct need){.wall_s = row->finished_unix_s - row->started_unix_s,
                          .cpu_s = cpu_s,
                          .memory_bytes = (double)row->peak_rss_bytes,
                          .disk_bytes = (double)disk_use_bytes(folder)};
    return true;
}

/* ---- sums ---- */

static int by_memory(const void *a, const void *b)
{
    const struct need *x = a, *y = b;
    return (x->memory_bytes < y->memory_bytes) - (x->memory_bytes > y->memory_bytes);
}

/* Time until the last of the jobs ends, when each place takes the next one of the table as soon as it is free. */
static double drain_s(const struct need_list *l, size_t n_place)
{
    double last = 0.0, *free_s = calloc(n_place, sizeof *free_s);
    if (free_s == NULL) return NAN;
    for (size_t i = 0; i < l->n; i++) {
        size_t next = 0;
        for (size_t k = 1; k < n_place; k++)
            if (free_s[k] < free_s[next]) next = k;
        free_s[next] += l->item[i].wall_s;
        last = fmax(last, free_s[next]);
    }
    free(free_s);
    return last;
}

/* Jobs that compute at the same time: as many as the cores have room for. */
static size_t places(const struct need_list *l, size_t n_core)
{
    size_t n_thread = 1;
    for (size_t i = 0; i < l->n; i++)
        if (l->item[i].n_thread > n_thread) n_thread = l->item[i].n_thread;
    size_t n = n_core / n_thread;
    if (n > l->n) n = l->n;
    return n > 0 ? n : 1;
}

/* Sorts the list by memory. n_core: 0 for resources that jobs have used, whose time together is not stated. */
static json_t *sum_up(struct need_list *l, size_t n_core)
{
    struct need sum = {0};
    const size_t n_at_once = places(l, n_core);
    const double wall_s = n_core > 0 ? drain_s(l, n_at_once) : 0.0;
    for (size_t i = 0; i < l->n; i++) {
        sum.wall_s += l->item[i].wall_s;
        sum.wall_low_s += l->item[i].wall_low_s;
        sum.wall_high_s += l->item[i].wall_high_s;
        sum.cpu_s += l->item[i].cpu_s;
        sum.disk_bytes += l->item[i].disk_bytes;
    }
    if (l->n > 0) qsort(l->item, l->n, sizeof *l->item, by_memory);
    for (size_t i = 0; i < l->n && i < n_at_once; i++) sum.memory_bytes += l->item[i].memory_bytes;
    json_t *out = json_pack("{s:I, s:f, s:f, s:f, s:f}", "n", (json_int_t)l->n, "cpu_s", sum.cpu_s, "job_s", sum.wall_s,
                            "memory_bytes", sum.memory_bytes, "disk_bytes", sum.disk_bytes);
    if (n_core > 0 && sum.wall_s > 0.0) {
        json_object_set_new(out, "n_at_once", json_integer((json_int_t)n_at_once));
        json_object_set_new(out, "wall_s", json_real(wall_s));
        json_object_set_new(out, "wall_low_s", json_real(wall_s * sum.wall_low_s / sum.wall_s));
        json_object_set_new(out, "wall_high_s", json_real(wall_s * sum.wall_high_s / sum.wall_s));
    }
    return out;
}

/* Ratio of used resources to expected ones. */
static json_t *ratios(const json_t *took, const json_t *expected)
{
    static const char *const key[] = {"cpu_s", "job_s", "memory_bytes", "disk_bytes"};
    json_t *out = json_object();
    for (size_t i = 0; i < sizeof key / sizeof *key; i++) {
        const double of = number_of(expected, key[i]);
        json_object_set_new(out, key[i], of > 0.0 ? json_real(number_of(took, key[i]) / of) : json_null());
    }
    return out;
}

/* ---- the plan ---- */

struct sums {
    struct need_list expected, ended, took; /* all samples; expected by those that ended; used by those that ended */
    json_t *samples;
};

static json_t *need_json(const struct need *n, bool expected)
{
    json_t *out = json_pack("{s:f, s:f, s:f, s:f}", "cpu_s", n->cpu_s, "job_s", n->wall_s, "memory_bytes",
                            n->memory_bytes, "disk_bytes", n->disk_bytes);
    if (expected) json_object_set_new(out, "n_thread", json_integer((json_int_t)n->n_thread));
    return out;
}

static void add_job(struct job_service *v, const struct job_row *row, struct sums *s)
{
    json_t *plan = worker_plan_read(v->settings->data, row->id), *expected = json_null(), *took_json = json_null();
    struct need took;
    if (plan != NULL) {
        const struct need n = planned(plan);
        s->expected.item[s->expected.n++] = n;
        expected = need_json(&n, true);
        if (taken(v, row, plan, &took)) {
            s->ended.item[s->ended.n++] = n;
            s->took.item[s->took.n++] = took;
            took_json = need_json(&took, false);
        }
    }
    json_array_append_new(s->samples,
                          json_pack("{s:s, s:s, s:s, s:o, s:o}", "sample", row->sample, "job", row->id, "state",
                                    job_state_name(row->state), "expected", expected, "took", took_json));
    json_decref(plan);
}

static size_t usual_cores(const struct job_service *v)
{
    const long n_processor = sysconf(_SC_NPROCESSORS_ONLN);
    const int64_t n_thread = v->settings->threads > 0 ? v->settings->threads : n_processor;
    return (size_t)(v->settings->workers * (n_thread > 0 ? n_thread : 1));
}

static json_t *describe(const struct batch_row *batch, size_t n_core, struct sums *s)
{
    json_t *expected = sum_up(&s->expected, n_core), *ended = sum_up(&s->ended, 0), *took = sum_up(&s->took, 0);
    json_t *out =
        json_pack("{s:s, s:s, s:I, s:I, s:o}", "id", batch->id, "name", batch->name, "n_sample",
                  (json_int_t)json_array_size(s->samples), "n_core", (json_int_t)n_core, "expected", expected);
    json_object_set_new(out, "ratio", s->took.n > 0 ? ratios(took, ended) : json_null());
    json_object_set_new(out, "expected_of_ended", ended);
    json_object_set_new(out, "took", took);
    json_object_set(out, "samples", s->samples);
    return out;
}

status batch_plan(struct job_service *v, const struct batch_row *batch, size_t n_core, json_t **plan, struct error *err)
{
    struct job_row *row = NULL;
    struct sums sums = {0};
    size_t n = 0;
    status s = batch_jobs(v, batch->id, &row, &n, err);
    if (s != STATUS_OK) return s;
    struct need *all = calloc(3 * n + 1, sizeof *all);
    sums.samples = json_array();
    if (all == NULL || sums.samples == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot plan the batch: out of memory");
    else {
        sums.expected.item = all;
        sums.ended.item = all + n;
        sums.took.item = all + 2 * n;
        for (size_t i = 0; i < n; i++) add_job(v, &row[i], &sums);
        *plan = describe(batch, n_core > 0 ? n_core : usual_cores(v), &sums);
    }
    json_decref(sums.samples);
    free(all);
    job_rows_free(row, n);
    return s;
}
