#include "renderer/glint/glint_option.h"

/* Sets a value that is not given, and checks it. */
static status complete_value(float *value, float standard, float least, float most, const char *name, struct error *err)
{
    if (*value == 0) *value = standard;
    if (*value >= least && *value <= most) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, name, "the %s of a glint surface is %g, which is not in %g to %g", name,
                           (double)*value, (double)least, (double)most);
}

status glint_option_complete(const struct glint_option *given, struct glint_option *o, struct error *err)
{
    *o = *given;
    if (o->n_texel == 0) o->n_texel = 512;
    if ((o->n_texel & (o->n_texel - 1)) != 0 || o->n_texel < 32 || o->n_texel > 2048)
        return error_set_field(err, STATUS_INVALID, "n_texel",
                               "a glint surface has %u texels along an edge, which is no power of two from 32 to 2,048",
                               o->n_texel);
    status s = complete_value(&o->texel_um, 1, 0.001F, 1000, "texel_um", err);
    const float texel = o->texel_um, most = texel * (float)o->n_texel / 4;
    if (s == STATUS_OK) s = complete_value(&o->slope, 0.1F, 1e-6F, 0.5F, "slope", err);
    if (s == STATUS_OK) s = complete_value(&o->roughness, 0.005F, 0.001F, 0.2F, "roughness", err);
    if (s == STATUS_OK) s = complete_value(&o->length_um[0], 12 * texel, 2 * texel, 1e6F * most, "length_um", err);
    if (s == STATUS_OK) s = complete_value(&o->length_um[1], 12 * texel, 2 * texel, 1e6F * most, "length_um", err);
    if (s == STATUS_OK) s = complete_value(&o->flake_um, 16 * texel, 2 * texel, most, "flake_um", err);
    if (s == STATUS_OK) s = complete_value(&o->scratch_share, 0.3F, 0, 1, "scratch_share", err);
    if (s == STATUS_OK) s = complete_value(&o->step_texel, 1, 0.5F, 2, "step_texel", err);
    if (s == STATUS_OK && o->step_texel != 0.5F && o->step_texel != 1 && o->step_texel != 2)
        return error_set_field(err, STATUS_INVALID, "step_texel",
                               "the step_texel of a glint surface is %g, not 0.5, 1 or 2", (double)o->step_texel);
    return s;
}
