#include "tests/support/cloth/fit_phantom.h"

#include "base/durable.h"
#include "base/rng.h"
#include "geometry/fibers/voxelise.h"
#include "optimizer/fit/objective/linear_model.h"
#include "optimizer/fit/objective/objective.h"
#include "optimizer/phantom/phantom_view_table.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { SEED_PHOTOGRAPH = 77001, SEED_KEPT = 77002, SEED_SCORE = 77003 };

void fit_check(status s, const struct error *err)
{
    if (s == STATUS_OK) return;
    fprintf(stderr, "%s\n", err->text);
    exit(1);
}

static void check_memory(const void *p)
{
    if (p != NULL) return;
    fputs("out of memory\n", stderr);
    exit(1);
}

/* ---- cloth ---- */

static void make_volume(struct fit_cloth *c, double voxel_m, struct thread_pool *pool)
{
    struct error err = {0};
    const struct voxelise_option o = {voxel_m, 1u << 30};
    fit_check(fibers_voxelise(&c->fiber, &o, pool, NULL, &c->volume, &voxel_m, &err), &err);
    fit_check(volume_scene_init(&c->volume_scene, &c->volume, &(struct volume_scene_option){.black_sheet = true}, &err),
              &err);
    c->has_volume = true;
}

/* As `selvedge-phantom cloth --yarn FILE --cover 1.1`: looser than smooth yarns, and closed all the same. */
static void take_yarn(struct phantom_option *o, const char *file)
{
    struct error err = {0};
    fit_check(phantom_yarn_read(file, &o->yarn, &err), &err);
    o->packing = 0.5;
    o->cover = 1.1;
}

static void take_felt(struct phantom_option *o, bool lofty)
{
    o->n_fiber_per_yarn = lofty ? 500 : 400;
    o->felt_tile_m = lofty ? 1e-3 : 6e-4;
    o->felt_thickness_m = lofty ? 1e-3 : 2.5e-4;
}

void fit_cloth_init(struct fit_cloth *c, const struct fit_cloth_option *option, struct thread_pool *pool)
{
    struct error err = {0};
    struct phantom_option o;
    struct phantom_report report;
    *c = (struct fit_cloth){0};
    fiber_set_init(&c->fiber);
    phantom_option_default(&o, option->weave);
    o.n_fiber_per_yarn = 37;
    o.vertex_spacing_m = 8e-6;
    if (option->weave == PHANTOM_FELT) take_felt(&o, option->lofty);
    if (option->yarn_file != NULL) take_yarn(&o, option->yarn_file);
    if (option->flatness > 0.0) o.flatness = option->flatness;
    fit_check(phantom_generate(&o, pool, NULL, &c->fiber, &report, &err), &err);
    fprintf(stderr, "phantom %s%s: %zu fibers, %zu vertices, covers %.3f, volume fraction %.2f\n",
            option->yarn_file != NULL ? "plied " : "", phantom_weave_name(option->weave), c->fiber.n_fiber,
            c->fiber.n_vertex, report.cover, report.volume_fraction);
    fit_check(scene_new(&c->fiber, &(struct scene_option){.black_sheet = true}, &c->scene, &err), &err);
    bool coarse = option->yarn_file != NULL || option->lofty;
    if (option->with_volume) make_volume(c, coarse ? 0.5 * o.fiber_radius_m[0] : 2e-6, pool);
}

void fit_cloth_release(struct fit_cloth *c)
{
    if (c->has_volume) {
        volume_scene_release(&c->volume_scene);
        direction_volume_release(&c->volume);
    }
    scene_free(c->scene);
    fiber_set_release(&c->fiber);
}

/* ---- phantom ---- */

static void start(struct fit_phantom *f, const char *folder, struct thread_pool *pool, const char *model_id,
                  const double *truth_file_unit)
{
    struct error err = {0};
    *f = (struct fit_phantom){.pool = pool, .folder = folder};
    fit_check(durable_make_folder(folder, &err), &err);
    if (!appearance_find(model_id, &f->model)) {
        fprintf(stderr, "no model '%s'\n", model_id);
        exit(1);
    }
    for (size_t p = 0; p < f->model.n_param; p++)
        f->truth[p] = truth_file_unit != NULL ? param_from_file_unit(&f->model.param[p], truth_file_unit[p])
                                              : f->model.param[p].start;
    observation_set_init(&f->observation);
    observation_set_init(&f->fitted);
}

void fit_phantom_init(struct fit_phantom *f, const char *folder, struct thread_pool *pool, enum phantom_weave weave,
                      const char *model_id, const double *truth_file_unit)
{
    start(f, folder, pool, model_id, truth_file_unit);
    fit_cloth_init(&f->cloth, &(struct fit_cloth_option){.weave = weave, .with_volume = f->model.kind == MODEL_VOLUME},
                   pool);
}

void fit_phantom_init_on(struct fit_phantom *f, const char *folder, struct thread_pool *pool,
                         const struct fit_cloth *cloth, const char *model_id, const double *truth_file_unit)
{
    start(f, folder, pool, model_id, truth_file_unit);
    f->cloth = *cloth;
    f->shares_cloth = true;
}

static void forget_observations(struct fit_phantom *f)
{
    observation_set_release(&f->observation);
    observation_set_release(&f->fitted);
    free(f->configuration);
    f->configuration = NULL;
}

void fit_phantom_release(struct fit_phantom *f)
{
    forget_observations(f);
    if (!f->shares_cloth) fit_cloth_release(&f->cloth);
}

void fit_phantom_observe(struct fit_phantom *f, const struct observation_set *o)
{
    struct error err = {0};
    forget_observations(f);
    if (o->n > FIT_MAX_OBSERVATION) {
        fprintf(stderr, "%zu observations: at most %d\n", o->n, FIT_MAX_OBSERVATION);
        exit(1);
    }
    for (size_t i = 0; i < o->n; i++) fit_check(observation_set_append(&f->observation, &o->item[i], &err), &err);
    fit_check(observation_set_select(o, JOB_SET_FIT, &f->fitted, &err), &err);
    f->configuration = trace_configurations(&f->observation);
    check_memory(f->configuration);
}

/* ---- estimates that are kept ---- */

struct kept_call {
    const double *param;
    const struct configuration *configuration;
    size_t n_configuration;
    uint64_t seed;
    uint32_t replica;
    bool want_jacobian, plain_paths;
};

static void run_counts(const struct fit_phantom *f, const struct kept_call *c, uint32_t iteration, const size_t *count,
                       struct estimate *out)
{
    struct error err = {0};
    const struct estimate_request q = {
        .input = {.scene = {.fibers = f->cloth.scene, .volume = f->cloth.has_volume ? &f->cloth.volume_scene : NULL},
                  .model = &f->model,
                  .param = c->param,
                  .want_derivative = c->want_jacobian,
                  .plain_paths = c->plain_paths},
        .configuration = c->configuration,
        .n_configuration = c->n_configuration,
        .n_path = count,
        .seed = c->seed,
        .iteration = iteration,
        .replica = c->replica};
    fit_check(estimate_run(&q, f->pool, NULL, out, &err), &err);
}

static void run_estimate(const struct fit_phantom *f, const struct kept_call *c, uint32_t iteration, size_t n_path,
                         struct estimate *out)
{
    size_t count[FIT_MAX_OBSERVATION];
    for (size_t i = 0; i < c->n_configuration; i++) count[i] = n_path;
    run_counts(f, c, iteration, count, out);
}

void fit_phantom_render(const struct fit_phantom *f, const double *param, size_t n_path, struct estimate *out)
{
    const struct kept_call call = {param, f->configuration, f->observation.n, SEED_SCORE, 0, false};
    run_estimate(f, &call, 1, n_path, out);
}

static uint32_t call_sum(const struct fit_phantom *f, const struct kept_call *c, uint32_t chunk, size_t n_path)
{
    const struct fiber_set *s = &f->cloth.fiber;
    const uint32_t number[] = {(uint32_t)c->seed, c->replica, chunk, c->want_jacobian, (uint32_t)n_path};
    uint32_t sum = (uint32_t)crc32_z(0, (const void *)s->position_m, 3 * s->n_vertex * sizeof *s->position_m);
    sum = (uint32_t)crc32_z(sum, (const void *)f->model.id, strlen(f->model.id));
    sum = (uint32_t)crc32_z(sum, (const void *)c->param, f->model.n_param * sizeof *c->param);
    for (size_t i = 0; i < c->n_configuration; i++) {
        const struct configuration *k = &c->configuration[i];
        const double angle[] = {k->light_theta_rad, k->light_phi_rad, k->camera_theta_rad, k->camera_phi_rad,
                                k->cloth_rotation_rad};
        sum = (uint32_t)crc32_z(sum, (const void *)angle, sizeof angle);
        if (k->n_rotation > 1) sum = (uint32_t)crc32_z(sum, (const void *)&k->n_rotation, sizeof k->n_rotation);
    }
    return (uint32_t)crc32_z(sum, (const void *)number, sizeof number);
}

static void chunk_estimate(const struct fit_phantom *f, const struct kept_call *c, uint32_t chunk, size_t n_path,
                           struct estimate *out)
{
    struct error err = {0};
    char path[1024], *data = NULL;
    size_t n = c->n_configuration * sizeof *out, n_read = 0;
    snprintf(path, sizeof path, "%s/%08x.estimates", f->folder, call_sum(f, c, chunk, n_path));
    if (file_read_all(path, n, &data, &n_read, &err) == STATUS_OK && n_read == n) {
        memcpy(out, data, n);
    } else {
        run_estimate(f, c, chunk, n_path, out);
        fit_check(durable_replace_volatile(path, out, n, &err), &err);
    }
    free(data);
}

/* sum <- sum + part, as means over chunks with equal path counts: divide by n_chunk at the end. */
static void merge(struct estimate *sum, const struct estimate *part, double share)
{
    for (int c = 0; c < 3; c++) {
        sum->mean[c] += share * part->mean[c];
        sum->var[c] += share * share * part->var[c];
    }
    for (int k = 0; k < 3 * SCATTERING_MAX_FLAT; k++) {
        sum->jac[k] += share * part->jac[k];
        sum->jac_var[k] += share * share * part->jac_var[k];
    }
    sum->n_path += part->n_path;
    sum->n_vertex += part->n_vertex;
}

static size_t n_chunks(size_t n_path) { return (n_path + FIT_CHUNK - 1) / FIT_CHUNK; }

static void kept_estimate(const struct fit_phantom *f, const struct kept_call *c, size_t first_chunk, size_t n_path,
                          struct estimate *out)
{
    size_t n_chunk = n_chunks(n_path);
    struct estimate *part = calloc(c->n_configuration, sizeof *part);
    check_memory(part);
    memset(out, 0, c->n_configuration * sizeof *out);
    for (size_t k = 0; k < n_chunk; k++) {
        chunk_estimate(f, c, (uint32_t)(first_chunk + k), n_path / n_chunk, part);
        for (size_t i = 0; i < c->n_configuration; i++) merge(&out[i], &part[i], 1.0 / (double)n_chunk);
    }
    free(part);
}

/* ---- photographs ---- */

static void views(struct phantom_view_table *t, struct configuration *configuration)
{
    static const struct job_document set_up = {
        .lamp_side_cm = 10.0, .lamp_distance_cm = 61.0, .camera_distance_cm = 100.0, .crop_cm = 1.0};
    phantom_view_table_builtin(t);
    for (size_t n = 0; n < FIT_N_VIEW; n++) {
        const struct job_photograph *v = &t->view[n];
        configuration[n] = observation_configuration(&set_up, v->light_theta_deg, v->light_phi_deg, v->camera_theta_deg,
                                                     v->camera_phi_deg, v->cloth_rotation_deg);
    }
}

void fit_phantom_photograph(struct fit_phantom *f, const struct fit_photography *how)
{
    struct phantom_view_table *t = calloc(1, sizeof *t);
    struct estimate *e = calloc(FIT_N_VIEW, sizeof *e);
    struct configuration configuration[FIT_N_VIEW];
    struct observation_set o;
    struct error err = {0};
    struct rng rng;
    check_memory(t);
    check_memory(e);
    views(t, configuration);
    const struct kept_call call = {f->truth, configuration, FIT_N_VIEW, SEED_PHOTOGRAPH, 0, .plain_paths = true};
    kept_estimate(f, &call, how->part * n_chunks(how->n_path), how->n_path, e);
    rng_start(&rng, &(struct rng_key){.seed = how->noise_seed, .iteration = 65533}, 0, 0);
    observation_set_init(&o);
    for (size_t i = 0; i < FIT_N_VIEW; i++) {
        struct observation item = {.set = t->view[i].set, .configuration = configuration[i], .weight = 1.0};
        memcpy(item.name, t->view[i].file, sizeof item.name);
        for (int c = 0; c < 3; c++) {
            double normal[2];
            rng_normal_pair(&rng, normal);
            item.mean_rgb[c] = e[i].mean[c] * (1.0 + how->noise * normal[0]);
            item.se_rgb[c] = sqrt(e[i].var[c] + how->noise * how->noise * e[i].mean[c] * e[i].mean[c]);
        }
        fit_check(observation_set_append(&o, &item, &err), &err);
    }
    fit_phantom_observe(f, &o);
    observation_set_release(&o);
    free(e);
    free(t);
}

uint64_t fit_phantom_fingerprint(const struct fit_phantom *f)
{
    const struct kept_call call = {f->truth, f->configuration, f->observation.n, 0, 0, false};
    uint32_t sum = 0;
    for (size_t i = 0; i < f->fitted.n; i++)
        sum = (uint32_t)crc32_z(sum, (const void *)f->fitted.item[i].mean_rgb, sizeof f->fitted.item[i].mean_rgb);
    return (uint64_t)call_sum(f, &call, 0, 0) << 32 | sum;
}

/* ---- scores ---- */

struct scorer {
    struct observation_set part;
    struct configuration *configuration;
    struct coordinate coordinate[SCATTERING_MAX_PARAM];
    struct linear_history history;
    struct linear_model model;
    struct estimate *replica[2];
};

static void append_here(struct scorer *s, const struct fit_phantom *f, const double *param)
{
    struct error err = {0};
    double x[SCATTERING_MAX_PARAM];
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
    check_memory(s->configuration);
    for (size_t p = 0; p < f->model.n_param; p++) {
        const struct param_info *info = &f->model.param[p];
        coordinate_init(&s->coordinate[p], info, info->lower, info->upper);
    }
    linear_history_init(&s->history, &s->part, s->coordinate, f->model.n_param);
    fit_check(linear_model_init(&s->model, 3 * s->part.n, f->model.n_param, &err), &err);
    for (int q = 0; q < 2; q++) check_memory(s->replica[q] = calloc(s->part.n, sizeof(struct estimate)));
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
        kept_estimate(f, &(struct kept_call){at, s->configuration, s->part.n, SEED_KEPT, q, true}, 0, n_kept,
                      s->replica[q]);
    append_here(s, f, at);
}

static void pool_at(struct scorer *s, const struct fit_phantom *f, const double *param)
{
    struct error err = {0};
    double x[SCATTERING_MAX_PARAM];
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

struct fit_score fit_phantom_score(const struct fit_phantom *f, enum job_set set, const double *at, size_t n_kept,
                                   const double *param, size_t n_path)
{
    struct scorer s;
    scorer_start(&s, f, set);
    if (at != NULL) append_kept(&s, f, at, n_kept);
    if (n_path > 0) {
        for (uint32_t q = 0; q < 2; q++)
            run_estimate(f, &(struct kept_call){param, s.configuration, s.part.n, SEED_SCORE, q, true}, 0, n_path,
                         s.replica[q]);
        append_here(&s, f, param);
    }
    pool_at(&s, f, param);
    struct fit_score score = score_of(&s.model);
    scorer_release(&s);
    return score;
}

/* What score_of makes of the squared error's se, the other way. */
static double squared_se(const struct linear_model *m, double rel_rms, double se)
{
    return fmax(2.0 * rel_rms, se) * se * (double)m->n_row;
}

/* Counts of the next round: configuration i's part of f is known to se_i with count[i] paths, so counts as se_i sqrt(count[i]) reach a
 * given se with the fewest. Where few paths bring most of the light a round may see none of them: the largest of what all rounds
 * saw counts, and no configuration gets less than a quarter of the mean. */
static void spread(const struct linear_model *m, const struct fit_score *now, const struct fit_score_goal *goal,
                   double work[FIT_MAX_OBSERVATION], size_t *count)
{
    const double reserve = 1.2; /* the errors are themselves estimates */
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
            run_counts(f, &(struct kept_call){param, s.configuration, s.part.n, SEED_SCORE, q, false}, round, count,
                       s.replica[q]);
        append_here(&s, f, param);
        pool_at(&s, f, param);
        const struct fit_score score = score_of(&s.model);
        bool last = score.se <= goal->se || round + 1 == ROUND;
        if (!last) spread(&s.model, &score, goal, work, count);
        scorer_release(&s);
        if (last) return score;
    }
}

/* trace(M J'J) / n_row on one set, J from the kept estimates at the truth. */
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
    double dx[SCATTERING_MAX_PARAM], m[SCATTERING_MAX_PARAM * SCATTERING_MAX_PARAM];
    for (size_t p = 0; p < n; p++) {
        struct coordinate k;
        coordinate_init(&k, &f->model.param[p], f->model.param[p].lower, f->model.param[p].upper);
        dx[p] = coordinate_from_param(&k, param[p]) - coordinate_from_param(&k, f->truth[p]);
    }
    for (size_t p = 0; p < n; p++)
        for (size_t q = 0; q < n; q++) m[p * n + q] = dx[p] * dx[q];
    return quadratic(f, set, n_kept, m);
}
