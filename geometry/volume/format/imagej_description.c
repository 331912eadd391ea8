/* ImageJ's description of a stack: lines "key=value" after "ImageJ=" and a version. Pages are in the order channel,
 * slice, time, the channel fastest, unless a line "order" says otherwise. Source: ij/io/FileInfo, ij/io/TiffEncoder. */
#include "geometry/volume/format/length_unit.h"
#include "geometry/volume/format/tiff_description.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Copies the value of a line "key=value" to value[n]. Returns whether there is one. */
static bool value_of(const char *text, const char *key, char *value, size_t n)
{
    const size_t n_key = strlen(key);
    for (const char *line = text; line != NULL; line = strchr(line, '\n')) {
        line += *line == '\n';
        if (strncmp(line, key, n_key) != 0 || line[n_key] != '=') continue;
        const char *from = line + n_key + 1;
        size_t length = strcspn(from, "\r\n");
        while (length > 0 && from[length - 1] == ' ') length--;
        if (length >= n) length = n - 1;
        memcpy(value, from, length);
        value[length] = '\0';
        return true;
    }
    return false;
}

static size_t count_of(const char *text, const char *key)
{
    char value[32], *end;
    if (!value_of(text, key, value, sizeof value)) return 0;
    const long long n = strtoll(value, &end, 10);
    return end != value && n > 0 && n < 1LL << 40 ? (size_t)n : 0;
}

/* Lengths are in one unit, or along y and z in others. */
static void read_lengths(const char *text, const double px_per_unit[2], struct volume_source_info *info)
{
    static const char *const key[3] = {"unit", "yunit", "zunit"};
    char value[64] = "", unit[3][64] = {"", "", ""};
    double size_m[3] = {NAN, NAN, NAN};
    for (int a = 0; a < 3; a++) {
        if (!value_of(text, key[a], unit[a], sizeof unit[a]) && a > 0) memcpy(unit[a], unit[0], sizeof unit[a]);
        const double metre = length_unit_m(unit[a], strlen(unit[a]));
        if (a < 2) size_m[a] = metre / px_per_unit[a];
        if (a == 2 && value_of(text, "spacing", value, sizeof value)) size_m[2] = metre * fabs(strtod(value, NULL));
        if (!isfinite(size_m[a])) size_m[a] = NAN;
    }
    const bool of_prints = length_unit_m(unit[0], strlen(unit[0])) >= 0.01; /* inches, centimetres */
    if (of_prints && size_m[0] >= MOST_PRINT_VOXEL_M) {
        file_ledger_add(&info->ledger, "resolution", "it is no size of a voxel", "%g pixels per %s (ImageJ)",
                        px_per_unit[0], unit[0]);
        return;
    }
    volume_state_voxel_size(info, size_m, "ImageJ");
    /* one pixel per unit is what tifffile writes by default */
    info->is_weak_size = of_prints || (px_per_unit[0] == 1.0 && px_per_unit[1] == 1.0);
    if (isnan(info->voxel_size_m[0]) && unit[0][0] != '\0')
        file_ledger_add(&info->ledger, "unit of length", "no voxel size comes from it", "%s", unit[0]);
}

/* Statements about grey values, which need no calibration: void and solid are found in the histogram. */
static void state_values(const char *text, struct file_ledger *ledger)
{
    char c[2][32], unit[32] = "";
    if (value_of(text, "c0", c[0], sizeof c[0]) && value_of(text, "c1", c[1], sizeof c[1])) {
        value_of(text, "vunit", unit, sizeof unit);
        file_ledger_add(ledger, "calibration of values", "densities come from the histogram of stored values",
                        "%s + %s v %s", c[0], c[1], unit);
    }
}

static void read_order(const char *text, int order[TIFF_DIMENSIONS])
{
    char value[8];
    order[0] = TIFF_CHANNELS, order[1] = TIFF_SLICES, order[2] = TIFF_TIMES;
    if (!value_of(text, "order", value, sizeof value) || strlen(value) != 3) return;
    int found[3], seen = 0;
    for (int i = 0; i < 3; i++) {
        const char *at = strchr("czt", value[i] | 0x20);
        if (at == NULL) return;
        found[i] = (int)(at - "czt");
        seen |= 1 << found[i];
    }
    if (seen == 7) memcpy(order, found, sizeof found);
}

bool imagej_description_read(const char *text, const double px_per_unit[2], struct tiff_description *d,
                             struct volume_source_info *info)
{
    if (strncmp(text, "ImageJ=", 7) != 0) return false;
    size_t n_image = count_of(text, "images"), known;
    d->n[TIFF_CHANNELS] = count_of(text, "channels");
    d->n[TIFF_TIMES] = count_of(text, "frames");
    d->n[TIFF_SLICES] = count_of(text, "slices");
    for (int i = 0; i < TIFF_DIMENSIONS; i++)
        if (i != TIFF_SLICES && d->n[i] == 0) d->n[i] = 1;
    if (d->n[TIFF_SLICES] == 0 && !__builtin_mul_overflow(d->n[TIFF_CHANNELS], d->n[TIFF_TIMES], &known))
        d->n[TIFF_SLICES] = n_image > known && n_image % known == 0 ? n_image / known : 1;
    read_order(text, d->order);
    d->source = "ImageJ's description";
    d->may_follow = true;
    read_lengths(text, px_per_unit, info);
    state_values(text, &info->ledger);
    return true;
}
