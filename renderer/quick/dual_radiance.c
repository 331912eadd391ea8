#include "renderer/quick/dual_radiance.h"
#include "renderer/quick/dual_shade.h"
#include "renderer/transport/surface/shaded_radiance.h"

static status check(const struct radiance_input *in, struct error *err)
{
    const struct dual_option *o = in->dual;
    if (!(o->density_forward >= 0 && o->density_forward <= 1 && o->density_backward >= 0 && o->density_backward <= 1))
        return error_set(err, STATUS_INVALID, "cannot render by dual scattering with densities of %g and %g",
                         (double)o->density_forward, (double)o->density_backward);
    if (scene_has_films(in->scene.fibers))
        return error_set(err, STATUS_UNSUPPORTED,
                         "cannot render films by dual scattering: take the method 'fast' or 'path'");
    if (o->tables->n_set != (in->n_set > 1 ? in->n_set : 1))
        return error_set(err, STATUS_INVALID, "cannot render by dual scattering: its averages are of another cloth");
    return STATUS_OK;
}

static status init(void *setting, const struct radiance_input *in, struct error *err)
{
    (void)err;
    ((struct dual_setting *)setting)->option = in->dual;
    return STATUS_OK;
}

static uint32_t shade(const void *setting, struct scene_ray *ray, struct rng *rng, float radiance[3])
{
    return dual_shade(setting, ray, rng, radiance);
}

static status prepare(const struct radiance_input *in, const struct configuration *c, size_t n_configuration,
                      void **state, struct error *err)
{
    static const struct shaded_method dual = {"dual scattering", sizeof(struct dual_setting), check, init, NULL, shade};
    return shaded_prepare(&dual, in, c, n_configuration, state, err);
}

const struct radiance_tracer dual_radiance = SHADED_TRACER(prepare);
