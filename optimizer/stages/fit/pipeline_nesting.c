#include "optimizer/stages/fit/pipeline_nesting.h"
#include "optimizer/job/document/job_fit_option.h"

#include <string.h>

/* The model of the job that n names as the inner one of model i_model; NULL when there is none. */
static const struct model_setup *inner_model(const struct model_setup *model, size_t n_model, size_t i_model,
                                             const struct model_nesting *n)
{
    if (strcmp(n->outer, model[i_model].appearance.id) != 0) return NULL;
    for (size_t i = 0; i < n_model; i++)
        if (strcmp(n->inner, model[i].appearance.id) == 0) return &model[i];
    return NULL;
}

/* Returns whether all models of the job that model i_model contains are done. */
static bool inner_models_done(const struct model_setup *model, size_t n_model, size_t i_model, const bool *done)
{
    const struct model_nesting *n;
    for (size_t i = 0; (n = model_catalogue_nesting(i)) != NULL; i++) {
        const struct model_setup *inner = inner_model(model, n_model, i_model, n);
        if (inner != NULL && !done[inner - model]) return false;
    }
    return true;
}

void pipeline_fit_order(const struct model_setup *model, size_t n_model, size_t order[JOB_MAX_MODEL])
{
    bool done[JOB_MAX_MODEL] = {false};
    for (size_t k = 0; k < n_model; k++) {
        size_t next = 0;
        while (done[next] || !inner_models_done(model, n_model, next, done)) next++; /* no model contains itself */
        order[k] = next;
        done[next] = true;
    }
}

/* Writes the parameters of `to` that equal the result `fit` of the model `from`, and the n_number numbers of its
 * cloth. The parameter that only `to` has, in every group of fibers, gets `value`. */
static void nested_start(const struct model_info *to, const struct model_info *from, const struct model_fit *fit,
                         double value, size_t n_number, double *start)
{
    for (size_t p = 0; p < to->n_param; p++) {
        start[p] = value;
        for (size_t q = 0; q < from->n_param; q++)
            if (strcmp(to->param[p].name, from->param[q].name) == 0) start[p] = fit->result.param[q];
    }
    memcpy(start + to->n_param, fit->cloth.number, n_number * sizeof *start);
}

static size_t room_for_starts(const struct model_setup *m)
{
    size_t room = FIT_MAX_START - m->option->n_start;
    return room < FIT_MAX_EXTRA_START ? room : FIT_MAX_EXTRA_START;
}

size_t pipeline_n_nested_start(const struct model_setup *model, size_t n_model, size_t i_model)
{
    const struct model_nesting *n;
    size_t n_start = 0, room = room_for_starts(&model[i_model]);
    for (size_t i = 0; (n = model_catalogue_nesting(i)) != NULL; i++)
        if (inner_model(model, n_model, i_model, n) != NULL) n_start += MODEL_N_NESTED_START;
    return n_start < room ? n_start : room;
}

void pipeline_add_nested_starts(const struct nested_models *m, size_t i_model, struct fit_option *o)
{
    const struct model_nesting *n;
    size_t room = room_for_starts(&m->setup[i_model]);
    for (size_t i = 0; (n = model_catalogue_nesting(i)) != NULL; i++) {
        const struct model_setup *inner = inner_model(m->setup, m->n, i_model, n);
        for (size_t k = 0; k < MODEL_N_NESTED_START && inner != NULL && o->n_extra_start < room; k++)
            nested_start(&m->setup[i_model].sets.info, &inner->sets.info, &m->fit[inner - m->setup], n->start[k],
                         m->n_number, o->extra_start[o->n_extra_start++]);
    }
}
