#include "optimizer/stages/run/worker_series.h"
#include "base/files/durable.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/job/job_folder.h"

#include <errno.h>
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct worker_series {
    const struct worker_folder *folder;
    char path[WORKER_PATH_BYTES];
    uint64_t *end; /* end[i]: first byte after record i of the file */
    size_t n_record, capacity;
    size_t i_next; /* number of the next record */
};

static bool grow(struct worker_series *s, uint64_t end)
{
    if (s->n_record == s->capacity) {
        size_t capacity = s->capacity > 0 ? 2 * s->capacity : 256;
        uint64_t *grown = realloc(s->end, capacity * sizeof *grown);
        if (grown == NULL) return false;
        s->end = grown;
        s->capacity = capacity;
    }
    s->end[s->n_record++] = end;
    return true;
}

struct scan {
    struct worker_series *series;
    uint64_t at;
    bool out_of_memory;
};

static bool note_record(void *context, const char *json, size_t n_json)
{
    struct scan *scan = context;
    (void)json;
    scan->at += n_json + 10; /* checksum, blank, newline */
    scan->out_of_memory = !grow(scan->series, scan->at);
    return !scan->out_of_memory;
}

status worker_series_open(const struct worker_folder *folder, struct worker_series **series, struct error *err)
{
    struct worker_series *s = calloc(1, sizeof *s);
    status result = STATUS_OK;
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot open the series: out of memory");
    s->folder = folder;
    worker_folder_path(folder, JOB_FILE_SERIES, NULL, s->path);
    if (access(s->path, F_OK) == 0) {
        struct scan scan = {.series = s};
        uint64_t next = 0;
        result = record_read(s->path, 0, note_record, &scan, &next, err);
        if (result == STATUS_OK && scan.out_of_memory)
            result = error_set(err, STATUS_NO_MEMORY, "cannot open the series: out of memory");
        if (result == STATUS_OK) result = record_truncate(s->path, next, err);
    }
    if (result == STATUS_OK)
        *series = s;
    else
        worker_series_close(s);
    return result;
}

void worker_series_close(struct worker_series *s)
{
    if (s == NULL) return;
    free(s->end);
    free(s);
}

/* Describes the numbers in "parameter"; written with the first step of each model. */
static json_t *parameters_json(const struct worker_series_model *model)
{
    json_t *list = json_array();
    for (size_t p = 0; p < model->info->n_param; p++) {
        const struct param_info *info = &model->info->param[p];
        const struct fit_parameter *k = &model->parameter[p];
        json_array_append_new(list, json_pack("{s:s, s:s, s:s?, s:f, s:f, s:b}", "name", info->name, "unit",
                                              param_unit_name(info->unit), "set", info->set, "lower",
                                              param_to_file_unit(info, k->lower), "upper",
                                              param_to_file_unit(info, k->upper), "fixed", (int)k->fixed));
    }
    return list;
}

static char *record_text(const struct fit_step *step, const struct worker_series_model *model)
{
    const struct param_info *info = model->info->param;
    json_t *parameter = json_array(), *parameter_se = step->param_se != NULL ? json_array() : json_null(),
           *rendered = json_array();
    for (size_t p = 0; p < step->n_param; p++) {
        json_array_append_new(parameter, json_number(param_to_file_unit(&info[p], step->param[p])));
        if (step->param_se != NULL)
            json_array_append_new(parameter_se, json_number(param_to_file_unit(&info[p], step->param_se[p])));
    }
    for (size_t i = 0; i < step->n_configuration; i++) {
        json_t *rgb = json_array();
        for (int c = 0; c < 3; c++)
            json_array_append_new(rgb, json_number(0.5 * (step->replica[0][i].mean[c] + step->replica[1][i].mean[c])));
        json_array_append_new(rendered, rgb);
    }
    json_t *json = json_pack(
        "{s:I, s:s, s:I, s:I, s:s, s:f, s:I, s:I, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:s}", "step",
        (json_int_t)(model->step_base + step->step), "model", model->info->id, "i_model", (json_int_t)model->i_model,
        "model_step", (json_int_t)step->step, "phase", step->phase, "wall_s", step->wall_s, "n_path",
        (json_int_t)step->n_path, "n_path_total", (json_int_t)step->n_path_total, "objective",
        json_number(step->objective.value), "objective_se", json_number(step->objective.se), "parameter", parameter,
        "parameter_se", parameter_se, "rel_rms", json_number(step->objective.rel_rms), "rendered", rendered, "damping",
        json_number(step->damping), "noise", json_number(step->noise), "note", step->note != NULL ? step->note : "");
    if (json != NULL && step->step == 0) json_object_set_new(json, "parameters", parameters_json(model));
    if (json != NULL) {
        json_t *paths = json_array(); /* paths of both replicas, per row */
        for (size_t i = 0; i < step->n_configuration; i++)
            json_array_append_new(paths,
                                  json_integer((json_int_t)(step->replica[0][i].n_path + step->replica[1][i].n_path)));
        json_object_set_new(json, "n_path_row", paths);
        json_object_set_new(json, "step_length", json_number(step->step_length));
        json_object_set_new(json, "step_limit", json_number(step->step_limit));
        json_object_set_new(json, "gain", json_number(step->decrease));
    }
    if (json != NULL && step->nuisance != NULL) {
        json_t *nuisance = json_object();
        for (size_t i = 0; i < step->nuisance->n; i++)
            json_object_set_new(
                nuisance, step->nuisance->name[i],
                json_pack("[o, o]", json_number(step->nuisance->value[i]), json_number(step->nuisance->se[i])));
        json_object_set_new(json, "nuisance", nuisance);
    }
    char *text = json != NULL ? json_dumps(json, JSON_REAL_PRECISION(9) | JSON_COMPACT) : NULL;
    json_decref(json);
    return text;
}

status worker_series_add(struct worker_series *s, const struct fit_step *step, const struct worker_series_model *model,
                         bool replayed, struct error *err)
{
    if (replayed && s->i_next < s->n_record) {
        s->i_next++;
        return STATUS_OK;
    }
    status result = worker_folder_check(s->folder, err);
    if (result == STATUS_OK && s->i_next < s->n_record) {
        result = record_truncate(s->path, s->i_next > 0 ? s->end[s->i_next - 1] : 0, err);
        s->n_record = s->i_next;
    }
    if (result != STATUS_OK) return result;
    char *text = record_text(step, model);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write to the series: out of memory");
    result = record_append(s->path, text, true, err);
    uint64_t before = s->n_record > 0 ? s->end[s->n_record - 1] : 0;
    if (result == STATUS_OK && !grow(s, before + strlen(text) + 10))
        result = error_set(err, STATUS_NO_MEMORY, "cannot write to the series: out of memory");
    s->i_next = s->n_record;
    free(text);
    return result;
}
