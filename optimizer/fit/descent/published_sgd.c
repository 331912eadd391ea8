/* published_sgd.v1: the optimizer of the fabric thesis (5.5.4, 5.5.5, B.1), so that results can be compared.
 *
 * Rescaling curves first (rescale.h). Then six runs from the start with the step a / i, i = 50, 51, ..., 60
 * iterations each, with exponentially spaced a; the run with the lowest final objective wins; if it still oscillates,
 * 10 more iterations at a tenth of its last step. Every iteration renders all configurations twice (two replicas). As
 * published that is 64 x 64 x 64 paths a configuration and replica.
 *
 * Differs: the thesis does not give the six values of a; here they grow by a factor of 3, and the first step moves
 * the parameter that moves most by 0.5 % .. 120 % of its rescaled range. "Final objective" is the mean over the last
 * five iterations of a run: the value of one iteration is noisy. "Oscillates" means that successive steps point
 * against each other on average. A run is at rest below a mean cosine of turn_limit, over at least N_EXTRA pairs of
 * steps; steps that follow the noise of tracing are so, too. So the fit counts as converged only if 4 more estimates
 * at the winner also show that no lower objective is near, and are precise enough to show it (rest_check.h). A
 * parameter that is fixed keeps its value. With a path budget, all renderings shrink alike. Errors come from the same
 * 4 estimates.
 */
#include "optimizer/fit/descent/descent_end.h"
#include "optimizer/fit/descent/rescale.h"
#include "renderer/estimate/estimate.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N = FIT_MAX_PARAM, N_RUN = 6, N_EXTRA = 10, FIRST_I = 50, N_LAST = 5 };

static const uint64_t published_path = 64 * 64 * 64;
static const double first_move = 0.005, factor = 3.0, turn_limit = 0.3;

struct sgd {
    struct descent_run run;
    struct rescale_curve curve[N];
    double param[N];
    double last_step[N];      /* in r */
    double a;                 /* of the present run */
    double objective[N_LAST]; /* ring buffer of the last objectives */
    /* exponentially fading sum, over some N_EXTRA steps, of the cosine between successive steps; see mean_turn */
    double turn;
    size_t i;          /* iterations of this run so far */
    uint32_t next_key; /* iteration number of the random key */
};

/* Descent direction in r: df/dr = df/dp dp/dr; zero for fixed parameters. */
static void gradient_in_r(const struct sgd *g, double *gradient)
{
    const struct fit_problem *problem = g->run.problem;
    objective_gradient(problem->observation, g->run.replica[0], g->run.replica[1], problem->n_param, gradient);
    for (size_t p = 0; p < problem->n_param; p++)
        gradient[p] = g->run.fixed[p] ? 0.0 : gradient[p] * rescale_slope(&g->curve[p], g->param[p]);
}

static double cosine(const double *x, const double *y, size_t n)
{
    double xy = 0.0, xx = 0.0, yy = 0.0;
    for (size_t p = 0; p < n; p++) {
        xy += x[p] * y[p];
        xx += x[p] * x[p];
        yy += y[p] * y[p];
    }
    return xx > 0.0 && yy > 0.0 ? xy / sqrt(xx * yy) : 0.0;
}

/* One iteration: estimate, report, move by rate x gradient in r, clamp to the bounds. */
static status iterate(struct sgd *g, const char *phase, double rate, struct error *err)
{
    const struct fit_problem *problem = g->run.problem;
    struct fit_step step = {.phase = phase, .param = g->param};
    double gradient[N], move[N];
    status s = descent_estimate(&g->run, g->param, g->next_key++, true, err);
    if (s == STATUS_OK) s = descent_report(&g->run, &step, err);
    if (s != STATUS_OK) return s;
    g->objective[g->i % N_LAST] = step.objective.value;
    gradient_in_r(g, gradient);
    double moved[N];
    for (size_t p = 0; p < problem->n_param; p++) {
        move[p] = -rate * gradient[p];
        moved[p] = g->run.fixed[p]
                       ? g->param[p]
                       : rescale_backward(&g->curve[p], rescale_forward(&g->curve[p], g->param[p]) + move[p]);
    }
    if (g->i > 0) g->turn += (cosine(move, g->last_step, problem->n_param) - g->turn) / N_EXTRA;
    memcpy(g->last_step, move, sizeof move);
    memcpy(g->param, moved, problem->n_param * sizeof *moved);
    g->i++;
    return STATUS_OK;
}

/* Number of steps of this run that have a predecessor in it. */
static size_t n_compared(const struct sgd *g) { return g->i > 0 ? g->i - 1 : 0; }

/* Mean cosine of successive steps, in which the last ones count most. The division corrects for the sum's start at 0,
 * which acts like earlier steps at right angles. */
static double mean_turn(const struct sgd *g)
{
    double known = 1.0 - pow(1.0 - 1.0 / N_EXTRA, (double)n_compared(g));
    return known > 0.0 ? g->turn / known : 0.0;
}

static double final_objective(const struct sgd *g)
{
    size_t n = g->i < N_LAST ? g->i : N_LAST;
    double sum = 0.0;
    for (size_t k = 0; k < n; k++) sum += g->objective[k];
    return n > 0 ? sum / (double)n : INFINITY;
}

/* The multiplier for which the first step a / 50 moves the fastest parameter by `first_move` of its range. */
static status first_rate(struct sgd *g, double *a, struct error *err)
{
    double gradient[N], fastest = 0.0;
    status s = descent_estimate(&g->run, g->param, g->next_key++, true, err);
    if (s != STATUS_OK) return s;
    gradient_in_r(g, gradient);
    for (size_t p = 0; p < g->run.problem->n_param; p++)
        fastest = fmax(fastest, fabs(gradient[p]) / g->curve[p].r[g->curve[p].n - 1]);
    *a = fastest > 0.0 ? first_move * FIRST_I / fastest : 0.0;
    return STATUS_OK;
}

static void start_run(struct sgd *g, double a)
{
    for (size_t p = 0; p < g->run.problem->n_param; p++) g->param[p] = g->run.problem->parameter[p].start;
    memset(g->last_step, 0, sizeof g->last_step);
    g->a = a;
    g->turn = 0.0;
    g->i = 0;
}

struct winner {
    double param[N], objective, turn, rate, a;
    int i_run;
    size_t n_compared;
};

static status run_all(struct sgd *g, size_t n_iteration, double a, struct winner *best, struct error *err)
{
    for (int k = 0; k < N_RUN; k++, a *= factor) {
        char phase[32];
        snprintf(phase, sizeof phase, "run %d of %d", k + 1, N_RUN);
        start_run(g, a);
        for (size_t i = 0; i < n_iteration; i++) {
            status s = iterate(g, phase, g->a / (double)(FIRST_I + i), err);
            if (s != STATUS_OK) return s;
        }
        double f = final_objective(g);
        if (k > 0 && !(f < best->objective)) continue;
        *best = (struct winner){
            .objective = f, .turn = mean_turn(g), .a = a, .i_run = k, .rate = a / (double)(FIRST_I + n_iteration - 1)};
        best->n_compared = n_compared(g);
        memcpy(best->param, g->param, sizeof g->param);
    }
    return STATUS_OK;
}

static status iterate_more(struct sgd *g, const struct winner *best, struct error *err)
{
    start_run(g, best->a);
    memcpy(g->param, best->param, sizeof g->param);
    for (size_t i = 0; i < N_EXTRA; i++) {
        status s = iterate(g, "settling", 0.1 * best->rate, err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

/* Decides whether the winner is a minimum, and writes the reason. end: of the estimates there. */
static void judge(const struct winner *best, const struct rest_check *end, struct fit_result *result)
{
    const bool at_end = best->i_run == 0 || best->i_run == N_RUN - 1, enough = best->n_compared >= N_EXTRA;
    const bool at_rest = best->turn <= turn_limit;
    result->stop = !enough    ? STOP_TOO_FEW_STEPS
                   : at_end   ? STOP_END_OF_BRACKET
                   : !at_rest ? STOP_STILL_MOVING
                              : rest_check_verdict(end);
    result->converged = result->stop == STOP_SCHEDULE;
    int n = snprintf(result->reason, sizeof result->reason, "run %d of %d had the lowest sum of squared errors%s; ",
                     best->i_run + 1, N_RUN, at_end ? ", which is at the end of the bracket" : "");
    char *rest = result->reason + n;
    const size_t room = sizeof result->reason - (size_t)n;
    if (!enough)
        snprintf(rest, room,
                 "%zu pairs of successive steps are too few to tell whether it has converged (%d are needed)",
                 best->n_compared, N_EXTRA);
    else
        snprintf(rest, room,
                 "its steps have a mean cosine of %.2f (below %.1f is at rest); further steps promise to lower the "
                 "sum of squared errors, %.3g, by %.2g with a noise of %.2g",
                 best->turn, turn_limit, result->objective.value, end->promised, end->noise);
}

/* Number of renderings of one configuration: for the curves, the first rate, the runs, the extra iterations and the
 * end. */
static double n_rendering(const struct fit_problem *problem, const struct coordinate *k)
{
    size_t n_iteration =
        problem->max_iteration > 0 ? problem->max_iteration : method_published_sgd.default_max_iteration;
    return RESCALE_POINTS * (double)rescale_n_curve(problem, k) +
           2.0 * (1.0 + (double)(N_RUN * n_iteration) + N_EXTRA + DESCENT_N_END);
}

/* Paths of one rendering of every configuration with the fewest paths that an estimate takes. */
static double least_rendering(const struct observation_set *o)
{
    double sum = 0.0;
    for (size_t i = 0; i < o->n; i++) sum += (double)estimate_n_path(&o->item[i].configuration, 1);
    return sum;
}

/* Meets a stated budget by a common multiple of the fewest paths. The progress then refers to the paths planned here.
 */
static void plan_paths(struct descent_run *run)
{
    const struct observation_set *o = run->problem->observation;
    double n = n_rendering(run->problem, run->coordinate), sum = 0.0;
    double times = floor((double)run->problem->path_budget / (n * least_rendering(o)));
    for (size_t i = 0; i < o->n; i++) {
        size_t least = estimate_n_path(&o->item[i].configuration, 1);
        run->n_path[i] = run->problem->path_budget > 0 ? (size_t)fmax(1.0, times) * least : published_path;
        sum += (double)run->n_path[i];
    }
    run->path_budget = (uint64_t)(n * sum);
}

static uint64_t least_budget(const struct fit_problem *problem)
{
    struct coordinate k[N];
    for (size_t p = 0; p < problem->n_param; p++)
        coordinate_init(&k[p], &problem->info[p], problem->parameter[p].lower, problem->parameter[p].upper);
    return (uint64_t)(n_rendering(problem, k) * least_rendering(problem->observation));
}

static status run_published_sgd(const struct fit_problem *problem, struct fit_result *result, struct error *err)
{
    struct sgd *g = calloc(1, sizeof *g);
    struct winner best = {.objective = INFINITY};
    struct rest_check end = {0};
    memset(result, 0, sizeof *result);
    if (g == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start a fit: out of memory");
    status s = descent_run_init(&g->run, problem, &descent_published_sgd, err);
    if (s != STATUS_OK) goto out;
    size_t n_iteration =
        problem->max_iteration > 0 ? problem->max_iteration : method_published_sgd.default_max_iteration;
    plan_paths(&g->run);
    struct fit_problem planned = *problem;
    planned.path_budget = g->run.path_budget;
    s = rescale_measure(&planned, g->run.coordinate, g->run.n_path, g->curve, &g->run.n_path_total, &g->run.wall_s,
                        err);
    if (s != STATUS_OK) goto out;
    double a = 0.0;
    start_run(g, 0.0);
    s = first_rate(g, &a, err);
    if (s == STATUS_OK) s = run_all(g, n_iteration, a, &best, err);
    if (s != STATUS_OK) goto out;
    if (best.turn < 0.0)
        s = iterate_more(g, &best, err);
    else
        memcpy(g->param, best.param, sizeof g->param);
    if (s == STATUS_OK) s = descent_end(&g->run, g->param, g->next_key, result, &end, err);
    if (s == STATUS_OK) judge(&best, &end, result);
out:
    descent_run_release(&g->run);
    free(g);
    return s;
}

const struct descent_method descent_published_sgd = {
    .info = &method_published_sgd,
    .plain_paths = true,
    .run = run_published_sgd,
    .least_budget = least_budget,
};
