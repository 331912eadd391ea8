#include "optimizer/stages/validation/pipeline_choice.h"
#include "optimizer/job/document/job_fit_option.h"

#include <math.h>
#include <stdio.h>

enum pipeline_choice pipeline_choice(const struct pipeline_model *model, size_t n_model)
{
    if (n_model < 2) return CHOICE_ONLY_MODEL;
    for (size_t i = 0; i < n_model; i++)
        if (model[i].fit->result.cross_validation.n_fold == 0) return CHOICE_FITTED_ROWS;
    return CHOICE_CROSS_VALIDATION;
}

const char *pipeline_choice_id(enum pipeline_choice choice)
{
    static const char *const id[] = {
        [CHOICE_ONLY_MODEL] = "only_model",
        [CHOICE_CROSS_VALIDATION] = "cross_validation",
        [CHOICE_FITTED_ROWS] = "fitted_rows",
    };
    return id[choice];
}

static const struct objective_value *fitted_error(const struct pipeline_model *m)
{
    return m->setup->option->gain == JOB_GAIN_PER_PHOTOGRAPH ? &m->validation->fit_with_gains : &m->validation->fit;
}

static double judged_square(const struct pipeline_model *m, enum pipeline_choice choice)
{
    return choice == CHOICE_CROSS_VALIDATION ? m->fit->result.cross_validation.rel_square : fitted_error(m)->rel_square;
}

/* Returns the error of b less the error of a, as relative squares; se: its standard error. */
static double difference(const struct pipeline_model *a, const struct pipeline_model *b, enum pipeline_choice choice,
                         double *se)
{
    if (choice == CHOICE_CROSS_VALIDATION)
        return cross_validation_difference(&a->fit->result.cross_validation, &b->fit->result.cross_validation, se);
    *se = hypot(fitted_error(a)->rel_square_se, fitted_error(b)->rel_square_se);
    return fitted_error(b)->rel_square - fitted_error(a)->rel_square;
}

static size_t lowest_error(const struct pipeline_model *model, size_t n_model, enum pipeline_choice choice)
{
    size_t lowest = 0;
    for (size_t i = 1; i < n_model; i++)
        if (judged_square(&model[i], choice) < judged_square(&model[lowest], choice)) lowest = i;
    return lowest;
}

/* Unknowns that were fitted: those with an error. */
static size_t n_fitted(const struct pipeline_model *m)
{
    const struct uncertainty *u = &m->fit->result.unknown_uncertainty;
    size_t n = 0;
    for (size_t p = 0; p < u->n_param; p++) n += u->cov[p * u->n_param + p] > 0.0;
    return n;
}

/* Akaike's criterion with its correction for few values (Burnham and Anderson 2002, "Model Selection and Multimodel
 * Inference", section 2.4): n ln(error^2) + 2 k n / (n - k - 1). Infinite where unknowns are as many as values. */
static double akaike(const struct pipeline_model *m)
{
    const struct cross_validation *v = &m->fit->result.cross_validation;
    const struct objective_value *e = fitted_error(m);
    double n = 0.0, k = (double)n_fitted(m);
    for (size_t f = 0; f < v->n_fold; f++) n += v->fold_count[f];
    double square = fmax(fmax(e->rel_square, e->rel_square_se), 1e-12); /* noise may leave less than nothing */
    return n > k + 1.0 ? n * log(square) + 2.0 * k * n / (n - k - 1.0) : INFINITY;
}

size_t pipeline_best_model(const struct pipeline_model *model, size_t n_model)
{
    const enum pipeline_choice choice = pipeline_choice(model, n_model);
    const size_t lowest = lowest_error(model, n_model, choice);
    size_t best = lowest;
    for (size_t i = 0; i < n_model && choice == CHOICE_CROSS_VALIDATION; i++) {
        const struct pipeline_model *m = &model[i];
        double se, more = difference(&model[lowest], m, choice, &se);
        if (more <= se && akaike(m) < akaike(&model[best])) best = i;
    }
    return best;
}

/* Writes "two_lobe.v1 (8.7 +- 0.3 %)". */
static void describe(const struct pipeline_model *m, enum pipeline_choice choice, char text[120])
{
    bool folds = choice == CHOICE_CROSS_VALIDATION;
    double rms = folds ? m->fit->result.cross_validation.rel_rms : fitted_error(m)->rel_rms,
           se = folds ? m->fit->result.cross_validation.rel_rms_se : fitted_error(m)->rel_rms_se;
    snprintf(text, 120, "%.64s (%.3g +- %.2g %%)", m->setup->appearance.id, 100.0 * rms, 100.0 * se);
}

static void warn_of_equals(struct worker_status *st, const struct pipeline_model *model, size_t n_model,
                           enum pipeline_choice choice)
{
    size_t best = pipeline_best_model(model, n_model), used = 0;
    char text[1200], name[120];
    for (size_t i = 0; i < n_model && used < sizeof text; i++) {
        double se, more = difference(&model[best], &model[i], choice, &se);
        if (i == best || !(more < 2.0 * se)) continue;
        if (used == 0) {
            describe(&model[best], choice, name);
            used = (size_t)snprintf(text, sizeof text, "the %s do not tell %s from",
                                    choice == CHOICE_CROSS_VALIDATION ? "fitted rows, cross-validated," : "fitted rows",
                                    name);
        }
        describe(&model[i], choice, name);
        used += (size_t)snprintf(text + used, sizeof text - used, " %s", name);
    }
    const char *simpler = best != lowest_error(model, n_model, choice)
                              ? "; of these the one with the lowest Akaike criterion is the result"
                              : "";
    if (used > 0) worker_status_warn(st, "%s%s", text, simpler);
}

void pipeline_warn_choice(struct worker_status *st, const struct pipeline_model *model, size_t n_model)
{
    const enum pipeline_choice choice = pipeline_choice(model, n_model);
    if (choice == CHOICE_ONLY_MODEL) return;
    if (choice == CHOICE_FITTED_ROWS)
        worker_status_warn(st,
                           "there are too few fitted rows for cross-validation: the best model was chosen by its error "
                           "over the rows to which it was fitted, which favours models with more parameters");
    warn_of_equals(st, model, n_model, choice);
}
