#include "geometry/phantom/phantom.h"

#include "base/rng.h"
#include "geometry/fibers/fiber_view.h"
#include "geometry/phantom/phantom_strand.h"

#include <math.h>
#include <string.h>

static const struct {
    const char *name;
    size_t repeat;
} weave_info[PHANTOM_WEAVE_COUNT] = {
    [PHANTOM_PLAIN] = {"plain", 2},   [PHANTOM_TWILL_2_2] = {"twill", 4}, [PHANTOM_TWILL_3_1] = {"twill31", 4},
    [PHANTOM_SATIN_5] = {"satin", 5}, [PHANTOM_VELVET] = {"velvet", 2},   [PHANTOM_KNIT] = {"knit", 1},
    [PHANTOM_FELT] = {"felt", 1},
};

const char *phantom_weave_name(enum phantom_weave w)
{
    return (unsigned)w < PHANTOM_WEAVE_COUNT ? weave_info[w].name : "?";
}

status phantom_weave_find(const char *name, enum phantom_weave *w, struct error *err)
{
    for (int i = 0; i < PHANTOM_WEAVE_COUNT; i++)
        if (strcmp(name, weave_info[i].name) == 0) {
            *w = (enum phantom_weave)i;
            return STATUS_OK;
        }
    return error_set_field(err, STATUS_INVALID, "weave",
                           "unknown weave '%s': plain, twill, twill31, satin, velvet, knit or felt", name);
}

void phantom_option_default(struct phantom_option *o, enum phantom_weave weave)
{
    *o = (struct phantom_option){.weave = weave,
                                 .seed = 1,
                                 .voxel_size_m = 2e-6,
                                 .fiber_radius_m = {7e-6, 7e-6, 7e-6},
                                 .n_fiber_per_yarn = 19,
                                 .packing = 0.7,
                                 .flatness = 1.8,
                                 .cover = 1.05,
                                 .twist_turns = 1.0 / 3.0,
                                 .migration = 0.05,
                                 .pile_height_m = 2e-4,
                                 .felt_tile_m = 3.2e-4,
                                 .felt_thickness_m = 1.2e-4,
                                 .n_relax = 300};
    if (weave == PHANTOM_VELVET) o->n_fiber_per_yarn = 7;
    if (weave == PHANTOM_FELT) o->n_fiber_per_yarn = 60;
    if (weave == PHANTOM_KNIT) {
        o->flatness = 1.0;
        o->cover = 1.0;
    }
}

static status check_range(const char *field, double value, double lower, double upper, struct error *err)
{
    if (value >= lower && value <= upper) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, field, "phantom option '%s' is %g, but must be between %g and %g",
                           field, value, lower, upper);
}

/* Sets the defaults of open options and checks the others. */
static status check(struct phantom_option *o, struct error *err)
{
    if ((unsigned)o->weave >= PHANTOM_WEAVE_COUNT)
        return error_set_field(err, STATUS_INVALID, "weave", "unknown weave");
    size_t repeat = weave_info[o->weave].repeat;
    for (int k = 0; k < 2; k++) {
        if (o->n_yarn[k] == 0) o->n_yarn[k] = o->weave == PHANTOM_KNIT ? 2 : repeat;
        if (o->n_yarn[k] % repeat != 0 || o->n_yarn[k] > 1000)
            return error_set_field(err, STATUS_INVALID, "n_yarn",
                                   "%zu yarns per tile: a %s needs a multiple of %zu, at most 1000", o->n_yarn[k],
                                   weave_info[o->weave].name, repeat);
    }
    if (o->yarn.n_ply > 0 && (o->weave == PHANTOM_FELT || o->weave == PHANTOM_VELVET))
        return error_set_field(err, STATUS_INVALID, "yarn", "a %s cannot have a plied yarn", weave_info[o->weave].name);
    if (o->vertex_spacing_m == 0.0) o->vertex_spacing_m = 1.5 * o->voxel_size_m;
    if (o->margin_m == 0.0) o->margin_m = 4.0 * o->voxel_size_m;
    const struct {
        const char *field;
        double value, lower, upper;
    } range[] = {
        {"voxel_size_m", o->voxel_size_m, 1e-8, 1e-3},
        {"fiber_radius_m", o->fiber_radius_m[0], 1e-7, 1e-3},
        {"fiber_radius_m", o->fiber_radius_m[1], 1e-7, 1e-3},
        {"fiber_radius_m", o->fiber_radius_m[2], 1e-7, 1e-3},
        {"radius_spread", o->radius_spread, 0.0, 0.3},
        {"n_fiber_per_yarn", (double)o->n_fiber_per_yarn, 1, o->weave == PHANTOM_FELT ? 100000 : 1000},
        {"packing", o->packing, 0.3, 0.9},
        {"flatness", o->flatness, 1.0, 4.0},
        {"cover", o->cover, 0.5, 1.3},
        {"twist_turns", o->twist_turns, -100.0, 100.0},
        {"migration", o->migration, 0.0, 0.5},
        {"n_flyaway_per_yarn", (double)o->n_flyaway_per_yarn, 0, 10000},
        {"pile_height_m", o->pile_height_m, 0.0, 0.1},
        {"felt_tile_m", o->felt_tile_m, 1e-6, 0.1},
        {"felt_thickness_m", o->felt_thickness_m, 1e-6, 0.1},
        {"n_relax", (double)o->n_relax, 0, 10000},
        {"vertex_spacing_m", o->vertex_spacing_m, 1e-9, 1.0},
        {"margin_m", o->margin_m, 0.0, 0.1},
    };
    for (size_t i = 0; i < sizeof range / sizeof *range; i++) {
        status st = check_range(range[i].field, range[i].value, range[i].lower, range[i].upper, err);
        if (st != STATUS_OK) return st;
    }
    return phantom_section_check(&o->section, err);
}

/* Gives every strand a radius of its own. */
static void spread_radii(const struct phantom_option *o, struct strand_set *s)
{
    static const double cut = 2.0, cut_sd = 0.8796; /* standard deviation of a normal that is cut at +-2 */
    const struct rng_key key = {.seed = o->seed, .iteration = STREAM_SPREAD};
    for (size_t i = 0; i < s->n_strand && o->radius_spread > 0.0; i++) {
        struct rng rng;
        double normal[2];
        rng_start(&rng, &key, (uint32_t)i, 0);
        do rng_normal_pair(&rng, normal);
        while (!(fabs(normal[0]) <= cut));
        s->strand[i].radius_m *= 1.0 + o->radius_spread / cut_sd * normal[0];
    }
}

static status make(struct phantom_strands *s, const struct phantom_option *o, struct phantom_report *r,
                   struct error *err)
{
    switch (o->weave) {
    case PHANTOM_FELT:
        return felt_make(&s->set, o, err);
    case PHANTOM_KNIT:
        return knit_make(s, o, r, err);
    default:
        return weave_make(s, o, r, err);
    }
}

static status report_fill(const struct phantom_option *o, const struct fiber_set *f, struct phantom_report *r,
                          struct error *err)
{
    double low, high, volume = 0.0;
    fiber_set_z_range_m(f, &low, &high);
    for (int a = 0; a < 2; a++) r->n_voxel[a] = (size_t)llround(f->tile_size_m[a] / o->voxel_size_m);
    r->n_voxel[2] = (size_t)ceil((high + o->margin_m) / o->voxel_size_m);
    for (size_t i = 0; i < f->n_fiber; i++) {
        struct fiber_set one = {.n_fiber = 1, .first_vertex = f->first_vertex + i, .position_m = f->position_m};
        volume += M_PI * (double)f->radius_m[i] * (double)f->radius_m[i] * fiber_set_length_m(&one);
    }
    r->volume_fraction = volume / (f->tile_size_m[0] * f->tile_size_m[1] * (high - low));
    r->twist_turns = o->weave == PHANTOM_FELT ? 0.0 : round(6.0 * o->twist_turns) / 6.0;
    r->n_fiber_per_yarn = o->weave == PHANTOM_FELT ? 0 : 1 + (o->n_fiber_per_yarn + 4) / 6 * 6;
    if (o->yarn.n_ply > 0 && o->weave != PHANTOM_FELT) {
        r->twist_turns = r->plied.ply_turns[0];
        r->n_fiber_per_yarn = o->yarn.n_ply * o->yarn.n_fiber;
    }
    size_t size[2];
    return fiber_top_view(f, o->voxel_size_m, size, NULL, &r->cover, err);
}

status phantom_generate(const struct phantom_option *option, struct thread_pool *pool, const struct progress *progress,
                        struct fiber_set *f, struct phantom_report *report, struct error *err)
{
    struct phantom_option o = *option;
    struct phantom_strands s = {0};
    struct strand_fit fit = {0};
    *report = (struct phantom_report){0};
    status st = check(&o, err);
    double room = phantom_section_spacing(&o.section);
    for (int a = 0; a < 3; a++) o.fiber_radius_m[a] *= room;
    if (st == STATUS_OK) st = make(&s, &o, report, err);
    report->plied = s.plied;
    spread_radii(&o, &s.set);
    if (st == STATUS_OK)
        st = strand_relax(&s.set, &(struct strand_relax_option){.n_round = o.n_relax}, pool, progress, &fit, err);
    report->overlap_mean = fit.overlap_mean;
    report->overlap_max = fit.overlap_max;
    report->strain_p95 = fit.strain_p95;
    if (st == STATUS_OK) st = strand_emit(&s.set, o.vertex_spacing_m, o.margin_m, f, err);
    for (size_t i = 0; i < f->n_fiber && st == STATUS_OK; i++) f->radius_m[i] = (float)((double)f->radius_m[i] / room);
    if (st == STATUS_OK) st = phantom_section_shapes(&o.section, f, err);
    if (st == STATUS_OK) st = fiber_set_validate(f, err);
    if (st == STATUS_OK) st = report_fill(&o, f, report, err);
    strand_set_release(&s.set);
    return st;
}

status phantom_pad(struct fiber_set *f, struct phantom_report *report, double voxel_size_m, size_t n_slice,
                   struct error *err)
{
    size_t *n = &report->n_voxel[2];
    if (n_slice < *n || n_slice > 1000000)
        return error_set_field(err, STATUS_INVALID, "voxels_z", "the cloth needs %zu slices, but %zu were requested",
                               *n, n_slice);
    float rise_m = (float)((double)((n_slice - *n) / 2) * voxel_size_m);
    for (size_t i = 0; i < f->n_vertex; i++) f->position_m[3 * i + 2] += rise_m;
    *n = n_slice;
    return STATUS_OK;
}
