/* The gradient certificate of a job: derivative_check.h on its own cloth, photographs and result. */
#include "base/clock.h"
#include "optimizer/fit/descent/trace_estimator.h"
#include "optimizer/worker/stages/fit/pipeline_cloth.h"
#include "optimizer/worker/stages/result/pipeline_advice.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { N_PATH = 2048 };

/* Relative error of a derivative, beyond noise, above which the certificate fails. Rounding in single precision alone
 * gives up to 0.2 %. */
static const double allowed_error = 0.01;

bool pipeline_certificate_passed(const struct pipeline_model *m)
{
    return derivative_check_excess(&m->certificate, m->certificate.worst) <= allowed_error;
}

static void warn_of(struct pipeline_context *c, const struct pipeline_model *m)
{
    const struct derivative_check *k = &m->certificate;
    if (pipeline_certificate_passed(m)) return;
    worker_status_warn(
        c->status,
        "the derivatives by '%s' of model '%s' are off by %.2g of themselves on this cloth, where noise gives %.2g +- "
        "%.1g: do not trust the fit's standard errors, and report this",
        m->sets.info.param[k->worst].name, m->appearance.id, k->error[k->worst], k->noise[k->worst],
        k->noise_se[k->worst]);
}

static status certify(struct pipeline_context *c, struct pipeline_model *m, const struct configuration *configuration,
                      const double *weight, struct error *err)
{
    bool skip[FIT_MAX_PARAM];
    double start_s = clock_monotonic_s();
    for (size_t p = 0; p < m->sets.info.n_param; p++) skip[p] = m->parameter[p].fixed;
    const struct derivative_check_request q = {.input = {.scene = pipeline_scene(c, m),
                                                         .model = &m->appearance,
                                                         .param = m->fit.param,
                                                         .n_set = m->sets.n_set},
                                               .skip = skip,
                                               .configuration = configuration,
                                               .weight = weight,
                                               .n_configuration = c->fitted.n,
                                               .n_path = N_PATH,
                                               .seed = c->doc->fit.seed,
                                               .replica = REPLICA_CERTIFICATE};
    status s = derivative_check_run(&q, &c->progress, &m->certificate, err);
    if (s != STATUS_OK) return s;
    const struct derivative_check *k = &m->certificate;
    log_info(c->log,
             "gradient certificate of %s: worst relative error %.2g, noise %.2g +- %.1g (%s), %zu paths, %.1f s",
             m->appearance.id, k->error[k->worst], k->noise[k->worst], k->noise_se[k->worst],
             m->sets.info.param[k->worst].name, (size_t)k->n_path, clock_monotonic_s() - start_s);
    warn_of(c, m);
    return STATUS_OK;
}

status pipeline_certify(struct pipeline_context *c, struct error *err)
{
    struct configuration *configuration = trace_configurations(&c->fitted);
    double *weight = malloc((c->fitted.n + 1) * sizeof *weight);
    status s = configuration != NULL && weight != NULL
                   ? STATUS_OK
                   : error_set(err, STATUS_NO_MEMORY, "cannot check derivatives: out of memory");
    for (size_t i = 0; i < c->fitted.n && s == STATUS_OK; i++)
        weight[i] = sqrt(objective_relative_weight(&c->fitted.item[i]));
    for (size_t i = 0; i < c->n_model && s == STATUS_OK; i++) {
        s = pipeline_cloth_use(c, i, err);
        if (s == STATUS_OK) s = certify(c, &c->model[i], configuration, weight, err);
    }
    free(weight);
    free(configuration);
    return s;
}
