/* The part of the section "fit" that depends on the models: their ids, and the values of their parameters. */
#include "base/catalogue/method_catalogue.h"
#include "optimizer/job/checks/job_document_parts.h"
#include "optimizer/job/checks/option_checks.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_fit_option.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_LISTED = 31 };

const char *job_model_id(size_t i)
{
    const struct model_info *m = model_catalogue_at(i);
    return m != NULL ? m->id : NULL;
}

const char *job_method_id(size_t i)
{
    const struct method_info *m = method_catalogue_at(i);
    return m != NULL ? m->id : NULL;
}

/* Ids of all models, NULL-terminated. */
static void list_models(const char *name[MAX_LISTED + 1])
{
    size_t n = 0;
    while (n < MAX_LISTED && (name[n] = job_model_id(n)) != NULL) n++;
    name[n] = NULL;
}

static status parse_model_list(const struct json_field *f, const char *const *name, struct job_fit *fit,
                               struct error *err)
{
    const json_t *list = json_object_get(f->object, "models");
    if (!json_is_array(list) || json_array_size(list) == 0 || json_array_size(list) > JOB_MAX_MODEL)
        return error_set_field(err, STATUS_INVALID, "fit.models", "'fit.models' must be a list of 1 to %d model ids",
                               JOB_MAX_MODEL);
    fit->n_model = 0;
    for (size_t i = 0; i < json_array_size(list); i++) {
        const char *id = json_string_value(json_array_get(list, i));
        char path[JSON_PATH_BYTES], known[600];
        size_t k = 0;
        snprintf(path, sizeof path, "fit.models[%zu]", i);
        while (name[k] != NULL && (id == NULL || strcmp(id, name[k]) != 0)) k++;
        if (name[k] == NULL) {
            json_list_text(name, known, sizeof known);
            return error_set_field(err, STATUS_INVALID, path, "'%s' is no model: allowed are %s", path, known);
        }
        for (size_t j = 0; j < i; j++)
            if (strcmp(fit->model[j].id, id) == 0)
                return error_set_field(err, STATUS_INVALID, path, "'%s' names the model '%s' a second time", path, id);
        snprintf(fit->model[fit->n_model++].id, sizeof fit->model[0].id, "%s", id);
    }
    return STATUS_OK;
}

static status parse_models(const struct json_field *f, struct job_fit *fit, struct error *err)
{
    const char *name[MAX_LISTED + 1];
    if (json_object_get(f->object, "models") == NULL) return STATUS_OK;
    if (json_object_get(f->object, "model") != NULL)
        return error_set_field(err, STATUS_INVALID, "fit.models",
                               "'fit.model' and 'fit.models' are both given: a job takes one of them");
    list_models(name);
    return parse_model_list(f, name, fit, err);
}

/* Number of the first slots that are of the same set of parameters. */
static size_t slots_of_one_set(const struct model_info *m, const size_t *slot, size_t n_slot)
{
    size_t n = 1;
    while (n < n_slot && m->param[slot[n]].set == m->param[slot[0]].set) n++;
    return n;
}

/* Reads one key of "fixed" or "start": a colour ("C_TT", one number for all channels, or three) or one parameter
 * ("C_TT.r"). Without the name of a set it applies to all sets. Sets *known when the model has it. */
static status parse_value(const struct json_field *f, const char *key, const json_t *value, const struct model_info *m,
                          double *out, bool *known, struct error *err)
{
    size_t slot[JOB_MAX_PARAM], n_slot = job_parameter_slots(m, job_n_named_parameter(m), key, slot);
    if (n_slot == 0) return STATUS_OK;
    size_t n_own = slots_of_one_set(m, slot, n_slot);
    *known = true;
    char path[JSON_PATH_BYTES];
    json_field_path(f, key, path);
    const struct param_info *info = &m->param[slot[0]];
    double lower = param_to_file_unit(info, info->lower), upper = param_to_file_unit(info, info->upper);
    const double slack = 1e-12 * (fabs(lower) + fabs(upper)); /* rounding of degrees to radians and back */
    double v[JOB_MAX_PARAM];
    status s;
    if (json_is_array(value)) {
        s = json_field_number_array(f, key, n_own, lower - slack, upper + slack, v, err);
    } else {
        s = json_field_required_number(f, key, lower - slack, upper + slack, &v[0], err);
        for (size_t i = 1; i < n_own; i++) v[i] = v[0];
    }
    if (s != STATUS_OK) return s;
    for (size_t i = 0; i < n_slot; i++) {
        if (!isnan(out[slot[i]]))
            return error_set_field(err, STATUS_INVALID, path, "'%s' sets '%s' a second time", path,
                                   m->param[slot[i]].name);
        out[slot[i]] = fmin(fmax(v[i % n_own], lower), upper);
    }
    return STATUS_OK;
}

/* Reads the section "fixed" or "start". Each key applies to every model that has such a parameter. */
static status parse_values(const struct json_field *section, bool fixed, const struct model_info *const *model,
                           struct job_fit *fit, struct error *err)
{
    struct json_field f;
    bool present;
    status s = json_field_object(section, fixed ? "fixed" : "start", &f, &present, err);
    if (s != STATUS_OK || !present) return s;
    void *iter = json_object_iter((json_t *)(uintptr_t)f.object);
    for (; iter != NULL; iter = json_object_iter_next((json_t *)(uintptr_t)f.object, iter)) {
        const char *key = json_object_iter_key(iter);
        bool known = false;
        for (size_t i = 0; i < fit->n_model && s == STATUS_OK; i++)
            s = parse_value(&f, key, json_object_iter_value(iter), model[i],
                            fixed ? fit->model[i].fixed : fit->model[i].start, &known, err);
        if (s != STATUS_OK) return s;
        char path[JSON_PATH_BYTES];
        json_field_path(&f, key, path);
        if (!known) return job_unknown_parameter(model, fit->n_model, path, key, err);
    }
    return STATUS_OK;
}

/* Fixes the density multiplier of volume models at the given value, or starts its fit there. */
static status set_density(const struct json_field *f, const struct model_info *const *model, struct job_fit *fit,
                          struct error *err)
{
    bool any_volume = false;
    for (size_t i = 0; i < fit->n_model; i++) {
        if (model[i]->kind != MODEL_VOLUME) continue;
        const struct param_info *d = &model[i]->param[model[i]->n_param - 1];
        bool given = !isnan(fit->density_multiplier_per_cm);
        double value = given ? fit->density_multiplier_per_cm : param_to_file_unit(d, d->start);
        if (!fit->fit_density) fit->model[i].fixed[model[i]->n_param - 1] = value;
        if (fit->fit_density && given)
            fit->model[i].start[model[i]->n_param - 1] = value; /* without a value, a prior's mean may be the start */
        any_volume = true;
    }
    static const char *const key[] = {"density_multiplier_per_cm", "fit_density"};
    for (size_t i = 0; i < 2 && !any_volume; i++)
        if (json_object_get(f->object, key[i]) != NULL) {
            char path[JSON_PATH_BYTES];
            json_field_path(f, key[i], path);
            return error_set_field(err, STATUS_INVALID, path, "'%s' belongs to volume models, but the job fits '%s'%s",
                                   path, fit->model[0].id, fit->n_model > 1 ? " and other surface models" : "");
        }
    return STATUS_OK;
}

static status check_radius(const struct model_info *const *model, const struct job_fit *fit, struct error *err)
{
    for (size_t i = 0; i < fit->n_model && fit->fit_radius; i++)
        if (model[i]->kind == MODEL_SURFACE) return STATUS_OK;
    return fit->fit_radius
               ? error_set_field(err, STATUS_INVALID, "fit.fit_radius",
                                 "'fit.fit_radius' needs a surface model, and '%s' is a volume model", model[0]->id)
               : STATUS_OK;
}

static status check_starts(const struct model_info *m, const struct job_model *given, struct error *err)
{
    for (size_t p = 0; p < m->n_param; p++)
        if (!isnan(given->fixed[p]) && !isnan(given->start[p]))
            return error_set_field(err, STATUS_INVALID, "fit.start",
                                   "'fit.start' has '%s', which 'fit.fixed' holds fixed", m->param[p].name);
    return STATUS_OK;
}

/* Finds the models of the document, each with one set of parameters for each group of fibers. */
static status find_models(const struct job_fit *fit, const struct job_cloth *cloth, struct model_sets *sets,
                          const struct model_info **model, struct error *err)
{
    for (size_t i = 0; i < fit->n_model; i++) {
        const struct model_info *m = model_catalogue_find(fit->model[i].id);
        if (m == NULL)
            return error_set_field(err, STATUS_INVALID, "fit.model", "the model '%s' is not in this program",
                                   fit->model[i].id);
        status s = model_sets_init(&sets[i], m, cloth->group, cloth->n_group, err);
        if (s != STATUS_OK) {
            snprintf(err->field, sizeof err->field, "fit.model");
            return s;
        }
        model[i] = &sets[i].info;
    }
    return STATUS_OK;
}

/* Reads the parameters of all models of the document. */
static status parse_parameters(const struct json_field *f, const struct model_info *const *model, struct job_fit *fit,
                               struct error *err)
{
    status s = parse_values(f, true, model, fit, err);
    if (s == STATUS_OK) s = parse_values(f, false, model, fit, err);
    if (s == STATUS_OK) s = set_density(f, model, fit, err);
    if (s == STATUS_OK) s = check_radius(model, fit, err);
    for (size_t i = 0; i < fit->n_model && s == STATUS_OK; i++) s = check_starts(model[i], &fit->model[i], err);
    return s == STATUS_OK ? job_parse_fit_options(f, model, fit, err) : s;
}

status job_check_fit(const struct option_value *v, struct error *err)
{
    struct job_fit *fit = v->own;
    struct json_field f = {.object = v->value};
    snprintf(f.path, sizeof f.path, "%s", v->path);
    const struct model_info *model[JOB_MAX_MODEL];
    struct model_sets *sets = malloc(JOB_MAX_MODEL * sizeof *sets);
    if (sets == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the job document: out of memory");
    status s = parse_models(&f, fit, err);
    if (s == STATUS_OK) s = find_models(fit, v->section->cloth, sets, model, err);
    if (s == STATUS_OK) s = parse_parameters(&f, model, fit, err);
    free(sets);
    return s;
}
