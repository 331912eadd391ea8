/* Records of a series are sorted by steps: first the records of a search for the radius, then each model's in order.
 * The requested records are found by bisection (record_seek), counted, and merged while they are read. So the cost of a
 * request depends on the size of its reply and not of the file, and memory holds only the points. */
#include "server/views/series_view.h"
#include "base/catalogue/model_catalogue.h"
#include "base/files/durable.h"
#include "base/files/foreign_json.h"
#include "base/files/json_member.h"
#include "optimizer/job/document/job_limits.h"
#include "optimizer/job/job_folder.h"
#include "server/settings/job_paths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Limit on the size of a reply with the renderings of all points; beyond it there are fewer points. */
enum { ALL_RENDERED_BYTES = 8 << 20, KEY_RADIUS = -1 };

/* Limits of reading a file for one request. A longer series is given in several requests. */
enum { READ_MOST_BYTES = 256 << 20, HELD_MOST_BYTES = 128 << 20, DESCRIPTION_MOST_BYTES = 64 << 20 };

#define STEP_MOST (INT64_C(1) << 53)
#define POINT_MEMBERS                                                                                                  \
    "step", "model", "i_model", "model_step", "phase", "wall_s", "n_path", "n_path_total", "objective",                \
        "objective_se", "parameter", "parameter_se", "rel_rms", "damping", "noise", "step_length", "step_limit",       \
        "gain", "nuisance", "note"
static const char *const key_member[] = {"step", "phase", "i_model", NULL},
                         *const description_member[] = {"phase", "i_model", "model", "parameters", NULL},
                         *const point_member[] = {POINT_MEMBERS, NULL},
                         *const whole_member[] = {POINT_MEMBERS, "rendered", "n_path_row", NULL};
static const struct foreign_bounds key_bounds = {RECORD_MOST_BYTES, 4096, 16, key_member},
                                   description_bounds = {RECORD_MOST_BYTES, 1 << 20, 16, description_member},
                                   point_bounds = {RECORD_MOST_BYTES, 1 << 20, 16, point_member},
                                   whole_bounds = {RECORD_MOST_BYTES, 8 << 20, 16, whole_member};

/* Returns NULL for a line that is no record. */
static json_t *parse(const char *json, size_t n, const struct foreign_bounds *bounds, size_t *held)
{
    json_t *j = NULL;
    foreign_json_parse(json, n, bounds, held, &j, NULL);
    return j;
}

/* Reads "step", which the worker writes first. Returns false for a record without a whole step. */
static bool read_step(const char *json, size_t n, json_int_t *step)
{
    static const char begin[] = "{\"step\":";
    char *end = NULL;
    if (n > sizeof begin && memcmp(json, begin, sizeof begin - 1) == 0) {
        *step = strtoll(json + sizeof begin - 1, &end, 10);
        if (end != json + sizeof begin - 1 && (*end == ',' || *end == '}')) return *step >= 0 && *step < STEP_MOST;
    }
    json_t *j = parse(json, n, &key_bounds, NULL), *value = json_object_get(j, "step");
    bool found = json_is_integer(value) && json_integer_value(value) >= 0 && json_integer_value(value) < STEP_MOST;
    *step = json_integer_value(value);
    json_decref(j);
    return found;
}

/* Whether a record describes the parameters of a model. */
static bool is_description(json_t *parameters, const json_t *model)
{
    static const struct json_member of_parameter[] = {{"name", JSON_IS_TEXT, false, 0, 0},
                                                      {"unit", JSON_IS_TEXT, false, 0, 0},
                                                      {"lower", JSON_IS_NUMBER, false, -1e300, 1e300},
                                                      {"upper", JSON_IS_NUMBER, false, -1e300, 1e300},
                                                      {"fixed", JSON_IS_FLAG, false, 0, 0}};
    size_t i;
    json_t *one;
    json_array_foreach(parameters, i, one) if (!json_members_keep(one, of_parameter, 5, false)) return false;
    return json_is_array(parameters) && (model == NULL || json_is_string(model));
}

static json_int_t model_of(const json_t *record) { return json_integer_value(json_object_get(record, "i_model")); }

/* Sort key of the records: first the search for the radius, whatever model it used, then the models. */
static json_int_t key_of(const json_t *record)
{
    const char *phase = json_string_value(json_object_get(record, "phase"));
    return phase != NULL && strcmp(phase, "radius") == 0 ? KEY_RADIUS : model_of(record);
}

/* ---- selection of records ---- */

struct counting {
    long long after_step;
    json_int_t last_step;
    size_t n, n_bytes; /* of the records after after_step */
    size_t n_read;     /* bytes of all records that were read */
};

static bool is_seen(void *context, const char *json, size_t n)
{
    const struct counting *c = context;
    json_int_t step;
    return read_step(json, n, &step) && step <= c->after_step;
}

static bool count(void *context, const char *json, size_t n)
{
    struct counting *c = context;
    json_int_t step;
    c->n_read += n;
    if (c->n_read > READ_MOST_BYTES) return false;
    if (!read_step(json, n, &step)) return true;
    if (step > c->last_step) c->last_step = step;
    if (step <= c->after_step) return true;
    c->n++;
    c->n_bytes += n;
    return true;
}

/* ---- description of the numbers ---- */

struct description {
    json_int_t i_model;
    json_t *model; /* [{"id", "parameters"}] of the preceding models */
    size_t n_read;
};

static bool is_of_earlier_model(void *context, const char *json, size_t n)
{
    const struct description *d = context;
    json_t *j = parse(json, n, &key_bounds, NULL);
    bool earlier = j != NULL && key_of(j) < d->i_model;
    json_decref(j);
    return earlier;
}

/* The first record of a model describes its parameters. So does the first record of a search before the fit, for the
 * model that it uses. */
static bool take_description(void *context, const char *json, size_t n)
{
    struct description *d = context;
    json_t *j = parse(json, n, &description_bounds, NULL), *parameters = json_object_get(j, "parameters");
    bool found = is_description(parameters, json_object_get(j, "model")) && model_of(j) == d->i_model;
    d->n_read += n;
    bool go_on = !found && d->n_read < DESCRIPTION_MOST_BYTES && (j == NULL || key_of(j) < d->i_model);
    if (found)
        json_array_append_new(d->model,
                              json_pack("{s:O?,s:O}", "id", json_object_get(j, "model"), "parameters", parameters));
    json_decref(j);
    return go_on;
}

static bool keep_last_model(void *context, const char *json, size_t n)
{
    json_t *j = parse(json, n, &key_bounds, NULL);
    if (j != NULL) *(json_int_t *)context = key_of(j) > 0 ? key_of(j) : 0;
    json_decref(j);
    return true;
}

static bool always(void *context, const char *json, size_t n)
{
    (void)context, (void)json, (void)n;
    return true;
}

/* Describes all models whose fit has started. */
static status describe_models(const char *path, json_t *model, struct error *err)
{
    uint64_t from = 0;
    json_int_t last = 0;
    status s = record_seek(path, always, NULL, &from, err);
    if (s == STATUS_OK) s = record_read(path, from, keep_last_model, &last, NULL, err);
    for (json_int_t i = 0; s == STATUS_OK && i <= last && i < JOB_MAX_MODEL && json_array_size(model) == (size_t)i;
         i++) {
        struct description d = {i, model, 0};
        s = record_seek(path, is_of_earlier_model, &d, &from, err);
        if (s == STATUS_OK && i == 0) from = 0; /* the search may have described the model */
        if (s == STATUS_OK) s = record_read(path, from, take_description, &d, NULL, err);
    }
    return s;
}

/* ---- points ---- */

/* Records that are merged to one point: the last record with the extremes of all. */
struct group {
    json_t *last;
    size_t n, n_parameter, held; /* held: memory of the last record */
    double least, most, low[MODEL_MAX_FLAT], high[MODEL_MAX_FLAT];
};

struct merging {
    long long after_step;
    size_t n, n_point, i;
    bool all_rendered;
    json_t *point;
    size_t held; /* memory of the points */
    struct group group;
};

static void widen(const json_t *value, double *low, double *high)
{
    if (!json_is_number(value)) return;
    *low = fmin(*low, json_number_value(value));
    *high = fmax(*high, json_number_value(value));
}

static void restart_group(struct group *g, size_t n_parameter)
{
    json_decref(g->last);
    *g = (struct group){.n_parameter = n_parameter, .least = INFINITY, .most = -INFINITY};
    for (size_t p = 0; p < MODEL_MAX_FLAT; p++) {
        g->low[p] = INFINITY;
        g->high[p] = -INFINITY;
    }
}

/* Takes ownership of the record. A record of an earlier model or with other parameters cannot be merged, so it is
 * left out. */
static void add_to_group(struct group *g, json_t *record, size_t held)
{
    const json_t *parameter = json_object_get(record, "parameter");
    size_t n = json_array_size(parameter);
    if (g->n == 0 || n != g->n_parameter || model_of(g->last) != model_of(record)) restart_group(g, n);
    widen(json_object_get(record, "objective"), &g->least, &g->most);
    for (size_t p = 0; p < n && p < MODEL_MAX_FLAT; p++) widen(json_array_get(parameter, p), &g->low[p], &g->high[p]);
    json_decref(g->last);
    g->last = record;
    g->held = held;
    g->n++;
}

static bool is_whole(const struct merging *m) { return m->all_rendered || json_array_size(m->point) + 1 == m->n_point; }

static json_t *number_or_null(double v) { return isfinite(v) ? json_real(v) : json_null(); }

static void close_group(struct merging *m)
{
    struct group *g = &m->group;
    if (g->n > 1) {
        json_object_set_new(g->last, "n_merged", json_integer((json_int_t)g->n));
        json_object_set_new(g->last, "objective_min", number_or_null(g->least));
        json_object_set_new(g->last, "objective_max", number_or_null(g->most));
        json_t *low = json_array(), *high = json_array();
        for (size_t p = 0; p < g->n_parameter && p < MODEL_MAX_FLAT; p++) {
            json_array_append_new(low, number_or_null(g->low[p]));
            json_array_append_new(high, number_or_null(g->high[p]));
        }
        json_object_set_new(g->last, "parameter_min", low);
        json_object_set_new(g->last, "parameter_max", high);
    }
    json_array_append(m->point, g->last);
    m->held += g->held;
    restart_group(g, 0);
}

static bool merge(void *context, const char *json, size_t n)
{
    struct merging *m = context;
    json_int_t step;
    size_t held = 0;
    if (m->i == m->n || m->held > HELD_MOST_BYTES) return false;
    if (!read_step(json, n, &step) || step <= m->after_step) return true;
    json_t *j = parse(json, n, is_whole(m) ? &whole_bounds : &point_bounds, &held);
    m->i++;
    if (j != NULL) add_to_group(&m->group, j, held);
    if (m->group.n > 0 && m->i == (json_array_size(m->point) + 1) * m->n / m->n_point) close_group(m);
    return true;
}

static status read_series(const char *path, struct counting *c, struct merging *m, json_t *model, size_t max_points,
                          struct error *err)
{
    uint64_t from = 0;
    status s = record_seek(path, is_seen, c, &from, err);
    if (s == STATUS_OK) s = record_read(path, from, count, c, NULL, err);
    if (s == STATUS_OK) s = describe_models(path, model, err);
    if (s != STATUS_OK || c->n == 0) return s;
    if (m->all_rendered) {
        size_t most = ALL_RENDERED_BYTES / (c->n_bytes / c->n + 1);
        max_points = most < 2 ? 2 : most < max_points ? most : max_points;
    }
    m->n = c->n;
    m->n_point = c->n < max_points ? c->n : max_points;
    s = record_read(path, from, merge, m, NULL, err);
    if (m->group.n > 0) close_group(m); /* the worker has shortened the series meanwhile */
    return s;
}

status series_view(struct job_service *v, const struct job_row *row, long long after_step, size_t max_points,
                   bool all_rendered, json_t **view, struct error *err)
{
    char path[PATH_BYTES];
    struct counting c = {.after_step = after_step, .last_step = -1};
    struct merging m = {.after_step = after_step, .all_rendered = all_rendered, .point = json_array()};
    json_t *model = json_array();
    path_join(path, v->settings->data, "jobs", row->id, JOB_FILE_SERIES, NULL);
    status s = STATUS_OK;
    if (row->attempt > 0 && !row->dirty && access(path, F_OK) == 0)
        s = read_series(path, &c, &m, model, max_points, err);
    if (s == STATUS_NOT_FOUND) s = STATUS_OK; /* the series was removed meanwhile */
    json_decref(m.group.last);
    if (s != STATUS_OK) {
        json_decref(m.point);
        json_decref(model);
        return s;
    }
    json_int_t next = c.n > 0 ? c.last_step : (json_int_t)after_step;
    *view = json_pack("{s:o,s:o,s:I,s:I,s:I}", "points", m.point, "models", model, "next_after_step", next, "n_step",
                      c.last_step + 1, "generation", (json_int_t)row->generation);
    return STATUS_OK;
}
