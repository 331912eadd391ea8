#include "geometry/volume/format/tiff_page.h"
#include "base/option_id.h"

enum { MAX_EDGE = 1 << 20 };

static bool page_sample(uint16_t bits, uint16_t format, enum sample_type *t)
{
    static const struct {
        uint16_t format, bits;
        enum sample_type sample;
    } kind[] = {
        {SAMPLEFORMAT_UINT, 8, SAMPLE_UINT8},      {SAMPLEFORMAT_UINT, 16, SAMPLE_UINT16},
        {SAMPLEFORMAT_UINT, 32, SAMPLE_UINT32},    {SAMPLEFORMAT_INT, 8, SAMPLE_INT8},
        {SAMPLEFORMAT_INT, 16, SAMPLE_INT16},      {SAMPLEFORMAT_INT, 32, SAMPLE_INT32},
        {SAMPLEFORMAT_IEEEFP, 32, SAMPLE_FLOAT32}, {SAMPLEFORMAT_IEEEFP, 64, SAMPLE_FLOAT64},
    };
    if (format == SAMPLEFORMAT_VOID) format = SAMPLEFORMAT_UINT;
    for (size_t i = 0; i < sizeof kind / sizeof kind[0]; i++)
        if (kind[i].format == format && kind[i].bits == bits) {
            *t = kind[i].sample;
            return true;
        }
    return false;
}

/* Upper bound on the decoded bytes per stored byte. Constant slices come near it: 1032 with deflate, 7000 with LZMA,
 * 32768 with zstd (blocks of 128 KiB in four bytes). LERC stores one block of 90 bytes whatever the size of the
 * slice. The others stay far below. */
static uint64_t most_expansion(uint16_t compression)
{
    switch (compression) {
    case COMPRESSION_NONE:
        return 1;
    case COMPRESSION_LZMA:
        return 1 << 14;
    case COMPRESSION_ZSTD:
        return 1 << 16;
    case COMPRESSION_LERC:
        return 1 << 20;
    default:
        return 1 << 12;
    }
}

struct tags {
    uint16_t format, photometric; /* as libtiff names their values */
};

static void read_tags(TIFF *tiff, struct tiff_page *p, struct tags *k)
{
    uint16_t n_extra = 0, *extra = NULL, planar = PLANARCONFIG_CONTIG;
    uint32_t kind = 0;
    *p = (struct tiff_page){.bits = 1, .compression = COMPRESSION_NONE, .n_sample = 1, .depth = 1};
    *k = (struct tags){.format = SAMPLEFORMAT_UINT, .photometric = PHOTOMETRIC_MINISBLACK};
    TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &p->width);
    TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &p->height);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &p->bits);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &k->format);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &p->n_sample);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_IMAGEDEPTH, &p->depth);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &planar);
    TIFFGetField(tiff, TIFFTAG_ORIENTATION, &p->orientation);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_EXTRASAMPLES, &n_extra, &extra);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SUBFILETYPE, &kind);
    TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &k->photometric);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &p->compression);
    if (p->orientation > ORIENTATION_LEFTBOT) p->orientation = 0;
    if (p->depth == 0) p->depth = 1;
    p->is_separate = p->n_sample > 1 && planar == PLANARCONFIG_SEPARATE;
    p->has_alpha = p->n_sample == 2 && n_extra == 1 && extra[0] != EXTRASAMPLE_UNSPECIFIED;
    p->is_preview = (kind & FILETYPE_REDUCEDIMAGE) != 0;
}

/* Returns whether the samples of a pixel are the parts of a color. */
static bool is_color(uint16_t photometric)
{
    return photometric != PHOTOMETRIC_MINISBLACK && photometric != PHOTOMETRIC_MINISWHITE;
}

status tiff_page_read(TIFF *tiff, const char *name, size_t page, struct tiff_page *p, struct error *err)
{
    struct tags k;
    read_tags(tiff, p, &k);
    if (p->width == 0 || p->height == 0)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': page %zu has no pixels",
                               name, page);
    if (p->width > MAX_EDGE || p->height > MAX_EDGE)
        return error_set_field(
            err, STATUS_TOO_LARGE, OPTION_SCAN_FILES,
            "cannot read volume '%s': page %zu has %u x %u pixels, but the limit is %d along each edge", name, page,
            p->width, p->height, MAX_EDGE);
    if (p->n_sample == 0 || (p->n_sample > 1 && is_color(k.photometric)) || k.photometric == PHOTOMETRIC_PALETTE)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': page %zu is a color image: save the stack in grey", name,
                               page);
    /* programs disagree whether such a page has its values or only their display inverted */
    if (k.photometric == PHOTOMETRIC_MINISWHITE)
        return error_set_field(err, STATUS_UNSUPPORTED, OPTION_SCAN_FILES,
                               "cannot read volume '%s': page %zu has PhotometricInterpretation 0 (white is zero): "
                               "save the stack with black as "
                               "zero, so that denser material has higher values",
                               name, page);
    if (!page_sample(p->bits, k.format, &p->sample))
        return error_set_field(err, STATUS_UNSUPPORTED, OPTION_SCAN_FILES,
                               "cannot read volume '%s': page %zu has %u-bit samples of an unsupported kind", name,
                               page, p->bits);
    return STATUS_OK;
}

status tiff_page_compare(const struct tiff_page *p, const struct tiff_page *first, const char *name, size_t page,
                         struct error *err)
{
    const enum sample_type t = p->sample;
    if (p->width != first->width || p->height != first->height)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': page %zu has %u x %u pixels, page 1 has %u x %u", name, page,
                               p->width, p->height, first->width, first->height);
    if (t != first->sample && sample_bytes(t) != sample_bytes(first->sample))
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': page %zu is %u-bit, page 1 is %zu-bit", name, page, p->bits,
                               8 * sample_bytes(first->sample));
    if (t != first->sample)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': page %zu is %s, page 1 is %s", name, page, sample_name(t),
                               sample_name(first->sample));
    if (p->depth != first->depth || p->n_sample != first->n_sample || p->is_separate != first->is_separate)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': page %zu has %u slices of %u channels, page 1 has %u of %u",
                               name, page, p->depth, p->n_sample, first->depth, first->n_sample);
    if (p->orientation != 0 && p->orientation != first->orientation && p->orientation + first->orientation > 1)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': page %zu has orientation %u, page 1 has %u", name, page,
                               p->orientation, first->orientation);
    return STATUS_OK;
}

uint64_t tiff_page_bytes(const struct tiff_page *p) { return (uint64_t)p->width * p->height * sample_bytes(p->sample); }

bool tiff_page_is_contiguous(TIFF *tiff, const struct tiff_page *p)
{
    if (TIFFIsTiled(tiff) || p->compression != COMPRESSION_NONE || p->n_sample != 1) return false;
    uint64_t at = TIFFGetStrileOffset(tiff, 0);
    for (uint32_t i = 0, n = TIFFNumberOfStrips(tiff); i < n; at += TIFFGetStrileByteCount(tiff, i), i++)
        if (TIFFGetStrileOffset(tiff, i) != at) return false;
    return at - TIFFGetStrileOffset(tiff, 0) >= tiff_page_bytes(p) || TIFFNumberOfStrips(tiff) == 1;
}

bool tiff_page_fits(TIFF *tiff, const struct tiff_page *p, uint64_t file_bytes)
{
    const bool is_bare = p->depth > 1 && tiff_page_is_contiguous(tiff, p); /* libtiff knows strips of one slice */
    const uint64_t page_bytes = tiff_page_bytes(p) * p->n_sample * (is_bare ? 1 : p->depth);
    uint32_t n_block = TIFFIsTiled(tiff) ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
    if (n_block == 0 || n_block > file_bytes) return false;
    uint64_t stored = 0;
    for (uint32_t i = 0; i < n_block; i++) {
        uint64_t n = TIFFGetStrileByteCount(tiff, i), at = TIFFGetStrileOffset(tiff, i);
        if (at > file_bytes || n > file_bytes - at) return false;
        stored += n;
        if (stored > file_bytes * 2) return false;
    }
    if (is_bare && (file_bytes - TIFFGetStrileOffset(tiff, 0)) / page_bytes < p->depth) return false;
    uint64_t most = most_expansion(p->compression);
    return (page_bytes + most - 1) / most <= stored;
}
