#include "optimizer/tools/phantom/phantom_described.h"

#include "geometry/cloth/cloth.h"
#include "optimizer/job/job_parse.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

status phantom_described_read(const char *path, struct cloth_description *d, struct error *err)
{
    json_error_t at;
    json_t *section = json_load_file(path, JSON_REJECT_DUPLICATES, &at);
    if (section == NULL)
        return error_set(err, STATUS_FORMAT, "cannot read the description '%s': line %d: %s", path, at.line, at.text);
    /* the section of a whole job document is accepted as well */
    json_t *inner = json_object_get(section, "cloth");
    status st = job_parse_cloth(inner != NULL ? inner : section, d, err);
    json_decref(section);
    return st;
}

/* Stretches the tile to whole voxels, which changes lengths by less than half a voxel in the tile. */
static void fit_to_voxels(struct fiber_set *f, double voxel_size_m, double margin_m, struct phantom_report *report)
{
    double stretch[3] = {1.0, 1.0, 1.0}, low, high;
    for (int a = 0; a < 2; a++) {
        report->n_voxel[a] = (size_t)fmax(1.0, round(f->tile_size_m[a] / voxel_size_m));
        stretch[a] = (double)report->n_voxel[a] * voxel_size_m / f->tile_size_m[a];
        f->tile_size_m[a] *= stretch[a];
    }
    for (size_t i = 0; i < f->n_vertex; i++)
        for (int a = 0; a < 3; a++)
            f->position_m[3 * i + (size_t)a] =
                (float)((double)f->position_m[3 * i + (size_t)a] * stretch[a] + (a == 2 ? margin_m : 0.0));
    fiber_set_z_range_m(f, &low, &high);
    report->n_voxel[2] = (size_t)ceil((high + margin_m) / voxel_size_m);
}

status phantom_described_make(const struct cloth_description *d, double voxel_size_m, double margin_m,
                              struct thread_pool *pool, struct fiber_set *f, struct phantom_report *report,
                              struct error *err)
{
    struct cloth_report r;
    if (!(voxel_size_m >= 1e-8 && voxel_size_m <= 1e-3))
        return error_set_field(err, STATUS_INVALID, "voxel_size_m", "the voxel size is %g m: it must be 1e-8 to 1e-3",
                               voxel_size_m);
    status st = cloth_build(d, NULL, pool, NULL, f, &r, err);
    if (st != STATUS_OK) return st;
    *report = (struct phantom_report){.yarn_width_m = r.yarn_width_m[0],
                                      .yarn_height_m = r.yarn_height_m[0],
                                      .n_fiber_per_yarn = d->kind[0].n_fiber,
                                      .overlap_mean = r.overlap_mean,
                                      .overlap_max = r.overlap_max,
                                      .strain_p95 = r.strain_p95,
                                      .cover = r.cover,
                                      .volume_fraction = r.volume_fraction};
    memcpy(report->yarn_spacing_m, r.yarn_spacing_m, sizeof report->yarn_spacing_m);
    fit_to_voxels(f, voxel_size_m, margin_m > 0.0 ? margin_m : 4.0 * voxel_size_m, report);
    return STATUS_OK;
}

/* Sets a number, if the cloth has it, to the nearest value of its range. */
static void set_number(struct cloth_description *d, int kind, const char *name, double value)
{
    for (size_t i = 0; i < d->n_number; i++) {
        struct cloth_number *n = &d->number[i];
        if (n->kind == kind && strcmp(n->info->name, name) == 0)
            n->value = fmin(fmax(value, n->info->lower), n->info->upper);
    }
}

static void set_kind(struct cloth_description *d, int kind, const struct phantom_option *o,
                     const struct phantom_report *r, double radius_m, double length_m)
{

    set_number(d, kind, "fiber_radius_um", 1e6 * radius_m);
    set_number(d, kind, "packing", o->packing);
    set_number(d, kind, "flatness", o->flatness);
    set_number(d, kind, "twist_per_m", length_m > 0.0 ? r->twist_turns / length_m : 0.0);
    set_number(d, kind, "migration", o->migration);
    set_number(d, kind, "fiber_angle_deg", 0.0);
    set_number(d, kind, "hairs_per_mm", length_m > 0.0 ? (double)o->n_flyaway_per_yarn / (1e3 * length_m) : 0.0);
}

/* One kind of yarn for each radius. */
static void set_kinds(struct cloth_description *d, const struct phantom_option *o, const struct phantom_report *r,
                      const struct fiber_set *f)
{
    /* length of a yarn in a tile; a knitted one is longer than the tile, as its fibers are */
    double n_fiber = (double)(d->n_yarn[CLOTH_WEFT] * r->n_fiber_per_yarn), length_m = 0.0;
    if (d->structure == CLOTH_KNIT && n_fiber > 0.0) length_m = fiber_set_length_m(f) / n_fiber;
    if (d->structure == CLOTH_WOVEN || d->structure == CLOTH_VELVET) length_m = f->tile_size_m[0];
    bool two = d->structure == CLOTH_WOVEN && o->fiber_radius_m[0] != o->fiber_radius_m[1];
    d->kind[0].n_fiber = o->weave == PHANTOM_FELT ? o->n_fiber_per_yarn : r->n_fiber_per_yarn;
    if (two) {
        d->n_kind = 2;
        d->kind[1] = d->kind[0];
        d->order[CLOTH_WARP][0] = 1;
    }
    cloth_description_number(d);
    for (int k = 0; k < (int)d->n_kind; k++)
        set_kind(d, k, o, r, o->fiber_radius_m[k == d->pile_kind ? 2 : k], length_m);
}

status phantom_described_as(const struct phantom_option *o, const struct phantom_report *r, const struct fiber_set *f,
                            struct cloth_description *d, struct error *err)
{
    if (o->yarn.n_ply > 0) return error_set(err, STATUS_UNSUPPORTED, "a yarn file has laws that a description lacks");
    status st = cloth_description_init(d, o->weave == PHANTOM_KNIT ? "jersey" : phantom_weave_name(o->weave), err);
    if (st != STATUS_OK) return st;
    d->seed = o->seed;
    double cover = o->weave == PHANTOM_VELVET ? 0.7 * o->cover : o->cover;
    for (int a = 0; a < 2 && o->weave != PHANTOM_FELT; a++) /* wefts follow each other along y */
        d->n_yarn[a] = (size_t)lround((double)r->n_voxel[1 - a] * o->voxel_size_m / r->yarn_spacing_m[1 - a]);
    set_kinds(d, o, r, f);
    set_number(d, -1, "cover_warp", cover);
    set_number(d, -1, "cover_weft", cover);
    set_number(d, -1, "cover", cover);
    set_number(d, -1, "compression", 1.0);
    set_number(d, -1, "disorder", 0.0);
    set_number(d, -1, "pile_height_um", 1e6 * o->pile_height_m);
    set_number(d, -1, "thickness_um", 1e6 * o->felt_thickness_m);
    set_number(d, -1, "density", r->volume_fraction);
    return cloth_description_check(d, err);
}
