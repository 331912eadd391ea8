/* The section "fit" of a job document: names and values are checked against the catalogues of models and methods. */
#include "base/catalogue/method_catalogue.h"
#include "optimizer/job/job_document_parts.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MAX_LISTED = 31 };

/* Ids of all models, NULL-terminated. */
static void list_models(const char *name[MAX_LISTED + 1])
{
    size_t n = 0;
    for (const struct model_info *m; n < MAX_LISTED && (m = model_catalogue_at(n)) != NULL; n++) name[n] = m->id;
    name[n] = NULL;
}

/* Ids of all descent methods, NULL-terminated. */
static void list_methods(const char *name[MAX_LISTED + 1])
{
    size_t n = 0;
    for (const struct method_info *m; n < MAX_LISTED && (m = method_catalogue_at(n)) != NULL; n++) name[n] = m->id;
    name[n] = NULL;
}

static status parse_model_list(const struct json_field *f, const char *const *name, struct job_document *doc,
                               struct error *err)
{
    const json_t *list = json_object_get(f->object, "models");
    if (!json_is_array(list) || json_array_size(list) == 0 || json_array_size(list) > JOB_MAX_MODEL)
        return error_set_field(err, STATUS_INVALID, "fit.models", "'fit.models' must be a list of 1 to %d model ids",
                               JOB_MAX_MODEL);
    doc->n_model = 0;
    for (size_t i = 0; i < json_array_size(list); i++) {
        const char *id = json_string_value(json_array_get(list, i));
        char path[JSON_PATH_BYTES], known[400];
        size_t k = 0;
        snprintf(path, sizeof path, "fit.models[%zu]", i);
        while (name[k] != NULL && (id == NULL || strcmp(id, name[k]) != 0)) k++;
        if (name[k] == NULL) {
            json_list_text(name, known, sizeof known);
            return error_set_field(err, STATUS_INVALID, path, "'%s' is no model: allowed are %s", path, known);
        }
        for (size_t j = 0; j < i; j++)
            if (strcmp(doc->model[j].id, id) == 0)
                return error_set_field(err, STATUS_INVALID, path, "'%s' names the model '%s' a second time", path, id);
        snprintf(doc->model[doc->n_model++].id, sizeof doc->model[0].id, "%s", id);
    }
    return STATUS_OK;
}

static status parse_models(const struct json_field *f, struct job_document *doc, struct error *err)
{
    const char *name[MAX_LISTED + 1];
    list_models(name);
    if (json_object_get(f->object, "models") != NULL) {
        if (json_object_get(f->object, "model") != NULL)
            return error_set_field(err, STATUS_INVALID, "fit.models",
                                   "'fit.model' and 'fit.models' are both given: a job takes one of them");
        return parse_model_list(f, name, doc, err);
    }
    size_t i_model = MAX_LISTED;
    status s = json_field_choice(f, "model", name, &i_model, err);
    if (s == STATUS_OK && i_model < MAX_LISTED)
        snprintf(doc->model[0].id, sizeof doc->model[0].id, "%s", name[i_model]);
    return s;
}

static status parse_method(const struct json_field *f, struct job_document *doc, struct error *err)
{
    const char *name[MAX_LISTED + 1];
    size_t i_method = MAX_LISTED;
    list_methods(name);
    status s = json_field_choice(f, "method", name, &i_method, err);
    if (s == STATUS_OK && i_method < MAX_LISTED) snprintf(doc->method, sizeof doc->method, "%s", name[i_method]);
    return s;
}

/* Parameters that "fixed" and "start" can name: the density multiplier, the last one of volume models, has keys of its
 * own. */
static size_t n_named(const struct model_info *m) { return m->n_param - (m->kind == MODEL_VOLUME ? 1 : 0); }

/* "C_R, beta_R, ...": each group once. */
static void list_symbols(const struct model_info *m, char *text, size_t n_bytes)
{
    size_t used = 0;
    text[0] = '\0';
    for (size_t p = 0; p < n_named(m) && used < n_bytes; p++) {
        if (p > 0 && strcmp(m->param[p].symbol, m->param[p - 1].symbol) == 0) continue;
        int n = snprintf(text + used, n_bytes - used, "%s%s", p > 0 ? ", " : "", m->param[p].symbol);
        if (n < 0) return;
        used += (size_t)n;
    }
}

status job_unknown_parameter(const struct model_info *const *model, size_t n_model, const char *path, const char *key,
                             struct error *err)
{
    char list[300], text[1000];
    size_t used = 0;
    text[0] = '\0';
    for (size_t i = 0; i < n_model && used < sizeof text; i++) {
        list_symbols(model[i], list, sizeof list);
        int n = snprintf(text + used, sizeof text - used, "%s model '%s' has %s", i > 0 ? ";" : "", model[i]->id, list);
        used += n > 0 ? (size_t)n : 0;
    }
    return error_set_field(err, STATUS_INVALID, path, "unknown parameter '%.60s':%s", key, text);
}

/* One key of "fixed" or "start": a group ("C_TT": one number for all channels, or three) or one slot ("C_TT.r").
 * *known: set when the model has it. */
static status parse_value(const struct json_field *f, const char *key, const json_t *value, const struct model_info *m,
                          double *out, bool *known, struct error *err)
{
    size_t slot[JOB_MAX_PARAM], n_slot = 0;
    for (size_t p = 0; p < n_named(m); p++)
        if (strcmp(m->param[p].symbol, key) == 0 || strcmp(m->param[p].name, key) == 0) slot[n_slot++] = p;
    if (n_slot == 0) return STATUS_OK;
    *known = true;
    char path[JSON_PATH_BYTES];
    json_field_path(f, key, path);
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

/* The section "fixed" or "start": each key for every model that has such a parameter. */
static status parse_values(const struct json_field *fit, bool fixed, const struct model_info *const *model,
                           struct job_document *doc, struct error *err)
{
    struct json_field f;
    bool present;
    status s = json_field_object(fit, fixed ? "fixed" : "start", &f, &present, err);
    if (s != STATUS_OK || !present) return s;
    void *iter = json_object_iter((json_t *)(uintptr_t)f.object);
    for (; iter != NULL; iter = json_object_iter_next((json_t *)(uintptr_t)f.object, iter)) {
        const char *key = json_object_iter_key(iter);
        bool known = false;
        for (size_t i = 0; i < doc->n_model && s == STATUS_OK; i++)
            s = parse_value(&f, key, json_object_iter_value(iter), model[i],
                            fixed ? doc->model[i].fixed : doc->model[i].start, &known, err);
        if (s != STATUS_OK) return s;
        char path[JSON_PATH_BYTES];
        json_field_path(&f, key, path);
        if (!known) return job_unknown_parameter(model, doc->n_model, path, key, err);
    }
    return STATUS_OK;
}

/* The density multiplier of volume models. */
static status parse_density(const struct json_field *f, const struct model_info *const *model, struct job_document *doc,
                            struct error *err)
{
    bool any_volume = false;
    for (size_t i = 0; i < doc->n_model; i++) {
        if (model[i]->kind != MODEL_VOLUME) continue;
        const struct param_info *d = &model[i]->param[model[i]->n_param - 1];
        status s = json_field_number(f, "density_multiplier_per_cm", param_to_file_unit(d, d->lower),
                                     param_to_file_unit(d, d->upper), &doc->density_multiplier_per_cm, err);
        if (s == STATUS_OK) s = json_field_bool(f, "fit_density", &doc->fit_density, err);
        if (s != STATUS_OK) return s;
        bool given = !isnan(doc->density_multiplier_per_cm);
        double value = given ? doc->density_multiplier_per_cm : param_to_file_unit(d, d->start);
        if (!doc->fit_density) doc->model[i].fixed[model[i]->n_param - 1] = value;
        if (doc->fit_density && given)
            doc->model[i].start[model[i]->n_param - 1] = value; /* else a prior's mean may be */
        any_volume = true;
    }
    static const char *const key[] = {"density_multiplier_per_cm", "fit_density"};
    for (size_t i = 0; i < 2 && !any_volume; i++)
        if (json_object_get(f->object, key[i]) != NULL) {
            char path[JSON_PATH_BYTES];
            json_field_path(f, key[i], path);
            return error_set_field(err, STATUS_INVALID, path, "'%s' is of volume models: the job fits '%s'%s", path,
                                   doc->model[0].id, doc->n_model > 1 ? " and other surface models" : "");
        }
    return STATUS_OK;
}

/* true, false or the range to search. */
static status parse_radius(const struct json_field *f, const struct model_info *const *model, struct job_document *doc,
                           struct error *err)
{
    static const char *const key[] = {"lower_um", "upper_um", NULL};
    const json_t *value = json_object_get(f->object, "fit_radius");
    struct json_field range;
    if (value == NULL) return STATUS_OK;
    if (json_is_boolean(value)) {
        doc->fit_radius = json_is_true(value);
    } else if (!json_is_object(value)) {
        return error_set_field(err, STATUS_INVALID, "fit.fit_radius",
                               "'fit.fit_radius' must be true, false or an object of lower_um and upper_um");
    } else {
        status s = json_field_object(f, "fit_radius", &range, &doc->fit_radius, err);
        if (s == STATUS_OK) s = json_field_check_keys(&range, key, err);
        if (s == STATUS_OK) s = json_field_number(&range, "lower_um", 0.05, 1000.0, &doc->radius_lower_um, err);
        if (s == STATUS_OK) s = json_field_number(&range, "upper_um", 0.05, 1000.0, &doc->radius_upper_um, err);
        if (s != STATUS_OK) return s;
        if (doc->radius_upper_um < 1.1 * doc->radius_lower_um)
            return error_set_field(err, STATUS_INVALID, "fit.fit_radius.upper_um",
                                   "'fit.fit_radius.upper_um' is %g: it must be at least 1.1 times lower_um (%g)",
                                   doc->radius_upper_um, doc->radius_lower_um);
    }
    for (size_t i = 0; i < doc->n_model && doc->fit_radius; i++)
        if (model[i]->kind == MODEL_SURFACE) return STATUS_OK;
    return doc->fit_radius
               ? error_set_field(err, STATUS_INVALID, "fit.fit_radius",
                                 "'fit.fit_radius' needs a model of fibers' surfaces: '%s' sees a volume", model[0]->id)
               : STATUS_OK;
}

static status check_free_parameters(const struct model_info *m, const struct job_model *given, struct error *err)
{
    size_t n_free = 0;
    for (size_t p = 0; p < m->n_param; p++) {
        bool fixed = !isnan(given->fixed[p]);
        if (fixed && !isnan(given->start[p]))
            return error_set_field(err, STATUS_INVALID, "fit.start",
                                   "'fit.start' has '%s', which 'fit.fixed' holds fixed", m->param[p].name);
        if (!fixed) n_free++;
    }
    if (n_free == 0)
        return error_set_field(err, STATUS_INVALID, "fit.fixed",
                               "'fit.fixed' holds every parameter of model '%s': leave at least one free", m->id);
    return STATUS_OK;
}

/* Parameters of all models that are named. */
static status parse_parameters(const struct json_field *f, struct job_document *doc, struct error *err)
{
    const struct model_info *model[JOB_MAX_MODEL];
    for (size_t i = 0; i < doc->n_model; i++)
        if ((model[i] = model_catalogue_find(doc->model[i].id)) == NULL)
            return error_set_field(err, STATUS_INVALID, "fit.model", "the model '%s' is not in this program",
                                   doc->model[i].id);
    status s = parse_values(f, true, model, doc, err);
    if (s == STATUS_OK) s = parse_values(f, false, model, doc, err);
    if (s == STATUS_OK) s = parse_density(f, model, doc, err);
    if (s == STATUS_OK) s = parse_radius(f, model, doc, err);
    for (size_t i = 0; i < doc->n_model && s == STATUS_OK; i++)
        s = check_free_parameters(model[i], &doc->model[i], err);
    return s == STATUS_OK ? job_parse_fit_options(f, model, doc, err) : s;
}

status job_parse_fit(const struct json_field *f, struct job_document *doc, struct error *err)
{
    static const char *const key[] = {"model",       "models",         "method",
                                      "seed",        "max_iterations", "path_budget",
                                      "fixed",       "start",          "density_multiplier_per_cm",
                                      "fit_density", "render_px",      "render_samples",
                                      "tied",        "bounds",         "priors",
                                      "starts",      "nuisance",       "fit_radius",
                                      "candidates",  "texture",        NULL};
    status s = json_field_check_keys(f, key, err);
    if (s == STATUS_OK) s = parse_models(f, doc, err);
    if (s == STATUS_OK) s = parse_method(f, doc, err);
    if (s == STATUS_OK) s = json_field_u64(f, "seed", 0, &doc->seed, err);
    if (s == STATUS_OK) s = json_field_size(f, "max_iterations", 1, 10000, &doc->max_iteration, err);
    if (s == STATUS_OK) s = json_field_u64(f, "path_budget", 1000, &doc->path_budget, err);
    if (s == STATUS_OK) s = json_field_size(f, "render_px", 8, 2048, &doc->render_px, err);
    if (s == STATUS_OK) s = json_field_size(f, "render_samples", 1, 65536, &doc->render_sample, err);
    if (s == STATUS_OK) s = job_parse_candidates(f, doc, err);
    if (s == STATUS_OK) s = parse_parameters(f, doc, err);
    return s == STATUS_OK ? job_parse_texture(f, doc, err) : s;
}
