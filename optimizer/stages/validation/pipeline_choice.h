/* Chooses the best of a job's models. Held-out rows have no part in the choice, so neither the fit nor the choice has
 * seen the rows of the held-out error. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_CHOICE_H
#define SELVEDGE_OPTIMIZER_PIPELINE_CHOICE_H

#include "optimizer/stages/fit_stages.h"

enum pipeline_choice {
    CHOICE_ONLY_MODEL,
    CHOICE_CROSS_VALIDATION, /* by the error of fitted rows that are left out in turn (cross_validation.h) */
    CHOICE_FITTED_ROWS       /* there are too few rows for that: by the error over the rows that were fitted */
};

/* After validation. All models are compared by the same measure, so one fit without folds decides for all. */
enum pipeline_choice pipeline_choice(const struct pipeline_model *model, size_t n_model);
/* Its name in result.json: "only_model", "cross_validation", "fitted_rows". */
const char *pipeline_choice_id(enum pipeline_choice choice);
/* Index of the model with the lowest error by that measure. If the job gives every photograph a gain, each row has its
 * own. By cross-validation, models whose error is higher by no more than the standard error of the difference count as
 * equal (Hastie, Tibshirani, Friedman 2009, section 7.10.1), since a difference within its own error is chance. Of
 * these the one with the lowest Akaike criterion is the best: the error over the fitted rows, with a price for each
 * unknown. Where all have as many unknowns as values, the lowest error by cross-validation decides. */
size_t pipeline_best_model(const struct pipeline_model *model, size_t n_model);

/* Warns of models whose error equals the error of the best one within the noise, so that the choice between them is
 * chance, and of a choice by the fitted rows. */
void pipeline_warn_choice(struct worker_status *st, const struct pipeline_model *model, size_t n_model);

#endif
