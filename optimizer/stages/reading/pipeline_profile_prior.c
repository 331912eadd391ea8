#include "optimizer/stages/reading/pipeline_profile_prior.h"
#include "base/catalogue/model_catalogue.h"
#include "base/files/durable.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_fit_option.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/stages/scene/pipeline_adopt.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define ADOPTED_PROFILE JOB_FOLDER_ADOPTED "/profile"
enum { RESULT_LIMIT_BYTES = 64 << 20 };

void pipeline_copy_profile(const struct worker_folder *own, const char *profile_job)
{
    struct worker_folder other = {.lock_fd = -1};
    char from[WORKER_PATH_BYTES], to[WORKER_PATH_BYTES], folder[WORKER_PATH_BYTES], *text = NULL;
    size_t n = 0;
    if (profile_job[0] == '\0' || !pipeline_other_folder(own, profile_job, &other)) return;
    worker_folder_path(own, ADOPTED_PROFILE, "result.json", to);
    worker_folder_path(&other, JOB_FOLDER_RESULTS, "result.json", from);
    if (access(own->path, F_OK) != 0 || access(to, F_OK) == 0) return;
    if (file_read_all(from, RESULT_LIMIT_BYTES, &text, &n, NULL) != STATUS_OK) return;
    worker_folder_path(own, JOB_FOLDER_ADOPTED, NULL, folder);
    durable_make_folder(folder, NULL);
    worker_folder_path(own, ADOPTED_PROFILE, NULL, folder);
    durable_make_folder(folder, NULL);
    durable_replace(to, text, n, NULL);
    free(text);
}

static bool is_tied(const struct job_fit_option *o, size_t n_param, size_t p)
{
    for (size_t q = 0; q < n_param; q++)
        if (q != p && (o->leader[q] == p || o->leader[p] == q)) return true;
    return false;
}

/* Returns whether a value within three standard errors lies in the bounds that the job states, as for priors of its
 * own. */
static bool agrees(const struct job_fit_option *o, size_t p, double value, double se)
{
    return !(value + 3.0 * se < o->lower[p]) && !(value - 3.0 * se > o->upper[p]);
}

/* Adds the prior that one parameter of the other job gives; returns the number of parameters that took it. is_grey: the
 * profile has one channel. It does not tell the channels of a color apart, so a color takes nothing from it. */
static size_t take_parameter(const struct stage_tools *tools, const char *profile_job, struct job_model *m,
                             const struct model_sets *sets, const json_t *found, bool is_grey)
{
    const char *name = json_string_value(json_object_get(found, "name"));
    const json_t *value = json_object_get(found, "value"), *se = json_object_get(found, "standard_error");
    size_t n = 0;
    if (name == NULL || !json_is_number(value) || !json_is_number(se) || !(json_number_value(se) > 0.0) ||
        json_is_true(json_object_get(found, "fixed")) || !json_is_true(json_object_get(found, "determined")) ||
        json_is_string(json_object_get(found, "at_bound")))
        return 0;
    for (size_t p = 0; p < sets->info.n_param; p++) {
        const struct param_info *info = &sets->info.param[p];
        if (strcmp(param_own_name(info), name) != 0 || !isnan(m->fixed[p]) || !isnan(m->option.prior_mean[p]) ||
            is_tied(&m->option, sets->info.n_param, p) || (is_grey && info->kind == PARAM_COLOUR))
            continue;
        if (!agrees(&m->option, p, json_number_value(value), json_number_value(se))) {
            worker_status_warn(tools->status,
                               "the profile of job '%s' has '%s' at %g +- %g, outside of the bounds of this job: it "
                               "gives no prior",
                               profile_job, name, json_number_value(value), json_number_value(se));
            continue;
        }
        m->option.prior_mean[p] = json_number_value(value);
        m->option.prior_se[p] = json_number_value(se);
        n++;
    }
    return n;
}

/* The cloth and the fit whose parameters get the priors. */
struct prior_taking {
    const struct stage_tools *tools;
    const struct job_cloth *cloth;
    struct job_fit *fit;
};

/* Adds the priors of model i; *n_prior counts them, and *found is set when the other job has fitted the model. */
static status take_model(const struct prior_taking *q, size_t i, const json_t *profile, size_t *n_prior, bool *found,
                         struct error *err)
{
    const json_t *models = json_object_get(profile, "models");
    const bool is_grey = json_integer_value(json_object_get(json_object_get(profile, "table"), "n_channel")) == 1;
    struct job_model *m = &q->fit->model[i];
    struct model_sets sets;
    size_t k;
    const json_t *model, *parameter;
    status s = model_sets_init(&sets, model_catalogue_find(m->id), q->cloth->group, q->cloth->n_group, err);
    if (s != STATUS_OK) return s;
    json_array_foreach(models, k, model)
    {
        const char *id = json_string_value(json_object_get(model, "id"));
        if (id == NULL || strcmp(id, m->id) != 0) continue;
        *found = true;
        size_t p;
        json_array_foreach(json_object_get(model, "parameters"), p, parameter) *n_prior +=
            take_parameter(q->tools, q->fit->profile_job, m, &sets, parameter, is_grey);
    }
    return STATUS_OK;
}

static status refuse(const struct job_fit *fit, const char *why, struct error *err)
{
    return error_set_field(err, STATUS_INVALID, OPTION_PROFILE_JOB,
                           "cannot take priors from the profile of job '%s': %s", fit->profile_job, why);
}

status pipeline_profile_priors(const struct stage_tools *tools, const struct job_cloth *cloth, struct job_fit *fit,
                               struct error *err)
{
    char path[WORKER_PATH_BYTES];
    const struct prior_taking q = {tools, cloth, fit};
    size_t n_prior = 0;
    bool found = false;
    if (fit->profile_job[0] == '\0' || tools->folder->lock_fd < 0) return STATUS_OK;
    worker_folder_path(tools->folder, ADOPTED_PROFILE, "result.json", path);
    json_t *result = json_load_file(path, 0, NULL);
    const json_t *profile = json_object_get(result, "profile");
    status s = STATUS_OK;
    if (result == NULL)
        s = refuse(fit, "there is no such job, or it has no result yet", err);
    else if (!json_is_array(json_object_get(profile, "models")))
        s = refuse(fit, "it has not fitted the profile of a fiber", err);
    for (size_t i = 0; i < fit->n_model && s == STATUS_OK; i++) s = take_model(&q, i, profile, &n_prior, &found, err);
    json_decref(result);
    if (s == STATUS_OK && !found) s = refuse(fit, "it has fitted none of this job's models", err);
    if (s == STATUS_OK) log_info(tools->log, "%zu priors come from the profile of job %s", n_prior, fit->profile_job);
    if (s == STATUS_OK && n_prior == 0)
        worker_status_warn(tools->status,
                           "the profile of job '%s' determines no parameter that could take a prior: none was taken",
                           fit->profile_job);
    return s;
}
