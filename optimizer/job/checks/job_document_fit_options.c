/* Ties, bounds and priors of the section "fit" (job_fit_option.h). */
#include "base/catalogue/method_catalogue.h"
#include "optimizer/job/checks/job_document_parts.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_fit_option.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

void job_fit_option_init(struct job_fit_option *o)
{
    *o = (struct job_fit_option){.n_start = 1};
    for (size_t p = 0; p < JOB_MAX_PARAM; p++) {
        o->lower[p] = o->upper[p] = o->prior_mean[p] = o->prior_se[p] = NAN;
        o->leader[p] = p;
        o->ratio[p] = 1.0;
    }
}

struct reader {
    const struct model_info *const *model;
    struct job_fit *fit;
};

static status check_known(const struct reader *r, const char *path, const char *key, struct error *err)
{
    size_t slot[JOB_MAX_PARAM];
    for (size_t i = 0; i < r->fit->n_model; i++)
        if (job_parameter_slots(r->model[i], r->model[i]->n_param, key, slot) > 0) return STATUS_OK;
    return job_unknown_parameter(r->model, r->fit->n_model, path, key, err);
}

/* ---- ties ---- */

struct tie {
    const char *path;
    size_t n_name;
    const char *name[JOB_MAX_PARAM];
    double share[JOB_MAX_PARAM];
};

static status read_tie(const struct json_field *f, struct tie *t, struct error *err)
{
    bool list = json_is_array(f->object);
    if (!list && !json_is_object(f->object))
        return error_set_field(err, STATUS_INVALID, f->path,
                               "'%s' must be a list of parameter names, or an object of names and proportions",
                               f->path);
    size_t n = list ? json_array_size(f->object) : json_object_size(f->object);
    if (n > JOB_MAX_PARAM)
        return error_set_field(err, STATUS_INVALID, f->path, "'%s' names %zu parameters: allowed are %d", f->path, n,
                               JOB_MAX_PARAM);
    void *iter = list ? NULL : json_object_iter((json_t *)(uintptr_t)f->object);
    for (t->n_name = 0; t->n_name < n; t->n_name++) {
        t->share[t->n_name] = 1.0;
        t->name[t->n_name] =
            list ? json_string_value(json_array_get(f->object, t->n_name)) : json_object_iter_key(iter);
        if (t->name[t->n_name] == NULL)
            return error_set_field(err, STATUS_INVALID, f->path, "'%s' must be a list of parameter names", f->path);
        if (list) continue;
        status s = json_field_required_number(f, t->name[t->n_name], 1e-3, 1e3, &t->share[t->n_name], err);
        if (s != STATUS_OK) return s;
        iter = json_object_iter_next((json_t *)(uintptr_t)f->object, iter);
    }
    return STATUS_OK;
}

/* Ties the parameters of one model that a group names; *n_slot is their number. */
static status apply_tie(const struct tie *t, const struct model_info *m, struct job_fit_option *o, size_t *n_slot,
                        struct error *err)
{
    size_t slot[JOB_MAX_PARAM], leader = SIZE_MAX;
    double leader_share = 1.0;
    *n_slot = 0;
    for (size_t i = 0; i < t->n_name; i++) {
        size_t n = job_parameter_slots(m, m->n_param, t->name[i], slot);
        for (size_t k = 0; k < n; k++) {
            size_t p = slot[k];
            bool first = leader == SIZE_MAX;
            bool used = first ? job_parameter_is_tied(o, m->n_param, p)
                              : p == leader || job_parameter_is_tied(o, m->n_param, p);
            if (first) {
                leader = p;
                leader_share = t->share[i];
            }
            if (used)
                return error_set_field(err, STATUS_INVALID, t->path, "'%s' ties '%s' a second time", t->path,
                                       m->param[p].name);
            if (m->param[p].unit != m->param[leader].unit)
                return error_set_field(err, STATUS_INVALID, t->path,
                                       "'%s' ties '%s' to '%s': only parameters of the same unit can be tied", t->path,
                                       m->param[p].name, m->param[leader].name);
            o->leader[p] = leader;
            o->ratio[p] = t->share[i] / leader_share;
            (*n_slot)++;
        }
    }
    return STATUS_OK;
}

static status parse_tied(const struct reader *r, const struct json_field *fit, struct error *err)
{
    const json_t *list = json_object_get(fit->object, "tied");
    if (list == NULL) return STATUS_OK;
    if (!json_is_array(list))
        return error_set_field(err, STATUS_INVALID, "fit.tied", "'fit.tied' must be a list of groups of parameters");
    for (size_t g = 0; g < json_array_size(list); g++) {
        struct json_field f = {.object = json_array_get(list, g)};
        struct tie t = {.path = f.path};
        size_t largest = 0;
        snprintf(f.path, sizeof f.path, "fit.tied[%zu]", g);
        status s = read_tie(&f, &t, err);
        for (size_t i = 0; i < t.n_name && s == STATUS_OK; i++) s = check_known(r, f.path, t.name[i], err);
        for (size_t i = 0; i < r->fit->n_model && s == STATUS_OK; i++) {
            size_t n_slot;
            s = apply_tie(&t, r->model[i], &r->fit->model[i].option, &n_slot, err);
            if (n_slot > largest) largest = n_slot;
        }
        if (s != STATUS_OK) return s;
        if (largest < 2)
            return error_set_field(err, STATUS_INVALID, f.path, "'%s' must name at least two parameters of one model",
                                   f.path);
    }
    return STATUS_OK;
}

/* ---- bounds and priors ---- */

static status parse_bound(const struct json_field *f, const char *key, const struct model_info *m,
                          struct job_fit_option *o, struct error *err)
{
    size_t slot[JOB_MAX_PARAM], n_slot = job_parameter_slots(m, m->n_param, key, slot);
    char path[JSON_PATH_BYTES];
    double v[2];
    if (n_slot == 0) return STATUS_OK;
    const struct param_info *info = &m->param[slot[0]];
    double lower = param_to_file_unit(info, info->lower), upper = param_to_file_unit(info, info->upper);
    const double slack = 1e-12 * (fabs(lower) + fabs(upper));
    status s = json_field_number_array(f, key, 2, lower - slack, upper + slack, v, err);
    if (s != STATUS_OK) return s;
    json_field_path(f, key, path);
    if (!(v[0] < v[1]))
        return error_set_field(err, STATUS_INVALID, path,
                               "'%s' is [%g, %g]: the first must be below the second (to hold a parameter, use "
                               "'fit.fixed')",
                               path, v[0], v[1]);
    for (size_t i = 0; i < n_slot; i++) {
        if (!isnan(o->lower[slot[i]]))
            return error_set_field(err, STATUS_INVALID, path, "'%s' bounds '%s' a second time", path,
                                   m->param[slot[i]].name);
        o->lower[slot[i]] = fmax(v[0], lower);
        o->upper[slot[i]] = fmin(v[1], upper);
    }
    return STATUS_OK;
}

static status parse_prior(const struct json_field *f, const char *key, const struct model_info *m,
                          struct job_fit_option *o, struct error *err)
{
    static const char *const allowed[] = {"mean", "se", NULL};
    size_t slot[JOB_MAX_PARAM], n_slot = job_parameter_slots(m, m->n_param, key, slot);
    struct json_field sub;
    bool present;
    double mean = 0.0, se = 0.0;
    if (n_slot == 0) return STATUS_OK;
    status s = json_field_object(f, key, &sub, &present, err);
    if (s == STATUS_OK) s = json_field_check_keys(&sub, allowed, err);
    if (s != STATUS_OK) return s;
    const struct param_info *info = &m->param[slot[0]];
    double lower = param_to_file_unit(info, info->lower), upper = param_to_file_unit(info, info->upper);
    const double slack = 1e-12 * (fabs(lower) + fabs(upper));
    s = json_field_required_number(&sub, "mean", lower - slack, upper + slack, &mean, err);
    if (s == STATUS_OK) s = json_field_required_number(&sub, "se", 1e-6 * upper, 1e3 * upper, &se, err);
    if (s != STATUS_OK) return s;
    for (size_t i = 0; i < n_slot; i++) {
        if (!isnan(o->prior_mean[slot[i]]))
            return error_set_field(err, STATUS_INVALID, sub.path, "'%s' gives '%s' a second prior", sub.path,
                                   m->param[slot[i]].name);
        o->prior_mean[slot[i]] = fmin(fmax(mean, lower), upper);
        o->prior_se[slot[i]] = se;
    }
    return STATUS_OK;
}

static status parse_each(const struct reader *r, const struct json_field *fit, const char *section,
                         status (*one)(const struct json_field *f, const char *key, const struct model_info *m,
                                       struct job_fit_option *o, struct error *err),
                         struct error *err)
{
    struct json_field f;
    bool present;
    status s = json_field_object(fit, section, &f, &present, err);
    if (s != STATUS_OK || !present) return s;
    void *iter = json_object_iter((json_t *)(uintptr_t)f.object);
    for (; iter != NULL && s == STATUS_OK; iter = json_object_iter_next((json_t *)(uintptr_t)f.object, iter)) {
        char path[JSON_PATH_BYTES];
        const char *key = json_object_iter_key(iter);
        json_field_path(&f, key, path);
        s = check_known(r, path, key, err);
        for (size_t i = 0; i < r->fit->n_model && s == STATUS_OK; i++)
            s = one(&f, key, r->model[i], &r->fit->model[i].option, err);
    }
    return s;
}

static bool any_given(const double value[JOB_MAX_PARAM])
{
    for (size_t p = 0; p < JOB_MAX_PARAM; p++)
        if (!isnan(value[p])) return true;
    return false;
}

/* Returns whether the document gives start values. The entry of a density is filled in without (job_fit.h). */
static bool has_start(const struct model_info *m, const struct job_model *given)
{
    for (size_t p = 0; p < m->n_param; p++)
        if (m->param[p].kind != PARAM_DENSITY && !isnan(given->start[p])) return true;
    return false;
}

/* Refuses terms, starts and ties that the method does not take. */
static status check_method(const struct reader *r, struct error *err)
{
    const struct job_fit *fit = r->fit;
    const struct job_fit_option *o = &fit->model[0].option;
    bool prior = false, start = false, tied = false;
    for (size_t i = 0; i < fit->n_model; i++) {
        const struct job_fit_option *own = &fit->model[i].option;
        prior = prior || any_given(own->prior_mean);
        start = start || has_start(r->model[i], &fit->model[i]);
        for (size_t p = 0; p < r->model[i]->n_param; p++) tied = tied || own->leader[p] != p;
    }
    const struct {
        bool given;
        unsigned ability;
        const char *path;
    } term[] = {{fit->profile_job[0] != '\0', METHOD_TAKES_PRIORS, "fit.profile_job"},
                {prior, METHOD_TAKES_PRIORS, "fit.priors"},
                {o->gain != JOB_GAIN_NONE || o->stray_light, METHOD_TAKES_NUISANCE, "fit.nuisance"},
                {fit->precision > 0.0, METHOD_TAKES_PRECISION, "fit.precision"},
                {o->n_start > 1, METHOD_TAKES_STARTS, "fit.starts"},
                {start, METHOD_TAKES_STARTS, "fit.start"},
                {tied, METHOD_TAKES_TIES, "fit.tied"},
                {fit->fit_density, METHOD_TAKES_DENSITY, "fit.fit_density"}};
    const unsigned takes = method_catalogue_find(fit->method)->takes;
    unsigned wanted = 0;
    for (size_t k = 0; k < sizeof term / sizeof *term; k++) wanted |= term[k].given ? term[k].ability : 0u;
    for (size_t k = 0; k < sizeof term / sizeof *term; k++)
        if (term[k].given && (takes & term[k].ability) == 0)
            return error_set_field(err, STATUS_INVALID, term[k].path,
                                   "'%s' needs the method '%s': '%s' does not know it", term[k].path,
                                   method_catalogue_taking(wanted)->id, fit->method);
    return STATUS_OK;
}

static status check_only_model(const struct job_fit *fit, struct error *err)
{
    const char *only = method_catalogue_find(fit->method)->only_model;
    for (size_t i = 0; i < fit->n_model && only != NULL; i++)
        if (strcmp(fit->model[i].id, only) != 0)
            return error_set_field(err, STATUS_INVALID, "fit.method",
                                   "'fit.method' is '%s', which fits the model '%s' only, not '%s'", fit->method, only,
                                   fit->model[i].id);
    return STATUS_OK;
}

/* Copies the options that are the same for all models. They have been read into the first model. */
static status share_common(struct job_fit *fit, struct error *err)
{
    const struct job_fit_option *common = &fit->model[0].option;
    const struct method_info *method = method_catalogue_find(fit->method);
    const bool starts = (method->takes & METHOD_TAKES_STARTS) != 0;
    if ((common->n_start > 1 || !starts) && fit->max_iteration > method->max_iteration_of_starts)
        return error_set_field(err, STATUS_INVALID, "fit.max_iterations",
                               "'fit.max_iterations' is %zu: %s '%s' takes at most %zu", fit->max_iteration,
                               starts ? "with several starts" : "the method", fit->method,
                               method->max_iteration_of_starts);
    for (size_t i = 1; i < fit->n_model; i++) {
        struct job_fit_option *o = &fit->model[i].option;
        o->n_start = common->n_start;
        o->gain = common->gain;
        o->gain_prior_rel = common->gain_prior_rel;
        o->stray_light = common->stray_light;
        o->stray_light_prior = common->stray_light_prior;
    }
    return STATUS_OK;
}

status job_parse_fit_options(const struct json_field *f, const struct model_info *const *model, struct job_fit *fit,
                             struct error *err)
{
    struct reader r = {model, fit};
    struct job_fit_parameter resolved[JOB_MAX_PARAM];
    status s = parse_tied(&r, f, err);
    if (s == STATUS_OK) s = parse_each(&r, f, "bounds", parse_bound, err);
    if (s == STATUS_OK) s = parse_each(&r, f, "priors", parse_prior, err);
    if (s == STATUS_OK) s = share_common(fit, err);
    if (s == STATUS_OK) s = check_method(&r, err);
    if (s == STATUS_OK) s = check_only_model(fit, err);
    for (size_t i = 0; i < fit->n_model && s == STATUS_OK; i++) {
        s = job_fit_resolve(model[i]->param, model[i]->n_param, &fit->model[i], resolved, err);
        fit->model[i].first_free = -1;
        for (size_t p = model[i]->n_param; p-- > 0 && s == STATUS_OK;)
            if (!resolved[p].fixed) fit->model[i].first_free = (int)p;
    }
    return s;
}
