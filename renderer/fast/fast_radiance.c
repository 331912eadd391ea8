#include "renderer/fast/fast_radiance.h"
#include "renderer/fast/fast_shade.h"
#include "renderer/scene/scene_place.h"
#include "renderer/transport/surface/shaded_radiance.h"

static status check(const struct radiance_input *in, struct error *err)
{
    const struct fast_option *o = in->fast;
    double tile_mm[2];
    if (o->deep && o->visibility != FAST_TRACED)
        return error_set(err, STATUS_INVALID, "cannot take deep light from its table with visibility by tables");
    if (o->deep && (o->n_traced == 0 || o->tables->deep.n_traced != o->n_traced))
        return error_set(err, STATUS_INVALID, "cannot trace %u hits: the table of deep light is for %u", o->n_traced,
                         o->tables->deep.n_traced);
    if (scene_has_films(in->scene.fibers) && !o->deep)
        return error_set(err, STATUS_UNSUPPORTED,
                         "cannot render films by tables of cells: only with those of deep light");
    if (in->n_hit > 0 && !o->deep)
        return error_set(err, STATUS_INVALID, "cannot end paths at a hit by tables: only with those of deep light");
    scene_tile_mm(in->scene.fibers, tile_mm);
    size_t n_set = in->n_set > 1 ? in->n_set : 1;
    if (o->tables->n_set != n_set || o->tables->tile_mm[0] != tile_mm[0] || o->tables->tile_mm[1] != tile_mm[1])
        return error_set(err, STATUS_INVALID, "cannot render by tables of another cloth");
    if (o->visibility == FAST_TABLES &&
        (o->tables->n_row == 0 || o->tables->n_segment != scene_n_segment(in->scene.fibers)))
        return error_set(err, STATUS_INVALID, "cannot render by tables: they do not have what the segments see");
    if (o->tables->mirrored != 0 && !scene_has_black_sheet(in->scene.fibers))
        return error_set(err, STATUS_INVALID,
                         "cannot render a cloth without a black sheet by tables of one with a black sheet");
    return STATUS_OK;
}

static status init(void *setting, const struct radiance_input *in, struct error *err)
{
    struct fast_setting *s = setting;
    status st = fast_setting_init(s, in->fast, err);
    if (st == STATUS_OK && in->n_hit > 0) s->path.n_traced = in->n_hit;
    return st;
}

static void release(void *setting) { fast_setting_release(setting); }

static uint32_t shade(const void *setting, struct scene_ray *ray, struct rng *rng, float radiance[3])
{
    return fast_shade(setting, ray, rng, radiance);
}

static status prepare(const struct radiance_input *in, const struct configuration *c, size_t n_configuration,
                      void **state, struct error *err)
{
    static const struct shaded_method fast = {"tables", sizeof(struct fast_setting), check, init, release, shade};
    return shaded_prepare(&fast, in, c, n_configuration, state, err);
}

const struct radiance_tracer fast_radiance = SHADED_TRACER(prepare);
