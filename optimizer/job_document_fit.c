/* The section "fit" of a job document: names and values are checked against the registries of models and methods. */
#include "optimizer/descent/method_names.h"
#include "optimizer/job_document_parts.h"
#include "renderer/scattering/scattering.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MAX_MODEL = 31 };

static status parse_model(const struct json_field *f, struct job_document *doc, struct error *err)
{
    const char *name[MAX_MODEL + 1] = {NULL};
    const struct scattering_model *const *model = scattering_registry();
    for (size_t i = 0; i < MAX_MODEL && model[i] != NULL; i++) name[i] = model[i]->id;
    size_t i_model = MAX_MODEL, i_method = MAX_MODEL;
    status s = json_field_choice(f, "model", name, &i_model, err);
    if (s == STATUS_OK) s = json_field_choice(f, "method", method_name_list(), &i_method, err);
    if (s != STATUS_OK) return s;
    if (i_model < MAX_MODEL) snprintf(doc->model, sizeof doc->model, "%s", name[i_model]);
    if (i_method < MAX_MODEL) snprintf(doc->method, sizeof doc->method, "%s", method_name_list()[i_method]);
    return STATUS_OK;
}

/* "C_R, beta_R, ...": each group once. */
static void list_symbols(const struct scattering_model *m, char *text, size_t n_bytes)
{
    size_t used = 0;
    text[0] = '\0';
    for (size_t p = 0; p < m->n_param && used < n_bytes; p++) {
        if (p > 0 && strcmp(m->param[p].symbol, m->param[p - 1].symbol) == 0) continue;
        int n = snprintf(text + used, n_bytes - used, "%s%s", p > 0 ? ", " : "", m->param[p].symbol);
        if (n < 0) return;
        used += (size_t)n;
    }
}

/* One key of "fixed" or "start": a group ("C_TT": one number for all channels, or three) or one slot ("C_TT.r"). */
static status parse_value(const struct json_field *f, const char *key, const json_t *value,
                          const struct scattering_model *m, double *out, struct error *err)
{
    size_t slot[JOB_MAX_PARAM], n_slot = 0;
    for (size_t p = 0; p < m->n_param && p < JOB_MAX_PARAM; p++)
        if (strcmp(m->param[p].symbol, key) == 0 || strcmp(m->param[p].name, key) == 0) slot[n_slot++] = p;
    char path[JSON_PATH_BYTES], list[300];
    json_field_path(f, key, path);
    if (n_slot == 0) {
        list_symbols(m, list, sizeof list);
        return error_set_field(err, STATUS_INVALID, path,
                               "unknown parameter '%.60s' of model '%s': its parameters are %s", key, m->id, list);
    }
    const struct param_info *info = &m->param[slot[0]];
    double lower = param_to_file_unit(info, info->lower), upper = param_to_file_unit(info, info->upper);
    const double slack = 1e-12 * (fabs(lower) + fabs(upper)); /* degrees that went to radians and back */
    double v[JOB_MAX_PARAM];
    status s;
    if (json_is_array(value)) {
        s = json_field_number_array(f, key, n_slot, lower - slack, upper + slack, v, err);
    } else {
        s = json_field_required_number(f, key, lower - slack, upper + slack, &v[0], err);
        for (size_t i = 1; i < n_slot; i++) v[i] = v[0];
    }
    if (s != STATUS_OK) return s;
    for (size_t i = 0; i < n_slot; i++) {
        if (!isnan(out[slot[i]]))
            return error_set_field(err, STATUS_INVALID, path, "'%s' sets '%s' a second time", path,
                                   m->param[slot[i]].name);
        out[slot[i]] = fmin(fmax(v[i], lower), upper);
    }
    return STATUS_OK;
}

static status parse_values(const struct json_field *fit, const char *section, const struct scattering_model *m,
                           double *out, struct error *err)
{
    struct json_field f;
    bool present;
    status s = json_field_object(fit, section, &f, &present, err);
    if (s != STATUS_OK || !present) return s;
    void *iter = json_object_iter((json_t *)(uintptr_t)f.object);
    for (; iter != NULL; iter = json_object_iter_next((json_t *)(uintptr_t)f.object, iter)) {
        s = parse_value(&f, json_object_iter_key(iter), json_object_iter_value(iter), m, out, err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

static status check_free_parameters(const struct scattering_model *m, const struct job_document *doc, struct error *err)
{
    size_t n_free = 0;
    for (size_t p = 0; p < m->n_param && p < JOB_MAX_PARAM; p++) {
        bool fixed = !isnan(doc->fixed[p]);
        if (fixed && !isnan(doc->start[p]))
            return error_set_field(err, STATUS_INVALID, "fit.start",
                                   "'fit.start' has '%s', which 'fit.fixed' holds fixed", m->param[p].name);
        if (!fixed) n_free++;
    }
    if (n_free == 0)
        return error_set_field(err, STATUS_INVALID, "fit.fixed",
                               "'fit.fixed' holds every parameter of model '%s': leave at least one free", m->id);
    return STATUS_OK;
}

status job_parse_fit(const struct json_field *f, struct job_document *doc, struct error *err)
{
    static const char *const key[] = {"model", "method", "seed",      "max_iterations", "path_budget",
                                      "fixed", "start",  "render_px", "render_samples", NULL};
    status s = json_field_check_keys(f, key, err);
    if (s == STATUS_OK) s = parse_model(f, doc, err);
    if (s == STATUS_OK) s = json_field_u64(f, "seed", 0, &doc->seed, err);
    if (s == STATUS_OK) s = json_field_size(f, "max_iterations", 1, 10000, &doc->max_iteration, err);
    if (s == STATUS_OK) s = json_field_u64(f, "path_budget", 1000, &doc->path_budget, err);
    if (s == STATUS_OK) s = json_field_size(f, "render_px", 8, 2048, &doc->render_px, err);
    if (s == STATUS_OK) s = json_field_size(f, "render_samples", 1, 65536, &doc->render_sample, err);
    if (s != STATUS_OK) return s;
    const struct scattering_model *m = scattering_find(doc->model);
    if (m == NULL)
        return error_set_field(err, STATUS_INVALID, "fit.model", "the model '%s' is not in this program", doc->model);
    s = parse_values(f, "fixed", m, doc->fixed, err);
    if (s == STATUS_OK) s = parse_values(f, "start", m, doc->start, err);
    if (s == STATUS_OK) s = check_free_parameters(m, doc, err);
    return s;
}
