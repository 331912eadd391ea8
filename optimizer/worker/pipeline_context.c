#include "optimizer/worker/pipeline_context.h"
#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/options/option_key.h"
#include "renderer/transport/light/environment.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void pipeline_context_init(struct pipeline_context *c)
{
    memset(c, 0, sizeof *c);
    photograph_process_init(&c->process);
    observation_set_init(&c->observation);
    observation_set_init(&c->fitted);
    observation_set_init(&c->row);
    observation_set_init(&c->contrast);
    fiber_set_init(&c->fiber);
    fiber_set_init(&c->traced);
    c->path_share = 1.0;
    c->exports = json_array();
    c->surface_pictures = json_array();
    for (size_t i = 0; i < sizeof c->stage_wall_s / sizeof c->stage_wall_s[0]; i++) c->stage_wall_s[i] = NAN;
}

void pipeline_context_release(struct pipeline_context *c)
{
    job_document_free(c->doc);
    photograph_process_release(&c->process);
    observation_set_release(&c->observation);
    observation_set_release(&c->fitted);
    observation_set_release(&c->row);
    observation_set_release(&c->contrast);
    fiber_profile_release(&c->profile);
    environment_free(c->environment);
    json_decref(c->exports);
    json_decref(c->surface_pictures);
    volume_release(&c->volume);
    direction_volume_release(&c->direction);
    fiber_set_release(&c->fiber);
    fiber_set_release(&c->traced);
    fiber_set_release(&c->uncorrected);
    scratch_space_free(c->space);
    scene_free(c->scene);
    scene_free(c->section_scene);
    if (c->has_volume_scene) volume_scene_release(&c->volume_scene);
    for (size_t i = 0; i < c->n_model; i++) {
        for (int q = 0; q < 2; q++) {
            free(c->model[i].validation.replica[q]);
            free(c->model[i].validation.contrast[q]);
        }
        free(c->model[i].candidate);
        profile_fit_release(&c->model[i].profile);
    }
    free(c->model);
}

status pipeline_work_path(const struct pipeline_context *c, const char *stage, const char *name,
                          char path[WORKER_PATH_BYTES], struct error *err)
{
    char relative[256];
    snprintf(relative, sizeof relative, "%s/%s", JOB_FOLDER_WORK, stage);
    worker_folder_path(c->folder, relative, NULL, path);
    status s = durable_make_folder(path, err);
    if (s == STATUS_OK) worker_folder_path(c->folder, relative, name, path);
    return s;
}

status pipeline_model_path(const struct pipeline_context *c, const char *stage, const char *name, size_t i_model,
                           char path[WORKER_PATH_BYTES], struct error *err)
{
    char numbered[128];
    const char *dot = strrchr(name, '.');
    int n = dot != NULL ? (int)(dot - name) : (int)strlen(name);
    if (i_model == 0)
        snprintf(numbered, sizeof numbered, "%s", name);
    else
        snprintf(numbered, sizeof numbered, "%.*s-%zu%s", n, name, i_model, name + n);
    return pipeline_work_path(c, stage, numbered, path, err);
}

void pipeline_warn(void *context, const char *option, const char *text)
{
    struct pipeline_context *c = context;
    char key[64];
    job_option_resolve(option, key, sizeof key);
    worker_status_warn(c->status, "%s%s%s", key, key[0] != '\0' ? ": " : "", text);
}

size_t pipeline_n_free(const struct pipeline_model *m)
{
    size_t n = 0;
    for (size_t p = 0; p < m->sets.info.n_param; p++) n += !m->parameter[p].fixed && m->option->leader[p] == p;
    return n;
}
