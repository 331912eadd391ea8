/* The OME description of a stack: XML whose element Pixels states sizes, order and lengths, and whose elements TiffData
 * say which page holds which image. Source: the OME-TIFF specification (docs.openmicroscopy.org/ome-model). */
#include "base/option_id.h"
#include "geometry/volume/format/length_unit.h"
#include "geometry/volume/format/tiff_description.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_BLOCK = 1 << 20 };

/* Returns the next element of this name between from and end, with or without a name space; NULL: none. */
static const char *find_before(const char *from, const char *end, const char *name)
{
    const size_t n = strlen(name);
    for (const char *p = memchr(from, '<', (size_t)(end - from)); p != NULL;
         p = memchr(p + 1, '<', (size_t)(end - p - 1))) {
        const char *tag = p + 1 + (strncmp(p + 1, "ome:", 4) == 0 ? 4 : 0);
        if (strncmp(tag, name, n) == 0 && tag[n] != '\0' && strchr(" \t\r\n/>", tag[n]) != NULL) return p;
    }
    return NULL;
}

static const char *find_element(const char *from, const char *name)
{
    return find_before(from, from + strlen(from), name);
}

/* Writes a letter that XML states by its number, as UTF-8. Returns the bytes that it takes in the source. */
static size_t read_number(const char *from, char *to, size_t *n_to)
{
    char *end;
    const unsigned long code = from[2] == 'x' ? strtoul(from + 3, &end, 16) : strtoul(from + 2, &end, 10);
    if (*end != ';' || code == 0 || code > 0x7ff) return 0;
    if (code > 0x7f) to[(*n_to)++] = (char)(0xc0 | code >> 6);
    to[(*n_to)++] = (char)(code > 0x7f ? 0x80 | (code & 0x3f) : code);
    return (size_t)(end - from) + 1;
}

/* Copies the value of an attribute to value[n]. Returns whether the element has it. */
static bool attribute(const char *element, const char *name, char *value, size_t n)
{
    const size_t n_name = strlen(name);
    char quote = '\0';
    for (const char *p = element; *p != '\0' && (quote != '\0' || *p != '>'); p++) {
        if (quote == '\0' && strchr(" \t\r\n", p[0]) != NULL && strncmp(p + 1, name, n_name) == 0) {
            const char *at = p + 1 + n_name + strspn(p + 1 + n_name, " \t\r\n");
            if (*at == '=') at += 1 + strspn(at + 1, " \t\r\n");
            if (*at != '"' && *at != '\'') continue;
            const char *end = strchr(at + 1, *at);
            size_t used = 0;
            for (at++; end != NULL && at < end && used + 2 < n;) {
                const size_t taken = at[0] == '&' && at[1] == '#' ? read_number(at, value, &used) : 0;
                if (taken == 0) value[used++] = *at;
                at += taken > 0 ? taken : 1;
            }
            value[used] = '\0';
            return end != NULL;
        }
        if (quote != '\0' && *p == quote)
            quote = '\0';
        else if (quote == '\0' && (*p == '"' || *p == '\''))
            quote = *p;
    }
    return false;
}

/* Returns a whole number from `least` on, or `otherwise` where the element has none. */
static size_t number(const char *element, const char *name, size_t least, size_t otherwise)
{
    char value[32], *end;
    if (!attribute(element, name, value, sizeof value)) return otherwise;
    const long long n = strtoll(value, &end, 10);
    return end != value && n >= (long long)least && n < 1LL << 40 ? (size_t)n : otherwise;
}

static void read_lengths(const char *pixels, struct volume_source_info *info)
{
    double size_m[3] = {NAN, NAN, NAN};
    char value[64], unit[64];
    for (int a = 0; a < 3; a++) {
        const char key[] = {'P', 'h', 'y', 's', 'i', 'c', 'a', 'l', 'S', 'i', 'z', 'e', "XYZ"[a], '\0'};
        char unit_key[32];
        snprintf(unit_key, sizeof unit_key, "%sUnit", key);
        if (!attribute(pixels, key, value, sizeof value)) continue;
        if (!attribute(pixels, unit_key, unit, sizeof unit)) snprintf(unit, sizeof unit, "um");
        size_m[a] = strtod(value, NULL) * length_unit_m(unit, strlen(unit));
        if (isnan(size_m[a]))
            file_ledger_add(&info->ledger, "unit of length", "no voxel size comes from it", "%s", unit);
    }
    volume_state_voxel_size(info, size_m, "OME");
}

static void read_order(const char *pixels, int order[TIFF_DIMENSIONS])
{
    char value[16] = "";
    order[0] = TIFF_SLICES, order[1] = TIFF_CHANNELS, order[2] = TIFF_TIMES;
    if (!attribute(pixels, "DimensionOrder", value, sizeof value) || strncmp(value, "XY", 2) != 0) return;
    int found[3], seen = 0;
    for (int i = 0; i < 3; i++) {
        const char *at = value[2 + i] != '\0' ? strchr("CZT", value[2 + i]) : NULL;
        if (at == NULL) return;
        found[i] = (int)(at - "CZT");
        seen |= 1 << found[i];
    }
    if (seen == 7) memcpy(order, found, sizeof found);
}

static int compare_block(const void *a, const void *b)
{
    const struct tiff_block *x = a, *y = b;
    return (x->image > y->image) - (x->image < y->image);
}

static status add_block(struct tiff_description *d, size_t *capacity, const char *element, struct error *err)
{
    const size_t page = number(element, "IFD", 0, SIZE_MAX);
    const size_t first[] = {number(element, "FirstC", 0, 0), number(element, "FirstZ", 0, 0),
                            number(element, "FirstT", 0, 0)};
    if (d->n_block == *capacity) {
        *capacity = *capacity == 0 ? 64 : 2 * *capacity;
        struct tiff_block *more = *capacity <= MAX_BLOCK ? realloc(d->block, *capacity * sizeof *more) : NULL;
        if (more == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
        d->block = more;
    }
    d->block[d->n_block++] =
        (struct tiff_block){.page = page != SIZE_MAX ? page : 0,
                            .n_page = number(element, "PlaneCount", 1, page != SIZE_MAX ? 1 : SIZE_MAX),
                            .image = tiff_description_image(d, first)};
    return STATUS_OK;
}

/* Reads the elements TiffData, unless they name several files: those are given in the order of their images. */
static status read_blocks(const char *pixels, struct tiff_description *d, struct error *err)
{
    const char *close = strstr(pixels, "Pixels>"), *end = close != NULL ? close : pixels + strlen(pixels);
    size_t capacity = 0;
    char file[2][256] = {"", ""};
    status s = STATUS_OK;
    for (const char *p = find_before(pixels, end, "TiffData"), *next; p != NULL && s == STATUS_OK; p = next) {
        next = find_before(p + 1, end, "TiffData");
        const char *uuid = find_before(p, next != NULL ? next : end, "UUID");
        if (uuid != NULL && attribute(uuid, "FileName", file[1], sizeof file[1])) {
            if (file[0][0] == '\0') memcpy(file[0], file[1], sizeof file[0]);
            if (strcmp(file[0], file[1]) != 0) break;
        }
        s = add_block(d, &capacity, p, err);
    }
    if (file[0][0] != '\0' && strcmp(file[0], file[1]) != 0) d->n_block = 0;
    if (d->n_block > 1) qsort(d->block, d->n_block, sizeof *d->block, compare_block);
    return s;
}

status ome_description_read(const char *text, const char *name, struct tiff_description *d,
                            struct volume_source_info *info, struct error *err)
{
    char bits[16];
    const char *pixels = find_element(text, "OME") != NULL ? find_element(text, "Pixels") : NULL;
    if (pixels == NULL) return STATUS_OK;
    if (find_element(pixels + 1, "Pixels") != NULL)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': its OME description has several images: save the scan alone",
                               name);
    d->source = "its OME description";
    d->n[TIFF_CHANNELS] = number(pixels, "SizeC", 1, 1);
    d->n[TIFF_SLICES] = number(pixels, "SizeZ", 1, 1);
    d->n[TIFF_TIMES] = number(pixels, "SizeT", 1, 1);
    read_order(pixels, d->order);
    read_lengths(pixels, info);
    if (attribute(pixels, "SignificantBits", bits, sizeof bits))
        file_ledger_add(&info->ledger, "significant bits", "densities come from the histogram", "%s", bits);
    return read_blocks(pixels, d, err);
}
