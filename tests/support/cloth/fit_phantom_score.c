/* Scores of fits on a phantom (fit_phantom.h). */
#include "optimizer/fit/linear/linear_model.h"
#include "optimizer/fit/objective/objective.h"
#include "tests/support/cloth/cached_estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct scorer {
    struct observation_set part;
    struct configuration *configuration;
    struct coordinate coordinate[FIT_MAX_PARAM];
    struct linear_history history;
    struct linear_model model;
    struct estimate *replica[2];
};

static void append_here(struct scorer *s, const struct fit_phantom *f, const double *param)
{
    struct error err = {0};
    double x[FIT_MAX_PARAM];
    for (size_t p = 0; p < f->model.n_param; p++) x[p] = coordinate_from_param(&s->coordinate[p], param[p]);
    fit_check(linear_history_append(&s->history, x, s->replica[0], s->replica[1], &err), &err);
}

static void scorer_start(struct scorer *s, const struct fit_phantom *f, enum job_set set)
{
    struct error err = {0};
    *s = (struct scorer){0};
    observation_set_init(&s->part);
    fit_check(observation_set_select(&f->observation, set, &s->part, &err), &err);
    s->configuration = trace_configurations(&s->part);
    fit_check_memory(s->configuration);
    for (size_t p = 0; p < f->model.n_param; p++) {
        const struct param_info *info = &f->model.param[p];
        coordinate_init(&s->coordinate[p], info, info->lower, info->upper);
    }
    linear_history_init(&s->history, &s->part, s->coordinate, f->model.n_param);
    fit_check(linear_model_init(&s->model, 3 * s->part.n, f->model.n_param, &err), &err);
    for (int q = 0; q < 2; q++) fit_check_memory(s->replica[q] = calloc(s->part.n, sizeof(struct estimate)));
}

static void scorer_release(struct scorer *s)
{
    linear_model_release(&s->model);
    linear_history_release(&s->history);
    observation_set_release(&s->part);
    free(s->configuration);
    free(s->replica[0]);
    free(s->replica[1]);
}

static void append_kept(struct scorer *s, const struct fit_phantom *f, const double *at, size_t n_kept)
{
    for (uint32_t q = 0; q < 2; q++)
        cached_estimate(f, &(struct cached_call){at, s->configuration, s->part.n, SEED_KEPT, q, true, !f->guided}, 0,
                        n_kept, s->replica[q]);
    append_here(s, f, at);
}

static void pool_at(struct scorer *s, const struct fit_phantom *f, const double *param)
{
    struct error err = {0};
    double x[FIT_MAX_PARAM];
    for (size_t p = 0; p < f->model.n_param; p++) x[p] = coordinate_from_param(&s->coordinate[p], param[p]);
    fit_check(linear_model_pool(&s->model, &s->history, x, &err), &err);
}

static struct fit_score score_of(const struct linear_model *m)
{
    double se, value = fmax(linear_model_objective(m, &se), 0.0), n_row = (double)m->n_row;
    struct fit_score score = {.rel_rms = sqrt(value / n_row)};
    score.se = fmin(0.5 * se / (n_row * score.rel_rms), sqrt(se / n_row));
    return score;
}

double fit_phantom_stated_score(const struct fit_phantom *f, enum job_set set)
{
    struct observation_set part;
    struct error err = {0};
    observation_set_init(&part);
    fit_check(observation_set_select(&f->observation, set, &part, &err), &err);
    double score = sqrt(objective_mean_photograph_variance(&part));
    observation_set_release(&part);
    return score;
}

static void append_score_paths(struct scorer *s, const struct fit_phantom *f, const double *param, size_t n_path)
{
    for (uint32_t q = 0; q < 2; q++)
        kept_run(f, &(struct cached_call){param, s->configuration, s->part.n, SEED_SCORE, q, true, !f->guided}, 0,
                 n_path, s->replica[q]);
    append_here(s, f, param);
}

double fit_phantom_true_error(const struct fit_phantom *f, enum job_set set, size_t n_kept, const double *param,
                              size_t n_path)
{
    struct scorer s;
    scorer_start(&s, f, set);
    append_kept(&s, f, f->truth, n_kept);
    append_score_paths(&s, f, param, n_path);
    const size_t n_row = s.model.n_row;
    double *at_truth = malloc(2 * n_row * sizeof *at_truth), square = 0.0;
    fit_check_memory(at_truth);
    pool_at(&s, f, f->truth);
    for (size_t q = 0; q < 2; q++) memcpy(at_truth + q * n_row, s.model.r[q], n_row * sizeof *at_truth);
    pool_at(&s, f, param);
    for (size_t row = 0; row < n_row; row++)
        square += (s.model.r[0][row] - at_truth[row]) * (s.model.r[1][row] - at_truth[n_row + row]);
    free(at_truth);
    scorer_release(&s);
    return sqrt(fmax(0.0, square / (double)n_row));
}

struct fit_score fit_phantom_score(const struct fit_phantom *f, enum job_set set, const double *at, size_t n_kept,
                                   const double *param, size_t n_path)
{
    struct scorer s;
    scorer_start(&s, f, set);
    if (at != NULL) append_kept(&s, f, at, n_kept);
    if (n_path > 0) append_score_paths(&s, f, param, n_path);
    pool_at(&s, f, param);
    struct fit_score score = score_of(&s.model);
    scorer_release(&s);
    return score;
}

/* The standard error of the sum of squared errors at which rel_rms has the standard error se; the inverse of the
 * conversion in score_of. */
static double squared_se(const struct linear_model *m, double rel_rms, double se)
{
    return fmax(2.0 * rel_rms, se) * se * (double)m->n_row;
}

/* Path counts of the next round. The part of f that is due to configuration i has the standard error se_i with
 * count[i] paths, so counts in proportion to se_i sqrt(count[i]) reach a given standard error with the fewest paths.
 * Where few paths carry most of the light, a round may contain none of them and underestimate se_i. Therefore the
 * largest value of all rounds is used, and no configuration gets less than a quarter of the mean. */
static void spread(const struct linear_model *m, const struct fit_score *now, const struct fit_score_goal *goal,
                   double work[FIT_MAX_OBSERVATION], size_t *count)
{
    const double reserve = 1.2; /* because the standard errors are themselves estimates */
    size_t n = m->n_row / 3;
    double sum = 0.0, spent = 0.0, most = (double)(goal->most * n), se = squared_se(m, now->rel_rms, goal->se);
    for (size_t i = 0; i < n; i++) {
        double part;
        linear_model_part(m, i, &part);
        work[i] = fmax(work[i], part * sqrt((double)count[i]));
        sum += work[i];
        spent += (double)count[i];
    }
    double total = fmin(fmax(reserve * sum * sum / (se * se), 1.5 * spent), most);
    for (size_t i = 0; i < n; i++) count[i] = (size_t)(total * fmax(work[i] / sum, 0.25 / (double)n));
}

struct fit_score fit_phantom_score_to(const struct fit_phantom *f, enum job_set set, const double *param,
                                      const struct fit_score_goal *goal)
{
    enum { ROUND = 4 };
    size_t count[FIT_MAX_OBSERVATION];
    double work[FIT_MAX_OBSERVATION] = {0};
    for (size_t i = 0; i < FIT_MAX_OBSERVATION; i++) count[i] = goal->first;
    for (uint32_t round = 0;; round++) {
        struct scorer s;
        scorer_start(&s, f, set);
        for (uint32_t q = 0; q < 2; q++)
            kept_run_counts(f, &(struct cached_call){param, s.configuration, s.part.n, SEED_SCORE, q, false}, round,
                            count, s.replica[q]);
        append_here(&s, f, param);
        pool_at(&s, f, param);
        const struct fit_score score = score_of(&s.model);
        bool last = score.se <= goal->se || round + 1 == ROUND;
        if (!last) spread(&s.model, &score, goal, work, count);
        scorer_release(&s);
        if (last) return score;
    }
}

/* Returns trace(M J'J) / n_row on one set, with J from the kept estimates at the truth. */
static double quadratic(const struct fit_phantom *f, enum job_set set, size_t n_kept, const double *m)
{
    struct scorer s;
    size_t n = f->model.n_param;
    double sum = 0.0;
    scorer_start(&s, f, set);
    append_kept(&s, f, f->truth, n_kept);
    pool_at(&s, f, f->truth);
    for (size_t row = 0; row < s.model.n_row; row++)
        for (size_t p = 0; p < n; p++)
            for (size_t q = 0; q < n; q++) sum += s.model.j[0][row * n + p] * m[p * n + q] * s.model.j[1][row * n + q];
    sum /= (double)s.model.n_row;
    scorer_release(&s);
    return sum;
}

double fit_phantom_expected(const struct fit_phantom *f, enum job_set set, size_t n_kept, const double *cov)
{
    return quadratic(f, set, n_kept, cov);
}

double fit_phantom_first_order(const struct fit_phantom *f, enum job_set set, size_t n_kept, const double *param)
{
    size_t n = f->model.n_param;
    double dx[FIT_MAX_PARAM], m[FIT_MAX_PARAM * FIT_MAX_PARAM];
    for (size_t p = 0; p < n; p++) {
        struct coordinate k;
        coordinate_init(&k, &f->model.param[p], f->model.param[p].lower, f->model.param[p].upper);
        dx[p] = coordinate_from_param(&k, param[p]) - coordinate_from_param(&k, f->truth[p]);
    }
    for (size_t p = 0; p < n; p++)
        for (size_t q = 0; q < n; q++) m[p * n + q] = dx[p] * dx[q];
    return quadratic(f, set, n_kept, m);
}
