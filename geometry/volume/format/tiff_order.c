/* The slices of a TIFF volume among its pages, and the statements of its first file. */
#include "base/files/durable.h"
#include "base/option_id.h"
#include "geometry/volume/format/length_unit.h"
#include "geometry/volume/format/tiff_volume.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TAG_NO_DATA = 42113 }; /* of GDAL: the value of voxels without a measurement, as text */

static void resolution_of(TIFF *tiff, double px_per_unit[2])
{
    static const uint32_t tag[2] = {TIFFTAG_XRESOLUTION, TIFFTAG_YRESOLUTION};
    for (int a = 0; a < 2; a++) {
        float v = 0.0f;
        px_per_unit[a] = TIFFGetField(tiff, tag[a], &v) && isfinite(v) && v > 0.0f ? (double)v : NAN;
    }
}

/* The description of the file that is open. */
static status read_description(struct tiff_stack *h, struct tiff_description *d, struct volume_source_info *info,
                               struct error *err)
{
    const char *text = NULL;
    double px_per_unit[2];
    if (!TIFFGetField(h->tiff, TIFFTAG_IMAGEDESCRIPTION, &text)) text = NULL;
    resolution_of(h->tiff, px_per_unit);
    return tiff_description_read(text, px_per_unit, path_file_name(h->path[h->i_open]), d, info, err);
}

/* Resolution tags in pixels per inch or centimetre. Most programs write one for prints, such as 72 per inch, which is
 * no size of a voxel: only edges below a tenth of a millimetre are. */
static void state_resolution(TIFF *tiff, struct volume_source_info *info)
{
    double px[2], size_m[3] = {NAN, NAN, NAN};
    uint16_t unit = RESUNIT_INCH;
    TIFFGetFieldDefaulted(tiff, TIFFTAG_RESOLUTIONUNIT, &unit);
    resolution_of(tiff, px);
    if (isnan(px[0]) || isnan(px[1]) || !isnan(info->voxel_size_m[0])) return;
    const char *word = unit == RESUNIT_CENTIMETER ? "cm" : unit == RESUNIT_INCH ? "inch" : "no unit";
    for (int a = 0; a < 2; a++) size_m[a] = unit == RESUNIT_NONE ? NAN : length_unit_m(word, strlen(word)) / px[a];
    if (size_m[0] < MOST_PRINT_VOXEL_M && size_m[1] < MOST_PRINT_VOXEL_M) {
        volume_state_voxel_size(info, size_m, "resolution tags");
        info->is_weak_size = true;
    } else if (unit != RESUNIT_NONE || px[0] != 1.0 || px[1] != 1.0)
        file_ledger_add(&info->ledger, "resolution", "it is no size of a voxel", "%g x %g pixels per %s", px[0], px[1],
                        unit == RESUNIT_NONE ? "unit" : word);
}

static void state_values(TIFF *tiff, struct volume_source_info *info)
{
    static const struct {
        uint32_t tag;
        const char *name;
    } one[] = {{TIFFTAG_SMINSAMPLEVALUE, "smallest value"}, {TIFFTAG_SMAXSAMPLEVALUE, "largest value"}},
      whole[] = {{TIFFTAG_MINSAMPLEVALUE, "smallest value"}, {TIFFTAG_MAXSAMPLEVALUE, "largest value"}};
    static const char by_histogram[] = "void and solid come from the histogram";
    const char *text = NULL;
    uint32_t n = 0;
    for (int i = 0; i < 2; i++) {
        double v = 0.0;
        uint16_t w = 0;
        if (TIFFGetField(tiff, whole[i].tag, &w)) file_ledger_add(&info->ledger, whole[i].name, by_histogram, "%u", w);
        if (TIFFGetField(tiff, one[i].tag, &v)) file_ledger_add(&info->ledger, one[i].name, by_histogram, "%g", v);
    }
    if (TIFFGetField(tiff, TAG_NO_DATA, &n, &text) && n > 0 && text != NULL) {
        char value[32], *end;
        snprintf(value, sizeof value, "%.*s", (int)(n < 31 ? n : 31), text);
        info->padding = strtod(value, &end);
        if (end == value) info->padding = NAN;
    }
}

static void state_orientation(const struct tiff_page *p, struct file_ledger *ledger)
{
    static const char *const meaning[9] = {[2] = "mirrored",
                                           [3] = "turned by 180 degrees",
                                           [4] = "upside down",
                                           [5] = "rows and columns exchanged",
                                           [6] = "to be turned by 90 degrees",
                                           [7] = "exchanged and turned",
                                           [8] = "to be turned by 270 degrees"};
    if (p->orientation > ORIENTATION_TOPLEFT)
        file_ledger_add(ledger, "orientation", NULL, "%u: pages are stored %s", p->orientation,
                        meaning[p->orientation]);
}

status tiff_stack_add_bare(struct tiff_stack *h, uint64_t file_bytes, struct error *err)
{
    struct volume_source_info unused = volume_source_info_empty();
    struct tiff_description d;
    status s = read_description(h, &d, &unused, err);
    const size_t n = tiff_description_images(&d);
    const uint64_t page_bytes = tiff_page_bytes(&h->first), begin = TIFFGetStrileOffset(h->tiff, 0);
    if (d.may_follow && tiff_page_is_contiguous(h->tiff, &h->first) && n > 1 && begin < file_bytes &&
        (file_bytes - begin) / page_bytes >= n)
        for (size_t i = 1; i < n && s == STATUS_OK; i++)
            s = tiff_stack_add(h, (struct tiff_slice){h->i_open, begin + i * page_bytes, 0, true}, err);
    tiff_description_release(&d);
    return s;
}

/* Compares the images that the description states with the pages. Returns in *n_of_set the pages of a set that the
 * description is about, all or those of one file; 0: it is about other pages. */
static status match_pages(const struct tiff_stack *h, const struct tiff_description *d, size_t *n_of_set,
                          struct file_ledger *ledger, struct error *err)
{
    const size_t n = tiff_description_images(d);
    *n_of_set = n == h->n_slice || (n == h->n_of_first && h->n_slice % n == 0) ? n : 0;
    if (*n_of_set > 0) return STATUS_OK;
    const bool several = d->n[TIFF_CHANNELS] > 1 || d->n[TIFF_TIMES] > 1;
    if (several || (h->n_path == 1 && n > h->n_slice))
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': %s states %zu channel%s x %zu slices x %zu time%s, but there "
                               "%s %zu page%s: save the stack again",
                               path_file_name(h->path[0]), d->source, d->n[TIFF_CHANNELS],
                               d->n[TIFF_CHANNELS] == 1 ? "" : "s", d->n[TIFF_SLICES], d->n[TIFF_TIMES],
                               d->n[TIFF_TIMES] == 1 ? "" : "s", h->n_slice == 1 ? "is" : "are", h->n_slice,
                               h->n_slice == 1 ? "" : "s");
    if (n != h->n_of_first)
        file_ledger_add(ledger, "slices", "the pages that are there are read", "%zu", d->n[TIFF_SLICES]);
    return STATUS_OK;
}

/* Keeps the slices that the description gives to a channel and a time. */
static status take_part(struct tiff_stack *h, const struct tiff_description *d, const size_t index[2], size_t n_of_set,
                        struct error *err)
{
    const size_t n_z = d->n[TIFF_SLICES], n_set = h->n_slice / n_of_set;
    struct tiff_slice *kept = malloc(n_set * n_z * sizeof *kept);
    if (kept == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    for (size_t i = 0; i < n_set * n_z; i++) {
        const size_t at[TIFF_DIMENSIONS] = {index[VOLUME_CHANNELS], i % n_z, index[VOLUME_TIMES]};
        const size_t page = tiff_description_page(d, at);
        if (page >= n_of_set) {
            free(kept);
            return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                                   "cannot read volume '%s': %s gives no page to slice %zu", path_file_name(h->path[0]),
                                   d->source, i % n_z + 1);
        }
        kept[i] = h->slice[i / n_z * n_of_set + page];
    }
    free(h->slice);
    h->slice = kept;
    h->n_slice = n_set * n_z;
    return STATUS_OK;
}

/* The samples of a pixel are channels, or a grey value with its alpha. */
static status choose_sample(struct tiff_stack *h, const struct volume_part *part, struct volume_source_info *info,
                            struct error *err)
{
    size_t index[2];
    const struct volume_parts parts = {{h->first.n_sample, 1}, "its tag SamplesPerPixel"};
    if (h->first.has_alpha) {
        file_ledger_add(&info->ledger, "alpha", "a scan has densities alone", "a second sample in each pixel");
        return STATUS_OK;
    }
    status s = volume_part_choose(path_file_name(h->path[0]), &parts, part, index, &info->ledger, err);
    if (s == STATUS_OK) h->i_sample = index[VOLUME_CHANNELS];
    return s;
}

status tiff_stack_order(struct tiff_stack *h, const struct volume_part *part, struct volume_source_info *info,
                        struct error *err)
{
    struct tiff_description d = {0};
    size_t n_of_set = 0, index[2];
    status s = tiff_stack_open_file(h, 0, err);
    if (s == STATUS_OK && !TIFFSetSubDirectory(h->tiff, h->first_page))
        s = error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': %s",
                            path_file_name(h->path[0]), tiff_stack_cause(h));
    if (s == STATUS_OK) s = read_description(h, &d, info, err);
    if (s != STATUS_OK) goto out;
    state_resolution(h->tiff, info);
    state_values(h->tiff, info);
    state_orientation(&h->first, &info->ledger);
    if (h->first.depth > 1) file_ledger_add(&info->ledger, "ImageDepth", NULL, "%u slices in a page", h->first.depth);
    if (h->first.n_sample > 1) {
        s = choose_sample(h, part, info, err);
        goto out;
    }
    if (d.source != NULL) s = match_pages(h, &d, &n_of_set, &info->ledger, err);
    const struct volume_parts parts = {{d.n[TIFF_CHANNELS], d.n[TIFF_TIMES]}, d.source};
    if (s == STATUS_OK) s = volume_part_choose(path_file_name(h->path[0]), &parts, part, index, &info->ledger, err);
    if (s == STATUS_OK && n_of_set > 0) s = take_part(h, &d, index, n_of_set, err);
out:
    tiff_description_release(&d);
    return s;
}
