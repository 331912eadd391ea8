#include "optimizer/report/textures/texture_target.h"

#include "optimizer/fit/objective/objective.h"
#include "optimizer/report/export/cloth_directions.h"
#include "optimizer/report/result/result_json.h"
#include "optimizer/stages/validation/pipeline_discrepancy.h"

#include <math.h>
#include <stdlib.h>

enum { PATHS_OF_A_DIRECTION = 6144 };
/* Of the hemisphere, beside 1 of all rows. */
static const double hemisphere_weight = 0.5;

double texture_target_paths(void) { return (double)CLOTH_N_DIRECTION * PATHS_OF_A_DIRECTION; }

static void put(struct texture_target *t, size_t i, const struct configuration *c, enum texture_part part,
                const double rgb[3])
{
    struct texture_radiance *r = &t->item[i];
    *r = (struct texture_radiance){.configuration = *c, .part = part};
    for (int k = 0; k < 3; k++) r->rgb[k] = rgb[k];
    r->scale = 1.0 / fmax((rgb[0] + rgb[1] + rgb[2]) / 3.0, OBJECTIVE_TAU);
}

static status trace(const struct export_scene *e, const double part[2], struct configuration *c, struct estimate *out,
                    struct error *err)
{
    const struct pipeline_model *m = e->model;
    struct progress_part p;
    const struct progress progress = progress_begin_part(&p, e->progress, part[0], part[1] - part[0]);
    size_t n_path[CLOTH_N_DIRECTION];
    for (size_t i = 0; i < CLOTH_N_DIRECTION; i++) n_path[i] = PATHS_OF_A_DIRECTION;
    const struct estimate_request q = {.input = {.scene = made_cloth_scene(e->report->in.made, m->setup),
                                                 .model = &m->setup->appearance,
                                                 .param = m->fit->result.param,
                                                 .n_set = m->setup->sets.n_set,
                                                 .discrepancy = pipeline_discrepancy(m->validation)},
                                       .configuration = c,
                                       .n_configuration = CLOTH_N_DIRECTION,
                                       .n_path = n_path,
                                       .replica = REPLICA_CERTIFICATE,
                                       .seed = e->report->in.job->seed ^ 0x746172676574u};
    return estimate_run(&q, e->report->in.job->tools->pool, &progress, out, err);
}

/* A row of the job weighs in proportion to its weight in the fit. */
static void weigh(struct texture_target *t, const struct observation_set *rows)
{
    double of_rows = 0.0;
    for (size_t i = 0; i < t->n_row; i++)
        if (t->item[i].part == TEXTURE_FITTED_ROW) of_rows += rows->item[i].weight;
    for (size_t i = 0; i < t->n; i++) {
        if (t->item[i].part == TEXTURE_FITTED_ROW)
            t->item[i].weight = of_rows > 0.0 ? rows->item[i].weight / of_rows : 0.0;
        if (t->item[i].part == TEXTURE_FITTED_DIRECTION) t->item[i].weight = hemisphere_weight / CLOTH_N_FITTED;
    }
}

status texture_target_make(const struct export_scene *e, double from, double to, struct texture_target *t,
                           struct error *err)
{
    const struct observation_set *rows = &e->report->in.job->rows->observation;
    const double part[2] = {from, to};
    struct configuration direction[CLOTH_N_DIRECTION];
    *t = (struct texture_target){.n = rows->n + CLOTH_N_DIRECTION, .n_row = rows->n};
    t->item = calloc(t->n, sizeof *t->item);
    struct estimate *traced = calloc(CLOTH_N_DIRECTION, sizeof *traced);
    cloth_directions_make(e->report->in.made->fiber.tile_size_m, direction);
    status s = t->item != NULL && traced != NULL
                   ? trace(e, part, direction, traced, err)
                   : error_set(err, STATUS_NO_MEMORY, "cannot fit textures: out of memory");
    for (size_t i = 0; i < rows->n && s == STATUS_OK; i++) {
        double rgb[3], se[3];
        result_rendered_mean(e->model, i, rgb, se);
        put(t, i, &rows->item[i].configuration,
            rows->item[i].set == JOB_SET_FIT ? TEXTURE_FITTED_ROW : TEXTURE_HELDOUT_ROW, rgb);
    }
    for (size_t i = 0; i < CLOTH_N_DIRECTION && s == STATUS_OK; i++)
        put(t, rows->n + i, &direction[i], i < CLOTH_N_FITTED ? TEXTURE_FITTED_DIRECTION : TEXTURE_OTHER_DIRECTION,
            traced[i].mean);
    if (s == STATUS_OK) weigh(t, rows);
    free(traced);
    return s;
}

void texture_target_release(struct texture_target *t)
{
    free(t->item);
    *t = (struct texture_target){0};
}
