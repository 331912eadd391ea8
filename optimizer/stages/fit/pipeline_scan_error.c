#include "optimizer/stages/fit/pipeline_scan_error.h"
#include "base/catalogue/method_catalogue.h"
#include "base/clock.h"
#include "geometry/fibers/shape/fiber_roughen.h"
#include "optimizer/fit/cloth/carried_error.h"
#include "optimizer/fit/cloth/cloth_estimator.h"
#include "optimizer/fit/descent/fit_run.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/stages/fit/pipeline_cloth.h"
#include "optimizer/stages/fit/pipeline_trace.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RADIUS, NOISE, N_NUMBER };

/* The move of a number is a quarter of these ranges: 9 % of the radius, and a noise of twice the
 * stated direction error. Both are far above the errors, so that the noise of tracing is small beside the change. */
static const struct param_info number_info[N_NUMBER] = {
    [RADIUS] = {.name = "radius",
                .kind = PARAM_SHAPE,
                .channel = -1,
                .lower = 0.835,
                .upper = 1.2,
                .start = 1.0,
                .coordinate = PARAM_LOG},
    [NOISE] = {.name = "direction_noise", .kind = PARAM_SHAPE, .channel = -1, .upper = 16.0},
};
/* Between the axes as they should be and as they are: noise may have been left in them (-1), or as much of their own
 * waves been smoothed away (1). Uniform between the two. */
static const double noise_sd = 0.57735;
/* Paths of one of the cloths, as a share of the paths of the fit; move of a number as a share of its range. */
static const double path_share = 0.1, difference_share = 0.25;

struct scan_trace {
    const struct fit_input *in;
    size_t i_model;
    struct configuration *configuration;
    struct cloth_estimator cloth;
    struct fiber_roughness noise;
};

bool pipeline_scan_error_applies(const struct cloth_job *job, const struct made_cloth *made, size_t i_model)
{
    return job->scan->given && made->number.n == 0 && job->model[i_model].appearance.kind == MODEL_SURFACE &&
           job->model[i_model].sets.info.n_param + N_NUMBER <= FIT_MAX_PARAM &&
           made->geometry.axis_direction_se_rad > 0.0;
}

/* The fibers with the radius and the noise of the numbers. */
static status make_scene(const struct scan_trace *t, const double *number, struct scene **scene, struct error *err)
{
    struct fiber_set fiber;
    struct fiber_roughness noise = t->noise;
    fiber_set_init(&fiber);
    status s = fiber_set_copy(&t->in->made->fiber, &fiber, err);
    if (s != STATUS_OK) return s;
    for (size_t i = 0; i < fiber.n_fiber; i++) fiber_set_scale_radius(&fiber, i, number[RADIUS]);
    noise.direction_sd_rad *= sqrt(number[NOISE]);
    fiber_roughen(&fiber, &noise);
    s = made_cloth_fiber_scene(t->in->job, t->i_model, &fiber, scene, err);
    fiber_set_release(&fiber);
    return s;
}

static status estimate(void *context, const double *number, const struct estimator_call *call,
                       const struct progress *progress, struct estimate *out, double *wall_s, struct error *err)
{
    const struct scan_trace *t = context;
    struct trace_estimator live;
    struct scene *scene = NULL;
    double start_s = clock_monotonic_s();
    status s = make_scene(t, number, &scene, err);
    if (s != STATUS_OK) return s;
    pipeline_trace_request(&live, t->in->job, t->in->made, t->i_model, t->configuration, t->cloth.n_configuration);
    live.request.input.scene = (struct appearance_scene){.fibers = scene};
    struct estimator e = trace_estimator(&live);
    s = e.run(e.context, call, progress, out, wall_s, err);
    *wall_s = clock_monotonic_s() - start_s;
    scene_free(scene);
    return s;
}

/* Appends the numbers to the unknowns of the model's fit, which starts at its result. */
static void add_numbers(const struct fit_result *result, const double sd[N_NUMBER], struct pipeline_joint *j)
{
    const size_t n = j->n_scattering;
    for (size_t p = 0; p < n; p++)
        if (!j->parameter[p].fixed) j->parameter[p].start = result->param[p];
    for (size_t k = 0; k < N_NUMBER; k++) {
        const struct param_info *info = &number_info[k];
        j->param[n + k] = *info;
        j->parameter[n + k] = (struct fit_parameter){info->lower, info->upper, info->start, !(sd[k] > 0.0)};
        if (sd[k] > 0.0) {
            j->option.prior_mean[n + k] = info->start;
            j->option.prior_se[n + k] = sd[k];
        }
    }
    j->info.n_param = n + N_NUMBER;
    j->option.n_start = 1;
}

static status run_joint(struct scan_trace *t, uint64_t n_fit_path, struct pipeline_joint *j,
                        const struct progress *progress, struct fit_result *joint, struct error *err)
{
    const struct observation_set *row = &t->in->job->rows->row;
    const size_t n = j->n_scattering, n_path = (size_t)(path_share * (double)n_fit_path);
    const struct cloth_source source = {t, N_NUMBER, estimate, NULL};
    status s = cloth_estimator_init(&t->cloth, &source, n, row->n, j->param + n, j->parameter + n, err);
    if (s != STATUS_OK) return s;
    t->cloth.moves = CLOTH_MOVES_SINGLE; /* a single iteration */
    t->cloth.difference = difference_share;
    struct estimator e = cloth_estimator(&t->cloth);
    const struct fit_problem problem = {.n_param = j->info.n_param,
                                        .info = j->param,
                                        .parameter = j->parameter,
                                        .observation = row,
                                        .estimator = &e,
                                        .path_budget = n_path,
                                        .max_iteration = 1,
                                        .first_path = n_path / (2 * row->n),
                                        .progress = progress};
    return fit_run(descent_find(method_gauss_newton.id), &problem, &j->option, joint, err);
}

/* Adds the errors and notes how much they are. */
static void carry(const struct pipeline_joint *j, const double sd[N_NUMBER], const struct fit_result *joint,
                  struct model_fit *fit)
{
    const size_t n = j->n_scattering;
    size_t n_leader = 0;
    double variance[N_NUMBER];
    for (size_t p = 0; p < n; p++) n_leader += j->option.leader[p] == p;
    for (size_t k = 0; k < N_NUMBER; k++) variance[k] = sd[k] * sd[k]; /* both have slope 1 in their coordinate */
    struct uncertainty before = fit->result.uncertainty;
    carried_error_add(&joint->uncertainty, n, N_NUMBER, variance, &fit->result.uncertainty);
    carried_error_add(&joint->unknown_uncertainty, n_leader, N_NUMBER, variance, &fit->result.unknown_uncertainty);
    for (size_t p = 0; p < n; p++) {
        const double a = fit->result.uncertainty.se_param[p], b = before.se_param[p];
        fit->scan_error.se_param[p] = sqrt(fmax(a * a - b * b, 0.0));
    }
    carried_error_limit(j->param, j->parameter, &fit->result.uncertainty);
    fit->scan_error.radius_rel_se = sd[RADIUS];
}

status pipeline_scan_error_carry(const struct fit_input *in, size_t i_model, const struct progress *progress,
                                 struct model_fit *fit, struct error *err)
{
    const struct reconstruct_report *g = &in->made->geometry;
    memset(&fit->scan_error, 0, sizeof fit->scan_error);
    if (!pipeline_scan_error_applies(in->job, in->made, i_model)) return STATUS_OK;
    const double direction = g->axis_direction_se_rad,
                 sd[N_NUMBER] = {made_cloth_radius_error(in->job, in->made), noise_sd};
    struct scan_trace t = {.in = in, .i_model = i_model, .noise = {g->axis_noise_se_m / direction, direction}};
    struct pipeline_joint *j = malloc(sizeof *j);
    struct fit_result *joint = malloc(sizeof *joint);
    t.configuration = trace_configurations(&in->job->rows->row);
    status s = j != NULL && joint != NULL && t.configuration != NULL
                   ? pipeline_joint_init(&in->job->model[i_model], &in->made->number, j, err)
                   : error_set(err, STATUS_NO_MEMORY, "cannot carry the errors of the fibers: out of memory");
    if (s == STATUS_OK) {
        add_numbers(&fit->result, sd, j);
        s = run_joint(&t, fit->result.n_path, j, progress, joint, err);
    }
    if (s == STATUS_OK) {
        carry(j, sd, joint, fit);
        fit->scan_error.direction_se_rad = direction;
    }
    cloth_estimator_release(&t.cloth);
    free(t.configuration);
    free(joint);
    free(j);
    return s;
}
