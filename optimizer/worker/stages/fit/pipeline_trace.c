#include "optimizer/worker/stages/fit/pipeline_trace.h"

#include <stdlib.h>
#include <string.h>
#include <zlib.h>

/* Checksum of everything but the call that estimates depend on. */
static uint64_t fingerprint(const struct pipeline_context *c, size_t i_model)
{
    const struct fiber_set *f = &c->fiber;
    const char *id = c->model[i_model].appearance.id;
    uint32_t sum = (uint32_t)crc32_z(0, (const void *)f->position_m, 3 * f->n_vertex * sizeof *f->position_m);
    sum = (uint32_t)crc32_z(sum, (const void *)f->radius_m, f->n_fiber * sizeof *f->radius_m);
    sum = (uint32_t)crc32_z(sum, (const void *)f->group, f->n_fiber);
    if (f->shape != NULL) sum = (uint32_t)crc32_z(sum, (const void *)f->shape, f->n_vertex * sizeof *f->shape);
    sum = (uint32_t)crc32_z(sum, (const void *)id, strlen(id));
    if (c->model[i_model].appearance.kind == MODEL_VOLUME)
        sum = (uint32_t)crc32_z(sum, (const void *)c->direction.density, volume_n_voxel(c->direction.n));
    for (size_t i = 0; i < c->observation.n; i++) {
        sum = (uint32_t)crc32_z(sum, (const void *)c->observation.item[i].mean_rgb,
                                sizeof c->observation.item[i].mean_rgb);
        sum = (uint32_t)crc32_z(sum, (const void *)&c->observation.item[i].configuration, sizeof(struct configuration));
    }
    return c->fingerprint << 32 | sum;
}

static status may_write(void *context, struct error *err)
{
    const struct pipeline_context *c = context;
    return worker_folder_check(c->folder, err);
}

void pipeline_trace_request(struct trace_estimator *t, const struct pipeline_context *c, size_t i_model,
                            const struct configuration *configuration, size_t n_configuration)
{
    const struct pipeline_model *m = &c->model[i_model];
    *t = (struct trace_estimator){
        .request = {.input = {.scene = pipeline_scene(c, m), .model = &m->appearance, .n_set = m->sets.n_set},
                    .configuration = configuration,
                    .n_configuration = n_configuration,
                    .seed = c->doc->fit.seed,
                    .share_camera_paths = c->doc->fit.share_camera_paths},
        .pool = c->pool};
}

status pipeline_trace_journal(struct pipeline_context *c, const char *stage, const char *name, size_t i_model,
                              const struct estimator *live, struct estimate_journal **journal, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    status s = pipeline_model_path(c, stage, name, i_model, path, err);
    return s == STATUS_OK ? estimate_journal_open(path, fingerprint(c, i_model), live, may_write, c, journal, err) : s;
}

status pipeline_trace_open(struct pipeline_trace *t, struct pipeline_context *c, const char *stage, const char *name,
                           size_t i_model, const struct observation_set *o, struct error *err)
{
    *t = (struct pipeline_trace){.configuration = trace_configurations(o)};
    if (t->configuration == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot start the path tracer: out of memory");
    pipeline_trace_request(&t->live, c, i_model, t->configuration, o->n);
    t->live_estimator = trace_estimator(&t->live);
    return pipeline_trace_journal(c, stage, name, i_model, &t->live_estimator, &t->journal, err);
}

void pipeline_trace_close(struct pipeline_trace *t)
{
    estimate_journal_close(t->journal);
    free(t->configuration);
}

struct progress pipeline_model_progress(struct progress_part *part, const struct progress *whole,
                                        const struct pipeline_context *c, size_t i_place)
{
    double share = 1.0 / (double)c->n_model;
    return progress_begin_part(part, whole, share * (double)i_place, share);
}
