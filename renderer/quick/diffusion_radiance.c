#include "renderer/quick/diffusion_radiance.h"
#include "renderer/quick/diffusion_shade.h"
#include "renderer/transport/surface/shaded_radiance.h"

static status check(const struct radiance_input *in, struct error *err)
{
    const struct diffusion_option *o = in->diffusion;
    double tile_mm[2];
    scene_tile_mm(in->scene.fibers, tile_mm);
    if (scene_has_films(in->scene.fibers))
        return error_set(err, STATUS_UNSUPPORTED, "cannot render films by diffusion: take the method 'fast' or 'path'");
    if (o->tables->n_set != (in->n_set > 1 ? in->n_set : 1) || o->tables->tile_mm[0] != tile_mm[0] ||
        o->tables->tile_mm[1] != tile_mm[1])
        return error_set(err, STATUS_INVALID, "cannot render by diffusion: its tables are of another cloth");
    if (o->tables->black_sheet != scene_has_black_sheet(in->scene.fibers))
        return error_set(err, STATUS_INVALID,
                         "cannot render by diffusion: its tables are of the cloth %s a black sheet",
                         o->tables->black_sheet ? "with" : "without");
    return STATUS_OK;
}

static status init(void *setting, const struct radiance_input *in, struct error *err)
{
    (void)err;
    diffusion_setting_init(setting, in->diffusion);
    return STATUS_OK;
}

static uint32_t shade(const void *setting, struct scene_ray *ray, struct rng *rng, float radiance[3])
{
    return diffusion_shade(setting, ray, rng, radiance);
}

static status prepare(const struct radiance_input *in, const struct configuration *c, size_t n_configuration,
                      void **state, struct error *err)
{
    static const struct shaded_method diffusion = {"diffusion", sizeof(struct diffusion_setting), check, init, NULL,
                                                   shade};
    return shaded_prepare(&diffusion, in, c, n_configuration, state, err);
}

const struct radiance_tracer diffusion_radiance = SHADED_TRACER(prepare);
