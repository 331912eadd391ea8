/* The gradient certificate of a job: derivative_check.h on its own cloth, photographs and result. */
#include "base/clock.h"
#include "optimizer/fit/descent/trace_estimator.h"
#include "optimizer/report/findings/findings.h"
#include "optimizer/stages/fit/pipeline_cloth.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { N_PATH = 2048 };

/* Relative error of a derivative, beyond noise, above which the certificate fails. Rounding in single precision alone
 * gives up to 0.2 %. */
static const double allowed_error = 0.01;

bool pipeline_certificate_passed(const struct pipeline_model *m)
{
    return derivative_check_excess(&m->advice->certificate, m->advice->certificate.worst) <= allowed_error;
}

static void warn_of(struct report *report, const struct pipeline_model *m)
{
    const struct derivative_check *k = &m->advice->certificate;
    if (pipeline_certificate_passed(m)) return;
    worker_status_warn(
        report->in.job->tools->status,
        "the derivatives by '%s' of model '%s' are off by %.2g of themselves on this cloth, where noise gives %.2g +- "
        "%.1g: do not trust the fit's standard errors, and report this",
        m->setup->sets.info.param[k->worst].name, m->setup->appearance.id, k->error[k->worst], k->noise[k->worst],
        k->noise_se[k->worst]);
}

static status certify(struct report *report, size_t i_model, const struct configuration *configuration,
                      const double *weight, struct error *err)
{
    const struct pipeline_model *m = &report->model[i_model];
    struct progress progress = progress_silent(&report->in.job->tools->progress); /* the smallest part of the stage */
    bool skip[FIT_MAX_PARAM];
    double start_s = clock_monotonic_s();
    for (size_t p = 0; p < m->setup->sets.info.n_param; p++) skip[p] = m->setup->parameter[p].fixed;
    const struct derivative_check_request q = {.input = {.scene = made_cloth_scene(report->in.made, m->setup),
                                                         .model = &m->setup->appearance,
                                                         .param = m->fit->result.param,
                                                         .n_set = m->setup->sets.n_set},
                                               .skip = skip,
                                               .configuration = configuration,
                                               .weight = weight,
                                               .n_configuration = report->in.job->rows->fitted.n,
                                               .n_path = N_PATH,
                                               .seed = report->in.job->seed,
                                               .replica = REPLICA_CERTIFICATE};
    status s = derivative_check_run(&q, &progress, &report->advice[i_model].certificate, err);
    if (s != STATUS_OK) return s;
    const struct derivative_check *k = &m->advice->certificate;
    log_info(report->in.job->tools->log,
             "gradient certificate of %s: worst relative error %.2g, noise %.2g +- %.1g (%s), %zu paths, %.1f s",
             m->setup->appearance.id, k->error[k->worst], k->noise[k->worst], k->noise_se[k->worst],
             m->setup->sets.info.param[k->worst].name, (size_t)k->n_path, clock_monotonic_s() - start_s);
    warn_of(report, m);
    return STATUS_OK;
}

status pipeline_certify(struct report *report, struct error *err)
{
    struct configuration *configuration = trace_configurations(&report->in.job->rows->fitted);
    double *weight = malloc((report->in.job->rows->fitted.n + 1) * sizeof *weight);
    status s = configuration != NULL && weight != NULL
                   ? STATUS_OK
                   : error_set(err, STATUS_NO_MEMORY, "cannot check derivatives: out of memory");
    for (size_t i = 0; i < report->in.job->rows->fitted.n && s == STATUS_OK; i++)
        weight[i] = sqrt(objective_relative_weight(&report->in.job->rows->fitted.item[i]));
    for (size_t i = 0; i < report->n_model && s == STATUS_OK; i++) {
        s = pipeline_cloth_use(report->in.job, &report->in.fit[i], i, report->in.made, err);
        if (s == STATUS_OK) s = certify(report, i, configuration, weight, err);
    }
    free(weight);
    free(configuration);
    return s;
}
