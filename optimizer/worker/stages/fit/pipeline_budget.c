#include "optimizer/worker/stages/fit/pipeline_budget.h"
#include "base/option_id.h"
#include "optimizer/fit/objective/objective.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/worker/stages/fit/pipeline_cloth.h"
#include "optimizer/worker/stages/fit/pipeline_fit_option.h"
#include "optimizer/worker/stages/fit/pipeline_nesting.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

/* Least number of paths that all starts of a model's fit take together, and the search over the cloth's numbers. */
static status least_budget(const struct pipeline_context *c, size_t i_model, uint64_t *least, struct error *err)
{
    const struct pipeline_model *m = &c->model[i_model];
    const struct descent_method *method = descent_find(c->doc->fit.method);
    struct fit_option option;
    struct fit_layout *layout = calloc(1, sizeof *layout);
    if (layout == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the job: out of memory");
    pipeline_fit_option(m->option, m->sets.info.param, m->sets.info.n_param, &option);
    status s = fit_layout_init(layout, m->sets.info.param, m->parameter, m->sets.info.n_param, &option, err);
    const struct fit_problem problem = {.n_param = layout->n_unknown,
                                        .info = layout->info,
                                        .parameter = layout->parameter,
                                        .observation = &c->row,
                                        .max_iteration = c->doc->fit.max_iteration};
    size_t n_nested = pipeline_n_nested_start(c, i_model);
    uint64_t of_one = s == STATUS_OK && method != NULL ? method->least_budget(&problem) : 0;
    *least = c->number.n > 0 ? pipeline_cloth_least_budget(c, of_one, option.n_start, n_nested)
                             : of_one * (option.n_start + n_nested);
    free(layout);
    return s;
}

/* Warns of a goal of precision where no fitted row states an error that could be the measure. */
static void warn_precision(struct pipeline_context *c)
{
    bool stated = false;
    for (size_t i = 0; i < c->row.n; i++)
        for (size_t k = 0; k < 3; k++) stated = stated || objective_photograph_variance(&c->row.item[i], k) > 0.0;
    if (!stated && c->doc->fit.precision > 0.0)
        worker_status_warn(c->status,
                           "%s: the measurements state no errors that the noise of tracing could be compared with, so "
                           "the fit has no such goal",
                           job_option_key(OPTION_PRECISION));
}

status pipeline_warn_budget(struct pipeline_context *c, struct error *err)
{
    warn_precision(c);
    for (size_t i = 0; i < c->n_model && c->doc->fit.path_budget > 0; i++) {
        const struct pipeline_model *m = &c->model[i];
        uint64_t least;
        status s = least_budget(c, i, &least, err);
        if (s != STATUS_OK) return s;
        if (least <= c->doc->fit.path_budget) continue;
        worker_status_warn(c->status,
                           "%s: %" PRIu64
                           " paths are too few, the fit of %s by %s to these %zu rows takes up to %" PRIu64
                           " all the same: that is the least%s",
                           job_option_key(OPTION_PATH_BUDGET), c->doc->fit.path_budget, m->appearance.id,
                           c->doc->fit.method, c->fitted.n, least,
                           c->number.n > 0                                          ? " with numbers of the cloth"
                           : m->option->n_start + pipeline_n_nested_start(c, i) > 1 ? " for so many starts"
                                                                                    : "");
    }
    return STATUS_OK;
}
