/* Checks of a job that fits the profile of a single fiber. */
#include "base/catalogue/model_catalogue.h"
#include "optimizer/job/job_document.h"
#include "optimizer/job/options/option_checks.h"

#include <stdio.h>
#include <string.h>

static bool listed(const char *const *list, const char *key)
{
    for (; *list != NULL; list++)
        if (strcmp(*list, key) == 0) return true;
    return false;
}

/* Refuses keys of a section that a profile has no use for. */
static status check_keys(const json_t *section, const char *before, const char *const *allowed, struct error *err)
{
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)(uintptr_t)section, key, value)
    {
        char path[128];
        snprintf(path, sizeof path, "%s%.100s", before, key);
        if (!listed(allowed, key))
            return error_set_field(err, STATUS_INVALID, path,
                                   "'%s' and 'profile' are both given: a job with the profile of a fiber has no cloth",
                                   path);
    }
    return STATUS_OK;
}

status job_check_profile_document(const struct option_value *v, struct error *err)
{
    static const char *const of_document[] = {"sample", "profile", "fit", NULL},
                             *const of_fit[] = {"model",  "models", "seed",   "fixed",          "start", "tied",
                                                "bounds", "priors", "starts", "max_iterations", NULL};
    status s = check_keys(v->value, "", of_document, err);
    const json_t *fit = json_object_get(v->value, "fit");
    if (s == STATUS_OK && fit != NULL) s = check_keys(fit, "fit.", of_fit, err);
    for (size_t i = 0; i < v->doc->n_model && s == STATUS_OK; i++)
        if (model_catalogue_find(v->doc->model[i].id)->kind != MODEL_SURFACE)
            s = error_set_field(err, STATUS_INVALID, "fit.models",
                                "'%s' is a model of a cloth as a volume: a profile needs a model of fibers",
                                v->doc->model[i].id);
    return s;
}
