/* When a fit by gauss_newton.v1 is expected to end, for its progress.
 *
 * A fit that ends by its noise needs the paths that bring the noise of the pooled means to the target. A fit that ends
 * at misfit needs few paths but several iterations: each iteration that lowers the objective leaves about a fifth of
 * the possible decrease, then the regularization ends, which makes room for another decrease, and the last ones see no
 * progress. The numbers come from the example jobs (config/examples). */
#include "optimizer/fit/descent/gauss_newton.h"

#include <math.h>

static const double decrease_of_step = 5.0, arrived_share = 0.02;
static const double steps_regularized = 3.0, steps_without = 2.0;
/* The first steps go far, so their noise and misfit belong to other parameters than the result. The prediction passes
 * from the usual paths of such fits to the fit's own prediction over this many steps. */
static const double own_steps = 12.0;

/* Iterations until a fit that heads for misfit has arrived. */
static double steps_to_misfit(const struct gauss_newton *g)
{
    const double weighted = linear_model_weighted_objective(&g->model),
                 left = fmax(weighted - g->far_decrease, 0.1 * weighted);
    const double share = fmax(g->far_decrease, 0.0) / fmax(left, 1e-12);
    const double arrival = log(fmax(share / arrived_share, 1.0)) / log(decrease_of_step);
    return arrival + steps_without + (g->regularized ? steps_regularized : 0.0);
}

/* Paths of all configurations and replicas for each path of one of them. */
static double paths_per_effective(const struct gauss_newton *g)
{
    const size_t n = g->run.problem->observation->n;
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) sum += (double)g->run.n_path[i] / (double)n;
    return (double)g->run.n_path_step / sum;
}

double gauss_newton_expected_paths(const struct gauss_newton *g, double f, double se, size_t n_left)
{
    const double n_row_path = paths_per_effective(g), done = (double)g->run.n_path_total;
    const double next = g->n_path_mean * n_row_path;
    const double f_end = f - fmax(g->far_decrease, 0.0); /* while f is large, a large noise seems good enough */
    double effective = g->model.n_effective * fmax(gauss_newton_paths_to_grow(g, f_end, se), 1.0);
    if (g->regularized) effective = fmax(effective, GAUSS_NEWTON_REGULARIZED_UNTIL);
    double more = (effective - g->model.n_effective) * n_row_path;
    const double growth = gauss_newton_paths_to_misfit(g);
    if (isfinite(growth))
        more = fmin(more, fmax(next * steps_to_misfit(g), (growth - 1.0) * g->model.n_effective * n_row_path));
    more = fmin(more, next * (double)n_left);
    const double own = fmin(done + fmax(more, next), fmax((double)g->run.path_budget, done + next));
    const double usual = fmax(g->run.problem->usual_path, done + next),
                 trust = fmin((double)g->run.n_step / own_steps, 1.0);
    return g->run.problem->usual_path > 0.0 ? pow(own, trust) * pow(usual, 1.0 - trust) : own;
}
