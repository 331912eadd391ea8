#include "server/jobs/series_view.h"
#include "base/durable.h"
#include "optimizer/job_folder.h"
#include "server/jobs/job_paths.h"

#include <string.h>
#include <unistd.h>

enum { SERIES_MAX_RECORD = 1000000 };

struct reading {
    long long after_step;
    json_t *record;
    json_t *model; /* [{"id", "parameters"}]: what the numbers of each model's points are */
    json_int_t last_step;
    size_t n;
};

/* The first record of a model describes its parameters: to the list of models, and out of the record. */
static void take_description(struct reading *r, json_t *record)
{
    json_t *parameters = json_object_get(record, "parameters");
    if (parameters == NULL) return;
    json_int_t i_model = json_integer_value(json_object_get(record, "i_model"));
    if (i_model == (json_int_t)json_array_size(r->model)) /* a search before the fit describes the model as well */
        json_array_append_new(r->model, json_pack("{s:O?,s:O}", "id", json_object_get(record, "model"), "parameters", parameters));
    json_object_del(record, "parameters");
}

static bool on_record(void *context, const char *json, size_t n)
{
    struct reading *r = context;
    json_t *j = json_loadb(json, n, 0, NULL);
    json_int_t step = json_integer_value(json_object_get(j, "step"));
    if (json_is_integer(json_object_get(j, "step"))) {
        r->n++;
        if (step > r->last_step) r->last_step = step;
        take_description(r, j);
        if (step > r->after_step) json_array_append(r->record, j);
    }
    json_decref(j);
    return r->n < SERIES_MAX_RECORD;
}

/* Element-wise minimum and maximum of "parameter" over a group; members of other lengths are left out. */
static void merge_parameters(json_t *point, const json_t *record, size_t from, size_t to)
{
    const json_t *shape = json_object_get(point, "parameter");
    size_t n = json_array_size(shape);
    if (n == 0) return;
    json_t *low = json_array(), *high = json_array();
    for (size_t p = 0; p < n; p++) {
        double least = json_number_value(json_array_get(shape, p)), most = least;
        for (size_t i = from; i < to; i++) {
            const json_t *a = json_object_get(json_array_get(record, i), "parameter");
            if (json_array_size(a) != n) continue;
            double x = json_number_value(json_array_get(a, p));
            if (x < least) least = x;
            if (x > most) most = x;
        }
        json_array_append_new(low, json_real(least));
        json_array_append_new(high, json_real(most));
    }
    json_object_set_new(point, "parameter_min", low);
    json_object_set_new(point, "parameter_max", high);
}

static json_int_t model_of(const json_t *record, size_t i)
{
    return json_integer_value(json_object_get(json_array_get(record, i), "i_model"));
}

/* Records from .. to - 1 as one point; a group that begins in an earlier model is left to the last one's. */
static json_t *merge(const json_t *record, size_t from, size_t to)
{
    while (from + 1 < to && model_of(record, from) != model_of(record, to - 1)) from++;
    json_t *point = json_copy(json_array_get(record, to - 1));
    if (to - from == 1) return point;
    double least = 0, most = 0;
    bool any = false;
    for (size_t i = from; i < to; i++) {
        const json_t *f = json_object_get(json_array_get(record, i), "objective");
        if (!json_is_number(f)) continue;
        double x = json_number_value(f);
        if (!any || x < least) least = x;
        if (!any || x > most) most = x;
        any = true;
    }
    json_object_set_new(point, "n_merged", json_integer((json_int_t)(to - from)));
    json_object_set_new(point, "objective_min", any ? json_real(least) : json_null());
    json_object_set_new(point, "objective_max", any ? json_real(most) : json_null());
    merge_parameters(point, record, from, to);
    return point;
}

status series_view(struct job_service *v, const struct job_row *row, long long after_step, size_t max_points, bool all_rendered, json_t **view,
                   struct error *err)
{
    char path[PATH_BYTES];
    status s = STATUS_OK;
    struct reading r = {.after_step = after_step, .record = json_array(), .model = json_array(), .last_step = -1};
    path_join(path, v->settings->data, "jobs", row->id, JOB_FILE_SERIES, NULL);
    uint64_t next = 0;
    if (row->attempt > 0 && !row->dirty && access(path, F_OK) == 0) s = record_read(path, 0, on_record, &r, &next, err);
    if (s != STATUS_OK) {
        json_decref(r.record);
        json_decref(r.model);
        return s;
    }
    size_t n = json_array_size(r.record), n_point = n < max_points ? n : max_points;
    json_t *point = json_array();
    for (size_t i = 0; i < n_point; i++) {
        json_t *p = merge(r.record, i * n / n_point, (i + 1) * n / n_point);
        if (!all_rendered && i + 1 < n_point) json_object_del(p, "rendered");
        json_array_append_new(point, p);
    }
    json_decref(r.record);
    json_int_t last = n > 0 ? r.last_step : (json_int_t)after_step;
    *view = json_pack("{s:o,s:o,s:I,s:I,s:I}", "points", point, "models", r.model, "next_after_step", last, "n_step", (json_int_t)r.n, "generation", (json_int_t)row->generation);
    return STATUS_OK;
}
