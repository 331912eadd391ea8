#include "optimizer/stages/reading/pipeline_budget.h"
#include "base/option_id.h"
#include "optimizer/fit/objective/objective.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/stages/fit/pipeline_cloth.h"
#include "optimizer/stages/fit/pipeline_fit_option.h"
#include "optimizer/stages/fit/pipeline_nesting.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

/* Least number of paths that all starts of a model's fit take together, and the search over the cloth's numbers. */
static status least_budget(const struct job_inputs *in, size_t i_model, uint64_t *least, struct error *err)
{
    const struct model_setup *m = &in->model[i_model];
    const struct descent_method *method = descent_find(in->section.fit->method);
    struct fit_option option;
    struct fit_layout *layout = calloc(1, sizeof *layout);
    if (layout == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the job: out of memory");
    pipeline_fit_option(m->option, m->sets.info.param, m->sets.info.n_param, &option);
    status s = fit_layout_init(layout, m->sets.info.param, m->parameter, m->sets.info.n_param, &option, err);
    const struct fit_problem problem = {.n_param = layout->n_unknown,
                                        .info = layout->info,
                                        .parameter = layout->parameter,
                                        .observation = &in->rows.row,
                                        .max_iteration = in->section.fit->max_iteration};
    size_t n_nested = pipeline_n_nested_start(in->model, in->n_model, i_model);
    uint64_t of_one = s == STATUS_OK && method != NULL ? method->least_budget(&problem) : 0;
    *least = in->number.n > 0 ? pipeline_cloth_least_budget(&in->number, of_one, option.n_start, n_nested)
                              : of_one * (option.n_start + n_nested);
    free(layout);
    return s;
}

/* Warns of a goal of precision where no fitted row states an error that could be the measure. */
static void warn_precision(const struct stage_tools *tools, const struct job_inputs *in)
{
    bool stated = false;
    for (size_t i = 0; i < in->rows.row.n; i++)
        for (size_t k = 0; k < 3; k++) stated = stated || objective_photograph_variance(&in->rows.row.item[i], k) > 0.0;
    if (!stated && in->section.fit->precision > 0.0)
        worker_status_warn(tools->status,
                           "%s: the measurements state no errors that the noise of tracing could be compared with, so "
                           "the fit has no such goal",
                           job_option_key(OPTION_PRECISION));
}

status pipeline_warn_budget(const struct stage_tools *tools, const struct job_inputs *in, struct error *err)
{
    warn_precision(tools, in);
    for (size_t i = 0; i < in->n_model && in->section.fit->path_budget > 0; i++) {
        const struct model_setup *m = &in->model[i];
        uint64_t least;
        status s = least_budget(in, i, &least, err);
        if (s != STATUS_OK) return s;
        if (least <= in->section.fit->path_budget) continue;
        worker_status_warn(
            tools->status,
            "%s: %" PRIu64 " paths are too few, the fit of %s by %s to these %zu rows takes up to %" PRIu64
            " all the same: that is the least%s",
            job_option_key(OPTION_PATH_BUDGET), in->section.fit->path_budget, m->appearance.id, in->section.fit->method,
            in->rows.fitted.n, least,
            in->number.n > 0                                                              ? " with numbers of the cloth"
            : m->option->n_start + pipeline_n_nested_start(in->model, in->n_model, i) > 1 ? " for so many starts"
                                                                                          : "");
    }
    return STATUS_OK;
}
