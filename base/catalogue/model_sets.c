#include "base/catalogue/model_sets.h"

#include <stdio.h>
#include <string.h>

static void name_parameter(struct model_sets *s, size_t p, const struct param_info *own, const char *set)
{
    snprintf(s->name[p], sizeof s->name[p], "%s.%s", set, own->name);
    snprintf(s->symbol[p], sizeof s->symbol[p], "%s.%s", set, own->symbol);
    s->param[p].name = s->name[p];
    s->param[p].symbol = s->symbol[p];
    s->param[p].set = set;
}

status model_sets_init(struct model_sets *s, const struct model_info *model, const char (*set)[MODEL_SET_NAME_BYTES],
                       size_t n_set, struct error *err)
{
    memset(s, 0, sizeof *s);
    s->n_set = model->kind == MODEL_SURFACE && n_set > 1 ? n_set : 1;
    s->n_own = model->n_param;
    s->info = *model;
    if (s->n_set > MODEL_MAX_SET || s->n_set * s->n_own > MODEL_MAX_FLAT)
        return error_set(err, STATUS_INVALID,
                         "%zu sets of the %zu parameters of model '%s' are %zu: at most %d sets and %d parameters in "
                         "all are allowed",
                         n_set, s->n_own, model->id, n_set * s->n_own, MODEL_MAX_SET, MODEL_MAX_FLAT);
    s->info.n_param = s->n_set * s->n_own;
    s->info.param = s->param;
    for (size_t p = 0; p < s->info.n_param; p++) {
        const struct param_info *own = &model->param[p % s->n_own];
        s->param[p] = *own;
        if (s->n_set > 1) name_parameter(s, p, own, set[p / s->n_own]);
    }
    return STATUS_OK;
}
