#include "optimizer/photographs/reader/exif.h"

#include <math.h>
#include <string.h>

enum {
    TAG_ORIENTATION = 0x0112,
    TAG_X_RESOLUTION = 0x011a,
    TAG_RESOLUTION_UNIT = 0x0128,
    TAG_EXPOSURE_TIME = 0x829a,
    TAG_F_NUMBER = 0x829d,
    TAG_EXIF_FOLDER = 0x8769,
    TAG_ISO = 0x8827,
    TAG_STANDARD_SENSITIVITY = 0x8831,
    TAG_RECOMMENDED_INDEX = 0x8832,
    TAG_ISO_SPEED = 0x8833,
    TAG_SHUTTER_SPEED = 0x9201,
    TAG_APERTURE = 0x9202,
    TAG_COLOR_SPACE = 0xa001,
    TAG_WHITE_BALANCE = 0xa403,
    TAG_DIGITAL_ZOOM = 0xa404,
    ISO_OUT_OF_RANGE = 65535, /* the 16 bits of TAG_ISO do not hold the number */
    MOST_ENTRIES = 2000
};

enum {
    BYTE = 1,
    SHORT = 3,
    LONG = 4,
    RATIONAL = 5,
    SBYTE = 6,
    SSHORT = 8,
    SLONG = 9,
    SRATIONAL = 10,
    FLOAT = 11,
    DOUBLE = 12
};

struct exif {
    FILE *file;
    bool big_endian, big_tiff;
};

/* The values of tags of interest; NaN: not stated. */
struct exif_values {
    double exposure_s, f_number, shutter_apex, aperture_apex, iso, other_iso, orientation, color_space, resolution,
        unit, white_balance, zoom;
};

/* Reads a number of n_byte bytes; false beyond the end of the file. */
static bool take(const struct exif *e, uint64_t at, size_t n_byte, uint64_t *out)
{
    uint8_t b[8];
    if (at > INT64_MAX || fseeko(e->file, (off_t)at, SEEK_SET) != 0 || fread(b, 1, n_byte, e->file) != n_byte)
        return false;
    *out = 0;
    for (size_t i = 0; i < n_byte; i++) *out = *out << 8 | b[e->big_endian ? i : n_byte - 1 - i];
    return true;
}

static size_t type_bytes(uint64_t type)
{
    static const size_t bytes[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8};
    return type < sizeof bytes / sizeof *bytes ? bytes[type] : 0;
}

/* Interprets the bits of a number of up to 8 bytes. under: of a rational. */
static double number_of(uint64_t type, uint64_t bits, uint64_t under)
{
    float single;
    double twice;
    const uint32_t low = (uint32_t)bits;
    switch (type) {
    case SBYTE:
        return (int8_t)bits;
    case SSHORT:
        return (int16_t)bits;
    case SLONG:
        return (int32_t)bits;
    case RATIONAL:
        return (double)bits / (double)under;
    case SRATIONAL:
        return (double)(int32_t)bits / (double)(int32_t)under;
    case FLOAT:
        memcpy(&single, &low, sizeof single);
        return (double)single;
    case DOUBLE:
        memcpy(&twice, &bits, sizeof twice);
        return twice;
    default:
        return (double)bits;
    }
}

/* The first number of the entry at `entry`; NaN where there is none. */
static double first_number(const struct exif *e, uint64_t entry)
{
    uint64_t type, count, bits = 0, under = 1, at = entry + (e->big_tiff ? 12 : 8);
    const size_t inside = e->big_tiff ? 8 : 4;
    if (!take(e, entry + 2, 2, &type) || !take(e, entry + 4, inside, &count)) return NAN;
    const size_t bytes = type_bytes(type);
    if (bytes == 0 || type == 2 || type == 7 || count == 0 || count > UINT32_MAX) return NAN;
    if (bytes * count > inside && !take(e, at, inside, &at)) return NAN;
    const bool ratio = type == RATIONAL || type == SRATIONAL;
    if (!take(e, at, ratio ? 4 : bytes, &bits) || (ratio && !take(e, at + 4, 4, &under))) return NAN;
    double value = number_of(type, bits, under);
    return isfinite(value) ? value : NAN;
}

/* Returns the member that holds the value of a tag; NULL for a tag that is not read. */
static double *value_of_tag(struct exif_values *v, uint64_t tag)
{
    switch (tag) {
    case TAG_ORIENTATION:
        return &v->orientation;
    case TAG_X_RESOLUTION:
        return &v->resolution;
    case TAG_RESOLUTION_UNIT:
        return &v->unit;
    case TAG_EXPOSURE_TIME:
        return &v->exposure_s;
    case TAG_F_NUMBER:
        return &v->f_number;
    case TAG_ISO:
        return &v->iso;
    case TAG_STANDARD_SENSITIVITY:
    case TAG_RECOMMENDED_INDEX:
    case TAG_ISO_SPEED:
        return &v->other_iso;
    case TAG_SHUTTER_SPEED:
        return &v->shutter_apex;
    case TAG_APERTURE:
        return &v->aperture_apex;
    case TAG_COLOR_SPACE:
        return &v->color_space;
    case TAG_WHITE_BALANCE:
        return &v->white_balance;
    case TAG_DIGITAL_ZOOM:
        return &v->zoom;
    default:
        return NULL;
    }
}

/* Reads a folder; the first entry of a tag counts. Returns the place of the Exif folder, 0 when it names none. */
static uint64_t take_folder(const struct exif *e, uint64_t at, struct exif_values *v)
{
    const size_t count_bytes = e->big_tiff ? 8 : 2, entry_bytes = e->big_tiff ? 20 : 12;
    uint64_t n_entry = 0, tag, inner = 0;
    if (!take(e, at, count_bytes, &n_entry)) return 0;
    for (uint64_t i = 0; i < n_entry && i < MOST_ENTRIES; i++) {
        uint64_t entry = at + count_bytes + i * entry_bytes;
        if (!take(e, entry, 2, &tag)) break;
        double *place = value_of_tag(v, tag);
        if (place != NULL && isnan(*place)) *place = first_number(e, entry);
        if (tag == TAG_EXIF_FOLDER && !take(e, entry + (e->big_tiff ? 12 : 8), e->big_tiff ? 8 : 4, &inner)) inner = 0;
    }
    return inner;
}

static double sensitivity(const struct exif_values *v)
{
    return v->iso > 0.0 && !(v->iso == ISO_OUT_OF_RANGE && v->other_iso > 0.0) ? v->iso : v->other_iso;
}

static void set_positive(double *to, double value)
{
    if (isnan(*to) && value > 0.0 && value < 1e9) *to = value;
}

static void state(const struct exif_values *v, struct photograph_info *info)
{
    set_positive(&info->exposure_s, v->exposure_s);
    set_positive(&info->exposure_s, exp2(-v->shutter_apex));
    set_positive(&info->aperture, v->f_number);
    set_positive(&info->aperture, exp2(0.5 * v->aperture_apex));
    set_positive(&info->iso, sensitivity(v));
    if (v->orientation >= 1.0 && v->orientation <= 8.0 && info->orientation == 0)
        info->orientation = (unsigned)v->orientation;
    if (v->color_space >= 1.0 && v->color_space <= 65535.0) info->exif_color_space = (unsigned)v->color_space;
    if (v->resolution > 1.0 && v->unit != 1.0)
        file_ledger_add(&info->ledger, "resolution", "lengths follow from the crop", "%g pixels per %s", v->resolution,
                        v->unit == 3.0 ? "cm" : "inch");
    if (v->white_balance == 0.0 || v->white_balance == 1.0)
        file_ledger_add(&info->ledger, "white balance", "samples are taken as they are", "%s",
                        v->white_balance == 0.0 ? "automatic" : "manual");
    info->auto_balance = info->auto_balance || v->white_balance == 0.0;
    if (v->zoom > 1.0) file_ledger_add(&info->ledger, "digital zoom", "a mean does not need it", "%g", v->zoom);
}

void exif_read(FILE *file, struct photograph_info *info)
{
    struct exif e = {.file = file};
    struct exif_values v = {NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN};
    uint64_t order, version, first;
    if (!take(&e, 0, 1, &order)) return;
    e.big_endian = order == 'M';
    if (!take(&e, 2, 2, &version) || (version != 42 && version != 43)) return;
    e.big_tiff = version == 43;
    if (!take(&e, e.big_tiff ? 8 : 4, e.big_tiff ? 8 : 4, &first)) return;
    uint64_t inner = take_folder(&e, first, &v);
    if (inner > 0) take_folder(&e, inner, &v);
    state(&v, info);
}

void exif_read_bytes(const void *data, size_t n_bytes, struct photograph_info *info)
{
    const size_t skipped = n_bytes > 6 && memcmp(data, "Exif\0\0", 6) == 0 ? 6 : 0;
    FILE *file = n_bytes > skipped ? fmemopen((uint8_t *)(uintptr_t)data + skipped, n_bytes - skipped, "rb") : NULL;
    if (file == NULL) return;
    exif_read(file, info);
    fclose(file);
}
