#include "renderer/estimate/radiance_source.h"

#include "renderer/fast/fast_radiance.h"
#include "renderer/quick/diffusion_radiance.h"
#include "renderer/quick/dual_radiance.h"
#include "renderer/transport/surface/surface_radiance.h"
#include "renderer/transport/volume/volume_radiance.h"

#include <stdio.h>
#include <string.h>

static status check_scene(const struct appearance_scene *scene, const struct appearance *model, struct error *err)
{
    bool surface = model->kind == MODEL_SURFACE;
    if (surface ? scene->fibers != NULL : scene->volume != NULL) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, "model", "cannot trace model '%s': the cloth has no %s", model->id,
                           surface ? "fibers" : "density volume");
}

status radiance_source_init(struct radiance_source *s, const struct radiance_input *in, const struct configuration *c,
                            size_t n_configuration, struct error *err)
{
    memset(s, 0, sizeof *s);
    status st = check_scene(&in->scene, in->model, err);
    if (st != STATUS_OK) return st;
    s->tracer = in->model->kind != MODEL_SURFACE ? &volume_radiance
                : in->fast != NULL               ? &fast_radiance
                : in->dual != NULL               ? &dual_radiance
                : in->diffusion != NULL          ? &diffusion_radiance
                                                 : &surface_radiance;
    s->model = in->model;
    s->n_set = in->n_set > 1 ? in->n_set : 1;
    s->n_flat = in->want_derivative ? s->n_set * in->model->n_param : 0;
    return s->tracer->prepare(in, c, n_configuration, &s->state, err);
}

void radiance_source_release(struct radiance_source *s)
{
    if (s->state != NULL) s->tracer->release(s->state);
    s->state = NULL;
}

void radiance_derivative_name(const struct radiance_source *s, size_t i_flat, char text[RADIANCE_NAME_BYTES])
{
    const char *param = s->model->param[i_flat % s->model->n_param].name;
    if (s->n_set == 1)
        snprintf(text, RADIANCE_NAME_BYTES, "%s", param);
    else
        snprintf(text, RADIANCE_NAME_BYTES, "set%zu.%s", i_flat / s->model->n_param, param);
}
