#include "optimizer/report/export/hair_on_cloth.h"

#include "optimizer/fit/descent/fit_run.h"
#include "optimizer/fit/descent/trace_estimator.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/report/export/cloth_directions.h"
#include "optimizer/report/result/result_json.h"
#include "optimizer/stages/validation/pipeline_discrepancy.h"
#include "renderer/scene/scene_ray.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Parameters of one material of hair_mixture.v1, and of the whole mixture (dielectric_rows.def). */
enum { P_INDEX = 3, P_ALONG, P_AROUND, N_OF_MATERIAL, P_SHARE = HAIR_FIT_N_BLEND * N_OF_MATERIAL, N_OF_MIXTURE };
enum { N_FITTED = CLOTH_N_FITTED, N_DIRECTION = CLOTH_N_DIRECTION, N_REPLICA = 2, LEAST_PATHS = 512 };
static const char model_id[] = "hair_mixture.v1";
/* Paths of the fit: twice as many as the job's own, between these. The directions of the fitted cloth, and each
 * judgement, take shares of them. */
static const double least_budget = 1e6, most_budget = 2e6, traced_share = 0.35, judged_share = 0.15,
                    judged_row_share = 0.6;
/* Weight of all fitted rows beside 1 for the hemisphere, and the most rows that are fitted, in even steps. */
static const double weight_of_rows = 2.0;
enum { MOST_FITTED_ROWS = 64 };
/* How many times as long as a path of a photograph a path with this model takes: on a twill. */
static const double path_of_mixture = 1.6, mean_fits = 1.5; /* fit_from_starts */

struct on_cloth {
    struct export_scene *e;
    struct scene *round; /* the fibers as round tubes, where the job's own scene shows their sections; owned, or NULL */
    struct appearance mixture;
    struct model_sets sets;
    struct configuration configuration[N_DIRECTION];
    struct observation_set fitted, between, rows; /* with the radiances of the fitted cloth as measured ones */
    double budget;
    double param[FIT_MAX_PARAM];
    struct fit_result result;
};

static double budget_of(double n_fit_path)
{
    return n_fit_path > 0.0 ? fmin(fmax(2.0 * n_fit_path, least_budget), most_budget) : most_budget;
}

double hair_on_cloth_paths(double n_fit_path)
{
    return path_of_mixture * (mean_fits + traced_share + judged_share + judged_row_share) * budget_of(n_fit_path);
}

static struct estimate_request request_of(const struct on_cloth *f, const struct configuration *c, size_t n)
{
    return (struct estimate_request){
        .configuration = c, .n_configuration = n, .seed = f->e->report->in.job->seed ^ 0x68616972u};
}

/* The cloth as it was fitted, with its smooth factor. */
static struct radiance_input fitted_cloth(const struct on_cloth *f)
{
    const struct pipeline_model *m = f->e->model;
    return (struct radiance_input){.scene = made_cloth_scene(f->e->report->in.made, m->setup),
                                   .model = &m->setup->appearance,
                                   .param = m->fit->result.param,
                                   .n_set = m->setup->sets.n_set,
                                   .discrepancy = pipeline_discrepancy(m->validation)};
}

static struct radiance_input cloth_of_mixtures(const struct on_cloth *f)
{
    return (struct radiance_input){.scene = {.fibers = f->round != NULL ? f->round : f->e->report->in.made->scene},
                                   .model = &f->mixture,
                                   .param = f->param,
                                   .n_set = f->sets.n_set};
}

/* Estimates with as many paths for each configuration, during a part of the progress of e. */
static status trace(struct on_cloth *f, const struct estimate_request *request, double n_path_of_all,
                    const double part[2], struct estimate *out, struct error *err)
{
    struct estimate_request q = *request;
    struct progress_part p;
    const struct progress progress = progress_begin_part(&p, f->e->progress, part[0], part[1] - part[0]);
    size_t *n_path = malloc(q.n_configuration * sizeof *n_path);
    if (n_path == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit hair on the cloth: out of memory");
    for (size_t i = 0; i < q.n_configuration; i++)
        n_path[i] = (size_t)fmax(n_path_of_all / (double)q.n_configuration, LEAST_PATHS);
    q.n_path = n_path;
    status s = estimate_run(&q, f->e->report->in.job->tools->pool, &progress, out, err);
    free(n_path);
    return s;
}

static status trace_fitted_cloth(struct on_cloth *f, const double part[2], struct error *err)
{
    struct estimate_request q = request_of(f, f->configuration, N_DIRECTION);
    struct estimate *twin = calloc(N_DIRECTION, sizeof *twin);
    if (twin == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit hair on the cloth: out of memory");
    q.input = fitted_cloth(f);
    q.replica = REPLICA_CERTIFICATE;
    status s = trace(f, &q, traced_share * f->budget, part, twin, err);
    for (int i = 0; i < N_DIRECTION && s == STATUS_OK; i++) {
        struct observation o = {.set = JOB_SET_FIT, .configuration = f->configuration[i], .weight = 1.0};
        for (int c = 0; c < 3; c++) {
            o.mean_rgb[c] = twin[i].mean[c];
            o.se_rgb[c] = sqrt(twin[i].var[c]);
        }
        s = observation_set_append(i < N_FITTED ? &f->fitted : &f->between, &o, err);
    }
    free(twin);
    return s;
}

/* The rows of the job as it renders them. */
static status take_rows(struct on_cloth *f, struct error *err)
{
    const struct observation_set *rows = &f->e->report->in.job->rows->observation;
    status s = STATUS_OK;
    for (size_t i = 0; i < rows->n && s == STATUS_OK; i++) {
        struct observation o = {.set = JOB_SET_FIT, .configuration = rows->item[i].configuration, .weight = 1.0};
        result_rendered_mean(f->e->model, i, o.mean_rgb, o.se_rgb);
        s = observation_set_append(&f->rows, &o, err);
    }
    return s;
}

/* Adds the fitted rows to the directions that the mixtures are fitted to: highlights at grazing angles are rare over
 * the hemisphere, and what a job has rows of is what its user looks at. */
static status add_fitted_rows(struct on_cloth *f, struct error *err)
{
    const struct observation_set *rows = &f->e->report->in.job->rows->observation;
    size_t n = 0, seen = 0;
    double weight = 0.0;
    for (size_t i = 0; i < rows->n; i++) n += rows->item[i].set == JOB_SET_FIT && rows->item[i].weight > 0.0;
    const size_t step = (n + MOST_FITTED_ROWS - 1) / MOST_FITTED_ROWS;
    const size_t first = f->fitted.n;
    status s = STATUS_OK;
    for (size_t i = 0; i < rows->n && s == STATUS_OK; i++) {
        if (rows->item[i].set != JOB_SET_FIT || !(rows->item[i].weight > 0.0) || seen++ % step > 0) continue;
        struct observation o = f->rows.item[i];
        o.weight = rows->item[i].weight;
        weight += o.weight;
        s = observation_set_append(&f->fitted, &o, err);
    }
    for (size_t i = first; i < f->fitted.n; i++) f->fitted.item[i].weight *= weight_of_rows * N_FITTED / weight;
    return s;
}

/* ---- parameters ---- */

/* A second material that hardly takes part has hardly any derivatives, and the fit ends beside it: a cloth of dark
 * fibers came to 15 % of error so, and to 8 % from here. The rarer material starts as a rough copy of the other one.
 * Returns whether there was one. */
static bool spread_start(double *param)
{
    const double least_share = 0.2, start_share = 0.25, along = 0.6, around = 0.7;
    const bool first_is_rare = param[P_SHARE] > 0.5;
    double *rare = param + (first_is_rare ? 0 : N_OF_MATERIAL);
    if (param[P_SHARE] >= least_share && param[P_SHARE] <= 1.0 - least_share) return false;
    memcpy(rare, param + (first_is_rare ? N_OF_MATERIAL : 0), N_OF_MATERIAL * sizeof *param);
    rare[P_ALONG] = along;
    rare[P_AROUND] = around;
    param[P_SHARE] = first_is_rare ? 1.0 - start_share : start_share;
    return true;
}

static void param_of(const struct hair_blend *b, const struct param_info *info, double *param)
{
    for (size_t k = 0; k < HAIR_FIT_N_BLEND; k++) {
        const struct hair_lobes *l = &b->lobes[k];
        double *own = param + N_OF_MATERIAL * k;
        for (size_t c = 0; c < 3; c++) own[c] = exp(-2.0 * l->absorption[c]);
        own[P_INDEX] = l->index;
        own[P_ALONG] = l->longitudinal_roughness;
        own[P_AROUND] = l->azimuthal_roughness;
    }
    param[P_SHARE] = b->second_share;
    for (size_t p = 0; p < N_OF_MIXTURE; p++) { /* the fit moves none that stands at a bound */
        const double inside = 1e-3 * (info[p].upper - info[p].lower);
        param[p] = fmin(fmax(param[p], info[p].lower + inside), info[p].upper - inside);
    }
}

static struct hair_blend blend_of(const double *param)
{
    struct hair_blend b = {.second_share = param[P_SHARE]};
    for (size_t k = 0; k < HAIR_FIT_N_BLEND; k++) {
        const double *own = param + N_OF_MATERIAL * k;
        b.lobes[k] = (struct hair_lobes){own[P_ALONG], own[P_AROUND], own[P_INDEX], {0}};
        for (size_t c = 0; c < 3; c++) b.lobes[k].absorption[c] = -0.5 * log(own[c]);
    }
    return b;
}

/* ---- fit and judgement ---- */

/* The error of the cloth of mixtures over a set, and of each of its rows where row_error is not NULL. */
static status judge(struct on_cloth *f, const struct observation_set *o, double share, const double part[2],
                    struct objective_value *value, double *row_error, struct error *err)
{
    struct configuration *c = trace_configurations(o);
    struct estimate *a = calloc(N_REPLICA * o->n, sizeof *a);
    status s =
        c != NULL && a != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot judge an export: out of memory");
    for (uint32_t r = 0; r < N_REPLICA && s == STATUS_OK; r++) {
        const double middle = 0.5 * (part[0] + part[1]),
                     half[2] = {r == 0 ? part[0] : middle, r == 0 ? middle : part[1]};
        struct estimate_request q = request_of(f, c, o->n);
        q.input = cloth_of_mixtures(f);
        q.replica = REPLICA_FINAL_A + r;
        s = trace(f, &q, share * f->budget / N_REPLICA, half, a + r * o->n, err);
    }
    if (s == STATUS_OK) objective_evaluate(o, a, a + o->n, value);
    for (size_t i = 0; i < o->n && row_error != NULL && s == STATUS_OK; i++) {
        double se;
        row_error[i] = fmax(objective_row_error(&o->item[i], &a[i], &a[o->n + i], &se), 0.0);
        row_error[i] = fmax(row_error[i], se);
    }
    free(c);
    free(a);
    return s;
}

static status fit(struct on_cloth *f, const double part[2], struct error *err)
{
    struct progress_part p;
    const struct progress progress = progress_begin_part(&p, f->e->progress, part[0], part[1] - part[0]);
    struct configuration *configuration = trace_configurations(&f->fitted);
    if (configuration == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit hair on the cloth: out of memory");
    struct trace_estimator live = {request_of(f, configuration, f->fitted.n), f->e->report->in.job->tools->pool};
    live.request.input = cloth_of_mixtures(f);
    const struct estimator estimator = trace_estimator(&live);
    struct fit_parameter parameter[FIT_MAX_PARAM];
    for (size_t i = 0; i < f->sets.info.n_param; i++)
        parameter[i] =
            (struct fit_parameter){f->sets.info.param[i].lower, f->sets.info.param[i].upper, f->param[i], false};
    const struct fit_problem problem = {.n_param = f->sets.info.n_param,
                                        .info = f->sets.info.param,
                                        .parameter = parameter,
                                        .observation = &f->fitted,
                                        .estimator = &estimator,
                                        .path_budget = (uint64_t)f->budget,
                                        .progress = &progress};
    status s = fit_run(descent_find("gauss_newton.v1"), &problem, NULL, &f->result, err);
    if (s == STATUS_OK) memcpy(f->param, f->result.param, sizeof f->param);
    free(configuration);
    return s;
}

/* Fits from the mixtures of single fibers and, where one of them has a rare material, once more from spread ones. The
 * lower objective over the fitted directions and rows counts. */
static status fit_from_starts(struct on_cloth *f, const double part[2], struct error *err)
{
    const double middle = 0.5 * (part[0] + part[1]), first[2] = {part[0], middle}, second[2] = {middle, part[1]};
    double spread[FIT_MAX_PARAM], best[FIT_MAX_PARAM];
    bool is_rare = false;
    memcpy(spread, f->param, sizeof spread);
    for (size_t g = 0; g < f->sets.n_set; g++) is_rare |= spread_start(spread + g * N_OF_MIXTURE);
    status s = fit(f, is_rare ? first : part, err);
    if (s != STATUS_OK || !is_rare) return s;
    const double lowest = f->result.objective.value;
    memcpy(best, f->param, sizeof best);
    memcpy(f->param, spread, sizeof spread);
    s = fit(f, second, err);
    if (s == STATUS_OK && lowest < f->result.objective.value) memcpy(f->param, best, sizeof best);
    return s;
}

/* Fits, and judges between the fitted directions and over the rows. */
static status fit_and_judge(struct on_cloth *f, double from, double to, struct error *err)
{
    const double step = (to - from) / 10.0, at[5] = {from, from + 2 * step, from + 7 * step, from + 8 * step, to};
    struct objective_value between = {0}, rows = {0};
    struct hair_error *error = &f->e->hair_error;
    status s = trace_fitted_cloth(f, &at[0], err);
    if (s == STATUS_OK) s = add_fitted_rows(f, err);
    if (s == STATUS_OK) s = fit_from_starts(f, &at[1], err);
    if (s == STATUS_OK) s = judge(f, &f->between, judged_share, &at[2], &between, NULL, err);
    if (s == STATUS_OK) s = judge(f, &f->rows, judged_row_share, &at[3], &rows, error->row_rel_error, err);
    if (s != STATUS_OK) return s;
    error->rel_rms = fmax(between.rel_rms, between.rel_rms_se); /* an error below its noise is not known any nearer */
    error->row_rel_rms = fmax(rows.rel_rms, rows.rel_rms_se);
    error->row_rel_rms_se = rows.rel_rms_se;
    error->stated = true;
    log_info(f->e->report->in.job->tools->log,
             "exports: the cloth with hair mixtures differs by %.1f %% over the hemisphere, %.1f %% over the rows",
             1e2 * between.rel_rms, 1e2 * rows.rel_rms);
    return STATUS_OK;
}

status hair_on_cloth_run(struct export_scene *e, double from, double to, struct error *err)
{
    const size_t n_set = e->model->setup->sets.n_set;
    if (n_set * N_OF_MIXTURE > MODEL_MAX_FLAT) return STATUS_OK;
    struct on_cloth *f = calloc(1, sizeof *f);
    e->hair_error.row_rel_error = calloc(e->report->in.job->rows->observation.n, sizeof(double));
    if (f == NULL || e->hair_error.row_rel_error == NULL) {
        free(f);
        return error_set(err, STATUS_NO_MEMORY, "cannot fit hair on the cloth: out of memory");
    }
    struct film_groups films;
    job_cloth_films(e->report->in.job->cloth, &films);
    f->e = e;
    f->budget = budget_of((double)e->model->fit->result.n_path);
    observation_set_init(&f->fitted);
    observation_set_init(&f->between);
    observation_set_init(&f->rows);
    cloth_directions_make(e->report->in.made->fiber.tile_size_m, f->configuration);
    status s =
        appearance_find(model_id, &f->mixture)
            ? model_sets_init(&f->sets, model_catalogue_find(model_id), e->report->in.job->cloth->group, n_set, err)
            : error_set(err, STATUS_INTERNAL, "there is no model %s", model_id);
    if (s == STATUS_OK && scene_shows_sections(e->report->in.made->scene))
        s = scene_new(&e->report->in.made->fiber,
                      &(struct scene_option){.black_sheet = e->report->in.job->setup->black_sheet, .films = &films},
                      &f->round, err);
    for (size_t g = 0; g < n_set && s == STATUS_OK; g++)
        param_of(&e->hair[g].blend, f->mixture.param, f->param + g * N_OF_MIXTURE);
    if (s == STATUS_OK) s = take_rows(f, err);
    if (s == STATUS_OK) s = fit_and_judge(f, from, to, err);
    for (size_t g = 0; g < n_set && s == STATUS_OK; g++) e->hair[g].blend = blend_of(f->param + g * N_OF_MIXTURE);
    observation_set_release(&f->fitted);
    observation_set_release(&f->between);
    observation_set_release(&f->rows);
    scene_free(f->round);
    free(f);
    return s;
}
