#include "optimizer/stages/fit/pipeline_trace.h"
#include "optimizer/job/document/job_fit.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

/* Checksum of everything but the call that estimates depend on. */
static uint64_t fingerprint(const struct cloth_job *job, const struct made_cloth *made, size_t i_model)
{
    const struct fiber_set *f = &made->fiber;
    const char *id = job->model[i_model].appearance.id;
    uint32_t sum = (uint32_t)crc32_z(0, (const void *)f->position_m, 3 * f->n_vertex * sizeof *f->position_m);
    sum = (uint32_t)crc32_z(sum, (const void *)f->radius_m, f->n_fiber * sizeof *f->radius_m);
    sum = (uint32_t)crc32_z(sum, (const void *)f->group, f->n_fiber);
    if (f->shape != NULL) sum = (uint32_t)crc32_z(sum, (const void *)f->shape, f->n_vertex * sizeof *f->shape);
    sum = (uint32_t)crc32_z(sum, (const void *)id, strlen(id));
    if (job->model[i_model].appearance.kind == MODEL_VOLUME)
        sum = (uint32_t)crc32_z(sum, (const void *)made->direction.density, volume_n_voxel(made->direction.n));
    for (size_t i = 0; i < job->rows->observation.n; i++) {
        sum = (uint32_t)crc32_z(sum, (const void *)job->rows->observation.item[i].mean_rgb,
                                sizeof job->rows->observation.item[i].mean_rgb);
        sum = (uint32_t)crc32_z(sum, (const void *)&job->rows->observation.item[i].configuration,
                                sizeof(struct configuration));
    }
    return job->tools->fingerprint << 32 | sum;
}

static status may_write(void *context, struct error *err)
{
    const struct stage_tools *tools = context;
    return worker_folder_check(tools->folder, err);
}

void pipeline_trace_request(struct trace_estimator *t, const struct cloth_job *job, const struct made_cloth *made,
                            size_t i_model, const struct configuration *configuration, size_t n_configuration)
{
    const struct model_setup *m = &job->model[i_model];
    *t = (struct trace_estimator){
        .request = {.input = {.scene = made_cloth_scene(made, m), .model = &m->appearance, .n_set = m->sets.n_set},
                    .configuration = configuration,
                    .n_configuration = n_configuration,
                    .seed = job->seed,
                    .share_camera_paths = job->fit->share_camera_paths},
        .pool = job->tools->pool};
}

status pipeline_trace_journal(const struct cloth_job *job, const struct made_cloth *made, const char *stage,
                              const char *name, size_t i_model, const struct estimator *live,
                              struct estimate_journal **journal, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    status s = stage_model_path(job->tools, stage, name, i_model, path, err);
    return s == STATUS_OK ? estimate_journal_open(path, fingerprint(job, made, i_model), live, may_write,
                                                  (void *)(uintptr_t)job->tools, journal, err)
                          : s;
}

status pipeline_trace_open(struct pipeline_trace *t, const struct cloth_job *job, const struct made_cloth *made,
                           const char *stage, const char *name, size_t i_model, const struct observation_set *o,
                           struct error *err)
{
    *t = (struct pipeline_trace){.configuration = trace_configurations(o)};
    if (t->configuration == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot start the path tracer: out of memory");
    pipeline_trace_request(&t->live, job, made, i_model, t->configuration, o->n);
    t->live_estimator = trace_estimator(&t->live);
    return pipeline_trace_journal(job, made, stage, name, i_model, &t->live_estimator, &t->journal, err);
}

void pipeline_trace_close(struct pipeline_trace *t)
{
    estimate_journal_close(t->journal);
    free(t->configuration);
}

struct progress pipeline_model_progress(struct progress_part *part, const struct progress *whole, size_t n_model,
                                        size_t i_place)
{
    double share = 1.0 / (double)n_model;
    return progress_begin_part(part, whole, share * (double)i_place, share);
}
