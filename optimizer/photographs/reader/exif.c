#include "optimizer/photographs/reader/exif.h"

enum {
    TAG_EXIF_FOLDER = 0x8769,
    TAG_EXPOSURE_TIME = 0x829a,
    TAG_F_NUMBER = 0x829d,
    TAG_ISO = 0x8827,
    TYPE_SHORT = 3,
    TYPE_LONG = 4,
    TYPE_RATIONAL = 5,
    ENTRY_BYTES = 12
};

struct exif {
    const uint8_t *data;
    size_t n;
    bool big_endian;
};

static uint32_t number(const struct exif *e, size_t at, size_t n_byte)
{
    uint32_t v = 0;
    for (size_t i = 0; i < n_byte; i++) v = v << 8 | e->data[e->big_endian ? at + i : at + n_byte - 1 - i];
    return v;
}

static void take_rational(const struct exif *e, size_t entry, double *out)
{
    size_t at = number(e, entry + 8, 4);
    if (number(e, entry + 2, 2) != TYPE_RATIONAL || e->n < 8 || at > e->n - 8) return;
    double over = (double)number(e, at, 4), under = (double)number(e, at + 4, 4);
    if (over > 0.0 && under > 0.0) *out = over / under;
}

static void take_iso(const struct exif *e, size_t entry, double *out)
{
    uint32_t type = number(e, entry + 2, 2);
    uint32_t v = type == TYPE_SHORT ? number(e, entry + 8, 2) : type == TYPE_LONG ? number(e, entry + 8, 4) : 0;
    if (v > 0) *out = v;
}

/* Reads a folder of entries. Returns the place of the Exif folder, 0 when it names none. */
static size_t take_folder(const struct exif *e, size_t at, struct photograph_info *info)
{
    size_t inner = 0;
    if (e->n < 2 || at > e->n - 2) return 0;
    size_t n_entry = number(e, at, 2);
    for (size_t i = 0; i < n_entry; i++) {
        size_t entry = at + 2 + i * ENTRY_BYTES;
        if (e->n < ENTRY_BYTES || entry > e->n - ENTRY_BYTES) break;
        switch (number(e, entry, 2)) {
        case TAG_EXIF_FOLDER:
            inner = number(e, entry + 8, 4);
            break;
        case TAG_EXPOSURE_TIME:
            take_rational(e, entry, &info->exposure_s);
            break;
        case TAG_F_NUMBER:
            take_rational(e, entry, &info->aperture);
            break;
        case TAG_ISO:
            take_iso(e, entry, &info->iso);
            break;
        default:
            break;
        }
    }
    return inner;
}

void exif_read(const uint8_t *data, size_t n_bytes, struct photograph_info *info)
{
    struct exif e = {.data = data, .n = n_bytes};
    if (n_bytes < 8) return;
    e.big_endian = data[0] == 'M';
    if (number(&e, 2, 2) != 42) return;
    size_t inner = take_folder(&e, number(&e, 4, 4), info);
    if (inner > 0) take_folder(&e, inner, info);
}
