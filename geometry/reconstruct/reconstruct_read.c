/* Step "volume": reads files to a density volume in the cloth frame. */
#include "base/option_id.h"
#include "geometry/reconstruct/reconstruct.h"

#include "geometry/diameter/fiber_diameter.h"
#include "geometry/diameter/light_material.h"
#include "geometry/orientation/repeat_direction.h"
#include "geometry/reconstruct/noise_refusal.h"
#include "geometry/reconstruct/scan_look.h"
#include "geometry/reconstruct/void_trim.h"
#include "geometry/volume/density_map.h"
#include "geometry/volume/format/volume_source.h"
#include "geometry/volume/volume_align.h"
#include "geometry/volume/volume_unknown.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Fraction of the step once the files are read, and once the densities are mapped; lumens are looked for after that. */
static const double READ_SHARE = 0.6, MAPPED_SHARE = 0.7;
/* Separability from which on void and material can be distinguished (reconstruct_warn.c). */
static const double LEAST_SEPARABILITY = 0.7;

/* Changes to make to the grid of the file. "stored": after the permutation of axes, before matrix and cubic
 * resampling. */
struct plan {
    struct axis_map map;
    size_t n_file[3], n_stored[3], n_all[3]; /* n_all: after resampling, before cropping */
    double spacing_m[3];                     /* of the stored axes */
    double voxel_m;                          /* of the cubic voxels of the result */
    bool resample;
    size_t box[6];        /* in the result */
    size_t box_stored[6]; /* part of the stored grid that is kept in memory */
    bool trimmed;         /* the box was cropped in z to slices with material */
};

static bool is_identity(const double m[9])
{
    for (int i = 0; i < 9; i++)
        if (m[i] != (i % 4 == 0 ? 1.0 : 0.0)) return false;
    return true;
}

static status plan_voxel_size(const struct reconstruct_option *o, struct plan *p, struct error *err)
{
    double least = INFINITY, most = 0.0;
    for (int a = 0; a < 3; a++) {
        double w = o->voxel_size_m[a];
        if (!(w >= 1e-9) || !(w <= 1e-2))
            return error_set_field(err, STATUS_INVALID, OPTION_VOXEL_SIZE,
                                   "cannot use the volume: a voxel size of %g um is not possible", w * 1e6);
        p->spacing_m[a] = o->voxel_size_m[p->map.source[a]];
        least = fmin(least, w);
        most = fmax(most, w);
    }
    if (most > 20.0 * least)
        return error_set_field(err, STATUS_INVALID, OPTION_VOXEL_SIZE,
                               "cannot use the volume: voxels of %g x %g x %g um are too far from cubes",
                               o->voxel_size_m[0] * 1e6, o->voxel_size_m[1] * 1e6, o->voxel_size_m[2] * 1e6);
    p->voxel_m = least;
    p->resample = most > 1.0001 * least || !is_identity(o->matrix) || o->align;
    return STATUS_OK;
}

static status plan_crop(const struct reconstruct_option *o, struct plan *p, struct error *err)
{
    bool all = true;
    for (int a = 0; a < 6; a++) all = all && o->crop_voxel[a] == 0;
    for (size_t a = 0; a < 3; a++) {
        p->box[a] = all ? 0 : o->crop_voxel[a];
        p->box[3 + a] = all ? p->n_all[a] : o->crop_voxel[3 + a];
        if (p->box[3 + a] > p->n_all[a] || p->box[a] >= p->box[3 + a])
            return error_set_field(err, STATUS_INVALID, OPTION_CROP_BOX,
                                   "cannot crop the volume: %c from %zu to %zu, the aligned volume has 0 to %zu",
                                   "xyz"[a], p -> box[a], p -> box[3 + a], p -> n_all[a]);
        p->box_stored[a] = p->resample ? 0 : p->box[a];
        p->box_stored[3 + a] = p->resample ? p->n_stored[a] : p->box[3 + a];
    }
    return STATUS_OK;
}

static status plan_read(const struct volume_source_info *info, struct reconstruct_option *o, struct plan *p,
                        struct error *err)
{
    *p = (struct plan){0};
    status s = reconstruct_settle(info, o, NULL, err);
    if (s == STATUS_OK) s = axis_map_parse(o->axes, &p->map, err);
    if (s == STATUS_OK) s = plan_voxel_size(o, p, err);
    if (s != STATUS_OK) return s;
    memcpy(p->n_file, info->n, sizeof p->n_file);
    for (int a = 0; a < 3; a++) p->n_stored[a] = info->n[p->map.source[a]];
    memcpy(p->n_all, p->n_stored, sizeof p->n_all);
    if (p->resample) volume_resampled_shape(p->n_stored, p->spacing_m, p->voxel_m, p->n_all);
    return plan_crop(o, p, err);
}

/* Crops a large scan in z to the slices that hold material. */
static status trim_void(struct volume_source *source, const struct scan_look *look, const struct reconstruct_option *o,
                        struct plan *p, const struct progress *progress, struct error *err)
{
    bool given = p->resample;
    for (int i = 0; i < 6; i++) given = given || o->crop_voxel[i] > 0;
    if (given || volume_n_voxel(p->n_stored) <= o->trim_above_voxel) return STATUS_OK;
    size_t range[2];
    status s = void_trim_find(source, look, p->map.source[2], progress, range, err);
    if (s != STATUS_OK) return s;
    const size_t n = p->n_stored[2];
    p->box[2] = p->box_stored[2] = p->map.flip[2] ? n - range[1] : range[0];
    p->box[5] = p->box_stored[5] = p->map.flip[2] ? n - range[0] : range[1];
    p->trimmed = p->box[2] > 0 || p->box[5] < n;
    return s;
}

/* The file indices that are kept. */
static void file_range(const struct plan *p, size_t from[3], size_t to[3])
{
    for (int a = 0; a < 3; a++) {
        const int f = p->map.source[a];
        const size_t lo = p->box_stored[a], hi = p->box_stored[3 + a], n = p->n_file[f];
        from[f] = p->map.flip[a] ? n - hi : lo;
        to[f] = p->map.flip[a] ? n - lo : hi;
    }
}

/* Copies n_slice slices of the file from i_slice on to their places in the stored grid. block is n_slice x n_file[1]
 * x n_file[0]. */
static void scatter_slices(const struct plan *p, const float *block, size_t i_slice, size_t n_slice, struct volume *v)
{
    size_t stride[3] = {1, v->n[0], v->n[0] * v->n[1]}, from[3], to[3];
    ptrdiff_t step[3], first = 0;
    file_range(p, from, to);
    for (int a = 0; a < 3; a++) {
        const int f = p->map.source[a];
        const size_t lo = p->box_stored[a], hi = p->box_stored[3 + a];
        step[f] = p->map.flip[a] ? -(ptrdiff_t)stride[a] : (ptrdiff_t)stride[a];
        if (p->map.flip[a]) first += (ptrdiff_t)((hi - lo - 1) * stride[a]);
    }
    size_t k0 = i_slice > from[2] ? i_slice : from[2], k1 = i_slice + n_slice < to[2] ? i_slice + n_slice : to[2];
    size_t n_row = p->n_file[0], n_page = n_row * p->n_file[1];
    bool inwards = p->map.source[0] ==
                   /* the file's slices lie across rows; taking one row of all slices at a time keeps writes together */
                   2;
    for (size_t outer = inwards ? from[1] : k0; outer < (inwards ? to[1] : k1); outer++) {
        scratch_keep_within(v->space);
        for (size_t i = from[0]; inwards && i < to[0]; i++) {
            ptrdiff_t at = first + step[0] * (ptrdiff_t)(i - from[0]) + step[1] * (ptrdiff_t)(outer - from[1]);
            for (size_t k = k0; k < k1; k++)
                v->density[at + step[2] * (ptrdiff_t)(k - from[2])] = block[(k - i_slice) * n_page + outer * n_row + i];
        }
        for (size_t j = from[1]; !inwards && j < to[1]; j++) {
            ptrdiff_t at = first + step[2] * (ptrdiff_t)(outer - from[2]) + step[1] * (ptrdiff_t)(j - from[1]);
            const float *row = block + (outer - i_slice) * n_page + j * n_row;
            for (size_t i = from[0]; i < to[0]; i++) v->density[at + step[0] * (ptrdiff_t)(i - from[0])] = row[i];
        }
    }
}

/* Marks padding as unknown. VOLUME_OUTSIDE in a file is an infinite value, which is refused later. */
static void mark_padding(const struct scan_look *look, float *value, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (look->n_padding > 0 && scan_look_is_padding(look, value[i]))
            value[i] = VOLUME_OUTSIDE;
        else if (value[i] == VOLUME_OUTSIDE)
            value[i] = INFINITY;
}

static status read_slices(struct volume_source *source, const struct plan *p, const struct scan_look *look,
                          const struct progress *progress, struct volume *v, struct error *err)
{
    size_t n_page = p->n_file[0] * p->n_file[1], n_block = 1, from[3], to[3];
    file_range(p, from, to);
    if (p->map.source[0] == 2) n_block = scratch_buffer_bytes(v->space) / (n_page * sizeof(float));
    n_block = n_block < 1 ? 1 : n_block > to[2] - from[2] ? to[2] - from[2] : n_block;
    float *block = malloc(n_block * n_page * sizeof *block);
    if (block == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the volume: out of memory");
    status s = STATUS_OK;
    for (size_t k = from[2]; k < to[2] && s == STATUS_OK; k += n_block) {
        size_t n = k + n_block <= to[2] ? n_block : to[2] - k;
        for (size_t i = 0; i < n && s == STATUS_OK; i++) {
            if (progress_cancelled(progress))
                s = error_set(err, STATUS_CANCELLED, "reading the volume was cancelled");
            else
                s = volume_source_read(source, k + i, 1, block + i * n_page, err);
        }
        if (s == STATUS_OK) mark_padding(look, block, n * n_page);
        if (s == STATUS_OK) scatter_slices(p, block, k, n, v);
        progress_report(progress, READ_SHARE * (double)(k + n - from[2]) / (double)(to[2] - from[2]));
    }
    free(block);
    return s;
}

/* Estimates the matrix from the directions of the fibers. A rotation smaller than its own standard error, or than a
 * tenth of a degree, is not applied. */
static status estimate_alignment(const struct volume *stored, struct reconstruct_option *o, struct thread_pool *pool,
                                 const struct progress *progress, struct reconstruct_report *report, struct error *err)
{
    struct density_modes m;
    status s = density_modes_find(stored, &m, err);
    alignment_from_directions(&report->main, &report->align);
    if (s == STATUS_OK && m.separability < LEAST_SEPARABILITY) return STATUS_OK; /* noise */
    if (s == STATUS_OK) s = main_directions_find(stored, m.half, pool, progress, &report->main, err);
    if (s == STATUS_OK && report->main.n > 0) s = repeat_directions_refine(stored, m.low, pool, &report->main, err);
    if (s != STATUS_OK) return s;
    struct alignment *a = &report->align;
    alignment_from_directions(&report->main, a);
    double least_deg = fmax(0.1, 2.0 * a->se_deg), least_tilt_deg = fmax(0.1, 2.0 * a->tilt_se_deg);
    report->aligned = a->outcome == ALIGN_DONE && (fabs(a->rotation_deg) > least_deg ||
                                                   fabs(a->shear_deg) > least_deg || a->tilt_deg > least_tilt_deg);
    if (report->aligned) memcpy(o->matrix, a->matrix, sizeof o->matrix);
    return STATUS_OK;
}

/* With option "crop" chooses the box that tiles best. After any matrix, and with padding, measures how much of the
 * tile lies in the scan. A scan in which every column meets padding has no such box, and is kept whole without the
 * option. */
static status choose_crop(struct volume *v, struct reconstruct_option *o, struct thread_pool *pool,
                          const struct progress *progress, struct reconstruct_report *report, struct error *err)
{
    struct density_modes m;
    if (!o->crop && is_identity(o->matrix) && !report->has_padding) return STATUS_OK;
    status s = density_modes_find(v, &m, err);
    if (s == STATUS_OK)
        s = tile_crop_find(v, m.half, m.low, o->crop ? o->crop_keep : 1.0, pool, progress, &report->tile, err);
    report->is_all_padded = s == STATUS_INVALID && !o->crop && report->has_padding;
    if (report->is_all_padded) {
        s = STATUS_OK;
        if (err != NULL) *err = (struct error){0};
    }
    if (s != STATUS_OK || !o->crop) return s;
    memcpy(o->crop_voxel, report->tile.box, sizeof o->crop_voxel);
    volume_crop(v, o->crop_voxel);
    return STATUS_OK;
}

/* States the box of a trimmed scan in voxels of the whole scan. */
static void state_trim(const struct plan *p, struct reconstruct_option *o, struct tile_crop *tile)
{
    if (!o->crop) memcpy(o->crop_voxel, p->box, sizeof o->crop_voxel);
    for (int i = 2; i < 6 && o->crop; i += 3) {
        o->crop_voxel[i] += p->box[2];
        tile->box[i] += p->box[2];
    }
}

static status map_densities(struct volume *v, struct reconstruct_option *o, struct thread_pool *pool,
                            const struct progress *progress, struct reconstruct_report *report, struct error *err)
{
    struct density_modes m;
    status s = density_modes_find(v, &m, err);
    if (s == STATUS_OK && report->has_padding) s = volume_mark_unknown(v, err);
    if (s == STATUS_OK) s = noise_refuse(v, m.separability, o, pool, err);
    if (s != STATUS_OK) return s;
    const bool low_alone = !isnan(o->density_low) && isnan(o->density_high);
    const bool is_open = isnan(o->density_high);
    report->light = (struct light_material){.density = NAN};
    if (isnan(o->density_low)) o->density_low = m.low;
    if (isnan(o->density_high)) o->density_high = m.high;
    if (is_open && !(o->hollow_fibers > 0))
        s = light_material_raise(v, o->density_low, o->density_high, pool, &report->light, err);
    if (!isnan(report->light.density)) o->density_high = report->light.high;
    if (s == STATUS_OK)
        s = scan_densities_map(v, o->density_low, o->density_high, o->fiber_diameter_voxel, pool, &report->noise, err);
    if (s == STATUS_INVALID && low_alone && err != NULL) snprintf(err->field, sizeof err->field, OPTION_DENSITY_LOW);
    if (s != STATUS_OK) return s;
    double threshold = isnan(o->eps_d) ? 0.5 : o->eps_d;
    size_t n_slice = v->n[0] * v->n[1], n_above = 0;
    for (size_t k = 0; k < v->n[2]; k++) {
        const float *slice = v->density + k * n_slice;
        for (size_t i = 0; i < n_slice; i++) n_above += (double)slice[i] >= threshold;
        scratch_keep_within(v->space);
    }
    if (n_above == 0)
        return error_set_field(err, STATUS_INVALID, OPTION_SCAN_FILES,
                               "cannot use the volume: it is empty, no density reaches %g (scanner value %g)",
                               threshold, o->density_low + threshold * (o->density_high - o->density_low));
    report->density_low = o->density_low;
    report->density_high = o->density_high;
    report->separability = m.separability;
    progress_report(progress, MAPPED_SHARE);
    s = reconstruct_lumens(v, o, pool, report, err);
    if (s != STATUS_OK) return s;
    seam_density_measure(v, &report->seam_density);
    return STATUS_OK;
}

status reconstruct_read(const char *const *path, size_t n_path, struct reconstruct_option *o,
                        struct scratch_space *space, struct thread_pool *pool, const struct progress *progress,
                        struct volume *v, struct reconstruct_report *report, struct error *err)
{
    struct volume_source *source = NULL;
    struct volume stored = {0};
    struct plan p;
    struct scan_look look;
    *v = (struct volume){0};
    for (int i = 0; i < 6; i++) o->crop = o->crop && o->crop_voxel[i] == 0;
    o->align = o->align && is_identity(o->matrix);
    status s = volume_source_open_declared(path, n_path, &o->raw, &o->part, &source, err);
    if (s != STATUS_OK) return s;
    memcpy(report->file_voxel_size_m, volume_source_describe(source)->voxel_size_m, sizeof report->file_voxel_size_m);
    s = plan_read(volume_source_describe(source), o, &p, err);
    if (s == STATUS_OK) s = scan_look_take(source, &look, err);
    if (s == STATUS_OK) report->has_padding = look.n_padding > 0;
    if (s == STATUS_OK) s = trim_void(source, &look, o, &p, progress, err);
    if (s != STATUS_OK) goto out;
    size_t n[3];
    for (int a = 0; a < 3; a++) n[a] = p.box_stored[3 + a] - p.box_stored[a];
    const int n_byte = report->has_padding ? SCAN_BYTES_PER_PADDED_VOXEL : SCAN_BYTES_PER_VOXEL;
    s = scratch_check(space, n_byte * (double)volume_n_voxel(n), "the scan", err);
    if (s != STATUS_OK) {
        if (err != NULL) snprintf(err->field, sizeof err->field, OPTION_SCAN_FILES);
        goto out;
    }
    s = volume_init_in(&stored, n, p.spacing_m, space, err);
    if (s == STATUS_OK) s = read_slices(source, &p, &look, progress, &stored, err);
    if (s == STATUS_OK && o->align) s = estimate_alignment(&stored, o, pool, NULL, report, err);
    if (s != STATUS_OK) goto out;
    if (p.resample) {
        s = volume_resample(&stored, o->matrix, p.voxel_m, p.box, pool, NULL, v, err);
        volume_release(&stored);
    } else {
        *v = stored;
        stored = (struct volume){0};
    }
    if (s == STATUS_OK) s = choose_crop(v, o, pool, NULL, report, err);
    if (s == STATUS_OK && p.trimmed) state_trim(&p, o, &report->tile);
    if (s == STATUS_OK) s = map_densities(v, o, pool, progress, report, err);
    if (s != STATUS_OK) goto out;
    memcpy(report->n, v->n, sizeof report->n);
    memcpy(report->voxel_size_m, v->voxel_size_m, sizeof report->voxel_size_m);
    progress_report(progress, 1.0);
out:
    volume_release(&stored);
    if (s != STATUS_OK) volume_release(v);
    volume_source_close(source);
    return s;
}
